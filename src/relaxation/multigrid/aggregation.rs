//! Which vertices of a network become one vertex of the coarser network.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::super::Network;
use crate::constraint::Constraint;
use crate::mesh::csr::Csr;

/// Constraints differ when the squares of the difference of their projections add up to more: about 25 degrees between
/// two normals.
const ALIKE: f64 = 0.4;

/// Vertices join along springs of at least this share of the stiffest ones at their ends (geometric mean of the two).
///
/// On a wing of 102 341 tets, refined once and twice, a residual of 1e-6 then takes 8, 8 and 9 cycles, and 8, 10 and 11 if all
/// springs join. Where tets are thin those across are some thousand times stiffer than those along the wall: vertices join
/// across, and displacements that differ along the wall, which sweeps hardly damp, are left to the coarser network.
const STRONG: f64 = 0.3;

/// A vertex with more than this share of its stiffness in its anchor, weak springs apart, is left to the sweeps, which damp its
/// error at once. Thin layers end as such vertices, tied to the wall beneath, and would never become fewer.
const ANCHORED: f64 = 0.9;

/// Stands for no aggregate.
pub(super) const NONE: u32 = u32::MAX;

/// The aggregate of each vertex.
#[derive(Clone, Debug)]
pub(super) struct Aggregates {
    /// Aggregate of each vertex `[n_vertices]`, [`NONE`] for those that sweeps alone relax.
    pub(super) of_vertex: Vec<u32>,
    /// How many there are.
    pub(super) count: usize,
}

/// The springs along which vertices join: strong ones between vertices that may do the same.
///
/// Along these a coarse displacement is smoothed too. So it keeps to what all its vertices may do, and the coarse network is
/// as stiff as the fine one.
pub(super) fn strong(network: &Network) -> Network {
    let springs = |row: usize| network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]);
    let of_row = |row: usize| springs(row).fold(0.0, |stiffest: f64, (_, &k)| stiffest.max(k));
    let stiffest: Vec<f64> = (0..network.len()).map(of_row).collect();
    let mut row_start = Vec::with_capacity(network.len() + 1);
    let (mut entries, mut stiffness) = (Vec::new(), Vec::new());
    row_start.push(0);
    for row in 0..network.len() {
        for (&other, &k) in springs(row) {
            let at = other as usize;
            // Squares: the same from either end, to the bit.
            let is_strong = k > 0.0 && k * k >= STRONG * STRONG * (stiffest[row] * stiffest[at]);
            if is_strong && alike(&network.constraint[row], &network.constraint[at]) {
                entries.push(other);
                stiffness.push(k);
            }
        }
        row_start.push(entries.len() as u32);
    }
    let anchor = network.anchor.iter().map(|anchor| anchor.max(0.0)).collect();
    let graph = Arc::new(Csr { row_start, entries });
    Network::from_rows(graph, stiffness, anchor, network.constraint.clone(), network.inverse_length.clone())
}

impl Aggregates {
    /// Vertices with all their neighbours along strong springs, in the order of the vertices, so that no thread decides.
    ///
    /// - `strong`: see [`strong`]
    ///
    /// Source: Vanek, Mandel and Brezina (Computing 56, 1996), algorithm 5.1.
    pub(super) fn new(strong: &Network) -> Self {
        let n = strong.len();
        let mut of_vertex = vec![NONE; n];
        let mut count = 0;
        let is_anchored = |row: usize| strong.anchor[row] * strong.inverse_total[row] > ANCHORED;
        let joined = |row: usize| {
            let springs = strong.graph.row(row).iter().zip(&strong.stiffness[strong.graph.range(row)]);
            springs.map(|(&other, &k)| (other as usize, k)).filter(|&(other, _)| !is_anchored(other))
        };
        // Whole neighbourhoods that nobody has touched yet.
        for row in 0..n {
            let mut alone = true;
            if of_vertex[row] == NONE && !is_anchored(row) && joined(row).all(|(other, _)| of_vertex[other] == NONE) {
                for (other, _) in joined(row) {
                    of_vertex[other] = count;
                    alone = false;
                }
            }
            if !alone {
                of_vertex[row] = count;
                count += 1;
            }
        }
        // Those in between join the neighbourhood they are tied to most.
        let whole = of_vertex.clone();
        for row in 0..n {
            if whole[row] == NONE && !is_anchored(row) {
                let candidates = joined(row).filter(|&(other, _)| whole[other] != NONE);
                let nearest = candidates.reduce(|best, other| if other.1 > best.1 { other } else { best });
                if let Some((other, _)) = nearest {
                    of_vertex[row] = whole[other];
                }
            }
        }
        // The rest among themselves.
        for row in 0..n {
            if of_vertex[row] == NONE && !is_anchored(row) {
                of_vertex[row] = count;
                for (other, _) in joined(row) {
                    if of_vertex[other] == NONE {
                        of_vertex[other] = count;
                    }
                }
                count += 1;
            }
        }
        Self { of_vertex, count: count as usize }
    }

    /// What each aggregate may do: the directions that most of its vertices may follow.
    pub(super) fn constraints(&self, of_vertices: &[Constraint]) -> Vec<Constraint> {
        if of_vertices.iter().all(|constraint| *constraint == Constraint::Free) {
            return vec![Constraint::Free; self.count];
        }
        let mut mean = vec![(DMat3::ZERO, 0.0); self.count];
        for (&aggregate, constraint) in self.of_vertex.iter().zip(of_vertices).filter(|(of, _)| **of != NONE) {
            let (sum, count) = &mut mean[aggregate as usize];
            *sum += projection(constraint);
            *count += 1.0;
        }
        mean.into_iter().map(|(sum, count)| common(sum * (1.0 / count))).collect()
    }
}

fn alike(a: &Constraint, b: &Constraint) -> bool {
    if a == b {
        return true;
    }
    let difference = projection(a) - projection(b);
    difference.to_cols_array().iter().map(|x| x * x).sum::<f64>() < ALIKE
}

fn projection(constraint: &Constraint) -> DMat3 {
    DMat3::from_cols(constraint.limit(DVec3::X), constraint.limit(DVec3::Y), constraint.limit(DVec3::Z))
}

/// The constraint whose projection is nearest to a mean of projections.
fn common(mean: DMat3) -> Constraint {
    let matrix = nalgebra::Matrix3::from_column_slice(&mean.to_cols_array());
    let eigen = matrix.symmetric_eigen();
    let direction = |at: usize| {
        let v = eigen.eigenvectors.column(at);
        DVec3::new(v[0], v[1], v[2])
    };
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    match eigen.eigenvalues.iter().filter(|&&share| share > 0.5).count() {
        0 => Constraint::Held,
        1 => Constraint::OnLine(direction(order[2])),
        2 => Constraint::InPlane(direction(order[0])),
        _ => Constraint::Free,
    }
}
