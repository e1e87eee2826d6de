//! [`Connections`]: the cells behind each face and at each vertex.

use std::collections::HashMap;

use crate::mesh::{
    FamilyId, HybridMesh, MeshError,
    corners::Face,
    csr::Csr,
    half_face::{HalfFaces, face_vertices},
};

/// How the cells of a mesh are joined. Positions do not matter, so a moved mesh has the connections
/// of the original.
#[derive(Clone, Debug)]
pub struct Connections {
    /// The faces of the cells.
    pub(super) faces: HalfFaces,
    /// The cells at each vertex: `n_vertices` rows, each ascending.
    pub(super) cells_at: Csr,
    /// The boundary faces with a family, normals outward.
    pub(super) boundary: Vec<(Face, FamilyId)>,
    /// The boundary faces at each vertex, as indices in `boundary`: `n_vertices` rows.
    pub(super) boundary_at: Csr,
}

impl Connections {
    /// The connections of a mesh whose cells name only vertices that exist.
    ///
    /// # Errors
    /// As [`HalfFaces::new`]: the cells do not fit together.
    pub fn new<'a>(mesh: impl Into<HybridMesh<'a>>) -> Result<Self, MeshError> {
        let mesh = mesh.into();
        let faces = HalfFaces::new(mesh)?;
        let n_vertices = mesh.vertices().len();
        // A degenerate cell names a vertex twice, and stands in its row once.
        let vertices_of = move |number: usize| {
            let cell = mesh.cell(mesh.name(number));
            let new = (0..cell.len()).filter(move |&place| !cell[..place].contains(&cell[place]));
            new.map(move |place| (cell[place], number as u32))
        };
        let places = (0..mesh.n_cells()).flat_map(vertices_of);
        let cells_at = Csr::from_pairs(n_vertices, places);
        let outward: HashMap<[u32; 4], u32> =
            faces.boundary().map(|half_face| (face_vertices(mesh, half_face).key(), half_face)).collect();
        let of_family = |face: u32| {
            let half_face = outward.get(&mesh.face(face)?.key())?;
            Some((face_vertices(mesh, *half_face), mesh.family_of(face)?))
        };
        let boundary: Vec<_> = (0..mesh.n_faces() as u32).filter_map(of_family).collect();
        let corners_of = |(number, (face, _)): (u32, &'_ (Face, FamilyId))| {
            let vertices = *face;
            (0..vertices.vertices().len()).map(move |place| (vertices.vertices()[place], number))
        };
        let corners = (0..).zip(boundary.iter()).flat_map(corners_of);
        let boundary_at = Csr::from_pairs(n_vertices, corners);
        Ok(Self { faces, cells_at, boundary, boundary_at })
    }
}
