//! The checks that a mesh must pass before anything is built on it.

use glam::DVec3;

use super::{MeshError, TetMesh, half_edge::Surface, half_face::HalfFaces, size::SIZES};
use crate::{geometry, quality};

/// The topology of a checked mesh.
#[derive(Clone, Debug)]
pub struct Topology {
    /// The faces of the tets.
    pub faces: HalfFaces,
    /// The oriented boundary surface.
    pub surface: Surface,
    /// Vertices that no tet uses, ascending. They are not moved.
    pub unused_vertices: Vec<u32>,
}

/// Checks a mesh and builds its topology.
///
/// # Errors
/// The first fault found, in the order of [`MeshError`].
pub fn validate(mesh: &TetMesh) -> Result<Topology, MeshError> {
    check(mesh)?;
    Topology::new(mesh)
}

/// Checks each vertex, tet and triangle alone: coordinates are finite, all named vertices exist,
/// none is named twice in a tet or triangle, the size is in [`SIZES`], and no tet is inverted or
/// left-handed.
///
/// # Errors
/// The first fault found, in the order of [`MeshError`].
pub fn check(mesh: &TetMesh) -> Result<(), MeshError> {
    if mesh.tets.is_empty() {
        return Err(MeshError::NoTets);
    }
    if let Some(vertex) = mesh.vertices.iter().position(|at| !at.is_finite()) {
        return Err(MeshError::NotFinite { vertex, at: mesh.vertices[vertex].to_array() });
    }
    check_indices("tet", &mesh.tets, mesh.vertices.len())?;
    check_indices("triangle", &mesh.triangles, mesh.vertices.len())?;
    check_size(mesh.tets.iter().flatten().map(|&vertex| mesh.vertices[vertex as usize]))?;
    let corners = |tet: usize| geometry::corners(&mesh.vertices, mesh.tets[tet]);
    let volume = |tet: usize| quality::volume(corners(tet));
    let inverted: Vec<usize> = (0..mesh.tets.len()).filter(|&tet| volume(tet) <= 0.0).collect();
    if let Some(&first) = inverted.iter().find(|&&tet| volume(tet) < 0.0) {
        let count = inverted.iter().filter(|&&tet| volume(tet) < 0.0).count();
        // A few inverted tets are a fault of their places. Most tets cannot be.
        if 2 * count > mesh.tets.len() {
            let right_handed = (0..mesh.tets.len()).find(|&tet| volume(tet).is_nan() || volume(tet) >= 0.0);
            let (n_tets, at) = (mesh.tets.len(), corners(first)[0]);
            return Err(MeshError::LeftHanded { count, n_tets, first, right_handed, at });
        }
    }
    if let Some(&first) = inverted.first() {
        return Err(MeshError::Inverted {
            count: inverted.len(),
            n_tets: mesh.tets.len(),
            first,
            volume: volume(first),
            at: corners(first)[0],
        });
    }
    Ok(())
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
    /// The first mismatch of tets and triangles, in the order of [`MeshError`].
    pub fn new(mesh: &TetMesh) -> Result<Self, MeshError> {
        let faces = HalfFaces::new(mesh)?;
        let surface = Surface::new(mesh, &faces)?;
        let mut used = vec![false; mesh.vertices.len()];
        mesh.tets.iter().flatten().for_each(|&vertex| used[vertex as usize] = true);
        let unused_vertices = (0..mesh.vertices.len() as u32).filter(|&vertex| !used[vertex as usize]).collect();
        Ok(Self { faces, surface, unused_vertices })
    }
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
