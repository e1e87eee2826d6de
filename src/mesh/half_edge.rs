//! Surface half-edge structure (SHE): the oriented boundary triangles, their neighbours and their
//! families.
//!
//! The structure is made of arrays: half-edge `3 * triangle + k` runs from the triangle's vertex
//! `k` to its next vertex.
//!
//! Files hold triangles of mixed orientation. Here every triangle is oriented: its normal points
//! into the tets, *out of the body*. Formats also list triangles in different orders. Here they are
//! sorted, so one mesh gives one surface.
//!
//! The paper (section 4) uses SHE to traverse a family's triangles, vertices and boundary curves.

use std::collections::HashMap;

use glam::DVec3;

use super::{FamilyId, MeshError, TetMesh, csr::Csr, half_face, lowest_of};
use crate::geometry::{self, triangle_normal};

/// A curve along the boundary between one family and another: a run of edges with the same family
/// on the other side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BoundaryCurve {
    /// Vertices in order along the curve. Seen from the fluid, the family lies on the left. A
    /// closed curve does not repeat its first vertex.
    pub vertices: Vec<u32>,
    /// Whether an edge joins the last vertex to the first.
    pub closed: bool,
}

/// The oriented boundary surface.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Vertices of each triangle `[n_triangles]`, the lowest one first, with the normal out of the
    /// body. Sorted, not in the order of the file.
    pub triangles: Vec<[u32; 3]>,
    /// Family of each triangle `[n_triangles]`.
    pub family: Vec<FamilyId>,
    /// The twin of each half-edge in the neighbouring triangle `[3 * n_triangles]`.
    pub opposite: Vec<u32>,
    /// Index of each triangle in [`TetMesh::triangles`] `[n_triangles]`.
    of_mesh: Vec<u32>,
    of_family: Csr,
    vertices_of_family: Csr,
}

impl Surface {
    /// Orients the mesh's triangles by its tets and joins them along their edges.
    ///
    /// # Errors
    /// A triangle stands in the mesh twice, the triangles are not exactly the boundary of the tets,
    /// or the number of triangles at an edge is not two.
    pub fn new(mesh: &TetMesh, faces: &half_face::HalfFaces) -> Result<Self, MeshError> {
        let mut sorted: Vec<_> = oriented_triangles(mesh, faces)?.into_iter().zip(0..).collect();
        sorted.sort_unstable();
        let (triangles, of_mesh): (Vec<_>, Vec<u32>) = sorted.into_iter().unzip();
        let family: Vec<FamilyId> = of_mesh.iter().map(|&index| mesh.triangle_family[index as usize]).collect();
        let opposite = join_edges(mesh, &triangles)?;
        let pairs = family.iter().enumerate().map(|(triangle, family)| (family.0 as u32, triangle as u32));
        let of_family = Csr::from_pairs(mesh.families.len(), pairs);
        let mut corners: Vec<(u32, u32)> = family
            .iter()
            .zip(&triangles)
            .flat_map(|(family, corners)| corners.map(|vertex| (family.0 as u32, vertex)))
            .collect();
        corners.sort_unstable();
        corners.dedup();
        let vertices_of_family = Csr::from_pairs(mesh.families.len(), corners.into_iter());
        Ok(Self { triangles, family, opposite, of_mesh, of_family, vertices_of_family })
    }

    /// Indices of these triangles in [`TetMesh::triangles`], ascending.
    pub fn in_mesh(&self, triangles: &[u32]) -> Vec<u32> {
        let mut indices: Vec<u32> = triangles.iter().map(|&triangle| self.of_mesh[triangle as usize]).collect();
        indices.sort_unstable();
        indices
    }

    /// The triangles of a family, ascending.
    pub fn triangles_of(&self, family: FamilyId) -> &[u32] {
        self.of_family.row(family.index())
    }

    /// The vertices of each of a family's triangles, in the order of [`Self::triangles_of`].
    pub fn corners_of(&self, family: FamilyId) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles_of(family).iter().map(|&triangle| self.triangles[triangle as usize])
    }

    /// The vertices of a family, ascending, each once.
    pub fn vertices_of(&self, family: FamilyId) -> &[u32] {
        self.vertices_of_family.row(family.index())
    }

    /// The vertices of all families, one family after another. A vertex on several families occurs
    /// once for each of them.
    pub fn vertices(&self) -> &[u32] {
        &self.vertices_of_family.entries
    }

    /// The closed curves that bound a family. Each is a loop of half-edges of the family's own
    /// triangles.
    pub fn boundary_loops(&self, family: FamilyId) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.triangles_of(family).len() * 3];
        let first = |half_edge: u32| {
            let triangle = half_edge / 3;
            let place = self.triangles_of(family).binary_search(&triangle).expect("the half-edge is of this family");
            place * 3 + half_edge as usize % 3
        };
        let mut loops = Vec::new();
        for &triangle in self.triangles_of(family) {
            for start in 3 * triangle..3 * triangle + 3 {
                if !self.bounds(start, family) || seen[first(start)] {
                    continue;
                }
                let mut walk = Vec::new();
                let mut half_edge = start;
                while !seen[first(half_edge)] {
                    seen[first(half_edge)] = true;
                    walk.push(half_edge);
                    half_edge = next(half_edge);
                    while !self.bounds(half_edge, family) {
                        half_edge = next(self.opposite[half_edge as usize]);
                    }
                }
                loops.push(walk);
            }
        }
        loops
    }

    /// The curves that a family shares with another one, each as long as possible.
    pub fn shared_curves(&self, family: FamilyId, other: FamilyId) -> Vec<BoundaryCurve> {
        let shared = |half_edge: u32| self.family[self.opposite[half_edge as usize] as usize / 3] == other;
        let mut curves = Vec::new();
        for walk in self.boundary_loops(family) {
            let Some(gap) = walk.iter().position(|&half_edge| !shared(half_edge)) else {
                curves.push(BoundaryCurve { vertices: walk.iter().map(|&h| self.origin(h)).collect(), closed: true });
                continue;
            };
            let mut vertices: Vec<u32> = Vec::new();
            for step in 1..=walk.len() {
                let half_edge = walk[(gap + step) % walk.len()];
                if shared(half_edge) {
                    if vertices.is_empty() {
                        vertices.push(self.origin(half_edge));
                    }
                    vertices.push(self.origin(next(half_edge)));
                } else if !vertices.is_empty() {
                    curves.push(BoundaryCurve { vertices: std::mem::take(&mut vertices), closed: false });
                }
            }
        }
        curves
    }

    /// The family on the other side of a half-edge.
    pub fn family_behind(&self, half_edge: u32) -> FamilyId {
        self.family[self.opposite[half_edge as usize] as usize / 3]
    }

    /// The first vertex of a half-edge.
    pub fn origin(&self, half_edge: u32) -> u32 {
        self.triangles[half_edge as usize / 3][half_edge as usize % 3]
    }

    /// Unit normals at the vertices of a family, out of the body, in the order of
    /// [`Self::vertices_of`]. Only the family's own triangles count, weighted by area.
    ///
    /// - `vertices` `[n_vertices]`: positions, in any unit
    pub fn normals_of(&self, family: FamilyId, vertices: &[DVec3]) -> Vec<DVec3> {
        let own = self.vertices_of(family);
        let mut normals = vec![DVec3::ZERO; own.len()];
        for corners in self.corners_of(family) {
            let area = triangle_normal(geometry::corners(vertices, corners));
            for vertex in corners {
                normals[own.binary_search(&vertex).expect("a family's triangles have its vertices")] += area;
            }
        }
        normals.into_iter().map(DVec3::normalize_or_zero).collect()
    }

    fn bounds(&self, half_edge: u32, family: FamilyId) -> bool {
        self.family_behind(half_edge) != family
    }
}

/// The next half-edge of the same triangle.
pub fn next(half_edge: u32) -> u32 {
    if half_edge % 3 == 2 { half_edge - 2 } else { half_edge + 1 }
}

/// The mesh's triangles in their order. Each begins with its lowest vertex, and its normal points
/// out of the body.
fn oriented_triangles(mesh: &TetMesh, faces: &half_face::HalfFaces) -> Result<Vec<[u32; 3]>, MeshError> {
    let sorted = |mut triangle: [u32; 3]| {
        triangle.sort_unstable();
        triangle
    };
    // The triangle that takes a face of the boundary.
    let mut outer: HashMap<[u32; 3], (u32, Option<u32>)> =
        faces.boundary().map(|h| (sorted(half_face::face_vertices(mesh, h)), (h, None))).collect();
    let family = |triangle: u32| {
        let family = mesh.triangle_family.get(triangle as usize);
        family.and_then(|family| mesh.families.get(family.index())).cloned().unwrap_or_default()
    };
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let mut stray = Vec::new();
    let mut triangles = Vec::with_capacity(mesh.triangles.len());
    for (index, &triangle) in mesh.triangles.iter().enumerate() {
        match outer.get_mut(&sorted(triangle)) {
            Some(&mut (_, Some(first))) => {
                let triangles = [first, index as u32];
                let (families, at) = (triangles.map(family), at(triangle[0]));
                return Err(MeshError::DuplicateTriangle { triangles, families, vertices: triangle, at });
            }
            Some((half_face, taken)) => {
                *taken = Some(index as u32);
                // The normal of a tet's face points out of the fluid, the surface's out of the
                // body: two vertices swap.
                let [a, b, c] = half_face::face_vertices(mesh, *half_face);
                let mut outward = [a, c, b];
                let lowest = lowest_of(&outward);
                outward.rotate_left(lowest);
                triangles.push(outward);
            }
            None => stray.push(index as u32),
        }
    }
    if let Some(&first) = stray.first() {
        let mut families: Vec<(String, usize)> = Vec::new();
        for name in stray.iter().map(|&triangle| family(triangle)) {
            match families.iter_mut().find(|(known, _)| *known == name) {
                Some((_, count)) => *count += 1,
                None => families.push((name, 1)),
            }
        }
        let vertices = mesh.triangles[first as usize];
        return Err(MeshError::TrianglesNotOnBoundary {
            count: stray.len(),
            families,
            first,
            family: family(first),
            vertices,
            at: at(vertices[0]),
        });
    }
    let bare: Vec<u32> = outer.values().filter(|(_, taken)| taken.is_none()).map(|&(half_face, _)| half_face).collect();
    if let Some(&first) = bare.iter().min() {
        let vertices = half_face::face_vertices(mesh, first);
        return Err(MeshError::BoundaryWithoutFamily {
            count: bare.len(),
            vertices,
            at: mesh.vertices[vertices[0] as usize],
        });
    }
    Ok(triangles)
}

fn join_edges(mesh: &TetMesh, triangles: &[[u32; 3]]) -> Result<Vec<u32>, MeshError> {
    let origin = |h: u32| triangles[h as usize / 3][h as usize % 3];
    let ends = |h: u32| {
        let (a, b) = (origin(h), origin(next(h)));
        (a.min(b), a.max(b))
    };
    let n = triangles.len() as u32 * 3;
    let by_lowest = Csr::from_pairs(mesh.vertices.len(), (0..n).map(|h| (ends(h).0, h)));
    let mut opposite = vec![0; n as usize];
    let mut row: Vec<(u32, u32)> = Vec::new();
    for vertex in 0..mesh.vertices.len() {
        row.clear();
        row.extend(by_lowest.row(vertex).iter().map(|&h| (ends(h).1, h)));
        row.sort_unstable();
        for same in row.chunk_by(|a, b| a.0 == b.0) {
            let [(_, a), (_, b)] = *same else {
                let (low, high) = ends(same[0].1);
                return Err(MeshError::NonManifoldEdge {
                    vertices: [low, high],
                    triangles: same.len(),
                    at: mesh.vertices[low as usize],
                });
            };
            opposite[a as usize] = b;
            opposite[b as usize] = a;
        }
    }
    Ok(opposite)
}
