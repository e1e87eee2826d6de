//! Uniform refinement of meshes with other cells than tets.
//!
//! | cell | pieces |
//! |---|---|
//! | tet | 8 tets, see [`super::refine()`] |
//! | pyramid | 6 pyramids (4 at the base, 1 at the apex, 1 upside down under it) and 4 tets |
//! | prism | 8 prisms |
//! | hexahedron | 8 hexahedra |
//!
//! The middles of edges, of quadrilaterals (the mean of four vertices) and of hexahedra (the mean
//! of eight) become vertices, in this order after the old ones. Every face is cut by its own
//! middles alone, so neighbours agree.

use std::collections::HashMap;

use glam::DVec3;

use super::{
    CellKind, HybridMesh, MeshError, OtherCells, TetMesh,
    corners::{Face, faces_of, is_degenerate},
    edges::EDGE,
    refine::pieces_of_tet,
    validate,
    validate::check_corners,
};

/// Cuts every cell of a mesh into pieces of half its size; see the table of this module. Every
/// triangle and quadrilateral is cut into four of the same family. A quadrilateral that names a
/// vertex twice is the triangle that is left of it.
///
/// # Errors
/// - [`MeshError::Degenerate`]: a cell names a vertex twice
/// - [`MeshError::Refined`]: a piece of a cell with warped faces would be inverted
/// - others: the mesh is not valid; see [`validate()`]
pub fn refine_hybrid(mesh: HybridMesh) -> Result<(TetMesh, OtherCells), MeshError> {
    if mesh.others.is_empty() {
        return Ok((super::refine(mesh.mesh)?, OtherCells::none()));
    }
    validate(mesh)?;
    if let Some(cell) = (0..mesh.n_cells()).map(|cell| mesh.name(cell)).find(|&name| is_degenerate(mesh.cell(name))) {
        return Err(MeshError::Degenerate { cell, at: mesh.vertices()[mesh.cell(cell)[0] as usize] });
    }
    let middles = Middles::new(mesh);
    let vertices = &middles.vertices;
    let edge = |a: u32, b: u32| middles.edge(a, b);
    let face = |corners: [u32; 4]| middles.face(corners);

    let mut fine = TetMesh { families: mesh.mesh.families.clone(), ..TetMesh::default() };
    let mut others = OtherCells::none();
    for &tet in &mesh.mesh.tets {
        let of_tet = EDGE.map(|[a, b]| edge(tet[a], tet[b]));
        fine.tets.extend(pieces_of_tet(tet, of_tet, vertices));
    }
    for &[a, b, c, d, apex] in &mesh.others.pyramids {
        let middle = face([a, b, c, d]);
        let base = [a, b, c, d];
        let up = base.map(|corner| edge(corner, apex));
        for k in 0..4 {
            let (before, after) = ((k + 3) % 4, (k + 1) % 4);
            let (ahead, behind) = (edge(base[k], base[after]), edge(base[before], base[k]));
            others.pyramids.push([base[k], ahead, middle, behind, up[k]]);
            fine.tets.push([ahead, middle, up[k], up[after]]);
        }
        others.pyramids.push([up[0], up[1], up[2], up[3], apex]);
        others.pyramids.push([up[0], up[3], up[2], up[1], middle]);
    }
    for &[a, b, c, d, e, f] in &mesh.others.prisms {
        let triangles =
            |[a, b, c]: [u32; 3], [ab, bc, ca]: [u32; 3]| [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        let bottom = triangles([a, b, c], [edge(a, b), edge(b, c), edge(c, a)]);
        let sides = [face([a, b, e, d]), face([b, c, f, e]), face([c, a, d, f])];
        let middle = triangles([edge(a, d), edge(b, e), edge(c, f)], sides);
        let top = triangles([d, e, f], [edge(d, e), edge(e, f), edge(f, d)]);
        for (low, high) in bottom.iter().zip(&middle).chain(middle.iter().zip(&top)) {
            others.prisms.push([low[0], low[1], low[2], high[0], high[1], high[2]]);
        }
    }
    for (&[a, b, c, d, e, f, g, h], centre) in mesh.others.hexahedra.iter().zip(middles.first_centre..) {
        let quadrilaterals = |corners: [u32; 4], centre: u32, sides: [u32; 4]| {
            let [a, b, c, d] = corners;
            let [ab, bc, cd, da] = sides;
            [[a, ab, centre, da], [ab, b, bc, centre], [centre, bc, c, cd], [da, centre, cd, d]]
        };
        let bottom = quadrilaterals([a, b, c, d], face([a, b, c, d]), [edge(a, b), edge(b, c), edge(c, d), edge(d, a)]);
        let sides = [face([a, b, f, e]), face([b, c, g, f]), face([c, d, h, g]), face([d, a, e, h])];
        let middle = quadrilaterals([edge(a, e), edge(b, f), edge(c, g), edge(d, h)], centre, sides);
        let top = quadrilaterals([e, f, g, h], face([e, f, g, h]), [edge(e, f), edge(f, g), edge(g, h), edge(h, e)]);
        for (low, high) in bottom.iter().zip(&middle).chain(middle.iter().zip(&top)) {
            let ([a, b, c, d], [e, f, g, h]) = (*low, *high);
            others.hexahedra.push([a, b, c, d, e, f, g, h]);
        }
    }
    for index in 0..mesh.n_faces() as u32 {
        let (Some(of_mesh), Some(family)) = (mesh.face(index), mesh.family_of(index)) else { continue };
        match *of_mesh.vertices() {
            // Also a quadrilateral that names a vertex twice: its cell has a triangle there.
            [a, b, c] => {
                let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)];
                fine.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                fine.triangle_family.extend([family; 4]);
            }
            [a, b, c, d] => {
                let [ab, bc, cd, da] = [edge(a, b), edge(b, c), edge(c, d), edge(d, a)];
                let centre = face([a, b, c, d]);
                others.quadrilaterals.extend([
                    [a, ab, centre, da],
                    [ab, b, bc, centre],
                    [centre, bc, c, cd],
                    [da, centre, cd, d],
                ]);
                others.quadrilateral_family.extend([family; 4]);
            }
            _ => {}
        }
    }
    fine.vertices = middles.vertices;
    // The pieces of a cell with strongly warped faces may be inverted.
    let refined = HybridMesh { mesh: &fine, others: &others };
    CellKind::ALL
        .into_iter()
        .try_for_each(|kind| check_corners(refined, kind))
        .map_err(|error| MeshError::Refined(Box::new(error)))?;
    Ok((fine, others))
}

/// The new vertices of a refined mesh.
struct Middles {
    /// The old vertices, then the middles of edges, of quadrilaterals and of hexahedra.
    vertices: Vec<DVec3>,
    /// The cells' edges, the lower vertex first, in lexicographic order.
    edges: Vec<[u32; 2]>,
    /// Number of the mesh's vertices.
    n_vertices: usize,
    /// The vertex in the middle of each quadrilateral, by the key of the face.
    faces: HashMap<[u32; 4], u32>,
    /// The vertex in the middle of the first hexahedron.
    first_centre: u32,
}

impl Middles {
    fn new(mesh: HybridMesh) -> Self {
        let mut vertices = mesh.vertices().to_vec();
        let mut edges: Vec<[u32; 2]> = Vec::new();
        for face in mesh.cells().flat_map(faces_of) {
            let corners = face.vertices();
            let ends = |(place, &corner): (usize, &u32)| {
                let next = corners[(place + 1) % corners.len()];
                [corner.min(next), corner.max(next)]
            };
            edges.extend(corners.iter().enumerate().map(ends));
        }
        edges.sort_unstable();
        edges.dedup();
        let at = |vertex: u32| mesh.vertices()[vertex as usize];
        vertices.extend(edges.iter().map(|&[a, b]| 0.5 * at(a) + 0.5 * at(b)));
        let mean = |corners: &[u32]| corners.iter().map(|&vertex| at(vertex) / corners.len() as f64).sum::<DVec3>();
        let mut faces = HashMap::new();
        for face in mesh.cells().flat_map(faces_of).filter(|face| face.vertices().len() == 4) {
            faces.entry(face.key()).or_insert_with(|| {
                vertices.push(mean(face.vertices()));
                (vertices.len() - 1) as u32
            });
        }
        let first_centre = vertices.len() as u32;
        vertices.extend(mesh.others.hexahedra.iter().map(|cell| mean(cell)));
        Self { vertices, edges, n_vertices: mesh.vertices().len(), faces, first_centre }
    }

    /// The vertex in the middle of an edge.
    fn edge(&self, a: u32, b: u32) -> u32 {
        let edge = self.edges.binary_search(&[a.min(b), a.max(b)]);
        (self.n_vertices + edge.expect("the ends span an edge of a cell")) as u32
    }

    /// The vertex in the middle of a quadrilateral.
    fn face(&self, corners: [u32; 4]) -> u32 {
        let face = Face::new(&corners).expect("cells that are degenerate were refused");
        self.faces[&face.key()]
    }
}
