//! Which vertices of a network become one vertex of the coarser network.

use glam::{DMat3, DVec3};

use super::super::Network;
use crate::backend::Constraint;

/// Constraints differ when the squares of the difference of their projections add up to more: about 25 degrees between
/// two normals.
const ALIKE: f64 = 0.4;

/// The aggregate of each vertex.
#[derive(Clone, Debug)]
pub(super) struct Aggregates {
    /// Aggregate of each vertex `[n_vertices]`.
    pub(super) of_vertex: Vec<u32>,
    /// How many there are.
    pub(super) count: usize,
}

impl Aggregates {
    /// Vertices with all their neighbours, in the order of the vertices, so that no thread decides.
    ///
    /// Vertices join only those that may do the same: an aggregate inherits what its vertices may do. However weak a spring
    /// is, it joins: leaving out weak ones as the source does saves cycles on a mesh with ten layers of thin tets at the
    /// wall (10 to 15 instead of 15 to 17), but coarsens it so slowly there that each takes three times as long.
    ///
    /// Source: Vanek, Mandel and Brezina (Computing 56, 1996), algorithm 5.1.
    pub(super) fn new(network: &Network) -> Self {
        const NONE: u32 = u32::MAX;
        let n = network.len();
        let mut of_vertex = vec![NONE; n];
        let mut count = 0;
        let joined = |row: usize| {
            let springs = network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]);
            springs.filter_map(move |(&other, &stiffness)| {
                let other = other as usize;
                let joins = stiffness > 0.0 && alike(&network.constraint[row], &network.constraint[other]);
                joins.then_some((other, stiffness))
            })
        };
        // Whole neighbourhoods that nobody has touched yet.
        for row in 0..n {
            if of_vertex[row] == NONE && joined(row).all(|(other, _)| of_vertex[other] == NONE) {
                let mut alone = true;
                for (other, _) in joined(row) {
                    of_vertex[other] = count;
                    alone = false;
                }
                if !alone {
                    of_vertex[row] = count;
                    count += 1;
                }
            }
        }
        // Those in between join the neighbourhood they are tied to most.
        let whole = of_vertex.clone();
        for row in 0..n {
            if whole[row] == NONE {
                let candidates = joined(row).filter(|&(other, _)| whole[other] != NONE);
                let nearest = candidates.reduce(|best, other| if other.1 > best.1 { other } else { best });
                if let Some((other, _)) = nearest {
                    of_vertex[row] = whole[other];
                }
            }
        }
        // The rest among themselves.
        for row in 0..n {
            if of_vertex[row] == NONE {
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
        for (&aggregate, constraint) in self.of_vertex.iter().zip(of_vertices) {
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
