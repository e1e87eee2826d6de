//! Networks and edges in a device's number type, scaled so that f32 neither overflows nor
//! underflows.
//!
//! Both backends scale alike. Apart from the totals of rows, every scale is a power of two, so
//! scaling does not round.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::vectors::Vectors;
use super::{EdgeStiffness, Measure, NetworkData};
use crate::constraint::Constraint;
use crate::kernels::Real;
use crate::kernels::constraint::kind;
use crate::kernels::row::Rows;
use crate::mesh::csr::Csr;

/// Least number of rows in a task.
const ROWS: usize = 4096;

/// A network in a device's number type.
///
/// Each row's stiffness is divided by the row's total, which includes the anchor. Corrections are
/// divided by the largest load of the pass, because they are linear in the load.
pub(super) struct Packed<T> {
    graph: Arc<Csr>,
    stiffness: Vec<T>,
    anchor: Vec<T>,
    /// Whether a row has no stiffness. Such a vertex does not move.
    loose: Vec<bool>,
    constraint: Vec<[T; 4]>,
    load: Vec<[T; 4]>,
    inverse_length: Vec<T>,
    /// Unit of `inverse_length`, in the caller's unit.
    inverse_length_unit: f64,
    /// Unit of `load` and of the correction, in the caller's unit.
    load_unit: f64,
}

impl<T: Real> Packed<T> {
    /// Scales and converts a network.
    ///
    /// # Panics
    /// The arrays do not belong to one network.
    pub(super) fn new(network: &NetworkData) -> Self {
        let n_vertices = network.graph.n_rows();
        let columns = &network.graph.entries;
        assert_eq!(network.stiffness.len(), columns.len(), "one stiffness per entry");
        assert_eq!(network.anchor.len(), n_vertices, "one anchor per vertex");
        assert_eq!(network.inverse_length.len(), n_vertices, "one length per vertex");
        // A GPU returns zero outside an array, without an error.
        assert!(columns.iter().all(|&column| (column as usize) < n_vertices), "every neighbour is a vertex");
        let total = |row: usize| network.stiffness[network.graph.range(row)].iter().sum::<f64>() + network.anchor[row];
        let totals: Vec<f64> = (0..n_vertices).into_par_iter().with_min_len(ROWS).map(total).collect();
        // Equality, not `total > 0`: a NaN must reach the result, where the measure finds it.
        let loose: Vec<bool> = totals.iter().map(|&total| total == 0.0).collect();
        let scale = |row: usize| if loose[row] { 0.0 } else { totals[row].recip() };
        let mut stiffness = Vec::with_capacity(columns.len());
        for row in 0..n_vertices {
            let scale = scale(row);
            stiffness.extend(network.stiffness[network.graph.range(row)].iter().map(|&k| T::from_f64(k * scale)));
        }
        let anchors = network.anchor.iter().enumerate();
        let anchor: Vec<T> = anchors.map(|(row, &of_row)| T::from_f64(of_row * scale(row))).collect();
        let inverse_length_unit = power_of_two(network.inverse_length.iter().copied().fold(0.0, f64::max));
        let mut packed = Self {
            graph: Arc::clone(network.graph),
            stiffness,
            load: with_anchors(&anchor),
            anchor,
            loose,
            constraint: Vec::new(),
            inverse_length: network.inverse_length.iter().map(|&l| T::from_f64(l / inverse_length_unit)).collect(),
            inverse_length_unit,
            load_unit: 1.0,
        };
        packed.constrain(network.constraint);
        packed
    }

    pub(super) fn n_vertices(&self) -> usize {
        self.anchor.len()
    }

    /// Replaces the constraints `[n_vertices]`.
    pub(super) fn constrain(&mut self, constraint: &[Constraint]) {
        assert_eq!(constraint.len(), self.n_vertices(), "one constraint per vertex");
        self.constraint.clear();
        let held = |loose: bool, of_vertex| if loose { Constraint::Held } else { of_vertex };
        let of_vertices = constraint.iter().zip(&self.loose).map(|(&of_vertex, &loose)| held(loose, of_vertex));
        self.constraint.extend(of_vertices.map(|constraint| pack_constraint(&constraint)));
    }

    /// Sets the load of a pass `[n_vertices]`.
    pub(super) fn start(&mut self, load: &[DVec3]) {
        if self.load.is_empty() {
            self.load = with_anchors(&self.anchor);
        }
        self.load_unit = scale_into(load, 0, &mut self.load);
    }

    /// Sets the unit of a load that is made on the device.
    ///
    /// - `unit`: in the caller's unit, a power of two
    #[cfg(feature = "gpu")]
    pub(super) fn set_load_unit(&mut self, unit: f64) {
        self.load_unit = unit;
    }

    pub(super) fn rows(&self) -> Rows<'_, T> {
        self.rows_of(&self.load)
    }

    /// The rows with the loads of one or several designs `[n_vertices]`; see [`Rows`].
    pub(super) fn rows_of<'a, const N: usize>(&'a self, load: &'a [[T; N]]) -> Rows<'a, T, N> {
        Rows {
            row_start: if self.graph.row_start.is_empty() { &[0] } else { &self.graph.row_start },
            columns: &self.graph.entries,
            stiffness: &self.stiffness,
            constraint: &self.constraint,
            load,
            anchor: &self.anchor,
        }
    }

    /// Loads of zero for one or several designs `[n_vertices]`, with the anchors where [`Rows`] has
    /// them.
    pub(super) fn no_load<const N: usize>(&self) -> Vectors<T, N> {
        let mut load = Vectors::zero(self.n_vertices());
        if N == 4 {
            load.iter_mut().zip(&self.anchor).for_each(|(load, &anchor): (&mut [T; N], _)| load[3] = anchor);
        }
        load
    }

    /// Drops the load, for owners that keep the loads of their designs.
    pub(super) fn forget_load(&mut self) {
        self.load = Vec::new();
    }

    /// Drops the lengths, for owners that measure no change here.
    pub(super) fn forget_lengths(&mut self) {
        self.inverse_length = Vec::new();
    }

    /// Drops what a device has received: stiffness, constraints, load and lengths. Load and
    /// constraints are made again where they are replaced.
    #[cfg(feature = "gpu")]
    pub(super) fn forget_received(&mut self) {
        self.stiffness = Vec::new();
        self.constraint = Vec::new();
        self.forget_load();
        self.forget_lengths();
    }

    pub(super) fn constraint(&self) -> &[[T; 4]] {
        &self.constraint
    }

    pub(super) fn inverse_length(&self) -> &[T] {
        &self.inverse_length
    }

    /// The measure, from the partial results of all blocks.
    pub(super) fn measure(&self, partials: &[[T; 2]]) -> Measure {
        let mut sum = 0.0;
        let mut largest = 0.0f64;
        for [squared_residual, squared_change] in partials {
            sum += squared_residual.to_f64();
            largest = largest.max_magnitude(squared_change.to_f64());
        }
        Measure { change: self.change(largest), residual: f64::sqrt(sum) * self.load_unit }
    }

    /// The largest change in shortest edges, from its square in the device's units.
    pub(super) fn change(&self, squared: f64) -> f64 {
        self.change_of(squared, self.load_unit)
    }

    /// [`change_of`] a design.
    pub(super) fn change_of(&self, squared: f64, load_unit: f64) -> f64 {
        change_of(squared, load_unit, self.inverse_length_unit)
    }

    /// The correction in the caller's unit.
    ///
    /// - `e` `[n_vertices]`, `N >= 3`: further components are not used
    pub(super) fn correction<const N: usize>(&self, e: &[[T; N]]) -> Vec<DVec3> {
        correction_of(e, 0, self.load_unit)
    }
}

/// Writes the load of one of the designs of a pass, divided by its unit, which it returns.
///
/// - `load` `[n_vertices]`: in the caller's unit
/// - `packed` `[n_vertices]`: further components do not change
pub(super) fn scale_into<T: Real, const N: usize>(load: &[DVec3], design: usize, packed: &mut [[T; N]]) -> f64 {
    assert_eq!(load.len(), packed.len(), "one load per vertex");
    let greatest = |greatest: f64, v: &DVec3| greatest.max(v.abs().max_element());
    let unit = power_of_two(load.par_iter().with_min_len(ROWS).fold(|| 0.0, greatest).reduce(|| 0.0, f64::max));
    let scale = unit.recip();
    packed.par_iter_mut().zip(load).with_min_len(ROWS).for_each(|(packed, v)| {
        let scaled = (*v * scale).to_array().map(T::from_f64);
        packed[3 * design..3 * design + 3].copy_from_slice(&scaled);
    });
    unit
}

/// The largest change of a design in shortest edges, from its square in the device's units.
///
/// - `load_unit`: of [`scale_into`]
/// - `inverse_length_unit`: in the caller's unit
pub(super) fn change_of(squared: f64, load_unit: f64, inverse_length_unit: f64) -> f64 {
    f64::sqrt(squared) * load_unit * inverse_length_unit
}

/// The correction of one of the designs of a pass, in the caller's unit.
///
/// - `load_unit`: of [`scale_into`]
pub(super) fn correction_of<T: Real, const N: usize>(e: &[[T; N]], design: usize, load_unit: f64) -> Vec<DVec3> {
    let axes = [0, 1, 2].map(|axis| 3 * design + axis);
    let in_unit = |e: &[T; N]| DVec3::from_array(axes.map(|axis| e[axis].to_f64())) * load_unit;
    e.par_iter().with_min_len(ROWS).map(in_unit).collect()
}

/// Edge vectors in a device's number type, in a unit near the mean edge length.
pub(super) struct PackedEdges<T> {
    /// Edge vectors `[n_edges]`.
    pub(super) edge_vector: Vec<[T; 4]>,
}

impl<T: Real> PackedEdges<T> {
    /// Scales and converts edge vectors.
    ///
    /// # Panics
    /// The arrays do not belong to one mesh.
    pub(super) fn new(input: &EdgeStiffness) -> Self {
        let n_edges = input.edge_vector.len();
        let n_tets = input.tet_edges.len();
        assert_eq!(input.edge_tets.n_rows(), n_edges, "one row of tets per edge");
        // A GPU returns zero outside an array, without an error.
        assert!(input.edge_tets.entries.iter().all(|&entry| (entry as usize) < 6 * n_tets), "every entry is in a tet");
        assert!(input.tet_edges.iter().flatten().all(|&edge| (edge as usize) < 2 * n_edges), "every tet has its edges");
        let mean = input.edge_vector.iter().map(|v| v.length()).sum::<f64>() / n_edges.max(1) as f64;
        let unit = power_of_two(mean);
        let pack = |v: &DVec3| {
            let [x, y, z] = (*v / unit).to_array().map(T::from_f64);
            [x, y, z, T::ZERO]
        };
        Self { edge_vector: input.edge_vector.iter().map(pack).collect() }
    }
}

/// Loads of zero, with their anchors.
fn with_anchors<T: Real>(anchors: &[T]) -> Vec<[T; 4]> {
    anchors.iter().map(|&anchor| [T::ZERO, T::ZERO, T::ZERO, anchor]).collect()
}

/// A constraint in the layout of the kernels.
pub(super) fn pack_constraint<T: Real>(constraint: &Constraint) -> [T; 4] {
    let (v, kind) = match *constraint {
        Constraint::Free => (DVec3::ZERO, kind::FREE),
        Constraint::Held => (DVec3::ZERO, kind::HELD),
        Constraint::InPlane(normal) => (normal, kind::IN_PLANE),
        Constraint::OnLine(direction) => (direction, kind::ON_LINE),
    };
    [v.x, v.y, v.z, kind].map(T::from_f64)
}

/// The power of two at or below a positive number; otherwise 1.
pub(super) fn power_of_two(value: f64) -> f64 {
    if value.is_normal() && value > 0.0 { f64::from_bits(value.to_bits() & 0x7ff0_0000_0000_0000) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::power_of_two;

    #[test]
    fn power_of_two_is_at_or_below() {
        for (value, expected) in
            [(1.0, 1.0), (3.9, 2.0), (0.3, 0.25), (0.0, 1.0), (f64::NAN, 1.0), (f64::INFINITY, 1.0)]
        {
            assert_eq!(power_of_two(value), expected, "{value}");
        }
    }
}
