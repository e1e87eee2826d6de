//! [`SurfaceEquilibrium`]: the derivative of the equilibrium of a network whose vertices stay on a
//! surface, and the transpose.
//!
//! Each vertex that may move lies on a facet with the unit normal `f`. Its springs pull along the
//! smooth unit normal `n` of the surface there: `sum_j k_ij (u_j - u_i) = a_i n_i`. With `P = 1 - n
//! n^T`, a change of the displacement of held vertices keeps this if
//!
//! `P_i sum_j k_ij (du_j - du_i) - a_i (dn/dx)_i du_i = 0`, with `du_i` in the facet
//!
//! The unknown of a vertex is its change within the plane of `n`, `v = P du`. So `du = L v`, with
//! `L = 1 - n f^T / (n . f)`. The matrix is that of the network within the planes of `n`, which the
//! stage relaxes, but for the angles between facets and for the normal pull. It is not symmetric.
//! So products solve it, and its transpose, by flexible GMRES with the network's relaxation as
//! preconditioner (Y. Saad, SIAM J. Sci. Comput. 14(2), 1993).
//!
//! Where a vertex lies on a kink of the surface, as each does that has not moved, its plane is that
//! of `n`; see [`crate::projection::Slope`].

use std::collections::HashMap;

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::surface_network::SurfaceNetwork;
use crate::constraint::Constraint;
use crate::mesh::TetMesh;
use crate::projection::{Slope, TargetSurface};
use crate::relaxation::{Convergence, Stopping};
use crate::stage::NoProduct;

/// Least cosine of the angle between a facet and the smooth normal. At a sharper edge a vertex does
/// not slide from facet to facet.
const LEAST_COSINE: f64 = 0.1;

/// Tolerance of the relaxations that precondition.
const PRECONDITIONER: f64 = 1e-3;

/// Most directions that are kept. Then the solution starts again from what it has.
const DIRECTIONS: usize = 24;

/// Most starts. The first gains eight digits on the meshes measured.
const STARTS: usize = 12;

/// The linear equations around one equilibrium.
pub(super) struct SurfaceEquilibrium<'a> {
    network: &'a mut SurfaceNetwork,
    /// `None` for vertices that are held `[n]`.
    rows: Vec<Option<Row>>,
}

#[derive(Clone, Copy)]
struct Row {
    /// Smooth normal.
    normal: DVec3,
    /// `f / (n . f)`.
    facet: DVec3,
    /// `a dn/dx`, in the unit of stiffness.
    turn: DMat3,
}

impl Row {
    /// `P x`.
    fn level(&self, x: DVec3) -> DVec3 {
        x - self.normal * self.normal.dot(x)
    }

    /// `L v`.
    fn lift(&self, v: DVec3) -> DVec3 {
        v - self.normal * self.facet.dot(v)
    }

    /// `P L^T x`.
    fn lift_transposed(&self, x: DVec3) -> DVec3 {
        self.level(x - self.facet * self.normal.dot(x))
    }
}

impl<'a> SurfaceEquilibrium<'a> {
    /// The equations at an equilibrium.
    ///
    /// - `displacement` `[n_vertices]`: of the whole mesh, in the mesh's unit
    ///
    /// # Errors
    /// - [`NoProduct::Carenage`]: a vertex slid to an end or to a sharp edge of the surface
    /// - [`NoProduct::Backend`]: the backend failed
    pub fn new(
        mesh: &TetMesh,
        target: &TargetSurface,
        network: &'a mut SurfaceNetwork,
        displacement: &[DVec3],
    ) -> Result<Self, NoProduct> {
        let local = network.gather(displacement);
        let (constraint, vertices) = (&network.network().constraint, &network.vertices);
        let at = |row: usize| mesh.vertices[vertices[row] as usize] + local[row];
        let slope = |row: usize| (constraint[row] != Constraint::Held).then(|| target.slope(at(row)));
        let slopes: Vec<Option<Slope>> = (0..vertices.len()).into_par_iter().map(slope).collect();
        let pulls = pulls(network, &local);
        let mut open = None;
        let mut rows = Vec::with_capacity(slopes.len());
        for (row, slope) in slopes.iter().enumerate() {
            let Some(Slope { normal, facet, normal_change, beside }) = slope else {
                rows.push(None);
                continue;
            };
            let vertex = vertices[row];
            let ends = *beside
                && local[row] != DVec3::ZERO
                && target.ends(at(row), open.get_or_insert_with(|| target.open_edges()));
            let cosine = normal.dot(*facet);
            // Not a number where normals cancel.
            if ends || cosine.is_nan() || cosine < LEAST_COSINE {
                return Err(NoProduct::Carenage { vertex });
            }
            let turn = *normal_change * normal.dot(pulls[row]);
            rows.push(Some(Row { normal: *normal, facet: *facet / cosine, turn }));
        }
        let of_vertices = vertices.iter().zip(&rows);
        let planes: HashMap<u32, Constraint> = of_vertices
            .filter_map(|(&vertex, row)| Some((vertex, Constraint::InPlane(row.as_ref()?.normal))))
            .collect();
        network.constrain(|vertex| planes[&vertex])?;
        Ok(Self { network, rows })
    }

    /// Change of the equilibrium.
    ///
    /// - `change` `[n_vertices]`: of the displacement of the whole mesh, in any unit; set for the
    ///   vertices that may move
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed.
    pub fn forward(&mut self, change: &mut [DVec3], stopping: &Stopping) -> Result<Convergence, NoProduct> {
        let mut local = self.network.gather(change);
        for (local, row) in local.iter_mut().zip(&self.rows) {
            if row.is_some() {
                *local = DVec3::ZERO;
            }
        }
        let load = self.each(|row, at| row.level(at), &pulls(self.network, &local));
        let (level, convergence) = self.solve(&load, Self::product, stopping)?;
        for ((local, row), level) in local.iter_mut().zip(&self.rows).zip(level) {
            if let Some(row) = row {
                *local = row.lift(level);
            }
        }
        self.network.scatter(&local, change);
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `gradient` `[n_vertices]`: of the whole mesh, by the displacement after the stage on entry
    ///   and before it on exit, in any unit
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed.
    pub fn reverse(&mut self, gradient: &mut [DVec3], stopping: &Stopping) -> Result<Convergence, NoProduct> {
        let mut local = self.network.gather(gradient);
        let load = self.each(|row, at| row.lift_transposed(at), &local);
        let (by_pull, convergence) = self.solve(&load, Self::transposed_product, stopping)?;
        let by_neighbours = neighbours(self.network, &by_pull);
        for ((local, row), by_neighbours) in local.iter_mut().zip(&self.rows).zip(by_neighbours) {
            *local = if row.is_some() { DVec3::ZERO } else { *local + by_neighbours };
        }
        self.network.scatter(&local, gradient);
        Ok(convergence)
    }

    /// The equations' matrix, times the changes in the planes of the normals `[n]`.
    fn product(&self, level: &[DVec3]) -> Vec<DVec3> {
        let lifted = self.each(|row, at| row.lift(at), level);
        let pulls = pulls(self.network, &lifted);
        let of_row = |((row, pull), lifted): ((&Option<Row>, &DVec3), &DVec3)| match row {
            Some(row) => row.turn * *lifted - row.level(*pull),
            None => DVec3::ZERO,
        };
        self.rows.par_iter().zip(&pulls).zip(&lifted).map(of_row).collect()
    }

    /// The transpose of [`Self::product`].
    fn transposed_product(&self, by_row: &[DVec3]) -> Vec<DVec3> {
        let pulls = pulls(self.network, by_row);
        let of_row = |((row, pull), by_row): ((&Option<Row>, &DVec3), &DVec3)| match row {
            Some(row) => row.lift_transposed(row.turn.transpose() * *by_row - *pull),
            None => DVec3::ZERO,
        };
        self.rows.par_iter().zip(&pulls).zip(by_row).map(of_row).collect()
    }

    /// Applies a map to the vectors of the vertices that may move; others are zero.
    fn each(&self, map: impl Fn(&Row, DVec3) -> DVec3, vectors: &[DVec3]) -> Vec<DVec3> {
        let of_row = |(row, &vector): (&Option<Row>, &DVec3)| row.as_ref().map_or(DVec3::ZERO, |row| map(row, vector));
        self.rows.iter().zip(vectors).map(of_row).collect()
    }

    /// Solves the equations, or their transpose, by flexible GMRES.
    ///
    /// - `load` `[n]`: in the planes of the normals
    /// - `product`: [`Self::product`] or its transpose
    fn solve(
        &mut self,
        load: &[DVec3],
        product: fn(&Self, &[DVec3]) -> Vec<DVec3>,
        stopping: &Stopping,
    ) -> Result<(Vec<DVec3>, Convergence), NoProduct> {
        let mut solution = vec![DVec3::ZERO; load.len()];
        // The unit of the load does not matter, and squares must not vanish.
        let unit = load.iter().fold(0.0, |unit: f64, load| unit.max(load.abs().max_element()));
        if unit == 0.0 {
            return Ok((solution, Convergence::nothing_to_do()));
        }
        let load: Vec<DVec3> = load.iter().map(|load| *load / unit).collect();
        // Divided by the stiffness of their vertices, residuals have the unit of displacements.
        let total: Vec<f64> = {
            let network = self.network.network();
            (0..load.len()).map(|row| network.stiffness[network.graph.range(row)].iter().sum()).collect()
        };
        let weighted = |load: &[DVec3]| -> Vec<DVec3> {
            let of_row = |(load, total): (&DVec3, &f64)| if *total > 0.0 { *load / *total } else { DVec3::ZERO };
            load.iter().zip(&total).map(of_row).collect()
        };
        let first = norm(&weighted(&load));
        let inner = Stopping { tolerance: PRECONDITIONER, ..*stopping };
        let mut end = Convergence { error: f64::INFINITY, relative_residual: 1.0, ..Convergence::default() };
        let mut goal = stopping.tolerance;
        for _ in 0..STARTS {
            let of_solution = product(self, &solution);
            let residual: Vec<DVec3> = load.iter().zip(of_solution).map(|(load, product)| *load - product).collect();
            let residual = weighted(&residual);
            let size = norm(&residual);
            end.relative_residual = size / first;
            if size == 0.0 {
                (end.error, end.converged) = (0.0, true);
                break;
            }
            let mut krylov = Krylov::new(residual, size);
            loop {
                let force: Vec<DVec3> = krylov.newest().iter().zip(&total).map(|(of, total)| *of * *total).collect();
                let (direction, convergence) = self.network.of_force(&force, &inner)?;
                end.sweeps += convergence.sweeps;
                if krylov.directions.is_empty() {
                    // The preconditioner takes the residual to the error, roughly.
                    end.error = (size / first).max(size * largest(&direction) / largest(&solution));
                }
                let image = weighted(&product(self, &direction));
                let left = krylov.add(direction, image);
                let is_enough = left <= goal * first || end.error <= stopping.tolerance;
                if is_enough || krylov.directions.len() == DIRECTIONS || !left.is_finite() {
                    break;
                }
            }
            let correction = krylov.correction();
            solution.iter_mut().zip(&correction).for_each(|(solution, correction)| *solution += *correction);
            end.converged = end.error <= stopping.tolerance;
            if end.converged || end.error.is_nan() || end.sweeps >= stopping.max_sweeps {
                break;
            }
            // The residual falls by more than the tolerance if the error needs it.
            if end.error.is_finite() {
                goal = goal.min(0.5 * stopping.tolerance / end.error * end.relative_residual);
            }
        }
        solution.iter_mut().for_each(|solution| *solution *= unit);
        Ok((solution, end))
    }
}

/// Directions of a solution by GMRES, with the least squares over them.
struct Krylov {
    /// Orthonormal images of the directions, from the residual on.
    basis: Vec<Vec<DVec3>>,
    directions: Vec<Vec<DVec3>>,
    /// The columns of the triangular matrix.
    columns: Vec<Vec<f64>>,
    /// Cosine and sine of each rotation that made it triangular.
    turns: Vec<[f64; 2]>,
    right: Vec<f64>,
}

impl Krylov {
    /// - `size`: norm of the residual
    fn new(mut residual: Vec<DVec3>, size: f64) -> Self {
        residual.iter_mut().for_each(|residual| *residual /= size);
        let (directions, columns, turns) = Default::default();
        Self { basis: vec![residual], directions, columns, turns, right: vec![size] }
    }

    fn newest(&self) -> &[DVec3] {
        &self.basis[self.basis.len() - 1]
    }

    /// Adds a direction and its image. Returns the norm of the residual that is left.
    fn add(&mut self, direction: Vec<DVec3>, mut image: Vec<DVec3>) -> f64 {
        let mut column = vec![0.0; self.basis.len()];
        // Once more, for what rounding leaves.
        for _ in 0..2 {
            for (entry, own) in column.iter_mut().zip(&self.basis) {
                let along = dot(own, &image);
                *entry += along;
                image.iter_mut().zip(own).for_each(|(image, own)| *image -= *own * along);
            }
        }
        let rest = norm(&image);
        for (k, [cosine, sine]) in self.turns.iter().enumerate() {
            let [upper, lower] = [column[k], column[k + 1]];
            column[k] = cosine * upper + sine * lower;
            column[k + 1] = cosine * lower - sine * upper;
        }
        let last = column.len() - 1;
        let length = column[last].hypot(rest);
        let [cosine, sine] = if length > 0.0 { [column[last] / length, rest / length] } else { [1.0, 0.0] };
        column[last] = length;
        self.turns.push([cosine, sine]);
        self.columns.push(column);
        self.directions.push(direction);
        let right = self.right[last];
        self.right[last] = cosine * right;
        self.right.push(-sine * right);
        if rest > 0.0 {
            image.iter_mut().for_each(|image| *image /= rest);
        }
        self.basis.push(image);
        (sine * right).abs()
    }

    /// The sum of the directions that leaves the least residual.
    fn correction(&self) -> Vec<DVec3> {
        let n = self.directions.len();
        let mut shares = self.right[..n].to_vec();
        for k in (0..n).rev() {
            let known: f64 = (k + 1..n).map(|j| self.columns[j][k] * shares[j]).sum();
            let own = self.columns[k][k];
            shares[k] = if own == 0.0 { 0.0 } else { (shares[k] - known) / own };
        }
        let mut sum = vec![DVec3::ZERO; self.basis[0].len()];
        for (share, direction) in shares.iter().zip(&self.directions) {
            sum.iter_mut().zip(direction).for_each(|(sum, direction)| *sum += *direction * *share);
        }
        sum
    }
}

/// The pull of the springs on each vertex that may move `[n]`: `sum_j k_ij (u_j - u_i)`. Zero on
/// others.
fn pulls(network: &SurfaceNetwork, displacement: &[DVec3]) -> Vec<DVec3> {
    let network = network.network();
    let pull = |row: usize| {
        if network.constraint[row] == Constraint::Held {
            return DVec3::ZERO;
        }
        let springs = network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]);
        springs.fold(DVec3::ZERO, |sum, (&neighbour, &stiffness)| {
            sum + stiffness * (displacement[neighbour as usize] - displacement[row])
        })
    };
    (0..network.len()).into_par_iter().map(pull).collect()
}

/// The sum over the neighbours of each held vertex `[n]`: `sum_j k_ij x_j`. Zero on others.
fn neighbours(network: &SurfaceNetwork, of_rows: &[DVec3]) -> Vec<DVec3> {
    let network = network.network();
    let sum = |row: usize| {
        if network.constraint[row] != Constraint::Held {
            return DVec3::ZERO;
        }
        let springs = network.graph.row(row).iter().zip(&network.stiffness[network.graph.range(row)]);
        springs.fold(DVec3::ZERO, |sum, (&neighbour, &stiffness)| sum + stiffness * of_rows[neighbour as usize])
    };
    (0..network.len()).into_par_iter().map(sum).collect()
}

fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
}

fn norm(a: &[DVec3]) -> f64 {
    dot(a, a).sqrt()
}

fn largest(of: &[DVec3]) -> f64 {
    of.iter().fold(0.0, |largest, of| of.length().max(largest))
}
