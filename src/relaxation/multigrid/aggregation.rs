//! Aggregation: groups the vertices of a network. Each group becomes one vertex of the coarser
//! network.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::super::Network;
use crate::constraint::Constraint;
use crate::mesh::csr::Csr;

/// Two constraints differ if the squared Frobenius norm of the difference of their projections
/// exceeds this number: about 25 degrees between two normals.
const ALIKE: f64 = 0.4;

/// Vertices join along strong springs: springs of at least this share of the stiffest springs at
/// their two ends (geometric mean).
///
/// On a wing of 102 341 tets, refined once and twice, a residual of 1e-6 takes 8, 8 and 9 cycles;
/// if all springs count, 8, 10 and 11. In layers of thin tets the springs across the layer are some
/// thousand times stiffer than the springs along the wall. There vertices join across the layer.
/// Sweeps hardly damp displacements that differ along the wall, so these are left to the coarser
/// network.
const STRONG: f64 = 0.3;

/// A vertex is anchored if more than this share of its stiffness is in its anchor. Anchored
/// vertices join no aggregate: sweeps damp their error at once. On coarse levels thin layers end as
/// such vertices, tied to the wall beneath, and their number would never fall.
///
/// Weak springs count. Without them a vertex that has weak springs alone would be anchored by an
/// anchor of any size, and no coarser network would correct it. Such vertices stand where cells are
/// short across a symmetry plane: the strong springs of the plane's vertices lead off the plane.
/// The relaxation of an O-grid of 30 240 vertices then took 350 cycles in place of 25.
const ANCHORED: f64 = 0.9;

/// Stands for no aggregate.
pub(super) const NONE: u32 = u32::MAX;

/// The aggregates of a network.
#[derive(Clone, Debug)]
pub(super) struct Aggregates {
    /// Aggregate of each vertex `[n_vertices]`, or [`NONE`] for a vertex that only sweeps relax.
    pub(super) of_vertex: Vec<u32>,
    /// Number of aggregates.
    pub(super) count: usize,
}

/// The springs along which vertices join: strong springs between vertices with similar constraints.
///
/// A coarse displacement is also smoothed along these springs. So it keeps the constraints of all
/// vertices in an aggregate, and the coarse network is as stiff as the fine one.
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
            // Squares give the same bits from either end.
            let is_strong = k > 0.0 && k * k >= STRONG * STRONG * (stiffest[row] * stiffest[at]);
            if is_strong && alike(&network.constraint[row], &network.constraint[at]) {
                entries.push(other);
                stiffness.push(k);
            }
        }
        row_start.push(entries.len() as u32);
    }
    let graph = Arc::new(Csr { row_start, entries });
    Network::from_rows(
        graph,
        stiffness,
        network.anchor.clone(),
        network.constraint.clone(),
        network.inverse_length.clone(),
    )
}

impl Aggregates {
    /// Joins each vertex with all its neighbours along strong springs. The order of the vertices
    /// decides, not the threads.
    ///
    /// - `strong`: the strong springs of the network; see [`strong`]
    ///
    /// Source: Vanek, Mandel and Brezina (Computing 56, 1996), algorithm 5.1.
    pub(super) fn new(network: &Network, strong: &Network) -> Self {
        let n = strong.len();
        let mut of_vertex = vec![NONE; n];
        let mut count = 0;
        let is_anchored = |row: usize| network.anchor[row] * network.inverse_total[row] > ANCHORED;
        let joined = |row: usize| {
            let springs = strong.graph.row(row).iter().zip(&strong.stiffness[strong.graph.range(row)]);
            springs.map(|(&other, &k)| (other as usize, k)).filter(|&(other, _)| !is_anchored(other))
        };
        // First, whole neighbourhoods without a vertex in another aggregate.
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
        // Second, a remaining vertex joins the aggregate to which its stiffest spring leads.
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
        // Third, the vertices that are left join among themselves.
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

    /// Constraint of each aggregate: the directions that most of its vertices may follow.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Aggregates of a vertex in a plane and a free vertex, with a spring of stiffness 2 between
    /// them.
    fn aggregates(anchor_in_plane: f64) -> Vec<u32> {
        let graph = Arc::new(Csr { row_start: vec![0, 1, 2], entries: vec![1, 0] });
        let constraint = vec![Constraint::InPlane(DVec3::Y), Constraint::Free];
        let network = Network::from_rows(graph, vec![2.0; 2], vec![anchor_in_plane, 100.0], constraint, vec![1.0; 2]);
        Aggregates::new(&network, &strong(&network)).of_vertex
    }

    /// The spring is weak: it joins no vertices, but counts against an anchor.
    #[test]
    fn weak_springs_count_against_an_anchor() {
        for anchor in [0.0, 1e-15, -1e-15, 1e-4, 2.0, 17.9] {
            assert_eq!(aggregates(anchor), [0, NONE], "{anchor:e}");
        }
        assert_eq!(aggregates(18.1), [NONE, NONE]);
    }
}
