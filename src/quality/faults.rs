//! Faults of a moved mesh: clusters of inverted tets, and folded surface triangles.
//!
//! All faults are judged in f64 from coordinates alone. A surface is given by plain arrays, as in
//! [`crate::mesh::half_edge::Surface`]:
//!
//! - `triangles` `[n_triangles]`: vertices of each triangle, all with the same orientation
//! - `opposite` `[3 * n_triangles]`: for the half-edge `3 * triangle + k` its twin in the
//!   neighbouring triangle

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::geometry::{corners, triangle_normal};

/// Whether a tet with this beta is inverted. NaN counts as inverted.
pub fn is_inverted(beta: f64) -> bool {
    beta.is_nan() || beta <= 0.0
}

/// The indices of the inverted tets, ascending.
///
/// - `betas` `[n_tets]`
pub fn inverted(betas: &[f64]) -> Vec<u32> {
    (0..betas.len() as u32).filter(|&tet| is_inverted(betas[tet as usize])).collect()
}

/// The tets that share a vertex with the tets in `some`, these included, ascending.
pub fn around(tets: &[[u32; 4]], n_vertices: usize, some: &[u32]) -> Vec<u32> {
    let mut near = vec![false; n_vertices];
    some.iter().flat_map(|&tet| tets[tet as usize]).for_each(|vertex| near[vertex as usize] = true);
    let touches = |tet: &[u32; 4]| tet.iter().any(|&vertex| near[vertex as usize]);
    (0..tets.len() as u32).filter(|&tet| touches(&tets[tet as usize])).collect()
}

/// Inverted tets connected by shared vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct Cluster {
    /// Indices of the tets, ascending.
    pub tets: Vec<u32>,
    /// The tet with the lowest beta.
    pub worst: u32,
    /// The centre of the worst tet in the moved mesh, in the mesh's unit.
    pub at: DVec3,
}

/// The clusters of inverted tets, the cluster with the lowest beta first.
///
/// - `vertices` `[n_vertices]`, `betas` `[n_tets]`: of the moved mesh
pub fn clusters(vertices: &[DVec3], tets: &[[u32; 4]], betas: &[f64]) -> Vec<Cluster> {
    let inverted = inverted(betas);
    // A forest: each tet points to a tet of its cluster, the root to itself.
    let mut chief: Vec<usize> = (0..inverted.len()).collect();
    let find = |chief: &mut Vec<usize>, mut at: usize| {
        while chief[at] != at {
            chief[at] = chief[chief[at]];
            at = chief[at];
        }
        at
    };
    let mut first_at: HashMap<u32, usize> = HashMap::new();
    for (place, &tet) in inverted.iter().enumerate() {
        for vertex in tets[tet as usize] {
            let other = *first_at.entry(vertex).or_insert(place);
            let (a, b) = (find(&mut chief, place), find(&mut chief, other));
            chief[a.max(b)] = a.min(b);
        }
    }
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); inverted.len()];
    for (place, &tet) in inverted.iter().enumerate() {
        members[find(&mut chief, place)].push(tet);
    }
    let rank = |tet: u32| if betas[tet as usize].is_nan() { f64::NEG_INFINITY } else { betas[tet as usize] };
    let mut clusters: Vec<Cluster> = members
        .into_iter()
        .filter(|tets| !tets.is_empty())
        .map(|of_cluster| {
            let worst =
                of_cluster.iter().copied().min_by(|&a, &b| rank(a).total_cmp(&rank(b))).unwrap_or(of_cluster[0]);
            let at = centre(vertices, &tets[worst as usize]);
            Cluster { tets: of_cluster, worst, at }
        })
        .collect();
    clusters.sort_by(|a, b| rank(a.worst).total_cmp(&rank(b.worst)).then(a.worst.cmp(&b.worst)));
    clusters
}

fn centre<const N: usize>(vertices: &[DVec3], corners: &[u32; N]) -> DVec3 {
    corners.iter().map(|&vertex| vertices[vertex as usize]).sum::<DVec3>() / N as f64
}

/// The surface triangle nearest to the worst tet of a cluster. Distances are measured between
/// centres.
///
/// The candidates are the triangles at the worst tet's vertices. If there are none, the triangles
/// at the cluster's vertices are taken, and otherwise all triangles. `None` only if there is no
/// triangle.
///
/// - `vertices` `[n_vertices]`: of the moved mesh
pub fn nearest_triangle(
    vertices: &[DVec3],
    tets: &[[u32; 4]],
    triangles: &[[u32; 3]],
    cluster: &Cluster,
) -> Option<u32> {
    let distance = |triangle: u32| centre(vertices, &triangles[triangle as usize]).distance_squared(cluster.at);
    let all = 0..triangles.len() as u32;
    let nearest =
        |candidates: &mut dyn Iterator<Item = u32>| candidates.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
    let at_vertices_of = |some: &[u32]| {
        let mut own: Vec<u32> = some.iter().flat_map(|&tet| tets[tet as usize]).collect();
        own.sort_unstable();
        let touches = |&triangle: &u32| triangles[triangle as usize].iter().any(|at| own.binary_search(at).is_ok());
        nearest(&mut all.clone().filter(touches))
    };
    at_vertices_of(&[cluster.worst]).or_else(|| at_vertices_of(&cluster.tets)).or_else(|| nearest(&mut all.clone()))
}

/// The triangles folded by a motion, ascending: each is turned over against the surface around it.
///
/// An edge is *turned* if the motion changes the angle between the normals of its two triangles by
/// more than 90 degrees, either way. The angle is measured about the edge, so a rigid motion does
/// not change it. A fold changes the angle by 180 degrees; at a sharp edge that keeps its shape the
/// change is 0.
///
/// Turned edges cut the surface into parts. In each connected surface the part with the largest
/// original area is not folded. A part across a turned edge from an unfolded part is folded, a part
/// across a further turned edge is not, and so on.
///
/// A crease that ends inside the surface does not cut it, so it folds no triangle. A triangle that
/// has lost its area has no normal and is not counted; the tet behind it is inverted.
///
/// - `original`, `moved` `[n_vertices]`: positions, in the mesh's unit
pub fn folded(original: &[DVec3], moved: &[DVec3], triangles: &[[u32; 3]], opposite: &[u32]) -> Vec<u32> {
    EdgeAngles::new(original, triangles, opposite).folded(original, moved, triangles, opposite)
}

/// The angles at the edges of a surface before a motion.
#[derive(Clone, Debug)]
pub struct EdgeAngles {
    /// The lower half-edge of each edge, with the cosine and the sine of the edge's angle, both
    /// times the same positive number.
    edges: Vec<(u32, DVec2)>,
}

/// Edges in a task.
const EDGES: usize = 2048;

impl EdgeAngles {
    /// Measures the angles of a surface.
    ///
    /// - `original` `[n_vertices]`: positions, in the mesh's unit
    pub fn new(original: &[DVec3], triangles: &[[u32; 3]], opposite: &[u32]) -> Self {
        let normals: Vec<DVec3> = triangles.iter().map(|&triangle| normal(original, triangle)).collect();
        let lower = (0..opposite.len() as u32).filter(|&half_edge| half_edge < opposite[half_edge as usize]);
        let angle = |half_edge: u32| {
            let twin = opposite[half_edge as usize] as usize;
            (half_edge, edge_angle(original, &normals, triangles, half_edge as usize, twin))
        };
        Self { edges: lower.map(angle).collect() }
    }

    /// [`folded()`] for the surface that these angles were measured on.
    pub fn folded(&self, original: &[DVec3], moved: &[DVec3], triangles: &[[u32; 3]], opposite: &[u32]) -> Vec<u32> {
        let normals: Vec<DVec3> =
            triangles.par_iter().with_min_len(EDGES).map(|&triangle| normal(moved, triangle)).collect();
        let is_turned = |&&(half_edge, before): &&(u32, DVec2)| {
            let twin = opposite[half_edge as usize] as usize;
            before.dot(edge_angle(moved, &normals, triangles, half_edge as usize, twin)) < 0.0
        };
        let edges: Vec<u32> =
            self.edges.par_iter().with_min_len(EDGES).filter(is_turned).map(|&(half_edge, _)| half_edge).collect();
        if edges.is_empty() {
            return Vec::new();
        }
        let mut turned = vec![false; opposite.len()];
        for half_edge in edges {
            turned[half_edge as usize] = true;
            turned[opposite[half_edge as usize] as usize] = true;
        }
        turned_over(original, triangles, opposite, &turned)
    }

    /// The edges whose angle changes by more than so many degrees, ascending, each by its lower
    /// half-edge and with the change in degrees.
    ///
    /// - `moved` `[n_vertices]`: positions, in the mesh's unit
    /// - `triangles`, `opposite`: of the surface that these angles were measured on
    pub fn changed(&self, degrees: f64, moved: &[DVec3], triangles: &[[u32; 3]], opposite: &[u32]) -> Vec<(u32, f64)> {
        let normals: Vec<DVec3> =
            triangles.par_iter().with_min_len(EDGES).map(|&triangle| normal(moved, triangle)).collect();
        let least = degrees.to_radians().cos();
        let change = |&(half_edge, before): &(u32, DVec2)| {
            let twin = opposite[half_edge as usize] as usize;
            let after = edge_angle(moved, &normals, triangles, half_edge as usize, twin);
            let is_changed = before.dot(after) < least * before.length() * after.length();
            is_changed.then(|| (half_edge, before.angle_to(after).abs().to_degrees()))
        };
        self.edges.par_iter().with_min_len(EDGES).filter_map(change).collect()
    }
}

/// The triangles turned over, ascending, given the turned half-edges `[3 * n_triangles]`; see
/// [`folded()`].
fn turned_over(original: &[DVec3], triangles: &[[u32; 3]], opposite: &[u32], turned: &[bool]) -> Vec<u32> {
    let (part, area) = parts(original, triangles, opposite, turned);
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); area.len()];
    for half_edge in (0..opposite.len()).filter(|&half_edge| turned[half_edge]) {
        let (own, other) = (part[half_edge / 3], part[opposite[half_edge] as usize / 3]);
        if own != other {
            beside[own as usize].push(other);
        }
    }
    let mut largest_first: Vec<u32> = (0..area.len() as u32).collect();
    largest_first.sort_by(|&a, &b| area[b as usize].total_cmp(&area[a as usize]));
    let mut over: Vec<Option<bool>> = vec![None; area.len()];
    for start in largest_first {
        if over[start as usize].is_some() {
            continue;
        }
        over[start as usize] = Some(false);
        let mut front = vec![start];
        while !front.is_empty() {
            let mut next = Vec::new();
            for own in front {
                for &other in &beside[own as usize] {
                    if over[other as usize].is_none() {
                        over[other as usize] = over[own as usize].map(|is| !is);
                        next.push(other);
                    }
                }
            }
            front = next;
        }
    }
    let is_folded = |&triangle: &u32| over[part[triangle as usize] as usize] == Some(true);
    (0..triangles.len() as u32).filter(is_folded).collect()
}

/// The part of each triangle `[n_triangles]` and the area of each part `[n_parts]`. Turned edges
/// bound the parts.
fn parts(vertices: &[DVec3], triangles: &[[u32; 3]], opposite: &[u32], turned: &[bool]) -> (Vec<u32>, Vec<f64>) {
    let mut part = vec![u32::MAX; triangles.len()];
    let mut area = Vec::new();
    for start in 0..triangles.len() {
        if part[start] != u32::MAX {
            continue;
        }
        let number = area.len() as u32;
        let mut of_part = 0.0;
        part[start] = number;
        let mut stack = vec![start];
        while let Some(triangle) = stack.pop() {
            of_part += normal(vertices, triangles[triangle]).length() / 2.0;
            for half_edge in 3 * triangle..3 * triangle + 3 {
                let other = opposite[half_edge] as usize / 3;
                if !turned[half_edge] && part[other] == u32::MAX {
                    part[other] = number;
                    stack.push(other);
                }
            }
        }
        area.push(of_part);
    }
    (part, area)
}

/// Cosine and sine of the angle between the normals of the two triangles at an edge, measured about
/// the edge. Both are multiplied by the same positive number.
fn edge_angle(vertices: &[DVec3], normals: &[DVec3], triangles: &[[u32; 3]], half_edge: usize, twin: usize) -> DVec2 {
    let corners = triangles[half_edge / 3];
    let (from, to) = (corners[half_edge % 3], corners[(half_edge + 1) % 3]);
    let along = (vertices[to as usize] - vertices[from as usize]).normalize_or_zero();
    let (own, other) = (normals[half_edge / 3], normals[twin / 3]);
    DVec2::new(own.dot(other), along.dot(own.cross(other)))
}

/// Normal of a triangle. Its length is twice the area.
fn normal(vertices: &[DVec3], triangle: [u32; 3]) -> DVec3 {
    triangle_normal(corners(vertices, triangle))
}
