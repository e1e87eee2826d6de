//! The last stage of a run: moves vertices of the worst tets to where fewer of the tets around them fall short.
//!
//! The sum over powers settles where good tets balance bad ones, and its mean ratio is not beta. This lowers what is asked
//! for: the sum over a vertex's tets of `max(0, 1 - beta / goal)^4`. Tets above the goal do not count, and are not pushed
//! below it for the sake of others; the power lets the worst count most. Climbing on the smallest beta of a star alone
//! reaches the goal too, but lays many good tets down to its level: on a wing turned by 180 degrees the mean beta falls
//! to 0.023, with the fourth power to 0.043. With the second power the smallest beta stops at a fifth of the goal.

use glam::DVec3;
use rayon::prelude::*;

use super::Slide;
use crate::backend::Constraint;
use crate::mesh::csr::Csr;
use crate::quality;

/// Steps tried, each half the one before, the first a quarter of the shortest edge: the tets that are not among the
/// worst do not let much longer ones pass.
const HALVINGS: usize = 8;

/// Steps that lower the sum by less than this fraction are not worth taking.
const GAIN: f64 = 1e-5;

/// The goal lies higher by this fraction, or tets would come close to it and never reach it.
const MARGIN: f64 = 0.02;

/// What a climb needs to know of the mesh.
pub(super) struct Mesh<'a> {
    pub(super) tets: &'a [[u32; 4]],
    pub(super) vertex_tets: &'a Csr,
    pub(super) constraint: &'a [Constraint],
    pub(super) slides: &'a [bool],
    pub(super) slide: Option<&'a dyn Slide>,
}

/// One sweep over these vertices, colour by colour, towards a beta of `goal` or more.
pub(super) fn sweep(mesh: &Mesh, goal: f64, colours: &[Vec<u32>], positions: &mut [DVec3]) {
    for colour in colours {
        let at = &*positions;
        let moved: Vec<DVec3> = colour.par_iter().map(|&vertex| climb(mesh, goal, at, vertex)).collect();
        for (&vertex, moved) in colour.iter().zip(moved) {
            positions[vertex as usize] = moved;
        }
    }
}

/// Where the vertex is better off.
fn climb(mesh: &Mesh, goal: f64, positions: &[DVec3], vertex: u32) -> DVec3 {
    let start = positions[vertex as usize];
    let star: Vec<Corner> =
        mesh.vertex_tets.row(vertex as usize).iter().map(|&entry| Corner::new(mesh, positions, entry)).collect();
    let goal = (1.0 + MARGIN) * goal;
    let short = |corner: &Corner, at: DVec3| f64::max(0.0, 1.0 - corner.beta(at) / goal);
    let sum = |at: DVec3| star.iter().map(|corner| short(corner, at).powi(4)).sum::<f64>();
    let before = sum(start);
    let direction: DVec3 = star.iter().map(|corner| corner.slope(start) * short(corner, start).powi(3)).sum();
    let shortest = star.iter().flat_map(|corner| corner.others).map(|other| other.distance(start));
    let slide = mesh.slide.filter(|_| mesh.slides[vertex as usize]);
    let constraint = slide.map_or(mesh.constraint[vertex as usize], |slide| slide.tangent(vertex, start));
    let longest_step = 0.25 * shortest.fold(f64::INFINITY, f64::min);
    let mut step = constraint.limit(direction).try_normalize().unwrap_or_default() * longest_step;
    for _ in 0..HALVINGS {
        let trial = super::moved(start, step);
        let trial = slide.map_or(trial, |slide| slide.back(vertex, trial));
        if sum(trial) < (1.0 - GAIN) * before {
            return trial;
        }
        step *= 0.5;
    }
    start
}

/// A tet as one of its vertices sees it: the others, so ordered that the volume is positive where they turn to the right
/// as seen from it.
struct Corner {
    others: [DVec3; 3],
}

impl Corner {
    fn new(mesh: &Mesh, positions: &[DVec3], entry: u32) -> Self {
        // The other three, in an even permutation of the tet with the vertex first.
        const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        let tet = mesh.tets[entry as usize / 4];
        Self { others: OTHERS[entry as usize % 4].map(|local| positions[tet[local] as usize]) }
    }

    fn beta(&self, at: DVec3) -> f64 {
        let [a, b, c] = self.others;
        quality::beta([at, a, b, c])
    }

    /// Gradient of beta with respect to the vertex.
    fn slope(&self, at: DVec3) -> DVec3 {
        let [a, b, c] = self.others;
        let face = [b - a, c - b, a - c].map(DVec3::length_squared).into_iter().fold(0.0, f64::max);
        let longer = |x: DVec3, y: DVec3| if y.length_squared() > x.length_squared() { y } else { x };
        let d = longer(longer(at - a, at - b), at - c);
        let (longest, of_longest) = if d.length_squared() > face {
            let length = d.length();
            (length, d / length)
        } else {
            (face.sqrt(), DVec3::ZERO)
        };
        let of_volume = (c - a).cross(b - a) / 6.0;
        let cubed = longest * longest * longest;
        of_volume / cubed - of_longest * (3.0 * quality::volume([at, a, b, c]) / (cubed * longest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Central differences, from each vertex of a tet without symmetry.
    #[test]
    fn slope_against_differences() {
        let positions = [[0.1, 0.0, 0.2], [1.0, 0.1, 0.0], [0.3, 0.8, 0.1], [0.2, 0.4, 1.3]].map(DVec3::from);
        let tets = [[0, 1, 2, 3]];
        let vertex_tets = Csr::from_pairs(4, (0..4).map(|vertex| (vertex, vertex)));
        let (constraint, slides) = (&[Constraint::Free; 4], &[false; 4]);
        let mesh = Mesh { tets: &tets, vertex_tets: &vertex_tets, constraint, slides, slide: None };
        for vertex in 0..4 {
            let corner = Corner::new(&mesh, &positions, vertex);
            let at = positions[vertex as usize];
            assert!((corner.beta(at) - quality::beta(positions)).abs() < 1e-15);
            let h = 1e-6;
            for (axis, unit) in DVec3::AXES.into_iter().enumerate() {
                let slope = (corner.beta(at + unit * h) - corner.beta(at - unit * h)) / (2.0 * h);
                assert!((corner.slope(at)[axis] - slope).abs() < 1e-8, "{vertex} {axis}");
            }
        }
    }
}
