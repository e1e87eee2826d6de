//! [`Resident`]: relaxations whose values stay on a device. Held values go up, figures come back,
//! and the values of the vertices that move only where they are asked for.

use std::any::Any;
use std::sync::Arc;

use glam::DVec3;

use super::BackendError;

/// What a device needs beside the rows that move, so that the values may stay there.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// The vertex of each row that moves, ascending.
    pub moving: Arc<Vec<u32>>,
    /// The rows with springs to held vertices, ascending.
    pub rows: Vec<u32>,
    /// Start of each of these rows in `neighbours` and `stiffness` `[rows + 1]`.
    pub row_start: Vec<u32>,
    /// The neighbours of these rows, held ones among them: vertices, in CSR order.
    pub neighbours: Vec<u32>,
    /// Stiffness of each of these springs over the row's total.
    pub stiffness: Vec<f64>,
    /// Further vertices that do not move, whose values another network needs.
    pub further: Vec<u32>,
}

impl Surroundings {
    /// The vertices whose values are on the device: those that move, then all others, ascending.
    pub fn places(&self) -> Vec<u32> {
        let is_held = |vertex: &u32| self.moving.binary_search(vertex).is_err();
        let mut held: Vec<u32> = self.neighbours.iter().chain(&self.further).copied().filter(is_held).collect();
        held.sort_unstable();
        held.dedup();
        [self.moving.as_slice(), &held].concat()
    }
}

/// The end of a pass of cycles.
#[derive(Clone, Debug, PartialEq)]
pub struct EndOfPass {
    /// Norm of the residual at the start of the relaxation, in the unit of the values.
    pub first_norm: f64,
    /// Norm of the residual now.
    pub norm: f64,
    /// Largest correction by the pass, in shortest edges; NaN if one is not finite.
    pub furthest: f64,
    /// The value of each row that moves. Empty if nobody asked for them.
    pub values: Vec<DVec3>,
}

/// A network whose values stay on its device. A value is a displacement or a rotation vector.
pub trait Resident {
    /// The vertices whose values are on the device, those that move first.
    fn places(&self) -> &[u32];

    /// Gives the springs rest edges that turn with their ends.
    ///
    /// - `rotations`: a network on the same device, whose values are rotation vectors in radians
    /// - `positions` `[vertices of the mesh]`: undeformed positions
    ///
    /// # Errors
    /// The device failed, or has no room.
    fn turn_with(&mut self, rotations: &dyn Resident, positions: &[DVec3]) -> Result<(), BackendError>;

    /// Begins a relaxation in which every vertex that moves is at zero.
    ///
    /// - `values` `[vertices of the mesh]`: those of held vertices are read
    /// - `turns`: the unit of the values of the network that [`Self::turn_with`] was given, by
    ///   which the rest edges turn. `None`: they do not turn
    ///
    /// # Errors
    /// The device failed.
    fn begin(&mut self, values: &[DVec3], turns: Option<f64>) -> Result<(), BackendError>;

    /// The unit in which the device has the values, in the caller's unit.
    fn unit(&self) -> f64;

    /// Begins a pass with a correction of zero, whose load is the residual of the values.
    fn start_pass(&mut self);

    /// Adds the correction to the values and measures what is left.
    ///
    /// - `fetch`: whether the values are asked for
    ///
    /// # Errors
    /// The device failed.
    fn end_pass(&mut self, fetch: bool) -> Result<EndOfPass, BackendError>;

    /// The network itself, for another one on the same device.
    fn as_any(&self) -> &dyn Any;
}
