//! [`Connections`]: the cells behind each face and at each vertex.

use std::collections::HashMap;

use crate::mesh::{
    FamilyId, HybridMesh, MeshError, Order, OtherCells, TetMesh, cells_around,
    corners::Face,
    csr::Csr,
    half_face::{HalfFaces, face_vertices},
};

/// How the cells of a mesh are joined. Positions do not matter, so a moved mesh has the connections
/// of the original.
///
/// The cells stand in an [`Order`] in which neighbours are close in memory. In the order of a file
/// the dual volumes of 921 000 tets take three times as long. The order depends on the cells alone,
/// so a moved mesh that is read from its file has the figures of its report, to the bit.
#[derive(Debug)]
pub struct Connections {
    order: Order,
    tets: TetMesh,
    others: OtherCells,
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
        let given = mesh.into();
        let order = Order::breadth_first(given);
        let (tets, others) = (order.of(given.mesh), order.of_others(given.others));
        let mesh = HybridMesh { mesh: &tets, others: &others };
        // Errors name vertices and cells by their numbers in the mesh that was given.
        let faces = HalfFaces::new(mesh).or_else(|error| HalfFaces::new(given).and(Err(error)))?;
        let n_vertices = mesh.vertices().len();
        let cells_at = cells_around(mesh);
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
        Ok(Self { order, faces, cells_at, boundary, boundary_at, tets, others })
    }

    /// The mesh in its order.
    pub(super) fn mesh(&self) -> HybridMesh<'_> {
        HybridMesh { mesh: &self.tets, others: &self.others }
    }

    /// The order of the cells and vertices.
    pub(super) fn order(&self) -> &Order {
        &self.order
    }
}
