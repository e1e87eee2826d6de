//! New Medit files, as text or binary.

use std::io::{self, Write};
use std::iter;

use super::keywords::{DIMENSION, END, KEYWORDS, Keyword, MeditSection, mapbc_path};
use crate::formats::document::{Companion, Conditions, write_shortest};
use crate::formats::mapbc;
use crate::formats::mesh_builder::CellKind;
use crate::formats::new_file::{NewFile, renamed};
use crate::formats::out::Out;
use crate::formats::vtk::{list_names, listed_names};

/// The sections of elements in a new file.
fn sections(new_file: &NewFile) -> impl Iterator<Item = (&'static Keyword, CellKind)> {
    KEYWORDS.iter().filter_map(|keyword| match keyword.section {
        MeditSection::Elements(shape) if new_file.of(shape).len() > 0 => Some((keyword, shape)),
        _ => None,
    })
}

/// The elements of a shape with their references: the families' numbers, counted from 1, and 0 for
/// cells.
fn elements<'a>(new_file: &NewFile<'a>, shape: CellKind) -> impl Iterator<Item = (&'a [u32], i32)> {
    let families = new_file.families_of(shape).iter().map(|family| i32::from(family.0) + 1);
    new_file.of(shape).zip(families.chain(iter::repeat(0)))
}

/// Writes a Medit file whose arrays have been checked: version 2, or version 3 if the file is too
/// large for version 2.
pub(super) fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    if new_file.extension == "mesh" { create_text(out, new_file) } else { create_binary(out, new_file) }
}

fn create_text(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    write!(out, "MeshVersionFormatted 2\n# {}\nDimension 3\n", list_names(new_file.cells.families))?;
    writeln!(out, "Vertices\n{}", new_file.vertices.len())?;
    for vertex in new_file.vertices {
        for value in vertex.to_array() {
            write_shortest(out, value)?;
            out.write_all(b" ")?;
        }
        out.write_all(b"0\n")?;
    }
    for (keyword, shape) in sections(new_file) {
        write!(out, "{}\n{}\n", keyword.name, new_file.of(shape).len())?;
        for (corners, tag) in elements(new_file, shape) {
            corners.iter().try_for_each(|vertex| write!(out, "{} ", u64::from(*vertex) + 1))?;
            writeln!(out, "{tag}")?;
        }
    }
    out.write_all(b"End\n")
}

fn create_binary(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let int = |out: &mut Out, value: usize| {
        let value = i32::try_from(value)
            .map_err(|_| io::Error::other("Medit files idmesh writes hold 2^31 vertices at most"))?;
        out.write_all(&value.to_le_bytes())
    };
    let vertex_bytes = 28 * new_file.vertices.len();
    let element_bytes = |shape: CellKind| 4 * (shape.n_vertices() + 1) * new_file.of(shape).len();
    let size = 100 + vertex_bytes + sections(new_file).map(|(_, shape)| 16 + element_bytes(shape)).sum::<usize>();
    let version = if size < i32::MAX as usize { 2 } else { 3 };
    let position = if version == 2 { 4 } else { 8 };
    let mut at = 8;
    int(out, 1)?;
    int(out, version)?;
    // Writes a section's number and the offset of the next section, `length` bytes after the
    // contents begin.
    let mut begin = |out: &mut Out, number: i32, length: usize| {
        at += 4 + position + length;
        out.write_all(&number.to_le_bytes())?;
        out.write_all(&(at as u64).to_le_bytes()[..position])
    };
    begin(out, DIMENSION, 4)?;
    int(out, 3)?;
    begin(out, 4, 4 + vertex_bytes)?;
    int(out, new_file.vertices.len())?;
    for vertex in new_file.vertices {
        vertex.to_array().iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))?;
        int(out, 0)?;
    }
    for (keyword, shape) in sections(new_file) {
        begin(out, keyword.number, 4 + element_bytes(shape))?;
        int(out, new_file.of(shape).len())?;
        for (corners, tag) in elements(new_file, shape) {
            corners.iter().try_for_each(|&vertex| int(out, vertex as usize + 1))?;
            out.write_all(&tag.to_le_bytes())?;
        }
    }
    out.write_all(&END.to_le_bytes())?;
    out.write_all(&[0; 8][..position])
}

/// The names of a new file's references, so that the `.mapbc` file of another mesh is not taken for
/// it. A text file holds its names itself, but other programs read only the `.mapbc` file.
pub(super) fn companion(new_file: &NewFile) -> Companion {
    let names = match new_file.extension {
        "mesh" => (1..).zip(listed_names(new_file.cells.families)).collect(),
        _ => mapbc::names(new_file),
    };
    Companion { path: mapbc_path, bytes: None, names, conditions: Conditions::new() }
}

/// Losses of a new file: letters of names; all names, in a binary file.
pub(super) fn limits(new_file: &NewFile) -> Vec<String> {
    if new_file.extension == "mesh" {
        return renamed(new_file.cells.families, &listed_names(new_file.cells.families));
    }
    vec![format!("names of families: only their numbers are held ({})", list_names(new_file.cells.families))]
}
