//! The sections of version 4.1: entities, and blocks of nodes and elements on entities.

use super::elements::{ElementType, Elements};
use super::families::Groups;
use super::vertices::{Builder, Vertices};
use crate::formats::error::ReadError;
use crate::formats::scanner::Scanner;

/// Reads `$Entities`: the physical tags of the surfaces.
pub(super) fn read_entities(scanner: &mut Scanner, groups: &mut Groups) -> Result<(), ReadError> {
    let counts = read_entity_counts(scanner)?;
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = scanner.int("the tag of an entity")?;
            let physical = read_entity(scanner, dimension)?;
            if dimension == 2 {
                groups.add_surface(tag, physical);
            }
        }
    }
    Ok(())
}

/// Reads `$PartitionedEntities`: each entity cut into parts, and the interfaces between the parts
/// of a volume.
pub(super) fn read_partitioned_entities(scanner: &mut Scanner, groups: &mut Groups) -> Result<(), ReadError> {
    scanner.size("the number of partitions")?;
    for _ in 0..scanner.count("the number of ghost entities", 4, 8)? {
        scanner.int("the tag of a ghost entity")?;
        scanner.int("the partition of a ghost entity")?;
    }
    let counts = read_entity_counts(scanner)?;
    for (dimension, count) in (0..).zip(counts) {
        for _ in 0..count {
            let tag = scanner.int("the tag of an entity")?;
            let parent_dimension = scanner.int("the dimension of the parent entity")?;
            scanner.int("the tag of the parent entity")?;
            for _ in 0..scanner.count("the number of partitions of an entity", 2, 4)? {
                scanner.int("a partition")?;
            }
            let physical = read_entity(scanner, dimension)?;
            if dimension == 2 && parent_dimension > 2 {
                groups.add_interface(tag);
            } else if dimension == 2 {
                groups.add_surface(tag, physical);
            }
        }
    }
    Ok(())
}

/// Reads the numbers of points, curves, surfaces and volumes. An entity has at least five numbers:
/// a point without groups.
fn read_entity_counts(scanner: &mut Scanner) -> Result<[usize; 4], ReadError> {
    let mut counts = [0; 4];
    for count in &mut counts {
        *count = scanner.count("the number of entities", 10, 36)?;
    }
    Ok(counts)
}

/// Reads the rest of an entity after its tags: its box, physical tags and bounding entities.
/// Returns the physical tags.
fn read_entity(scanner: &mut Scanner, dimension: i32) -> Result<Vec<i32>, ReadError> {
    for _ in 0..if dimension == 0 { 3 } else { 6 } {
        scanner.double("a coordinate of an entity's bounding box")?;
    }
    let n_physical = scanner.count("the number of physical tags", 2, 4)?;
    let physical = (0..n_physical).map(|_| scanner.int("a physical tag")).collect::<Result<_, _>>()?;
    if dimension > 0 {
        for _ in 0..scanner.count("the number of bounding entities", 2, 4)? {
            scanner.int("a bounding entity")?;
        }
    }
    Ok(physical)
}

/// Reads `$Nodes`: blocks of node tags followed by coordinates. In a parametric block parameters
/// follow the coordinates.
pub(super) fn read_nodes(scanner: &mut Scanner) -> Result<Vertices, ReadError> {
    let n_blocks = scanner.size("the number of node blocks")?;
    let n_vertices = scanner.count("the number of nodes", 8, 32)?;
    scanner.size("the smallest node tag")?;
    scanner.size("the greatest node tag")?;
    let mut vertices = Builder::new(n_vertices);
    let mut tags = Vec::new();
    for _ in 0..n_blocks {
        let dimension = scanner.unsigned_int("the dimension of a node block")?;
        if dimension > 3 {
            return Err(scanner.malformed("the dimension of a node block, 0 to 3", dimension.to_string()));
        }
        scanner.int("the entity of a node block")?;
        let parametric = scanner.unsigned_int("whether a node block is parametric, 0 or 1")?;
        if parametric > 1 {
            return Err(scanner.malformed("whether a node block is parametric, 0 or 1", parametric.to_string()));
        }
        let count = scanner.count("the number of nodes in a block", 8, 32)?;
        tags.clear();
        for _ in 0..count {
            tags.push(scanner.size("a node tag")?);
        }
        for &tag in &tags {
            vertices.read(scanner, tag)?;
            for _ in 0..dimension * parametric {
                scanner.double("a parameter of a node")?;
            }
        }
    }
    scanner.same("nodes", n_vertices, vertices.len())?;
    vertices.finish(scanner)
}

/// Reads `$Elements`: blocks of elements of one type on one entity.
pub(super) fn read_elements(scanner: &mut Scanner, vertices: &Vertices) -> Result<Elements, ReadError> {
    let n_blocks = scanner.size("the number of element blocks")?;
    let n_elements = scanner.count("the number of elements", 4, 16)?;
    scanner.size("the smallest element tag")?;
    scanner.size("the greatest element tag")?;
    let mut elements = Elements::default();
    let mut n_read = 0;
    for _ in 0..n_blocks {
        scanner.int("the dimension of an element block")?;
        let entity = scanner.int("the entity of an element block")?;
        let kind = ElementType::read(scanner)?;
        let numbers = 1 + kind.n_vertices as u64;
        let count = scanner.count("the number of elements in a block", 2 * numbers, 8 * numbers)?;
        elements.begin(kind, count);
        for _ in 0..count {
            let element = scanner.size("an element tag")?;
            elements.read(scanner, kind, vertices, element, entity, |scanner| scanner.size("a node tag"))?;
        }
        n_read += count;
    }
    scanner.same("elements", n_elements, n_read)?;
    Ok(elements)
}
