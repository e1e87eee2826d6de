//! New `polyMesh` folders, in ASCII.

use std::io::{self, Write};
use std::ops::Range;

use rayon::prelude::*;

use crate::formats::document::{NamedFiles, write_shortest};
use crate::formats::new_file::{NewFile, clean_names, renamed};
use crate::mesh::csr::Csr;
use crate::mesh::{cell_faces, in_pieces};

/// Stands for no vertex, no cell and no side.
const NONE: u32 = u32::MAX;

/// The sides of all cells, followed by the faces of the families, which are sides of the boundary.
struct Sides {
    /// Corners of each side: three or four, with the normal out of the cell. After three corners
    /// [`NONE`].
    corners: Vec<[u32; 4]>,
    /// Cell of each side of a cell `[n_sides_of_cells]`, ascending.
    cells: Vec<u32>,
}

impl Sides {
    fn new(new_file: &NewFile) -> Self {
        let (mut corners, mut cells) = (Vec::with_capacity(4 * new_file.n_elements()), Vec::new());
        let side = |vertices: &mut dyn Iterator<Item = u32>| {
            let mut corners = [NONE; 4];
            corners.iter_mut().zip(vertices).for_each(|(corner, vertex)| *corner = vertex);
            corners
        };
        for (cell, (_, vertices)) in (0..).zip(new_file.volume_cells()) {
            let faces = cell_faces(vertices.len()).iter();
            corners.extend(faces.map(|face| side(&mut face.iter().map(|&corner| vertices[corner]))));
            cells.resize(corners.len(), cell);
        }
        corners.extend(new_file.faces().map(|(_, vertices, _)| side(&mut vertices.iter().copied())));
        Self { corners, cells }
    }

    fn is_of_cell(&self, side: u32) -> bool {
        (side as usize) < self.cells.len()
    }

    /// The side with the same corners as each side, or [`NONE`].
    ///
    /// # Errors
    /// The first side whose corners more than two sides have, or that no cell has.
    fn partners(&self, n_vertices: usize) -> Result<Vec<u32>, u32> {
        let lowest = |corners: &[u32; 4]| corners.iter().copied().min().unwrap_or(NONE);
        let by_lowest = Csr::from_pairs(n_vertices, self.corners.iter().map(lowest).zip(0..));
        let pairs_of = |vertices: Range<usize>| {
            let (mut pairs, mut wrong) = (Vec::new(), NONE);
            // The other corners in the upper bits, the side in the lower bits: numbers are sorted
            // faster than tuples.
            let mut row: Vec<u128> = Vec::new();
            for vertex in vertices {
                row.clear();
                row.extend(by_lowest.row(vertex).iter().map(|&side| {
                    let mut corners = self.corners[side as usize];
                    corners.sort_unstable();
                    let [_, b, c, d] = corners.map(u128::from);
                    b << 96 | c << 64 | d << 32 | u128::from(side)
                }));
                row.sort_unstable();
                for same in row.chunk_by(|a, b| a >> 32 == b >> 32) {
                    match *same {
                        [side] if self.is_of_cell(side as u32) => {}
                        [a, b] if self.is_of_cell(a as u32) => pairs.push([a as u32, b as u32]),
                        [.., last] => wrong = wrong.min(last as u32),
                        [] => {}
                    }
                }
            }
            (pairs, wrong)
        };
        let pieces = in_pieces(n_vertices, pairs_of);
        if let Some(wrong) = pieces.iter().map(|&(_, wrong)| wrong).min().filter(|&wrong| wrong != NONE) {
            return Err(wrong);
        }
        let mut partners = vec![NONE; self.corners.len()];
        for [a, b] in pieces.into_iter().flat_map(|(pairs, _)| pairs) {
            partners[a as usize] = b;
            partners[b as usize] = a;
        }
        Ok(partners)
    }
}

/// The files of a new folder, points last. Internal faces have OpenFOAM's upper-triangular order.
/// Patches are the families, of type `patch`.
///
/// # Errors
/// The faces of the families are not the boundary of the cells, or there are too many faces.
pub(super) fn create(new_file: &NewFile) -> io::Result<NamedFiles> {
    let sides = Sides::new(new_file);
    let (n_sides, n_of_cells) = (sides.corners.len(), sides.cells.len());
    if n_sides >= NONE as usize {
        return Err(invalid(format!("{n_sides} sides of cells are too many (at most {NONE})")));
    }
    let partners = sides.partners(new_file.vertices.len()).map_err(|side| {
        invalid(match (side as usize).checked_sub(n_of_cells).and_then(|face| new_file.faces().nth(face)) {
            Some((_, _, family)) => {
                let name = &new_file.cells.families[family.index()];
                format!(
                    "a face of the family '{name}' is no face on the boundary of the cells; this format holds no families \
                     inside the volume, and no cells that name a vertex twice"
                )
            }
            None => format!(
                "cell {} shares a face with two others, or names a vertex twice, which this format cannot hold",
                sides.cells[side as usize]
            ),
        })
    })?;
    let (of_cells, of_boundary) = partners.split_at(n_of_cells);
    let n_open = of_cells.iter().filter(|&&partner| partner == NONE).count();
    if n_open > 0 {
        return Err(invalid(format!("{n_open} faces on the boundary of the cells belong to no family")));
    }
    // A face is the side of its owner, with the neighbour's cell.
    let owner = |face: &(u32, u32)| sides.cells[face.0 as usize];
    let internal = (0..).zip(of_cells).filter(|&(side, &partner)| side < partner && sides.is_of_cell(partner));
    let mut faces: Vec<(u32, u32)> = internal.map(|(side, &partner)| (side, sides.cells[partner as usize])).collect();
    let of_owner = faces.chunk_by_mut(|a, b| owner(a) == owner(b));
    of_owner.for_each(|faces| faces.sort_by_key(|&(_, neighbour)| neighbour));
    let n_internal = faces.len();
    let names = patch_names(new_file.cells.families);
    let mut patches = vec![Vec::new(); names.len()];
    new_file.faces().zip(of_boundary).for_each(|((_, _, family), &side)| patches[family.index()].push((side, NONE)));
    faces.extend(patches.iter().flatten());

    let ends = patches.iter().scan(n_internal, |end, patch| {
        *end += patch.len();
        Some(*end)
    });
    let ends: Vec<usize> = ends.collect();
    let files: [(_, _, _, Entry); 5] = [
        ("faceList", "faces", faces.len(), &|index, text| {
            let corners = match &sides.corners[faces[index].0 as usize] {
                [corners @ .., NONE] => &corners[..],
                corners => corners,
            };
            add_whole(text, corners.len() as u32, b'(');
            corners.iter().for_each(|&corner| add_whole(text, corner, b' '));
            text.pop();
            text.extend_from_slice(b")\n");
            Ok(())
        }),
        ("labelList", "owner", faces.len(), &|index, text| {
            add_whole(text, owner(&faces[index]), b'\n');
            Ok(())
        }),
        ("labelList", "neighbour", n_internal, &|index, text| {
            add_whole(text, faces[index].1, b'\n');
            Ok(())
        }),
        ("polyBoundaryMesh", "boundary", names.len(), &|index, text| {
            let (name, n_faces) = (&names[index], patches[index].len());
            let start = ends[index] - n_faces;
            writeln!(text, "{name} {{ type patch; nFaces {n_faces}; startFace {start}; }}")
        }),
        ("vectorField", "points", new_file.vertices.len(), &|index, text| {
            for (place, value) in new_file.vertices[index].to_array().into_iter().enumerate() {
                text.push(if place == 0 { b'(' } else { b' ' });
                write_shortest(text, value)?;
            }
            writeln!(text, ")")
        }),
    ];
    let written = files.into_par_iter().map(|(class, object, count, write)| list(class, object, count, write));
    written.collect()
}

/// Appends the entry with this index to a list.
type Entry<'a> = &'a (dyn Fn(usize, &mut Vec<u8>) -> io::Result<()> + Sync);

/// A file with a list, and its name.
fn list(class: &str, object: &str, count: usize, write: Entry) -> io::Result<(String, Vec<u8>)> {
    let mut text = Vec::new();
    let header = format!("version 2.0; format ascii; class {class}; location \"constant/polyMesh\"; object {object};");
    write!(text, "FoamFile {{ {header} }}\n{count}\n(\n")?;
    (0..count).try_for_each(|index| write(index, &mut text))?;
    text.extend_from_slice(b")\n");
    Ok((object.to_string(), text))
}

/// Appends the digits of a number and a mark, several times as fast as `write!`.
fn add_whole(text: &mut Vec<u8>, mut number: u32, mark: u8) {
    let mut digits = [mark; 11];
    let mut start = 10;
    loop {
        start -= 1;
        digits[start] = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    text.extend_from_slice(&digits[start..]);
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

/// Names of the patches. OpenFOAM reads a number where a word begins like one, so `_` comes before
/// such a beginning.
fn patch_names(families: &[String]) -> Vec<String> {
    let words = families.iter().map(|name| match name.chars().next() {
        Some('0'..='9' | '-' | '.') => format!("_{name}"),
        _ => name.clone(),
    });
    clean_names(&words.collect::<Vec<_>>(), fits)
}

/// Losses of a new folder: spaces in names, beginnings of numbers, types of patches.
pub(super) fn limits(new_file: &NewFile) -> Vec<String> {
    let mut limits = renamed(new_file.cells.families, &patch_names(new_file.cells.families));
    limits.push("types of patches: all are 'patch', none is 'wall'".to_string());
    limits
}

fn fits(letter: char) -> bool {
    letter.is_alphanumeric() || matches!(letter, '_' | '-' | '.' | ':')
}
