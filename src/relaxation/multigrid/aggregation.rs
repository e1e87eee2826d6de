//! Aggregation: groups the vertices of a network. Each group becomes one vertex of the coarser
//! network.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::super::Network;
use super::rows::by_rows;
use crate::backend::Transfer;
use crate::constraint::Constraint;

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

/// Rows of a block, whose inside is aggregated before rows beside other blocks. The number is
/// fixed, so the aggregates do not depend on the number of threads.
const BLOCK: usize = 8192;

/// The springs along which vertices join: strong springs between vertices with similar constraints.
///
/// A coarse displacement is also smoothed along these springs. So it keeps the constraints of all
/// vertices in an aggregate, and the coarse network is as stiff as the fine one.
pub(super) fn strong(network: &Network) -> Network {
    let springs = |row: usize| network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]);
    let of_row = |row: usize| springs(row).fold(0.0, |stiffest: f64, (_, &k)| stiffest.max(k));
    let stiffest: Vec<f64> = (0..network.len()).into_par_iter().map(of_row).collect();
    let Transfer { sources, weights } = by_rows(
        network.len(),
        || (),
        |row, (), entries, stiffness| {
            for (&other, &k) in springs(row) {
                let at = other as usize;
                // Squares give the same bits from either end.
                let is_strong = k > 0.0 && k * k >= STRONG * STRONG * (stiffest[row] * stiffest[at]);
                if is_strong && alike(&network.constraint[row], &network.constraint[at]) {
                    entries.push(other);
                    stiffness.push(k);
                }
            }
        },
    );
    Network::from_rows(
        Arc::new(sources),
        weights,
        network.anchor.clone(),
        network.constraint.clone(),
        network.inverse_length.clone(),
    )
}

impl Aggregates {
    /// Joins each vertex with all its neighbours along strong springs. The order of the vertices
    /// decides, not the threads: first inside blocks of rows, then between them.
    ///
    /// - `strong`: the strong springs of the network; see [`strong`]
    ///
    /// Source: Vanek, Mandel and Brezina (Computing 56, 1996), algorithm 5.1.
    pub(super) fn new(network: &Network, strong: &Network) -> Self {
        let n = strong.len();
        let is_anchored: Vec<bool> = network
            .anchor
            .par_iter()
            .zip(&network.inverse_total)
            .map(|(anchor, of_total)| anchor * of_total > ANCHORED)
            .collect();
        let joined = |row: usize| {
            let springs = strong.graph.row(row).iter().zip(&strong.stiffness[strong.graph.range(row)]);
            springs.map(|(&other, &k)| (other as usize, k)).filter(|&(other, _)| !is_anchored[other])
        };
        // The vertex from which the aggregate of each vertex was made.
        let mut root = vec![NONE; n];
        // First, whole neighbourhoods without a vertex in another aggregate. `root` begins with the
        // vertex `first`.
        let join_around = |row: usize, first: usize, root: &mut [u32]| {
            let is_free = |other: usize| other.checked_sub(first).and_then(|at| root.get(at)) == Some(&NONE);
            let is_alone = joined(row).next().is_none();
            if !is_alone && !is_anchored[row] && is_free(row) && joined(row).all(|(other, _)| is_free(other)) {
                for other in joined(row).map(|(other, _)| other).chain([row]) {
                    root[other - first] = row as u32;
                }
            }
        };
        root.par_chunks_mut(BLOCK).enumerate().for_each(|(block, root)| {
            let first = block * BLOCK;
            (first..first + root.len()).for_each(|row| join_around(row, first, root));
        });
        (0..n).for_each(|row| join_around(row, 0, &mut root));
        // Second, a remaining vertex joins the aggregate to which its stiffest spring leads.
        let whole = root.clone();
        root.par_iter_mut().enumerate().filter(|(row, root)| **root == NONE && !is_anchored[*row]).for_each(
            |(row, root)| {
                let candidates = joined(row).filter(|&(other, _)| whole[other] != NONE);
                let nearest = candidates.reduce(|best, other| if other.1 > best.1 { other } else { best });
                *root = nearest.map_or(NONE, |(other, _)| whole[other]);
            },
        );
        // Third, the vertices that are left join among themselves.
        for row in 0..n {
            if root[row] == NONE && !is_anchored[row] {
                root[row] = row as u32;
                for (other, _) in joined(row) {
                    if root[other] == NONE {
                        root[other] = row as u32;
                    }
                }
            }
        }
        // Aggregates stand in the order of their vertices.
        let mut number = vec![NONE; n];
        let mut count = 0;
        for row in (0..n).filter(|&row| root[row] == row as u32) {
            number[row] = count;
            count += 1;
        }
        let of_vertex = root.par_iter().map(|&root| number.get(root as usize).copied().unwrap_or(NONE)).collect();
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
    use crate::mesh::csr::Csr;

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

    /// A lattice of more rows than a block has. Every vertex joins an aggregate, which is a
    /// neighbourhood of one of its vertices and what is beside it.
    #[test]
    fn aggregates_are_small_and_do_not_depend_on_threads() {
        const SIDE: u32 = 24;
        let at = |vertex: u32| [vertex % SIDE, vertex / SIDE % SIDE, vertex / (SIDE * SIDE)];
        let apart = |a: u32, b: u32| (0..3).map(|axis| at(a)[axis].abs_diff(at(b)[axis])).sum::<u32>();
        let n = SIDE * SIDE * SIDE;
        let pairs = (0..n).flat_map(|vertex| {
            [1, SIDE, SIDE * SIDE]
                .into_iter()
                .flat_map(move |step| [vertex.checked_sub(step), Some(vertex + step)])
                .flatten()
                .map(move |other| (vertex, other))
        });
        let graph = Csr::from_pairs(n as usize, pairs.filter(|&(a, b)| b < n && apart(a, b) == 1));
        let springs = vec![1.0; graph.entries.len()];
        let [zero, one] = [0.0, 1.0].map(|value| vec![value; n as usize]);
        let network = Network::from_rows(Arc::new(graph), springs, zero, vec![Constraint::Free; n as usize], one);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Aggregates::new(&network, &strong(&network)))
        };
        let aggregates = on(1);
        let mut vertices = vec![Vec::new(); aggregates.count];
        (0..n).for_each(|vertex| vertices[aggregates.of_vertex[vertex as usize] as usize].push(vertex));
        for of_aggregate in &vertices {
            let reach = |&root: &u32| of_aggregate.iter().map(|&other| apart(root, other)).max();
            assert!(of_aggregate.iter().filter_map(reach).min().is_some_and(|reach| reach <= 2), "{of_aggregate:?}");
        }
        // A neighbourhood has 7 vertices.
        assert!((n as usize / 10..n as usize / 5).contains(&aggregates.count), "{}", aggregates.count);
        for threads in [2, 3] {
            assert_eq!(on(threads).of_vertex, aggregates.of_vertex, "{threads} threads");
        }
    }
}
