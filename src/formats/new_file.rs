//! The contents of a new file.

use std::collections::HashSet;
use std::slice::ChunksExact;

use glam::DVec3;

use super::error::WriteError;
use super::mesh_builder::{CellKind, numbered_names};
use crate::mesh::{CellMeasures, FamilyId, OtherCells, TetMesh};

/// Cells of a mesh: all cells, or a selection.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// Vertices of each triangle `[n_triangles]`.
    pub triangles: &'a [[u32; 3]],
    /// Family of each triangle `[n_triangles]`.
    pub triangle_family: &'a [FamilyId],
    /// Names of the families.
    pub families: &'a [String],
}

impl<'a> Cells<'a> {
    /// All cells of a mesh.
    pub fn of(mesh: &'a TetMesh) -> Self {
        let TetMesh { tets, triangles, triangle_family, families, .. } = mesh;
        Self { tets, triangles, triangle_family, families }
    }
}

/// Results beside the mesh, in formats that can hold them (new VTU files; other formats hold only
/// the mesh).
#[derive(Clone, Copy, Debug, Default)]
pub struct Fields<'a> {
    /// New minus old position of each vertex `[n_vertices]`, in the mesh's unit.
    pub displacement: Option<&'a [DVec3]>,
    /// Quality `V / l_max^3` of each tet `[n_tets]`, without unit.
    pub beta: Option<&'a [f64]>,
    /// Scaled Jacobian and shape of the worst corner of each cell `[n_cells]`, tets first, then
    /// pyramids, prisms and hexahedra; without unit.
    pub measures: Option<&'a [CellMeasures]>,
}

/// The contents of a new mesh file.
#[derive(Clone, Copy)]
pub(super) struct NewFile<'a> {
    pub vertices: &'a [DVec3],
    pub cells: Cells<'a>,
    pub others: &'a OtherCells,
    pub fields: Fields<'a>,
    /// The extension, which selects the format, and in some formats the variant.
    pub extension: &'static str,
}

impl<'a> NewFile<'a> {
    /// The vertices of each cell or face of one kind.
    pub fn of(&self, shape: CellKind) -> ChunksExact<'a, u32> {
        self.vertices_of(shape).chunks_exact(shape.n_vertices())
    }

    /// The vertices of all cells or faces of one kind, one after another.
    pub fn vertices_of(&self, shape: CellKind) -> &'a [u32] {
        let NewFile { cells, others, .. } = *self;
        match shape {
            CellKind::Triangle => cells.triangles.as_flattened(),
            CellKind::Quadrilateral => others.quadrilaterals.as_flattened(),
            CellKind::Tet => cells.tets.as_flattened(),
            CellKind::Pyramid => others.pyramids.as_flattened(),
            CellKind::Prism => others.prisms.as_flattened(),
            CellKind::Hexahedron => others.hexahedra.as_flattened(),
        }
    }

    /// The family of each face of one kind. Empty for cells.
    pub fn families_of(&self, shape: CellKind) -> &'a [FamilyId] {
        match shape {
            CellKind::Triangle => self.cells.triangle_family,
            CellKind::Quadrilateral => &self.others.quadrilateral_family,
            _ => &[],
        }
    }

    /// The cells that fill the volume: tets, pyramids, prisms, hexahedra, each kind in its order.
    pub fn volume_cells(&self) -> impl Iterator<Item = (CellKind, &'a [u32])> + use<'a> {
        let new_file = *self;
        CellKind::CELLS.into_iter().flat_map(move |shape| new_file.of(shape).map(move |cell| (shape, cell)))
    }

    /// The boundary faces with their families: triangles, quadrilaterals, each kind in its order.
    pub fn faces(&self) -> impl Iterator<Item = (CellKind, &'a [u32], FamilyId)> + use<'a> {
        let new_file = *self;
        CellKind::FACES.into_iter().flat_map(move |shape| {
            let faces = new_file.of(shape).zip(new_file.families_of(shape));
            faces.map(move |(face, &family)| (shape, face, family))
        })
    }

    /// The boundary faces of each family `[n_families]`: triangles, then quadrilaterals.
    pub fn faces_by_family(&self) -> Vec<Vec<(CellKind, &'a [u32])>> {
        let mut faces = vec![Vec::new(); self.cells.families.len()];
        self.faces().for_each(|(shape, face, family)| faces[family.index()].push((shape, face)));
        faces
    }

    /// Number of cells and faces.
    pub fn n_elements(&self) -> usize {
        CellKind::CELLS.into_iter().chain(CellKind::FACES).map(|shape| self.of(shape).len()).sum()
    }

    /// All cells, then all faces.
    pub fn elements(&self) -> impl Iterator<Item = (CellKind, &'a [u32])> + use<'a> {
        self.volume_cells().chain(self.faces().map(|(shape, face, _)| (shape, face)))
    }

    /// Checks that it can be written.
    ///
    /// # Errors
    /// A coordinate is not finite, an array has the wrong length, or a cell names a vertex that is
    /// not there.
    pub fn check(&self) -> Result<(), WriteError> {
        let NewFile { vertices, cells, others, fields, .. } = self;
        check_finite(vertices)?;
        check_length("triangle families", cells.triangle_family.len(), cells.triangles.len())?;
        check_length("quadrilateral families", others.quadrilateral_family.len(), others.quadrilaterals.len())?;
        check_vertices("tet", cells.tets, vertices.len())?;
        check_vertices("triangle", cells.triangles, vertices.len())?;
        check_vertices("pyramid", &others.pyramids, vertices.len())?;
        check_vertices("prism", &others.prisms, vertices.len())?;
        check_vertices("hexahedron", &others.hexahedra, vertices.len())?;
        check_vertices("quadrilateral", &others.quadrilaterals, vertices.len())?;
        if let Some(displacement) = fields.displacement {
            check_length("displacement", displacement.len(), vertices.len())?;
        }
        if let Some(beta) = fields.beta {
            check_length("beta", beta.len(), cells.tets.len())?;
        }
        if let Some(measures) = fields.measures {
            check_length("measures", measures.len(), cells.tets.len() + others.n_cells())?;
        }
        Ok(())
    }
}

/// Names in which `_` replaces every letter that the format does not accept, and empty names. All
/// names are different.
pub(super) fn clean_names(names: &[String], takes: impl Fn(char) -> bool) -> Vec<String> {
    let filled = |name: &String| if name.is_empty() { "_".to_owned() } else { name.clone() };
    different_names(&names.iter().map(filled).collect::<Vec<_>>(), takes)
}

/// [`clean_names`] in which a name may be empty.
pub(super) fn different_names(names: &[String], takes: impl Fn(char) -> bool) -> Vec<String> {
    let mut seen = HashSet::new();
    let clean = |name: &String| {
        let name: String = name.chars().map(|letter| if takes(letter) { letter } else { '_' }).collect();
        numbered_names(&name).find(|name| seen.insert(name.clone())).unwrap_or_default()
    };
    names.iter().map(clean).collect()
}

/// Messages about families whose names change.
pub(super) fn renamed(names: &[String], new: &[String]) -> Vec<String> {
    let changed = names.iter().zip(new).filter(|(old, new)| old != new);
    changed.map(|(old, new)| format!("the family '{old}' is called '{new}'")).collect()
}

/// Fails if an array has another length than it must.
pub(super) fn check_length(what: &'static str, found: usize, expected: usize) -> Result<(), WriteError> {
    if found == expected { Ok(()) } else { Err(WriteError::Length { what, found, expected }) }
}

fn check_vertices<const N: usize>(
    entity: &'static str,
    cells: &[[u32; N]],
    n_vertices: usize,
) -> Result<(), WriteError> {
    let broken = |cell: &[u32; N]| cell.iter().copied().find(|&vertex| vertex as usize >= n_vertices);
    match cells.iter().enumerate().find_map(|(index, cell)| Some((index, broken(cell)?))) {
        Some((index, vertex)) => Err(WriteError::VertexOutOfRange { entity, index, vertex, n_vertices }),
        None => Ok(()),
    }
}

/// Fails if a coordinate is NaN or infinite.
pub(super) fn check_finite(vertices: &[DVec3]) -> Result<(), WriteError> {
    match vertices.iter().position(|vertex| !vertex.is_finite()) {
        Some(vertex) => Err(WriteError::NotFinite { vertex, position: vertices[vertex] }),
        None => Ok(()),
    }
}
