//! The part of the start test with the kernels of [`super::residency`].

use glam::DVec3;
use wgpu::Buffer;

use super::BackendError;
use super::device::Device;
use super::levels::{uniform, vector};
use super::network::slots;
use super::pipeline::Pipeline;
use super::start_test::{ALLOWED, N_ROWS, SPRINGS, Sample, StartTest, compared, staging};
use crate::kernels::block::LARGEST;
use crate::kernels::convergence::BLOCK;
use crate::kernels::row::Entry;
use crate::kernels::{OfDoubleKernels, add_correction, constraint, figures, residual_double, rest_load, squares, turn};

/// Every so many rows one is beside a held vertex.
const BESIDE_HELD: usize = 5;

/// Stands in places that a kernel must not write.
const UNTOUCHED: f64 = 0.75;

/// The unit of rotation vectors, and one over the unit of loads.
const UNIT: f64 = 4.0;
const SCALE: f64 = 0.5;

/// Tests the kernels of residencies. An error of the device is a no.
pub(super) fn run(device: &Device, kernels: &OfDoubleKernels<Pipeline>) -> [StartTest; 6] {
    let sample = &Sample::new();
    let test = Test { device, kernels, sample };
    let run = |kernel, work: &dyn Fn() -> Result<StartTest, BackendError>| {
        device.guarded(work).unwrap_or_else(|_| StartTest::failed(kernel))
    };
    [
        run("turn", &|| test.turn()),
        run("rest_load", &|| test.rest_load()),
        run("residual_double", &|| test.residual()),
        run("add_correction", &|| test.add_correction()),
        run("squares", &|| test.squares()),
        run("figures", &|| test.figures()),
    ]
}

struct Test<'a> {
    device: &'a Device,
    kernels: &'a OfDoubleKernels<Pipeline>,
    sample: &'a Sample,
}

impl Test<'_> {
    /// Runs a kernel once.
    fn dispatch<P: bytemuck::NoUninit>(
        &self,
        kernel: &Pipeline,
        params: P,
        buffers: &[(&str, &Buffer)],
        n_invocations: usize,
    ) {
        let of_dispatch = uniform(self.device, 1);
        self.device.write(&of_dispatch, &slots([params].into_iter()));
        let group = self.device.bind(kernel, &[&[("params", &of_dispatch)], buffers].concat());
        let mut encoder = self.device.encoder();
        self.device.dispatch(&mut encoder.pass(), kernel, (&group, 0), n_invocations);
        self.device.submit(encoder);
    }

    fn read(&self, buffer: &Buffer, n: usize) -> Result<Vec<f64>, BackendError> {
        self.device.read(self.device.encoder(), buffer, &staging(self.device, 8 * n), n)
    }

    /// Rotation vectors of up to some turns.
    fn vectors(&self) -> Vec<DVec3> {
        self.sample.e.iter().map(|&[x, y, z, _]| DVec3::new(x, y, z)).collect()
    }

    fn positions(&self) -> Vec<DVec3> {
        self.sample.e_previous.iter().map(|&[x, y, z, _]| DVec3::new(x, y, z)).collect()
    }

    fn turns(&self) -> Vec<turn::Turn> {
        self.vectors().iter().map(|vector| turn::run(*vector * UNIT)).collect()
    }

    /// The rows beside held vertices.
    fn listed() -> Vec<u32> {
        (0..N_ROWS as u32).step_by(BESIDE_HELD).collect()
    }

    /// Residuals, and an anchor beside held vertices.
    fn load(&self) -> Vec<[f64; 4]> {
        let anchor = |row: usize| if row.is_multiple_of(BESIDE_HELD) { 0.25 } else { 0.0 };
        (0..N_ROWS).map(|row| [UNTOUCHED, UNTOUCHED, UNTOUCHED, anchor(row)]).collect()
    }

    fn springs(&self, row: usize) -> impl Iterator<Item = (u32, f64)> {
        let Sample { columns, stiffness, .. } = self.sample;
        (row * SPRINGS..(row + 1) * SPRINGS).map(|at| (columns[at], stiffness[at]))
    }

    /// The arrays of the springs of these rows.
    fn springs_of(&self, rows: impl Iterator<Item = usize>) -> [Buffer; 3] {
        let springs: Vec<(u32, f64)> = rows.flat_map(|row| self.springs(row)).collect();
        let entries: Vec<Entry> = springs.iter().map(|&(column, _)| Entry { column, stiffness: 0.0 }).collect();
        let stiffness: Vec<f64> = springs.iter().map(|&(_, stiffness)| stiffness).collect();
        let row_start: Vec<u32> = (0..=springs.len() / SPRINGS).map(|row| (row * SPRINGS) as u32).collect();
        let Self { device, .. } = self;
        [
            device.filled("row_start", &row_start),
            device.filled("entries", &entries),
            device.filled("stiffness", &stiffness),
        ]
    }

    fn turn(&self) -> Result<StartTest, BackendError> {
        let Self { device, kernels, .. } = *self;
        // The places are the vectors from behind.
        let source: Vec<u32> = (0..N_ROWS as u32).rev().collect();
        let turns = vector(device, "turns", 32 * N_ROWS as u64);
        let buffers = [
            ("source", &device.filled("source", &source)),
            ("vectors", &device.filled("vectors", &arrays(&self.vectors()))),
            ("turns", &turns),
        ];
        let params = turn::Params { n_places: N_ROWS as u32, padding: 0, unit: UNIT };
        self.dispatch(&kernels.turn, params, &buffers, N_ROWS);
        let expected =
            self.turns().into_iter().rev().flat_map(|turn| [turn.vector.x, turn.vector.y, turn.vector.z, turn.scalar]);
        Ok(self.compared("turn", expected.collect(), &self.read(&turns, 4 * N_ROWS)?))
    }

    fn rest_load(&self) -> Result<StartTest, BackendError> {
        let Self { device, kernels, .. } = *self;
        let (positions, turns) = (self.positions(), self.turns());
        let rest = vector(device, "rest", 24 * N_ROWS as u64);
        let of_turns: Vec<[f64; 4]> =
            turns.iter().map(|turn| [turn.vector.x, turn.vector.y, turn.vector.z, turn.scalar]).collect();
        let shared = [
            ("positions", device.filled("positions", &arrays(&positions))),
            ("turns", device.filled("turns", &of_turns)),
            ("load", device.filled("load", &self.load())),
            ("rows", device.filled("rows", &Self::listed())),
        ];
        let mut found = Vec::new();
        for is_listed in [0, 1] {
            let (springs, n_rows) = self.rows(is_listed);
            device.write(&rest, &vec![UNTOUCHED; 3 * N_ROWS]);
            let [row_start, entries, stiffness] = &springs;
            let own = [("row_start", row_start), ("entries", entries), ("stiffness", stiffness), ("rest", &rest)];
            let buffers = [&shared.each_ref().map(|(name, buffer)| (*name, buffer))[..], &own].concat();
            let params = rest_load::Params { first_row: 0, n_rows: n_rows as u32, is_listed, padding: 0, scale: SCALE };
            self.dispatch(&kernels.rest_load, params, &buffers, n_rows);
            found.extend(self.read(&rest, 3 * N_ROWS)?);
        }
        let of_row = |row: usize| SCALE * rest_load::run(self.springs(row), &positions, &turns, row);
        Ok(self.compared("rest_load", expected_of(of_row), &found))
    }

    fn residual(&self) -> Result<StartTest, BackendError> {
        let Self { device, kernels, sample, .. } = *self;
        let (displacement, rest) = (self.vectors(), self.positions());
        let shared = [
            ("constraint", device.filled("constraint", &sample.constraint)),
            ("displacement", device.filled("displacement", &arrays(&displacement))),
            ("rest", device.filled("rest", &arrays(&rest))),
            ("rows", device.filled("rows", &Self::listed())),
        ];
        let mut found = Vec::new();
        for is_listed in [0, 1] {
            let (springs, n_rows) = self.rows(is_listed);
            let load = vector(device, "load", 32 * N_ROWS as u64);
            device.write(&load, &self.load());
            let [row_start, entries, stiffness] = &springs;
            let own = [("row_start", row_start), ("entries", entries), ("stiffness", stiffness), ("load", &load)];
            let buffers = [&shared.each_ref().map(|(name, buffer)| (*name, buffer))[..], &own].concat();
            let params = residual_double::Params { first_row: 0, n_rows: n_rows as u32, is_listed, has_rest: 1 };
            self.dispatch(&kernels.residual_double, params, &buffers, n_rows);
            let of_load = self.read(&load, 4 * N_ROWS)?;
            found.extend(of_load.as_chunks::<4>().0.iter().flat_map(|&[x, y, z, _]| [x, y, z]));
        }
        let of_row = |row: usize| {
            let sum = residual_double::run(self.springs(row), 0.0, Some(rest[row]), &displacement, row);
            DVec3::from_array(constraint::project(&sample.constraint[row], sum.to_array()))
        };
        Ok(self.compared("residual_double", expected_of(of_row), &found))
    }

    /// The displacement, and the largest correction of each block. The last block has a NaN.
    fn add_correction(&self) -> Result<StartTest, BackendError> {
        let Self { device, kernels, sample, .. } = *self;
        let (mut e, displacement) = (self.vectors(), self.positions());
        e[N_ROWS - 1].y = f64::NAN;
        let of_displacement = vector(device, "displacement", 24 * N_ROWS as u64);
        device.write(&of_displacement, &arrays(&displacement));
        let partials = vector(device, "partials", (8 * N_ROWS / BLOCK) as u64);
        let buffers = [
            ("constraint", &device.filled("constraint", &sample.constraint)),
            ("inverse_length", &device.filled("inverse_length", &sample.inverse_length)),
            ("e", &device.filled("e", &arrays(&e))),
            ("displacement", &of_displacement),
            ("partials", &partials),
        ];
        let params = add_correction::Params { n_vertices: N_ROWS as u32, padding: 0 };
        self.dispatch(&kernels.add_correction, params, &buffers, N_ROWS);
        let added = (0..N_ROWS - 1).flat_map(|row| {
            let allowed = constraint::project(&sample.constraint[row], e[row].to_array());
            (displacement[row] + DVec3::from_array(allowed)).to_array()
        });
        let pairs: Vec<(DVec3, f64)> = e.iter().copied().zip(sample.inverse_length.iter().copied()).collect();
        let largest = pairs.chunks(BLOCK).map(|block| add_correction::run(block.iter().copied()));
        let found = [self.read(&of_displacement, 3 * (N_ROWS - 1))?, self.read(&partials, N_ROWS / BLOCK)?].concat();
        Ok(self.compared("add_correction", added.chain(largest).collect(), &found))
    }

    /// The sum of each block. The last block has a NaN.
    fn squares(&self) -> Result<StartTest, BackendError> {
        let Self { device, kernels, .. } = *self;
        let mut load = self.vectors();
        load[N_ROWS - 1].z = f64::NAN;
        let of_load: Vec<[f64; 4]> = load.iter().map(|v| [v.x, v.y, v.z, 1.0]).collect();
        let partials = vector(device, "partials", (8 * N_ROWS / BLOCK) as u64);
        let buffers = [("load", &device.filled("load", &of_load)), ("partials", &partials)];
        let params = squares::Params { n_vertices: N_ROWS as u32, padding: 0 };
        self.dispatch(&kernels.squares, params, &buffers, N_ROWS);
        let expected = load.chunks(BLOCK).map(|block| squares::run(block.iter().copied())).collect();
        Ok(self.compared("squares", expected, &self.read(&partials, N_ROWS / BLOCK)?))
    }

    /// Lists longer than a workgroup, of which the last one has no finite sum.
    fn figures(&self) -> Result<StartTest, BackendError> {
        let Self { device, kernels, sample, .. } = *self;
        let lengths: Vec<f64> = sample.e.iter().flatten().map(|x| x.abs()).collect();
        let length = lengths.len() / 4 - 3;
        let mut lists = lengths[..3 * length].to_vec();
        lists[2 * length] = LARGEST;
        lists[2 * length + 1] = LARGEST;
        let found = vector(device, "figures", 16 * 4);
        let buffers = [("partials", &device.filled("partials", &lists)), ("figures_of", &found)];
        let params = figures::Params { n_lists: 3, length: length as u32, first: 1, padding: 0 };
        self.dispatch(&kernels.figures, params, &buffers, 3 * BLOCK);
        // The first place is not the kernel's.
        let expected = [0.0; 2].into_iter().chain(lists.chunks(length).flat_map(figures::run)).collect();
        Ok(self.compared("figures", expected, &self.read(&found, 8)?))
    }

    /// The springs of all rows, or of those beside held vertices, and the number of rows.
    fn rows(&self, is_listed: u32) -> ([Buffer; 3], usize) {
        match is_listed {
            0 => (self.springs_of(0..N_ROWS), N_ROWS),
            _ => (self.springs_of((0..N_ROWS).step_by(BESIDE_HELD)), Self::listed().len()),
        }
    }

    fn compared(&self, kernel: &'static str, expected: Vec<f64>, found: &[f64]) -> StartTest {
        let mut test = compared(kernel, expected.iter().copied().zip(found.iter().copied()), |expected| {
            if expected == LARGEST { 0.0 } else { ALLOWED * expected.abs().max(1.0) }
        });
        test.passes &= expected.len() == found.len();
        test
    }
}

/// What two dispatches give: one of the rows beside no held vertex, one of the others.
fn expected_of(of_row: impl Fn(usize) -> DVec3) -> Vec<f64> {
    let untouched = DVec3::splat(UNTOUCHED);
    let value = |is_listed: bool| {
        let of_row = &of_row;
        move |row: usize| if row.is_multiple_of(BESIDE_HELD) == is_listed { of_row(row) } else { untouched }
    };
    let both = (0..N_ROWS).map(value(false)).chain((0..N_ROWS).map(value(true)));
    both.flat_map(|value| value.to_array()).collect()
}

fn arrays(vectors: &[DVec3]) -> Vec<[f64; 3]> {
    vectors.iter().map(DVec3::to_array).collect()
}
