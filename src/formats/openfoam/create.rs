//! New `polyMesh` folders, ascii.

use std::collections::HashMap;
use std::io::{self, Write};

use crate::formats::content::{Content, clean_names, renamed};
use crate::formats::document::{NamedFiles, write_shortest};
use crate::mesh::cell_faces;

/// A face between two cells, or a cell and a patch.
struct Face {
    /// Three or four; behind three, `u32::MAX`.
    corners: [u32; 4],
    owner: usize,
    neighbour: Option<usize>,
}

impl Face {
    /// What faces with the same corners have in common.
    fn key(&self) -> [u32; 4] {
        key(&self.corners)
    }
}

/// Up to four corners, ascending, with `u32::MAX` behind.
fn key(corners: &[u32]) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    key[..corners.len()].copy_from_slice(corners);
    key.sort_unstable();
    key
}

/// The faces of all cells in the order in which cells have them first, those of two cells joined.
fn faces_of_cells(content: &Content) -> io::Result<Vec<Face>> {
    let mut sides = Vec::new();
    for (cell, (_, vertices)) in content.volume_cells().enumerate() {
        for face in cell_faces(vertices.len()) {
            let mut corners = [u32::MAX; 4];
            corners.iter_mut().zip(*face).for_each(|(corner, &of_cell)| *corner = vertices[of_cell]);
            sides.push(Face { corners, owner: cell, neighbour: None });
        }
    }
    // Sides with the same corners follow each other in this order, the side of the lower cell first.
    let mut order: Vec<([u32; 4], usize)> = sides.iter().enumerate().map(|(side, face)| (face.key(), side)).collect();
    order.sort_unstable();
    let mut is_second = vec![false; sides.len()];
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        match *same {
            [_] => {}
            [(_, first), (_, second)] => {
                sides[first].neighbour = Some(sides[second].owner);
                is_second[second] = true;
            }
            [.., (_, last)] => {
                return Err(invalid(format!("cell {} shares a face with two others", sides[last].owner)));
            }
            [] => {}
        }
    }
    let mut is_second = is_second.into_iter();
    sides.retain(|_| is_second.next() == Some(false));
    Ok(sides)
}

/// The files of a new folder, points last. Internal faces stand in OpenFOAM's upper-triangular order, patches are the
/// families, of type `patch`.
pub(in crate::formats) fn create(content: &Content) -> io::Result<NamedFiles> {
    let faces = faces_of_cells(content)?;
    let on_boundary = faces.iter().enumerate().filter(|(_, face)| face.neighbour.is_none());
    let mut boundary: HashMap<[u32; 4], usize> = on_boundary.map(|(index, face)| (face.key(), index)).collect();
    let names = clean_names(content.cells.families, fits);
    let mut patches: Vec<Vec<usize>> = vec![Vec::new(); names.len()];
    for (_, corners, family) in content.faces() {
        let Some(face) = boundary.remove(&key(corners)) else {
            let name = &content.cells.families[family.index()];
            return Err(invalid(format!("a face of the family '{name}' is no face on the boundary of the cells")));
        };
        patches[family.index()].push(face);
    }
    if !boundary.is_empty() {
        return Err(invalid(format!("{} faces on the boundary of the cells belong to no family", boundary.len())));
    }
    let mut order: Vec<usize> = (0..faces.len()).filter(|&face| faces[face].neighbour.is_some()).collect();
    let n_internal = order.len();
    order.sort_by_key(|&face| (faces[face].owner, faces[face].neighbour));
    order.extend(patches.iter().flatten());

    let list = |class: &str, object: &str, count: usize, write: &mut dyn FnMut(&mut Vec<u8>) -> io::Result<()>| {
        let mut out = Vec::new();
        let header =
            format!("version 2.0; format ascii; class {class}; location \"constant/polyMesh\"; object {object};");
        write!(out, "FoamFile {{ {header} }}\n{count}\n(\n")?;
        write(&mut out)?;
        out.extend_from_slice(b")\n");
        Ok::<_, io::Error>((object.to_string(), out))
    };
    Ok(vec![
        list("faceList", "faces", faces.len(), &mut |out| {
            order.iter().try_for_each(|&face| match faces[face].corners {
                [a, b, c, u32::MAX] => writeln!(out, "3({a} {b} {c})"),
                [a, b, c, d] => writeln!(out, "4({a} {b} {c} {d})"),
            })
        })?,
        list("labelList", "owner", faces.len(), &mut |out| {
            order.iter().try_for_each(|&face| writeln!(out, "{}", faces[face].owner))
        })?,
        list("labelList", "neighbour", n_internal, &mut |out| {
            order.iter().filter_map(|&face| faces[face].neighbour).try_for_each(|cell| writeln!(out, "{cell}"))
        })?,
        list("polyBoundaryMesh", "boundary", names.len(), &mut |out| {
            let mut start = n_internal;
            names.iter().zip(&patches).try_for_each(|(name, patch)| {
                writeln!(out, "{name} {{ type patch; nFaces {}; startFace {start}; }}", patch.len())?;
                start += patch.len();
                Ok(())
            })
        })?,
        list("vectorField", "points", content.vertices.len(), &mut |out| {
            content.vertices.iter().try_for_each(|vertex| {
                for (place, value) in vertex.to_array().into_iter().enumerate() {
                    out.extend_from_slice(if place == 0 { b"(" } else { b" " });
                    write_shortest(out, value)?;
                }
                writeln!(out, ")")
            })
        })?,
    ])
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

/// What a folder holds otherwise: names without spaces, types of patches.
pub(in crate::formats) fn limits(content: &Content) -> Vec<String> {
    let mut limits = renamed(content.cells.families, &clean_names(content.cells.families, fits));
    limits.push("types of patches: all are 'patch', none is 'wall'".to_string());
    limits
}

fn fits(letter: char) -> bool {
    letter.is_alphanumeric() || matches!(letter, '_' | '-' | '.' | ':')
}
