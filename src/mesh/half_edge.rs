//! Surface half-edge structure (SHE): the oriented boundary triangles, their neighbours and their
//! families.
//!
//! A quadrilateral is two triangles (see `division`). Triangles serve geometry:
//! closest points, normals, folds. A diagonal is no edge of the mesh, and no spring runs along it.
//!
//! The structure is made of arrays: half-edge `3 * triangle + k` runs from the triangle's vertex
//! `k` to its next vertex.
//!
//! Files hold triangles of mixed orientation. Here every triangle is oriented: its normal points
//! into the tets, *out of the body*. Formats also list triangles in different orders. Here they are
//! sorted, so one mesh gives one surface.
//!
//! The paper (section 4) uses SHE to traverse a family's triangles, vertices and boundary curves.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::{FamilyId, HybridMesh, MeshError, corners::Face, csr::Csr, division::triangles_of_face, half_face};
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
    /// The face of the mesh in which each triangle lies `[n_triangles]`, see
    /// [`HybridMesh::face`].
    of_mesh: Vec<u32>,
    of_family: Csr,
    vertices_of_family: Csr,
}

impl Surface {
    /// Orients the mesh's boundary faces by its cells and joins their triangles along their edges.
    ///
    /// Families whose faces all lie inside the volume have no part in the surface.
    ///
    /// # Errors
    /// A face stands in the mesh twice, the faces are not exactly the boundary of the cells, or the
    /// number of triangles at an edge is not two.
    pub fn new<'a>(mesh: impl Into<HybridMesh<'a>>, faces: &half_face::HalfFaces) -> Result<Self, MeshError> {
        let mesh = mesh.into();
        let mut sorted = oriented_triangles(mesh, faces)?;
        sorted.sort_unstable();
        let (triangles, of_mesh): (Vec<_>, Vec<u32>) = sorted.into_iter().unzip();
        let family: Vec<FamilyId> = of_mesh.iter().filter_map(|&face| mesh.family_of(face)).collect();
        let opposite = join_edges(mesh, &triangles)?;
        let n_families = mesh.mesh.families.len();
        let pairs = family.iter().enumerate().map(|(triangle, family)| (family.0 as u32, triangle as u32));
        let of_family = Csr::from_pairs(n_families, pairs);
        let mut corners: Vec<(u32, u32)> = family
            .iter()
            .zip(&triangles)
            .flat_map(|(family, corners)| corners.map(|vertex| (family.0 as u32, vertex)))
            .collect();
        corners.sort_unstable();
        corners.dedup();
        let vertices_of_family = Csr::from_pairs(n_families, corners.into_iter());
        Ok(Self { triangles, family, opposite, of_mesh, of_family, vertices_of_family })
    }

    /// The faces of the mesh in which these triangles lie, ascending, each once. In a mesh of tets
    /// these are indices in [`TetMesh::triangles`](super::TetMesh::triangles).
    pub fn in_mesh(&self, triangles: &[u32]) -> Vec<u32> {
        let mut indices: Vec<u32> = triangles.iter().map(|&triangle| self.of_mesh[triangle as usize]).collect();
        indices.sort_unstable();
        indices.dedup();
        indices
    }

    /// One of these triangles for each face of the mesh in which some lie.
    pub fn one_of_each_face(&self, mut triangles: Vec<u32>) -> Vec<u32> {
        triangles.sort_unstable_by_key(|&triangle| (self.of_mesh[triangle as usize], triangle));
        triangles.dedup_by_key(|triangle| self.of_mesh[*triangle as usize]);
        triangles
    }

    /// Whether a half-edge is the diagonal of a quadrilateral.
    pub fn is_diagonal(&self, half_edge: u32) -> bool {
        let face = |half_edge: u32| self.of_mesh[half_edge as usize / 3];
        face(half_edge) == face(self.opposite[half_edge as usize])
    }

    /// The triangles, in which a quadrilateral is divided along both diagonals. So that each face
    /// counts as often, a triangle of the mesh stands in the list twice. A mesh of triangles gives
    /// the triangles as they are.
    ///
    /// Sums over these triangles do not depend on the diagonal along which a quadrilateral is
    /// divided. A symmetric mesh gets symmetric sums.
    pub fn triangles_of_both_divisions(&self) -> Vec<[u32; 3]> {
        let diagonal = |triangle: u32| (3 * triangle..3 * triangle + 3).find(|&half_edge| self.is_diagonal(half_edge));
        let all = 0..self.triangles.len() as u32;
        if all.clone().all(|triangle| diagonal(triangle).is_none()) {
            return self.triangles.clone();
        }
        let other = |triangle: u32| {
            let own = self.triangles[triangle as usize];
            let Some(half_edge) = diagonal(triangle) else { return own };
            // From the apex to one end of the diagonal, and from there to the other apex. The
            // triangle on the other side of the diagonal gives the other half.
            let apex = self.origin(next(next(half_edge)));
            let beyond = self.origin(next(next(self.opposite[half_edge as usize])));
            [apex, self.origin(half_edge), beyond]
        };
        self.triangles.iter().copied().chain(all.map(other)).collect()
    }

    /// The edges of the mesh around these triangles, each once, the lower vertex first, in
    /// lexicographic order. Diagonals are no edges.
    pub fn edges_of<'a>(&self, triangles: impl IntoIterator<Item = &'a u32>) -> Vec<[u32; 2]> {
        let half_edges = triangles.into_iter().flat_map(|&triangle| 3 * triangle..3 * triangle + 3);
        let ends = |half_edge: u32| {
            let (a, b) = (self.origin(half_edge), self.origin(next(half_edge)));
            [a.min(b), a.max(b)]
        };
        let mut edges: Vec<[u32; 2]> = half_edges.filter(|&half_edge| !self.is_diagonal(half_edge)).map(ends).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    }

    /// The triangles of a family, ascending.
    pub fn triangles_of(&self, family: FamilyId) -> &[u32] {
        self.of_family.row(family.index())
    }

    /// The faces of a family: its triangles, and each of its quadrilaterals as a whole.
    pub fn faces_of(&self, family: FamilyId) -> impl Iterator<Item = Face> + '_ {
        self.triangles_of(family).iter().filter_map(|&triangle| {
            let half_edges = 3 * triangle..3 * triangle + 3;
            let Some(diagonal) = half_edges.into_iter().find(|&half_edge| self.is_diagonal(half_edge)) else {
                return Some(Face::of_triangle(self.triangles[triangle as usize]));
            };
            let opposite = self.opposite[diagonal as usize];
            let apex = |half_edge: u32| self.origin(next(next(half_edge)));
            // The lower of the two triangles stands for the quadrilateral.
            let corners = [self.origin(diagonal), apex(opposite), self.origin(opposite), apex(diagonal)];
            if triangle < opposite / 3 { Face::new(&corners) } else { None }
        })
    }

    /// The vertices of each of a family's triangles, in the order of [`Self::triangles_of`].
    pub fn corners_of(&self, family: FamilyId) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles_of(family).iter().map(|&triangle| self.triangles[triangle as usize])
    }

    /// The vertices of a family, ascending, each once.
    pub fn vertices_of(&self, family: FamilyId) -> &[u32] {
        self.vertices_of_family.row(family.index())
    }

    /// The shortest edge of a family's triangles at each of the family's vertices, in the unit of
    /// the positions.
    ///
    /// - `positions` `[n_vertices]`
    pub fn shortest_edges(&self, positions: &[DVec3], family: FamilyId) -> BTreeMap<u32, f64> {
        let mut shortest = BTreeMap::new();
        for [a, b, c] in self.corners_of(family) {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                let length = positions[a as usize].distance(positions[b as usize]);
                for end in [a, b] {
                    shortest.entry(end).and_modify(|least: &mut f64| *least = least.min(length)).or_insert(length);
                }
            }
        }
        shortest
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

/// The triangles of the mesh's boundary faces, each with its face. Each triangle begins with its
/// lowest vertex, and its normal points out of the body.
fn oriented_triangles(mesh: HybridMesh, faces: &half_face::HalfFaces) -> Result<Vec<([u32; 3], u32)>, MeshError> {
    // The face of the mesh that takes each half-face of the boundary.
    let mut outer: HashMap<[u32; 4], (Face, Option<u32>)> = faces
        .boundary()
        .map(|half_face| half_face::face_vertices(mesh, half_face))
        .map(|face| (face.key(), (face, None)))
        .collect();
    let mut stray = Vec::new();
    let mut triangles = Vec::with_capacity(mesh.n_faces() + mesh.others.quadrilaterals.len());
    for index in 0..mesh.n_faces() as u32 {
        // A face that has shrunk to a line bounds nothing.
        let Some(face) = mesh.face(index) else { continue };
        match outer.get_mut(&face.key()) {
            Some(&mut (_, Some(first))) => return Err(duplicate_face(mesh, first, index)),
            Some((face, taken)) => {
                check_cycle(mesh, index, face)?;
                *taken = Some(index);
                // The normal of a cell's face points out of the fluid, the surface's out of the
                // body.
                let outward = face.turned_over();
                triangles.extend(triangles_of_face(outward.vertices(), mesh.vertices()).map(|half| (half, index)));
            }
            None => stray.push(index),
        }
    }
    check_inside(mesh, faces, &stray)?;
    let bare = faces.boundary().filter(|&half_face| {
        let key = half_face::face_vertices(mesh, half_face).key();
        outer.get(&key).is_some_and(|(_, taken)| taken.is_none())
    });
    let bare: Vec<u32> = bare.collect();
    if let Some(&first) = bare.first() {
        let vertices = half_face::face_vertices(mesh, first).vertices().to_vec();
        let at = mesh.vertices()[vertices[0] as usize];
        let are_doubled = are_doubled(mesh, &vertices);
        return Err(MeshError::BoundaryWithoutFamily { count: bare.len(), vertices, at, are_doubled });
    }
    Ok(triangles)
}

/// Checks that faces that are not on the boundary lie inside the volume, and that no other faces of
/// their families are on the boundary.
fn check_inside(mesh: HybridMesh, faces: &half_face::HalfFaces, stray: &[u32]) -> Result<(), MeshError> {
    if stray.is_empty() {
        return Ok(());
    }
    let inner: HashMap<[u32; 4], Face> = faces
        .inner()
        .map(|half_face| half_face::face_vertices(mesh, half_face))
        .map(|face| (face.key(), face))
        .collect();
    for &face in stray {
        if let Some(of_cell) = mesh.face(face).and_then(|face| inner.get(&face.key())) {
            check_cycle(mesh, face, of_cell)?;
        }
    }
    let is_inner = |face: u32| mesh.face(face).is_some_and(|face| inner.contains_key(&face.key()));
    let nowhere: Vec<u32> = stray.iter().copied().filter(|&face| !is_inner(face)).collect();
    if let Some(&first) = nowhere.first() {
        let mut families: Vec<(String, usize)> = Vec::new();
        for name in nowhere.iter().map(|&face| family_name(mesh, face)) {
            match families.iter_mut().find(|(known, _)| *known == name) {
                Some((_, count)) => *count += 1,
                None => families.push((name, 1)),
            }
        }
        let vertices: Box<[u32]> = mesh.face_vertices(first).into();
        let at = mesh.vertices()[vertices[0] as usize];
        return Err(MeshError::FacesOfNoCell {
            count: nowhere.len(),
            families,
            first: mesh.face_name(first).into(),
            family: family_name(mesh, first),
            are_doubled: are_doubled(mesh, &vertices),
            vertices,
            at,
        });
    }
    let count = |faces: &mut dyn Iterator<Item = u32>| {
        let mut counts = vec![0; mesh.mesh.families.len()];
        for family in faces.filter_map(|face| mesh.family_of(face)) {
            counts[family.index()] += 1;
        }
        counts
    };
    let all = &mut (0..mesh.n_faces() as u32).filter(|&face| mesh.face(face).is_some());
    let (inside, all) = (count(&mut stray.iter().copied()), count(all));
    let is_partly_inside =
        |face: &&u32| mesh.family_of(**face).is_some_and(|family| inside[family.index()] < all[family.index()]);
    match stray.iter().find(is_partly_inside) {
        Some(&face) => {
            let family = mesh.family_of(face).map_or(0, FamilyId::index);
            let at = mesh.vertices()[mesh.face_vertices(face)[0] as usize];
            let (inside, all) = (inside[family], all[family]);
            Err(MeshError::PartlyInside { family: family_name(mesh, face), inside, all, at })
        }
        None => Ok(()),
    }
}

/// Whether each of some vertices has another one at its place, as where a volume and its surface,
/// or two volumes, were put into one file without merging their points.
fn are_doubled(mesh: HybridMesh, vertices: &[u32]) -> bool {
    let positions = mesh.vertices();
    let is_doubled = |&vertex: &u32| positions.iter().filter(|at| **at == positions[vertex as usize]).count() > 1;
    vertices.iter().all(is_doubled)
}

/// Checks that a face joins its vertices in the order of the cell's face, either way round.
fn check_cycle(mesh: HybridMesh, face: u32, of_cell: &Face) -> Result<(), MeshError> {
    let fits = |own: Face| own.is_turn_of(of_cell) || own.turned_over().is_turn_of(of_cell);
    if mesh.face(face).is_some_and(fits) {
        return Ok(());
    }
    let vertices = mesh.face_vertices(face).to_vec();
    let at = mesh.vertices()[vertices[0] as usize];
    Err(MeshError::CrossedFace { face: mesh.face_name(face), family: family_name(mesh, face), vertices, at })
}

fn family_name(mesh: HybridMesh, face: u32) -> String {
    mesh.family_of(face).and_then(|family| mesh.mesh.families.get(family.index())).cloned().unwrap_or_default()
}

fn duplicate_face(mesh: HybridMesh, first: u32, second: u32) -> MeshError {
    let vertices = mesh.face_vertices(second).to_vec();
    let at = mesh.vertices()[vertices[0] as usize];
    let faces = [first, second];
    let families = Box::new(faces.map(|face| family_name(mesh, face)));
    MeshError::DuplicateFace { faces: Box::new(faces.map(|face| mesh.face_name(face))), families, vertices, at }
}

fn join_edges(mesh: HybridMesh, triangles: &[[u32; 3]]) -> Result<Vec<u32>, MeshError> {
    let origin = |h: u32| triangles[h as usize / 3][h as usize % 3];
    let ends = |h: u32| {
        let (a, b) = (origin(h), origin(next(h)));
        (a.min(b), a.max(b))
    };
    let n = triangles.len() as u32 * 3;
    let by_lowest = Csr::from_pairs(mesh.vertices().len(), (0..n).map(|h| (ends(h).0, h)));
    let mut opposite = vec![0; n as usize];
    let mut row: Vec<(u32, u32)> = Vec::new();
    for vertex in 0..mesh.vertices().len() {
        row.clear();
        row.extend(by_lowest.row(vertex).iter().map(|&h| (ends(h).1, h)));
        row.sort_unstable();
        for same in row.chunk_by(|a, b| a.0 == b.0) {
            let [(_, a), (_, b)] = *same else {
                let (low, high) = ends(same[0].1);
                return Err(MeshError::NonManifoldEdge {
                    vertices: [low, high],
                    triangles: same.len(),
                    at: mesh.vertices()[low as usize],
                });
            };
            opposite[a as usize] = b;
            opposite[b as usize] = a;
        }
    }
    Ok(opposite)
}
