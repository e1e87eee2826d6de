//! The checks that a mesh must pass before anything is built on it.

use glam::DVec3;

use super::{
    CellKind, CellName, HybridMesh, MeshError, OtherCells,
    cell_quality::{WorstCorner, cell_volume, middle_of_cell, worst_corner},
    corners::{Face, is_degenerate, n_corner_tets},
    half_edge::Surface,
    half_face::HalfFaces,
    size::SIZES,
};
use crate::geometry;
use crate::quality::faults::is_inverted;

/// The topology of a checked mesh.
#[derive(Clone, Debug)]
pub struct Topology {
    /// The faces of the cells.
    pub faces: HalfFaces,
    /// The oriented boundary surface.
    pub surface: Surface,
    /// Vertices that no cell uses, ascending. They are not moved.
    pub unused_vertices: Vec<u32>,
}

/// Checks a mesh and builds its topology.
///
/// # Errors
/// The first fault found, in the order of [`MeshError`].
pub fn validate<'a>(mesh: impl Into<HybridMesh<'a>>) -> Result<Topology, MeshError> {
    let mesh = mesh.into();
    check(mesh)?;
    Topology::new(mesh)
}

/// Checks each vertex, cell and boundary face alone: coordinates are finite, all named vertices
/// exist, no tet or triangle names one twice, the size is in [`SIZES`], and no cell is inverted or
/// left-handed.
///
/// # Errors
/// The first fault found, in the order of [`MeshError`].
pub fn check<'a>(mesh: impl Into<HybridMesh<'a>>) -> Result<(), MeshError> {
    let mesh = mesh.into();
    let vertices = mesh.vertices();
    if mesh.n_cells() == 0 {
        return Err(MeshError::NoTets);
    }
    if let Some(vertex) = vertices.iter().position(|at| !at.is_finite()) {
        return Err(MeshError::NotFinite { vertex, at: vertices[vertex].to_array() });
    }
    check_indices("tet", &mesh.mesh.tets, vertices.len())?;
    check_indices("triangle", &mesh.mesh.triangles, vertices.len())?;
    let OtherCells { pyramids, prisms, hexahedra, quadrilaterals, .. } = mesh.others;
    check_degenerate("pyramid", pyramids, vertices.len())?;
    check_degenerate("prism", prisms, vertices.len())?;
    check_degenerate("hexahedron", hexahedra, vertices.len())?;
    check_degenerate("quadrilateral", quadrilaterals, vertices.len())?;
    check_size(mesh.cells().flatten().map(|&vertex| vertices[vertex as usize]))?;
    for kind in CellKind::ALL {
        check_corners(mesh, kind)?;
    }
    Ok(())
}

/// Checks that the corners of all cells of a kind have positive volumes.
pub(super) fn check_corners(mesh: HybridMesh, kind: CellKind) -> Result<(), MeshError> {
    let n_cells = mesh.count(kind);
    let of_cell = |index: usize| worst_corner(mesh.cell(CellName { kind, index }), mesh.vertices());
    let volume = |index: usize| of_cell(index).volume;
    let inverted: Vec<usize> = (0..n_cells).filter(|&index| is_inverted(volume(index))).collect();
    let at = |cell: usize| mesh.vertices()[mesh.cell(CellName { kind, index: cell })[0] as usize];
    // A cell with a bad corner may have a positive volume. It is not left-handed.
    let whole = |index: usize| match kind {
        CellKind::Tet => volume(index),
        _ => cell_volume(mesh.cell(CellName { kind, index }), mesh.vertices()),
    };
    let left_handed: Vec<usize> = inverted.iter().copied().filter(|&cell| whole(cell) < 0.0).collect();
    // A few inverted cells are a fault of their places. Most cells cannot be.
    if let Some(&first) = left_handed.first()
        && 2 * left_handed.len() > n_cells
    {
        let count = left_handed.len();
        let right_handed = (0..n_cells).find(|&cell| volume(cell).is_nan() || whole(cell) >= 0.0);
        return Err(MeshError::LeftHanded { kind, count, n_cells, first, right_handed, at: at(first) });
    }
    let Some(&first) = inverted.first() else { return Ok(()) };
    let (count, worst) = (inverted.len(), of_cell(first));
    Err(match kind {
        CellKind::Tet => MeshError::Inverted { count, n_tets: n_cells, first, volume: worst.volume, at: at(first) },
        _ => {
            let middle = || middle_of_cell(mesh.cell(CellName { kind, index: first }), mesh.vertices());
            let at = worst.corner.map_or_else(middle, |corner| mesh.vertices()[corner as usize]);
            let WorstCorner { corner, volume } = worst;
            MeshError::InvertedCell { kind, count, n_cells, first, corner, volume, at }
        }
    })
}

/// The kinds of cells of which most are left-handed, each as [`MeshError::LeftHanded`], which
/// [`check`] returns.
///
/// The cells name only vertices that exist.
pub fn mostly_left_handed<'a>(mesh: impl Into<HybridMesh<'a>>) -> Vec<MeshError> {
    let mesh = mesh.into();
    let errors = CellKind::ALL.into_iter().filter_map(|kind| check_corners(mesh, kind).err());
    errors.filter(|error| matches!(error, MeshError::LeftHanded { .. })).collect()
}

/// Checks the size of a mesh: the largest extent of its vertices along an axis. Beyond [`SIZES`]
/// volumes and squares of lengths would be zero or infinite.
///
/// Vertices without extent pass, and so do coordinates that are not finite. Other checks find them.
///
/// - `vertices`: positions, in the mesh's unit
///
/// # Errors
/// [`MeshError::Size`]
pub fn check_size(vertices: impl IntoIterator<Item = DVec3>) -> Result<(), MeshError> {
    let Some([low, high]) = geometry::bounds(vertices) else { return Ok(()) };
    let size = (high - low).max_element();
    let is_judged = low.is_finite() && high.is_finite() && size > 0.0;
    if is_judged && !SIZES.contains(&size) { Err(MeshError::Size { size }) } else { Ok(()) }
}

impl Topology {
    /// Builds the topology of a mesh that has passed [`check`].
    ///
    /// # Errors
    /// The first mismatch of cells and faces, in the order of [`MeshError`].
    pub fn new<'a>(mesh: impl Into<HybridMesh<'a>>) -> Result<Self, MeshError> {
        let mesh = mesh.into();
        let faces = HalfFaces::new(mesh)?;
        let surface = Surface::new(mesh, &faces)?;
        let n_vertices = mesh.vertices().len();
        let mut used = vec![false; n_vertices];
        mesh.cells().flatten().for_each(|&vertex| used[vertex as usize] = true);
        let unused_vertices = (0..n_vertices as u32).filter(|&vertex| !used[vertex as usize]).collect();
        Ok(Self { faces, surface, unused_vertices })
    }
}

/// Checks that all vertices exist, and that something is left of each cell. Cells and faces may
/// name a vertex twice. A face may have shrunk to a line, as around the axis of a structured mesh:
/// then no cell has such a face, and it has no part in the surface.
fn check_degenerate<const N: usize>(
    what: &'static str,
    cells: &[[u32; N]],
    n_vertices: usize,
) -> Result<(), MeshError> {
    for (index, cell) in cells.iter().enumerate() {
        if let Some(&vertex) = cell.iter().find(|&&vertex| vertex as usize >= n_vertices) {
            return Err(MeshError::VertexOutOfRange { what, index, vertex, n_vertices });
        }
        let is_new = |&place: &usize| !cell[..place].contains(&cell[place]);
        let is_line = || (0..N).filter(is_new).count() < 3;
        let is_nothing = || if N == 4 { Face::new(cell).is_none() && !is_line() } else { n_corner_tets(cell) == 0 };
        if is_degenerate(cell) && is_nothing() {
            return Err(MeshError::Shrunk { what, index, at: cell[0] });
        }
    }
    Ok(())
}

fn check_indices<const N: usize>(
    what: &'static str,
    simplices: &[[u32; N]],
    n_vertices: usize,
) -> Result<(), MeshError> {
    for (index, simplex) in simplices.iter().enumerate() {
        for (place, &vertex) in simplex.iter().enumerate() {
            if vertex as usize >= n_vertices {
                return Err(MeshError::VertexOutOfRange { what, index, vertex, n_vertices });
            }
            if simplex[..place].contains(&vertex) {
                return Err(MeshError::RepeatedVertex { what, index, vertex });
            }
        }
    }
    Ok(())
}
