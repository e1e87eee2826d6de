//! Where the wing's edges cross the profiles' planes, and what the facets make of the displacement there.
//!
//! A wing of facets moves by its vertices. Even if every vertex moves exactly right, the section between two of them is the
//! straight line between their displacements and misses the new profile: on a coarse mesh by half a percent of the
//! chord. The ends of the edges that cross a plane are therefore corrected until the crossings go where the profile says:
//! a damped least-squares problem, solved by conjugate gradients (CGLS). Undamped, a strip of triangles has nearly as many
//! crossings as vertices, and vertices on either side of the plane would be played off against each other.

use glam::DVec3;

/// Weight of the square of the correction against that of what is missing: what varies slowly along the section is
/// corrected to 0.2 %, what alternates from vertex to vertex is left.
const DAMPING: f64 = 1e-3;
/// Most rounds; with that damping each fifty gain a digit.
const ROUNDS: usize = 2000;
/// Share of the first gradient at which to stop: below what any comparison of two runs looks at.
const ENOUGH: f64 = 1e-10;

/// One edge that crosses one plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    /// Its ends, as places among the wing's vertices.
    pub ends: [u32; 2],
    /// Where it crosses: 0 at the first end, 1 at the second.
    pub at: f64,
}

/// The edges that cross any of the planes.
///
/// - `distances` `[n_planes][n_vertices]`: signed distance of each vertex from each plane
/// - `edges`: pairs of places among the vertices
pub(super) fn find(distances: &[Vec<f64>], edges: &[[u32; 2]]) -> Vec<Crossing> {
    let crossing = |distances: &Vec<f64>, ends: [u32; 2]| {
        let [a, b] = ends.map(|end| distances[end as usize]);
        // A vertex on the plane has the profile's displacement already.
        (a * b < 0.0).then(|| Crossing { ends, at: a / (a - b) })
    };
    distances.iter().flat_map(|distances| edges.iter().filter_map(move |&ends| crossing(distances, ends))).collect()
}

/// Corrects displacements `[n_vertices]` so that the crossings move by `target` `[n_crossings]`.
pub(super) fn correct(crossings: &[Crossing], target: &[DVec3], displacement: &mut [DVec3]) {
    let mut missing: Vec<DVec3> =
        crossings.iter().zip(target).map(|(crossing, &target)| target - crossing.between(displacement)).collect();
    let mut correction = vec![DVec3::ZERO; displacement.len()];
    let mut first_slope = f64::NAN;
    let mut direction = vec![DVec3::ZERO; displacement.len()];
    let mut last_slope = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut gradient: Vec<DVec3> = correction.iter().map(|&correction| correction * -DAMPING).collect();
        for (crossing, &missing) in crossings.iter().zip(&missing) {
            for (end, weight) in crossing.weighted_ends() {
                gradient[end] += missing * weight;
            }
        }
        let slope = square(&gradient);
        if first_slope.is_nan() {
            first_slope = slope;
        }
        if slope == 0.0 || slope <= ENOUGH * ENOUGH * first_slope {
            break;
        }
        for (direction, gradient) in direction.iter_mut().zip(gradient) {
            *direction = gradient + *direction * (slope / last_slope);
        }
        last_slope = slope;
        let change: Vec<DVec3> = crossings.iter().map(|crossing| crossing.between(&direction)).collect();
        let step = slope / (square(&change) + DAMPING * square(&direction));
        if !step.is_finite() {
            break;
        }
        correction.iter_mut().zip(&direction).for_each(|(correction, direction)| *correction += *direction * step);
        missing.iter_mut().zip(&change).for_each(|(missing, change)| *missing -= *change * step);
    }
    displacement.iter_mut().zip(correction).for_each(|(displacement, correction)| *displacement += correction);
}

fn square(vectors: &[DVec3]) -> f64 {
    vectors.iter().map(|v| v.length_squared()).sum()
}

impl Crossing {
    fn weighted_ends(&self) -> [(usize, f64); 2] {
        [(self.ends[0] as usize, 1.0 - self.at), (self.ends[1] as usize, self.at)]
    }

    /// The value at the crossing of what is linear between the vertices.
    fn between(&self, values: &[DVec3]) -> DVec3 {
        let [(a, weight_a), (b, weight_b)] = self.weighted_ends();
        values[a] * weight_a + values[b] * weight_b
    }
}
