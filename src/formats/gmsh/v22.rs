//! The sections of version 2.2, in which nodes and elements have their tags beside them.

use super::elements::{ElementType, Elements};
use super::vertices::{Builder, Vertices};
use crate::formats::error::ReadError;
use crate::formats::scanner::{Encoding, Scanner, shown};

/// Reads a count, which is text on a line of its own, also in binary files.
fn read_count(scanner: &mut Scanner, what: &'static str, text: u64, binary: u64) -> Result<usize, ReadError> {
    if scanner.encoding == Encoding::Text {
        return scanner.count(what, text, binary);
    }
    let line = scanner.line();
    let count = std::str::from_utf8(line).ok().and_then(|line| line.parse().ok());
    let count = count.ok_or_else(|| scanner.malformed(what, shown(line)))?;
    scanner.checked(what, count, text, binary)
}

/// Reads `$Nodes`: tag and coordinates of each node. In `$ParametricNodes` the dimension and the
/// tag of the node's entity follow, and the parameters of the node on a curve or a surface.
pub(super) fn read_nodes(scanner: &mut Scanner, parametric: bool) -> Result<Vertices, ReadError> {
    let n_vertices = read_count(scanner, "the number of nodes", 8, 28)?;
    let mut vertices = Builder::new(n_vertices);
    for _ in 0..n_vertices {
        let tag = scanner.unsigned_int("a node tag")?;
        vertices.read(scanner, tag)?;
        if parametric {
            let dimension = scanner.int("the dimension of a node's entity")?;
            scanner.int("the entity of a node")?;
            for _ in 0..if matches!(dimension, 1 | 2) { dimension } else { 0 } {
                scanner.double("a parameter of a node")?;
            }
        }
    }
    vertices.finish(scanner)
}

/// Reads `$Elements`: `tag type n_tags tags... nodes...`. In a binary file type and number of tags
/// stand before each run of elements that share them. The first tag is the physical group.
pub(super) fn read_elements(scanner: &mut Scanner, vertices: &Vertices) -> Result<Elements, ReadError> {
    let n_elements = read_count(scanner, "the number of elements", 8, 8)?;
    let mut elements = Elements::default();
    let mut n_read = 0;
    while n_read < n_elements {
        let mut element = 0;
        let mut count = 1;
        let kind;
        if scanner.encoding == Encoding::Text {
            element = scanner.unsigned_int("an element tag")?;
            kind = ElementType::read(scanner)?;
        } else {
            kind = ElementType::read(scanner)?;
            count = scanner.unsigned_int("the number of elements in a run")?;
        }
        let n_tags = scanner.unsigned_int("the number of tags")?;
        let numbers = 1 + n_tags + kind.n_vertices as u64;
        if scanner.encoding != Encoding::Text {
            let count = scanner.checked("the number of elements in a run", count, 0, 4 * numbers)?;
            elements.begin(kind, count);
        } else {
            scanner.checked("the number of tags", n_tags, 2, 4)?;
        }
        if count > (n_elements - n_read) as u64 {
            return Err(scanner.malformed(format!("{} more elements at most", n_elements - n_read), count.to_string()));
        }
        for _ in 0..count {
            if scanner.encoding != Encoding::Text {
                element = scanner.unsigned_int("an element tag")?;
            }
            let mut group = 0;
            for tag in 0..n_tags {
                let value = scanner.int("a tag of an element")?;
                if tag == 0 {
                    group = value;
                }
            }
            let node = |scanner: &mut Scanner| scanner.unsigned_int("a node tag");
            elements.read(scanner, kind, vertices, element, group, node)?;
        }
        n_read += count as usize;
    }
    Ok(elements)
}
