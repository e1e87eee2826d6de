//! Makes a mesh with families of the cells and faces of a file, in any format.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use glam::DVec3;

use super::error::{Location, ReadError};
use crate::mesh::{FamilyId, OtherCells, TetMesh};
use crate::quality;

/// A kind of cell or face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CellKind {
    Triangle,
    Quadrilateral,
    Tet,
    Pyramid,
    Prism,
    Hexahedron,
}

impl CellKind {
    /// The kinds that fill the volume, in the usual order of files.
    pub const CELLS: [CellKind; 4] = [CellKind::Tet, CellKind::Pyramid, CellKind::Prism, CellKind::Hexahedron];

    /// The kinds that bound the volume.
    pub const FACES: [CellKind; 2] = [CellKind::Triangle, CellKind::Quadrilateral];

    /// Number of vertices.
    pub const fn n_vertices(self) -> usize {
        match self {
            CellKind::Triangle => 3,
            CellKind::Quadrilateral | CellKind::Tet => 4,
            CellKind::Pyramid => 5,
            CellKind::Prism => 6,
            CellKind::Hexahedron => 8,
        }
    }

    /// Name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            CellKind::Triangle => "triangle",
            CellKind::Quadrilateral => "quadrilateral",
            CellKind::Tet => "tet",
            CellKind::Pyramid => "pyramid",
            CellKind::Prism => "prism",
            CellKind::Hexahedron => "hexahedron",
        }
    }

    /// Whether the kind bounds the volume.
    pub const fn is_face(self) -> bool {
        matches!(self, CellKind::Triangle | CellKind::Quadrilateral)
    }
}

/// The meaning of a kind of element for idmesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A part of the mesh.
    Mesh(CellKind),
    /// Points or lines, with their name: not part of the mesh.
    PassOver(&'static str),
    /// Refused elements, with their name for the message.
    Refuse(&'static str),
}

/// Largest number of vertices that can be numbered.
pub(super) const MOST_VERTICES: usize = u32::MAX as usize;

/// Cells and faces while they are read.
#[derive(Debug, Default, PartialEq)]
pub(super) struct MeshBuilder {
    pub tets: Vec<[u32; 4]>,
    pub triangles: Vec<[u32; 3]>,
    /// Tag of each triangle `[n_triangles]`: a marker, a group or a reference in the file.
    pub triangle_tags: Vec<i32>,
    /// Pyramids, prisms, hexahedra and quadrilaterals. Their families are set by
    /// [`MeshBuilder::finish`].
    pub others: OtherCells,
    /// Tag of each quadrilateral `[n_quadrilaterals]`.
    pub quadrilateral_tags: Vec<i32>,
    refused: BTreeMap<&'static str, usize>,
    passed_over: BTreeMap<&'static str, usize>,
}

impl MeshBuilder {
    /// Reserves memory for `count` elements. The count was checked against the size of the file.
    pub fn reserve(&mut self, shape: CellKind, count: usize) {
        match shape {
            CellKind::Triangle => {
                self.triangles.reserve(count);
                self.triangle_tags.reserve(count);
            }
            CellKind::Quadrilateral => {
                self.others.quadrilaterals.reserve(count);
                self.quadrilateral_tags.reserve(count);
            }
            CellKind::Tet => self.tets.reserve(count),
            CellKind::Pyramid => self.others.pyramids.reserve(count),
            CellKind::Prism => self.others.prisms.reserve(count),
            CellKind::Hexahedron => self.others.hexahedra.reserve(count),
        }
    }

    /// Adds a cell or face. `corner` gives its vertices one after another. Only faces use `tag`.
    #[inline]
    pub fn push<E>(&mut self, shape: CellKind, tag: i32, corner: impl FnMut() -> Result<u32, E>) -> Result<(), E> {
        match shape {
            CellKind::Triangle => {
                self.triangles.push(corners(corner)?);
                self.triangle_tags.push(tag);
            }
            CellKind::Quadrilateral => {
                self.others.quadrilaterals.push(corners(corner)?);
                self.quadrilateral_tags.push(tag);
            }
            CellKind::Tet => self.tets.push(corners(corner)?),
            CellKind::Pyramid => self.others.pyramids.push(corners(corner)?),
            CellKind::Prism => self.others.prisms.push(corners(corner)?),
            CellKind::Hexahedron => self.others.hexahedra.push(corners(corner)?),
        }
        Ok(())
    }

    /// The vertices of all cells and faces.
    pub fn vertices_mut(&mut self) -> impl Iterator<Item = &mut u32> {
        let OtherCells { pyramids, prisms, hexahedra, quadrilaterals, .. } = &mut self.others;
        let cells = self.tets.iter_mut().flatten().chain(pyramids.iter_mut().flatten());
        let cells = cells.chain(prisms.iter_mut().flatten()).chain(hexahedra.iter_mut().flatten());
        cells.chain(self.triangles.iter_mut().flatten()).chain(quadrilaterals.iter_mut().flatten())
    }

    /// Counts refused elements.
    pub fn refuse(&mut self, name: &'static str, count: usize) {
        *self.refused.entry(name).or_default() += count;
    }

    /// Counts elements that do not belong to the mesh.
    pub fn pass_over(&mut self, name: &'static str, count: usize) {
        *self.passed_over.entry(name).or_default() += count;
    }

    /// The elements that do not belong to the mesh, in words: `12 lines`.
    pub fn passed_over(&self) -> Vec<String> {
        self.passed_over
            .iter()
            .filter(|(_, count)| **count > 0)
            .map(|(name, count)| format!("{count} {name}"))
            .collect()
    }

    /// Names and numbers of the refused elements.
    pub fn refused(&self) -> impl Iterator<Item = (&'static str, usize)> {
        self.refused.iter().map(|(&name, &count)| (name, count))
    }

    /// Checks that the file has no refused elements.
    ///
    /// # Errors
    /// [`ReadError::Unsupported`]
    pub fn check_refused(&self, path: &Path) -> Result<(), ReadError> {
        if self.refused.is_empty() {
            return Ok(());
        }
        let found = self.refused.iter().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>().join(", ");
        let hint = if self.refused.contains_key("polyhedra") {
            "split polyhedra into tets, pyramids, prisms or hexahedra"
        } else {
            "save it with linear elements (in Gmsh: -order 1)"
        };
        Err(ReadError::Unsupported { path: path.into(), found: format!("a mesh with {found}"), hint })
    }

    /// Turns all prisms over if their total volume is negative. VTK's documentation has said both
    /// that the normal of a wedge's base points into it and that it points out, and programs write
    /// either.
    pub fn orient_prisms(&mut self, positions: &[DVec3]) {
        let prisms = OtherCells { prisms: std::mem::take(&mut self.others.prisms), ..OtherCells::default() };
        let at = |vertex: u32| positions[vertex as usize];
        let volume: f64 = prisms.tets().into_iter().map(|tet| quality::volume(tet.map(at))).sum();
        self.others.prisms = prisms.prisms;
        if volume < 0.0 {
            self.others.prisms.iter_mut().for_each(|&mut [_, ref mut b, ref mut c, _, ref mut e, ref mut f]| {
                std::mem::swap(b, c);
                std::mem::swap(e, f);
            });
        }
    }

    /// Makes the mesh. The families are the tags of the faces, ascending. `name` gives the name of
    /// a tag, if it has one; tags with one name are one family. A tag without a name is a family of
    /// its own, called [`surface`].
    ///
    /// # Errors
    /// [`ReadError`]: refused elements, no cells, no faces, or too many families.
    pub fn finish(
        self,
        path: &Path,
        positions: Vec<DVec3>,
        name: impl Fn(i32) -> Option<String>,
    ) -> Result<(TetMesh, OtherCells), ReadError> {
        let mut used = self.used_tags();
        used.sort_unstable();
        self.finish_in_order(path, positions, &used, name)
    }

    /// The tags of the faces, each once, in the order of their first use.
    pub fn used_tags(&self) -> Vec<i32> {
        let mut seen = HashSet::new();
        let of_faces = runs(&self.triangle_tags).chain(runs(&self.quadrilateral_tags));
        of_faces.map(|(tag, _)| tag).filter(|&tag| seen.insert(tag)).collect()
    }

    /// [`MeshBuilder::finish`] with the families in the order of `used`, which holds every tag.
    pub fn finish_in_order(
        self,
        path: &Path,
        positions: Vec<DVec3>,
        used: &[i32],
        name: impl Fn(i32) -> Option<String>,
    ) -> Result<(TetMesh, OtherCells), ReadError> {
        self.check_refused(path)?;
        let missing = |what, hint| ReadError::Missing { path: path.into(), what, hint };
        let Self { tets, triangles, triangle_tags, mut others, quadrilateral_tags, .. } = self;
        if tets.is_empty() && others.n_cells() == 0 {
            return Err(missing("tets", "mesh the volume, and save it (Gmsh: put it into a physical group)"));
        }
        if triangles.is_empty() && others.quadrilaterals.is_empty() {
            return Err(missing("boundary triangles", "save every boundary surface (Gmsh: in a physical group)"));
        }
        let limit = usize::from(u16::MAX);
        if used.len() > limit {
            return Err(ReadError::TooMany { path: path.into(), what: "families", count: used.len(), limit });
        }
        // A name that a file gives may look like that of a number.
        let given: HashSet<String> = used.iter().filter_map(|&tag| name(tag)).collect();
        let name_of_number = |tag: i32| numbered_names(&surface(tag)).find(|name| !given.contains(name));
        let mut families: Vec<String> = Vec::new();
        let mut of_name = HashMap::new();
        let mut of_tag = HashMap::new();
        for &tag in used {
            let name = name(tag).or_else(|| name_of_number(tag)).unwrap_or_default();
            let family = *of_name.entry(name).or_insert_with_key(|name| {
                families.push(name.clone());
                FamilyId((families.len() - 1) as u16)
            });
            of_tag.insert(tag, family);
        }
        let numbered = |tags: &[i32]| {
            let mut families = Vec::with_capacity(tags.len());
            runs(tags).for_each(|(tag, length)| families.resize(families.len() + length, of_tag[&tag]));
            families
        };
        others.quadrilateral_family = numbered(&quadrilateral_tags);
        let triangle_family = numbered(&triangle_tags);
        Ok((TetMesh { vertices: positions, tets, triangles, triangle_family, families }, others))
    }
}

/// Runs of equal tags and their lengths. Most files hold the faces of a family together, so there
/// are few runs.
fn runs(tags: &[i32]) -> impl Iterator<Item = (i32, usize)> {
    tags.chunk_by(|a, b| a == b).map(|run| (run[0], run.len()))
}

#[inline]
fn corners<const N: usize, E>(mut corner: impl FnMut() -> Result<u32, E>) -> Result<[u32; N], E> {
    let mut corners = [0; N];
    for vertex in &mut corners {
        *vertex = corner()?;
    }
    Ok(corners)
}

/// Checks that the coordinates of the vertex with this tag are finite.
#[inline]
pub(super) fn check_finite_at(
    position: [f64; 3],
    vertex: u64,
    place: impl FnOnce() -> Location,
) -> Result<(), ReadError> {
    match position.into_iter().find(|value| !value.is_finite()) {
        Some(value) => Err(ReadError::NotFinite { place: place(), vertex, value }),
        None => Ok(()),
    }
}

/// The family name of faces with a number only.
pub(super) fn surface(tag: i32) -> String {
    format!("surface {tag}")
}

/// A name, and this name with numbers from 2 on.
pub(super) fn numbered_names(name: &str) -> impl Iterator<Item = String> {
    (1..).map(move |count| if count == 1 { name.to_owned() } else { format!("{name}_{count}") })
}
