//! Where the wing's edges cross the profiles' planes, and what the facets make of the displacement there.
//!
//! A wing of facets moves by its vertices. Even if every vertex moves exactly right, the section between two of them is the
//! straight line between their displacements and misses the new profile: on a coarse mesh by half a percent of the
//! chord. The ends of the edges that cross a plane are therefore corrected until the crossings go where the profile says
//! (Cimmino's simultaneous projections: the smallest correction, in the least-squares sense, that does it).

use glam::DVec3;

/// Rounds of correction. Neighbouring crossings share vertices; ten rounds leave less than a tenth of what they found.
const ROUNDS: usize = 40;

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
    let mut share = vec![0.0; displacement.len()];
    for crossing in crossings {
        for (end, weight) in crossing.weighted_ends() {
            share[end] += weight;
        }
    }
    let mut change = vec![DVec3::ZERO; displacement.len()];
    for _ in 0..ROUNDS {
        for (crossing, &target) in crossings.iter().zip(target) {
            let [(a, weight_a), (b, weight_b)] = crossing.weighted_ends();
            let missing = target - displacement[a] * weight_a - displacement[b] * weight_b;
            let missing = missing / (weight_a * weight_a + weight_b * weight_b);
            change[a] += missing * (weight_a * weight_a);
            change[b] += missing * (weight_b * weight_b);
        }
        for ((displacement, change), &share) in displacement.iter_mut().zip(&mut change).zip(&share) {
            if share > 0.0 {
                *displacement += std::mem::take(change) / share;
            }
        }
    }
}

impl Crossing {
    fn weighted_ends(&self) -> [(usize, f64); 2] {
        [(self.ends[0] as usize, 1.0 - self.at), (self.ends[1] as usize, self.at)]
    }
}
