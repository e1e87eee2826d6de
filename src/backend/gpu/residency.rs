//! What a hierarchy in f64 keeps on the device beside its cycles, so that values stay there:
//! values of the vertices that move and of held ones, the springs between them, and figures.
//!
//! The springs among the rows that move are those of the hierarchy. Rows beside held vertices have
//! springs of their own, with held neighbours among them in the order of the mesh, so sums round as
//! on the CPU.

use std::ops::Range;

use glam::DVec3;
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::commands::Commands;
use super::device::Device;
use super::levels::{uniform, vector};
use super::network::{SLOT, slots};
use super::pipeline::Pipeline;
use crate::backend::packed::power_of_two;
use crate::backend::{BackendError, Surroundings};
use crate::kernels::convergence::BLOCK;
use crate::kernels::row::Entry;
use crate::kernels::{OfDoubleKernels, add_correction, figures, residual_double, rest_load, squares, turn};

/// Bytes of a value, and of a quaternion.
const VALUE: u64 = 24;
const TURN: u64 = 32;

/// Arrays of the hierarchy.
#[derive(Clone, Copy)]
pub(super) struct OfHierarchy<'a> {
    /// The rows of each chunk, their starts, entries and stiffness.
    pub(super) chunks: &'a [(Range<usize>, [Buffer; 3])],
    pub(super) constraint: &'a Buffer,
    pub(super) load: &'a Buffer,
    pub(super) inverse_length: &'a Buffer,
    pub(super) e: &'a [Buffer; 2],
    pub(super) kernels: &'a OfDoubleKernels<Pipeline>,
}

/// What stays on the device.
pub(super) struct Residency {
    /// The vertices whose values are here, those that move first.
    pub(super) places: Vec<u32>,
    n_rows: usize,
    /// `[n_places * 3]`, in `unit`.
    values: Buffer,
    /// Unit of values, loads and corrections, in the caller's unit: a power of two.
    unit: f64,
    /// Figures: first norm, norm and furthest correction, in this order.
    figures: Buffer,
    sums: Vec<OfRows>,
    /// Bindings for either index of the correction.
    add_correction: [BindGroup; 2],
    squares: BindGroup,
    of_squares: BindGroup,
    of_corrections: BindGroup,
    staging: Buffer,
    rest: Buffer,
    turning: Option<Turning>,
    /// The chunks, and the rows beside held vertices.
    springs: Vec<Springs>,
}

/// Springs of some rows.
struct Springs {
    first_row: usize,
    n_rows: usize,
    is_listed: bool,
    row_start: Buffer,
    entries: Buffer,
    stiffness: Buffer,
    rows: Buffer,
}

/// The residual of some rows. The parameters in the first slot have no loads of rest edges.
struct OfRows {
    n_rows: usize,
    bound: BindGroup,
}

/// Rest edges that turn with the values of another network.
struct Turning {
    n_places: usize,
    turn: BindGroup,
    turn_params: Buffer,
    rest_load: Vec<OfRows>,
    /// One slot for each of `rest_load`.
    rest_params: Buffer,
}

/// How a relaxation began.
#[derive(Clone, Copy)]
pub(super) struct Begin {
    turns: bool,
}

impl Residency {
    /// `None` if an array is larger than one binding.
    pub(super) fn new(device: &Device, around: &Surroundings, of: OfHierarchy) -> Result<Option<Self>, BackendError> {
        let places = around.places();
        let n_rows = around.moving.len();
        if TURN * places.len() as u64 > device.max_array {
            return Ok(None);
        }
        device.rows_fit(&around.row_start, 1, "vertex")?;
        let values = vector(device, "values", VALUE * places.len() as u64);
        let rest = vector(device, "rest", VALUE * n_rows as u64);
        let n_blocks = n_rows.div_ceil(BLOCK);
        let [of_squares, of_corrections] =
            ["squares", "corrections"].map(|label| vector(device, label, 8 * n_blocks as u64));
        let found = vector(device, "figures", 16 * 3);
        let none = device.filled("rows", &[0u32]);
        let mut springs: Vec<Springs> = of
            .chunks
            .iter()
            .map(|(range, [row_start, entries, stiffness])| Springs {
                first_row: range.start,
                n_rows: range.len(),
                is_listed: false,
                row_start: row_start.clone(),
                entries: entries.clone(),
                stiffness: stiffness.clone(),
                rows: none.clone(),
            })
            .collect();
        springs.push(beside_held(device, around, &places));
        let sums = springs.iter().map(|springs| {
            let params = uniform(device, 2);
            let of_dispatch = |has_rest| residual_double::Params {
                first_row: springs.first_row as u32,
                n_rows: springs.n_rows as u32,
                is_listed: u32::from(springs.is_listed),
                has_rest,
            };
            device.write(&params, &slots([0, 1].map(of_dispatch).into_iter()));
            let buffers = [
                ("params", &params),
                ("constraint", of.constraint),
                ("displacement", &values),
                ("rest", &rest),
                ("load", of.load),
            ];
            OfRows { n_rows: springs.n_rows, bound: springs.bind(device, &of.kernels.residual_double, &buffers) }
        });
        let sums = sums.collect();
        let n_vertices = n_rows as u32;
        let params = uniform(device, 1);
        device.write(&params, &slots([add_correction::Params { n_vertices, padding: 0 }].into_iter()));
        let add = |current: usize| {
            let buffers = [
                ("params", &params),
                ("constraint", of.constraint),
                ("inverse_length", of.inverse_length),
                ("e", &of.e[current]),
                ("displacement", &values),
                ("partials", &of_corrections),
            ];
            device.bind(&of.kernels.add_correction, &buffers)
        };
        let add_correction = [0, 1].map(add);
        let params = uniform(device, 1);
        device.write(&params, &slots([squares::Params { n_vertices, padding: 0 }].into_iter()));
        let buffers = [("params", &params), ("load", of.load), ("partials", &of_squares)];
        let squares = device.bind(&of.kernels.squares, &buffers);
        let params = uniform(device, 3);
        let list = |first| figures::Params { n_lists: 1, length: n_blocks as u32, first, padding: 0 };
        device.write(&params, &slots([0, 1, 2].map(list).into_iter()));
        let figures = |partials| {
            let buffers = [("params", &params), ("partials", partials), ("figures_of", &found)];
            device.bind(&of.kernels.figures, &buffers)
        };
        let staging =
            device.buffer("staging", 48 + VALUE * n_rows as u64, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        Ok(Some(Self {
            of_squares: figures(&of_squares),
            of_corrections: figures(&of_corrections),
            figures: found,
            places,
            n_rows,
            values,
            unit: 1.0,
            sums,
            add_correction,
            squares,
            staging,
            rest,
            turning: None,
            springs,
        }))
    }

    /// See [`Resident::turn_with`](crate::backend::Resident::turn_with).
    ///
    /// # Panics
    /// A vertex has no value in the network of the rotations.
    pub(super) fn turn_with(&mut self, device: &Device, rotations: &Self, positions: &[DVec3], of: OfHierarchy) {
        let source: Vec<u32> =
            self.places.iter().map(|&vertex| place_of(vertex, &rotations.places, rotations.n_rows)).collect();
        let positions: Vec<[f64; 3]> =
            self.places.iter().map(|&vertex| positions[vertex as usize].to_array()).collect();
        let n_places = self.places.len();
        let positions = device.filled("positions", &positions);
        let turns = vector(device, "turns", TURN * n_places as u64);
        let turn_params = uniform(device, 1);
        let buffers = [
            ("params", &turn_params),
            ("source", &device.filled("source", &source)),
            ("vectors", &rotations.values),
            ("turns", &turns),
        ];
        let turn = device.bind(&of.kernels.turn, &buffers);
        let rest_params = uniform(device, self.springs.len());
        let rest_load = self.springs.iter().map(|springs| {
            let buffers = [
                ("params", &rest_params),
                ("positions", &positions),
                ("turns", &turns),
                ("load", of.load),
                ("rest", &self.rest),
            ];
            OfRows { n_rows: springs.n_rows, bound: springs.bind(device, &of.kernels.rest_load, &buffers) }
        });
        let rest_load = rest_load.collect();
        self.turning = Some(Turning { n_places, turn, turn_params, rest_load, rest_params });
    }

    /// Sets the held values and the unit, for a relaxation that begins at zero.
    ///
    /// - `values` `[vertices of the mesh]`
    /// - `turns`: the unit of the rotations by which the rest edges turn
    pub(super) fn begin(&mut self, device: &Device, values: &[DVec3], turns: Option<f64>) -> Begin {
        let held = self.places[self.n_rows..].iter().map(|&vertex| values[vertex as usize]);
        let largest = held.clone().fold(0.0, |largest: f64, value| largest.max(value.abs().max_element()));
        self.unit = power_of_two(largest);
        let scale = self.unit.recip();
        let held: Vec<[f64; 3]> = held.map(|value| (value * scale).to_array()).collect();
        device.write_from(&self.values, VALUE * self.n_rows as u64, &held);
        if let (Some(unit), Some(turning)) = (turns, &self.turning) {
            let n_places = turning.n_places as u32;
            device.write(&turning.turn_params, &slots([turn::Params { n_places, padding: 0, unit }].into_iter()));
            let of_rows = self.springs.iter().map(|springs| rest_load::Params {
                first_row: springs.first_row as u32,
                n_rows: springs.n_rows as u32,
                is_listed: u32::from(springs.is_listed),
                padding: 0,
                scale,
            });
            device.write(&turning.rest_params, &slots(of_rows));
        }
        Begin { turns: turns.is_some() }
    }

    /// The unit of the values, in the caller's unit.
    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    /// Records what begins a relaxation: values of zero, loads of rest edges, residual and its
    /// norm.
    pub(super) fn record_begin(
        &self,
        device: &Device,
        kernels: &OfDoubleKernels<Pipeline>,
        begin: Begin,
        encoder: &mut Commands,
    ) {
        if self.n_rows > 0 {
            device.clear_first(encoder, &self.values, Some(VALUE * self.n_rows as u64));
        }
        let mut pass = encoder.pass();
        if let (true, Some(turning)) = (begin.turns, &self.turning) {
            device.dispatch(&mut pass, &kernels.turn, (&turning.turn, 0), turning.n_places);
            for (at, OfRows { n_rows, bound }) in turning.rest_load.iter().enumerate() {
                device.dispatch(&mut pass, &kernels.rest_load, (bound, (at * SLOT) as u32), *n_rows);
            }
        }
        drop(pass);
        self.record_residual(device, kernels, begin, 0, encoder);
    }

    /// Records the end of a pass.
    ///
    /// - `current`: index of the correction
    pub(super) fn record_end(
        &self,
        device: &Device,
        kernels: &OfDoubleKernels<Pipeline>,
        begin: Begin,
        current: usize,
        encoder: &mut Commands,
    ) {
        let mut pass = encoder.pass();
        let bound = (&self.add_correction[current], 0);
        device.dispatch(&mut pass, &kernels.add_correction, bound, self.n_rows);
        device.dispatch(&mut pass, &kernels.figures, (&self.of_corrections, 2 * SLOT as u32), BLOCK);
        drop(pass);
        self.record_residual(device, kernels, begin, 1, encoder);
    }

    /// Records the residual, and its norm as one of the figures.
    fn record_residual(
        &self,
        device: &Device,
        kernels: &OfDoubleKernels<Pipeline>,
        begin: Begin,
        figure: usize,
        encoder: &mut Commands,
    ) {
        let mut pass = encoder.pass();
        for OfRows { n_rows, bound } in &self.sums {
            let slot = (usize::from(begin.turns) * SLOT) as u32;
            device.dispatch(&mut pass, &kernels.residual_double, (bound, slot), *n_rows);
        }
        device.dispatch(&mut pass, &kernels.squares, (&self.squares, 0), self.n_rows);
        device.dispatch(&mut pass, &kernels.figures, (&self.of_squares, (figure * SLOT) as u32), BLOCK);
    }

    /// Submits the commands. Returns the figures, and the values of the rows that move if they are
    /// asked for.
    pub(super) fn read(
        &self,
        device: &Device,
        encoder: Commands,
        fetch: bool,
    ) -> Result<([f64; 3], Vec<DVec3>), BackendError> {
        let n_values = if fetch { 3 * self.n_rows } else { 0 };
        let found: Vec<f64> =
            device.read_parts(encoder, &[(&self.figures, 0, 6), (&self.values, 0, n_values)], &self.staging)?;
        // A figure is the largest number and the sum of a list.
        let (of_lists, values) = found.split_at(6);
        let (values, _) = values.as_chunks::<3>();
        let values = values.iter().map(|value| DVec3::from_array(*value) * self.unit).collect();
        Ok(([of_lists[1], of_lists[3], of_lists[4]], values))
    }
}

impl Springs {
    fn bind(&self, device: &Device, pipeline: &Pipeline, buffers: &[(&str, &Buffer)]) -> BindGroup {
        let Self { row_start, entries, stiffness, rows, .. } = self;
        let own = [("row_start", row_start), ("entries", entries), ("stiffness", stiffness), ("rows", rows)];
        device.bind(pipeline, &[&own, buffers].concat())
    }
}

/// The place of a vertex.
///
/// - `places`: those that move, ascending, then all others, ascending
fn place_of(vertex: u32, places: &[u32], n_moving: usize) -> u32 {
    let (moving, held) = places.split_at(n_moving);
    let place = moving.binary_search(&vertex).or_else(|_| held.binary_search(&vertex).map(|at| at + n_moving));
    place.expect("a vertex whose value is read has a place") as u32
}

/// The springs of the rows beside held vertices.
fn beside_held(device: &Device, around: &Surroundings, places: &[u32]) -> Springs {
    let entry = |&vertex: &u32| Entry { column: place_of(vertex, places, around.moving.len()), stiffness: 0.0 };
    let entries: Vec<Entry> = around.neighbours.iter().map(entry).collect();
    Springs {
        first_row: 0,
        n_rows: around.rows.len(),
        is_listed: true,
        row_start: device.filled("row_start", &around.row_start),
        entries: device.filled("entries", &entries),
        stiffness: device.filled("stiffness", &around.stiffness),
        rows: device.filled("rows", &around.rows),
    }
}
