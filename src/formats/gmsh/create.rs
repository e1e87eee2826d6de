//! New Gmsh files: version 4.1, binary, little-endian.

use std::io::{self, Write};

use glam::DVec3;

use crate::formats::mesh_builder::CellKind;
use crate::formats::new_file::{NewFile, clean_names, renamed};
use crate::formats::out::Out;
use crate::geometry;

/// Gmsh's number for a type of element.
fn number(shape: CellKind) -> i32 {
    match shape {
        CellKind::Triangle => 2,
        CellKind::Quadrilateral => 3,
        CellKind::Tet => 4,
        CellKind::Hexahedron => 5,
        CellKind::Prism => 6,
        CellKind::Pyramid => 7,
    }
}

/// Elements of one type on one entity.
struct Block<'a> {
    dimension: i32,
    entity: i32,
    shape: CellKind,
    elements: Vec<&'a [u32]>,
}

/// Writes a Gmsh file whose arrays have been checked. A family is a surface entity and a physical
/// group, both with the family's number, counted from 1. The cells are volume 1, in the group
/// `volume`; Gmsh does not save cells without a group.
pub(super) fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let names = clean_names(new_file.cells.families, fits);
    let n_families = names.len() as u64;
    let volume_group = names.len() as i32 + 1;
    out.write_all(b"$MeshFormat\n4.1 1 8\n")?;
    ints(out, &[1])?;
    write!(out, "\n$EndMeshFormat\n$PhysicalNames\n{}\n", n_families + 1)?;
    for (index, name) in names.iter().enumerate() {
        writeln!(out, "2 {} \"{}\"", index + 1, name)?;
    }
    write!(out, "3 {volume_group} \"volume\"\n$EndPhysicalNames\n$Entities\n")?;

    let [low, high] = bounds(new_file.vertices.iter().copied());
    sizes(out, &[0, 0, n_families, 1])?;
    for (index, faces) in new_file.faces_by_family().into_iter().enumerate() {
        let corners = faces.into_iter().flat_map(|(_, face)| face);
        let [low, high] = bounds(corners.map(|&vertex| new_file.vertices[vertex as usize]));
        entity(out, index as i32 + 1, [low, high], index as i32 + 1, &[])?;
    }
    let surfaces: Vec<i32> = (1..=names.len() as i32).collect();
    entity(out, 1, [low, high], volume_group, &surfaces)?;
    out.write_all(b"\n$EndEntities\n$Nodes\n")?;

    let n_vertices = new_file.vertices.len() as u64;
    sizes(out, &[1, n_vertices, 1.min(n_vertices), n_vertices])?;
    ints(out, &[3, 1, 0])?;
    sizes(out, &[n_vertices])?;
    for tag in 1..=n_vertices {
        out.write_all(&tag.to_le_bytes())?;
    }
    for vertex in new_file.vertices {
        doubles(out, vertex)?;
    }
    out.write_all(b"\n$EndNodes\n$Elements\n")?;

    let blocks = blocks(new_file);
    let n_elements = blocks.iter().map(|block| block.elements.len() as u64).sum();
    sizes(out, &[blocks.len() as u64, n_elements, 1.min(n_elements), n_elements])?;
    let mut tag = 0;
    for Block { dimension, entity, shape, elements } in blocks {
        ints(out, &[dimension, entity, number(shape)])?;
        sizes(out, &[elements.len() as u64])?;
        for corners in elements {
            tag += 1;
            sizes(out, &[tag])?;
            for &vertex in corners {
                out.write_all(&(u64::from(vertex) + 1).to_le_bytes())?;
            }
        }
    }
    out.write_all(b"\n$EndElements\n")
}

/// Losses of a new file: quotes in names.
pub(super) fn limits(new_file: &NewFile) -> Vec<String> {
    renamed(new_file.cells.families, &clean_names(new_file.cells.families, fits))
}

/// `$PhysicalNames` cannot hold a quote or the end of a line.
fn fits(letter: char) -> bool {
    letter != '"' && !letter.is_control()
}

/// Blocks of faces by family and type, then blocks of cells by type.
fn blocks<'a>(new_file: &NewFile<'a>) -> Vec<Block<'a>> {
    let mut blocks: Vec<Block> = Vec::new();
    for (index, faces) in new_file.faces_by_family().into_iter().enumerate() {
        for shape in CellKind::FACES {
            let elements = faces.iter().filter(|(of, _)| *of == shape).map(|&(_, face)| face).collect();
            blocks.push(Block { dimension: 2, entity: index as i32 + 1, shape, elements });
        }
    }
    for shape in CellKind::CELLS {
        let elements = new_file.of(shape).collect();
        blocks.push(Block { dimension: 3, entity: 1, shape, elements });
    }
    blocks.retain(|block| !block.elements.is_empty());
    blocks
}

/// Writes a surface or volume: its box, its physical group and its bounding entities.
fn entity(out: &mut Out, tag: i32, bounds: [DVec3; 2], group: i32, boundary: &[i32]) -> io::Result<()> {
    ints(out, &[tag])?;
    doubles(out, &bounds[0])?;
    doubles(out, &bounds[1])?;
    sizes(out, &[1])?;
    ints(out, &[group])?;
    sizes(out, &[boundary.len() as u64])?;
    ints(out, boundary)
}

/// The box of some points. Without points it is the origin.
fn bounds(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    geometry::bounds(points).unwrap_or_default()
}

fn ints(out: &mut Out, values: &[i32]) -> io::Result<()> {
    values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
}

fn sizes(out: &mut Out, values: &[u64]) -> io::Result<()> {
    values.iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
}

fn doubles(out: &mut Out, values: &DVec3) -> io::Result<()> {
    values.to_array().iter().try_for_each(|value| out.write_all(&value.to_le_bytes()))
}
