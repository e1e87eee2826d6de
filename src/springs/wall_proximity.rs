//! Proximity of the edges of a mesh to the moved walls: a factor that makes springs stiffer, or
//! softer, near walls.
//!
//! After Blom's boundary improvement (Int. J. Numer. Meth. Fluids 32, 2000, 647-668). Blom
//! multiplies the springs at a moving wall by a number, so the tets at the wall move almost as a
//! rigid body and the tets farther away deform. The factor here falls smoothly with the distance
//! and has no unit.

use glam::DVec3;
use rayon::prelude::*;

use crate::projection::TriangleTree;

/// Proximity `h / (d + h)` of each edge `[n_edges]`: 1 on a wall, falling to 0 away from it. 1
/// everywhere if there is no wall.
///
/// `h` is the median edge length of the walls' triangles. `d` is the mean distance of the edge's
/// two ends from the walls. This mean differs from the distance of the edge's middle by less than
/// half an edge, and needs a fifth of the searches.
///
/// - `points` `[n_points]`: positions, in any unit
/// - `edges` `[n_edges]`: pairs of points
/// - `walls` `[n_triangles]`: triangles of points
pub fn wall_proximity(points: &[DVec3], edges: &[[u32; 2]], walls: &[[u32; 3]]) -> Vec<f64> {
    let at = |point: u32| points[point as usize];
    let mut lengths: Vec<f64> =
        walls.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|[a, b]| at(a).distance(at(b))).collect();
    if lengths.is_empty() {
        return vec![1.0; edges.len()];
    }
    let middle = lengths.len() / 2;
    let h = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
    let tree = TriangleTree::new(points, walls);
    let mut on_wall = vec![false; points.len()];
    walls.iter().flatten().for_each(|&point| on_wall[point as usize] = true);
    let away = |(&at, &on_wall): (&DVec3, &bool)| if on_wall { 0.0 } else { tree.closest(at).distance_squared.sqrt() };
    let distance: Vec<f64> = points.par_iter().zip(&on_wall).map(away).collect();
    edges.iter().map(|edge| edge.map(|end| distance[end as usize])).map(|[a, b]| h / (0.5 * (a + b) + h)).collect()
}
