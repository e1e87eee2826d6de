//! Rulings of a part along a closed curve of its boundary: the straight lines by which the part is
//! continued beyond the curve.
//!
//! A ruling lies in the part's surface, and rises by one unit above the surface on which the curve
//! lies. So it says by how much the curve shifts if that surface goes down by one unit. Its share
//! along the curve is chosen so that rulings change as little as possible from vertex to vertex:
//! springs of stiffness `1 / l` act between neighbours. On a cylinder of any section the rulings
//! are the cylinder's own, on a swept and tapered pylon they go along constant fractions of the
//! chord. At a sharp edge of the part the ruling goes along the edge.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::unit_normal;
use crate::mesh::{
    TetMesh,
    half_edge::{Surface, next},
};

/// Cosine of the least angle, 40 degrees, between the part's triangles on both sides of a sharp
/// edge.
const SHARP: f64 = 0.766_044_443_118_978;

/// The sine of the least angle, 6 degrees, between the part and the surface. Where they touch at a
/// smaller one, the place of their curve is hardly known.
const LEAST_SINE: f64 = 0.1;

/// The least residual of the springs, as a fraction of the first.
const TOLERANCE: f64 = 1e-14;

/// The closed curves of half-edges, in order. `None` if they are no closed curves.
pub(super) fn loops(surface: &Surface, half_edges: impl Iterator<Item = u32>) -> Option<Vec<Vec<u32>>> {
    let (mut from, mut order) = (HashMap::new(), Vec::new());
    for half_edge in half_edges {
        if from.insert(surface.origin(half_edge), half_edge).is_some() {
            return None;
        }
        order.push(half_edge);
    }
    let mut loops = Vec::new();
    for start in order {
        let mut found = Vec::new();
        let mut vertex = surface.origin(start);
        while let Some(half_edge) = from.remove(&vertex) {
            found.push(half_edge);
            vertex = surface.origin(next(half_edge));
        }
        if let Some(&first) = found.first() {
            if vertex != surface.origin(first) {
                return None;
            }
            loops.push(found);
        }
    }
    Some(loops)
}

/// The rulings at the vertices of a closed curve `[n]`, out of the part.
///
/// - `curve` `[n]`: half-edges of the part, in order
///
/// # Errors
/// The vertex at which the part only touches the surface.
pub(super) fn directions(mesh: &TetMesh, surface: &Surface, curve: &[u32]) -> Result<Vec<DVec3>, u32> {
    let n = curve.len();
    let at = |half_edge: u32| mesh.vertices[surface.origin(half_edge) as usize];
    let points: Vec<DVec3> = curve.iter().map(|&half_edge| at(half_edge)).collect();
    let length: Vec<f64> = (0..n).map(|i| points[i].distance(points[(i + 1) % n])).collect();
    let normal_at = |half_edge: u32| unit_normal([half_edge, next(half_edge), next(next(half_edge))].map(at));
    let normal: Vec<DVec3> = curve.iter().map(|&half_edge| normal_at(half_edge)).collect();
    let below: Vec<DVec3> = curve.iter().map(|&half_edge| -normal_at(surface.opposite[half_edge as usize])).collect();
    let outward = |i: usize| {
        let along = points[(i + 1) % n] - points[i];
        (points[i] - at(next(next(curve[i])))).reject_from(along).normalize_or_zero()
    };
    let across: Vec<DVec3> = (0..n).map(outward).collect();
    let mut tangent = vec![DVec3::ZERO; n];
    let mut direction = vec![DVec3::ZERO; n];
    let mut free = vec![true; n];
    for i in 0..n {
        let before = (i + n - 1) % n;
        let mean = |of: &[DVec3]| (of[before] * length[before] + of[i] * length[i]).normalize_or_zero();
        let (up, down) = (mean(&normal), mean(&below));
        tangent[i] = (points[(i + 1) % n] - points[before]).reject_from_normalized(up).normalize_or_zero();
        let out = mean(&across).reject_from_normalized(up).reject_from_normalized(tangent[i]).normalize_or_zero();
        let mut ruling = out;
        if normal[before].dot(normal[i]) < SHARP {
            let edge = normal[before].cross(normal[i]).normalize_or_zero();
            if edge.dot(down).abs() > LEAST_SINE {
                ruling = edge * edge.dot(down).signum();
                free[i] = false;
            }
        }
        let sine = ruling.dot(down);
        if sine <= LEAST_SINE {
            return Err(surface.origin(curve[i]));
        }
        direction[i] = ruling / sine;
    }
    let slant = slants(&direction, &tangent, &length, &free);
    Ok((0..n).map(|i| direction[i] + slant[i] * tangent[i]).collect())
}

/// The part along the curve of each ruling `[n]`: the equilibrium of springs between the directions
/// of neighbours, by conjugate gradients.
fn slants(direction: &[DVec3], tangent: &[DVec3], length: &[f64], free: &[bool]) -> Vec<f64> {
    let n = direction.len();
    // The forces of the springs on the directions, along the curve.
    let forces = |slant: &[f64], with: &dyn Fn(usize, f64) -> DVec3| -> Vec<f64> {
        let of = |i: usize| with(i, slant[i]);
        let force = |i: usize| {
            if !free[i] {
                return 0.0;
            }
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let sum = (of(before) - of(i)) / length[before] + (of(after) - of(i)) / length[i];
            sum.dot(tangent[i])
        };
        (0..n).map(force).collect()
    };
    let product = |slant: &[f64]| forces(slant, &|i, slant| slant * tangent[i]);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut slant = vec![0.0; n];
    let mut residual = forces(&slant, &|i, slant| direction[i] + slant * tangent[i]);
    let mut search = residual.clone();
    let first = dot(&residual, &residual);
    let mut square = first;
    for _ in 0..10 * n {
        if square <= TOLERANCE * TOLERANCE * first {
            break;
        }
        let change = product(&search);
        let curvature = -dot(&search, &change);
        if curvature <= 0.0 {
            break;
        }
        let step = square / curvature;
        for i in 0..n {
            slant[i] += step * search[i];
            residual[i] += step * change[i];
        }
        let after = dot(&residual, &residual);
        for i in 0..n {
            search[i] = residual[i] + after / square * search[i];
        }
        square = after;
    }
    slant
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slanted cylinder over an ellipse: all rulings are its own direction. From each vertex only
    /// the part across the curve is known.
    ///
    /// Fails if the rulings are perpendicular to the curve.
    #[test]
    fn rulings_of_a_cylinder_are_parallel() {
        let own = DVec3::new(0.7, -0.4, 1.0);
        let n = 40;
        let at = |k: usize| {
            let angle = std::f64::consts::TAU * (k % n) as f64 / n as f64;
            DVec3::new(3.0 * angle.cos(), 0.4 * angle.sin(), 0.0)
        };
        let length: Vec<f64> = (0..n).map(|k| at(k).distance(at(k + 1))).collect();
        let tangent: Vec<DVec3> = (0..n).map(|k| (at(k + 1) - at(k + n - 1)).normalize()).collect();
        for free in [vec![true; n], (0..n).map(|k| k != 7).collect()] {
            let across = |k: usize| if free[k] { own.reject_from_normalized(tangent[k]) } else { own };
            let direction: Vec<DVec3> = (0..n).map(across).collect();
            let slant = slants(&direction, &tangent, &length, &free);
            for k in 0..n {
                assert!((direction[k] + slant[k] * tangent[k]).distance(own) < 1e-9, "{k}: {}", slant[k]);
            }
        }
    }
}
