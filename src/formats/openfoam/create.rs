//! New `polyMesh` folders, ascii.

use std::collections::HashMap;
use std::io::{self, Write};

use crate::formats::content::{Content, clean_names, renamed};
use crate::formats::document::{NamedFiles, write_shortest};
use crate::mesh::cell_faces;

/// A face between two cells, or a cell and a patch.
struct Face {
    corners: Vec<u32>,
    owner: usize,
    neighbour: Option<usize>,
}

/// The files of a new folder, points last. Internal faces stand in OpenFOAM's upper-triangular order, patches are the
/// families, of type `patch`.
pub(in crate::formats) fn create(content: &Content) -> io::Result<NamedFiles> {
    let key = |corners: &[u32]| {
        let mut key = [u32::MAX; 4];
        key[..corners.len()].copy_from_slice(corners);
        key.sort_unstable();
        key
    };
    let mut index: HashMap<[u32; 4], usize> = HashMap::new();
    let mut faces: Vec<Face> = Vec::new();
    for (cell, (_, vertices)) in content.volume_cells().enumerate() {
        for face in cell_faces(vertices.len()) {
            let corners: Vec<u32> = face.iter().map(|&corner| vertices[corner]).collect();
            match index.get(&key(&corners)) {
                None => {
                    index.insert(key(&corners), faces.len());
                    faces.push(Face { corners, owner: cell, neighbour: None });
                }
                Some(&face) if faces[face].neighbour.is_none() => faces[face].neighbour = Some(cell),
                Some(_) => return Err(invalid(format!("cell {cell} shares a face with two others"))),
            }
        }
    }
    let names = clean_names(content.cells.families, fits);
    let mut patches: Vec<Vec<usize>> = vec![Vec::new(); names.len()];
    let mut in_patch = vec![false; faces.len()];
    for (_, corners, family) in content.faces() {
        match index.get(&key(corners)) {
            Some(&face) if faces[face].neighbour.is_none() && !in_patch[face] => {
                in_patch[face] = true;
                patches[family.index()].push(face);
            }
            _ => {
                let name = &content.cells.families[family.index()];
                return Err(invalid(format!("a face of the family '{name}' is no face on the boundary of the cells")));
            }
        }
    }
    let mut order: Vec<usize> = (0..faces.len()).filter(|&face| faces[face].neighbour.is_some()).collect();
    let n_internal = order.len();
    order.sort_by_key(|&face| (faces[face].owner, faces[face].neighbour));
    let n_boundary: usize = patches.iter().map(Vec::len).sum();
    if n_internal + n_boundary != faces.len() {
        let count = faces.len() - n_internal - n_boundary;
        return Err(invalid(format!("{count} faces on the boundary of the cells belong to no family")));
    }
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
            order.iter().try_for_each(|&face| {
                let corners: Vec<String> = faces[face].corners.iter().map(u32::to_string).collect();
                writeln!(out, "{}({})", corners.len(), corners.join(" "))
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
