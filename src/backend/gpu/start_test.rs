//! The test of an adapter at its start: whether its kernels in f64 have the precision of f64.
//!
//! A compiler decides kernel by kernel, so the kernels themselves run, on random numbers, and are
//! compared with their twins. A driver that computes in f32 is off by seven digits more than one
//! that contracts `a * b + c`.

use wgpu::BufferUsages;

use super::BackendError;
use super::device::Device;
use super::levels::{uniform, vector};
use super::network::slots;
use super::pipeline::Pipeline;
use crate::backend::packed::pack_constraint;
use crate::constraint::Constraint;
use crate::kernels::block::LARGEST;
use crate::kernels::convergence::BLOCK;
use crate::kernels::row::{Entry, Rows};
use crate::kernels::{OfDoubleKernels, accelerate_double, hand_over};

/// Rows of the test, and springs of a row.
pub(super) const N_ROWS: usize = 4 * BLOCK;
pub(super) const SPRINGS: usize = 12;

/// What is left of the loads, which almost balance the springs. In f32 nothing of it would be seen.
const LEFT: f64 = 1e-9;

/// Allowed errors of numbers of size 1. Contraction and other orders of sums err by some 1e-16.
pub(super) const ALLOWED: f64 = 1e-14;

/// The network of the test, in the layout of the twins.
pub(super) struct Sample {
    row_start: Vec<u32>,
    pub(super) columns: Vec<u32>,
    pub(super) stiffness: Vec<f64>,
    pub(super) constraint: Vec<[f64; 4]>,
    load: Vec<[f64; 4]>,
    pub(super) inverse_length: Vec<f64>,
    pub(super) e: Vec<[f64; 4]>,
    pub(super) e_previous: Vec<[f64; 4]>,
    of_cycle: Vec<[f32; 4]>,
}

/// What the test of a kernel found.
#[derive(Clone, Debug, PartialEq)]
pub struct StartTest {
    /// The kernel.
    pub kernel: &'static str,
    /// Numbers that were compared with those of the twin.
    pub numbers: usize,
    /// How many of them have other bits.
    pub differing: usize,
    /// The largest difference, of numbers of size 1; NaN if the device failed.
    pub largest: f64,
    /// Whether the kernel has the precision of f64.
    pub passes: bool,
}

/// Tests whether the device's kernels have the precision of f64. An error of the device is a no.
pub(super) fn run(device: &Device, kernels: &OfDoubleKernels<Pipeline>) -> [StartTest; 2] {
    let sample = Sample::new();
    let handed = device.guarded(|| sample.handed_over(device, kernels));
    let accelerated = device.guarded(|| sample.accelerated(device, kernels));
    let failed = StartTest::failed;
    [
        handed.map_or_else(|_| failed("hand_over"), |handed| sample.is_handed_over(&handed)),
        accelerated.map_or_else(|_| failed("accelerate_double"), |(e, largest)| sample.is_accelerated(&e, &largest)),
    ]
}

impl StartTest {
    /// The test of a kernel that did not run.
    pub(super) fn failed(kernel: &'static str) -> Self {
        Self { kernel, numbers: 0, differing: 0, largest: f64::NAN, passes: false }
    }
}

impl Sample {
    pub(super) fn new() -> Self {
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let mut vectors = || -> Vec<[f64; 4]> { (0..N_ROWS).map(|_| [random(), random(), random(), 0.0]).collect() };
        let (e, e_previous, left, unit) = (vectors(), vectors(), vectors(), vectors());
        let of_cycle = vectors().iter().map(|v| v.map(|x| x as f32)).collect();
        let columns = (0..N_ROWS * SPRINGS).map(|_| ((random() + 1.0) * 0.5 * (N_ROWS - 1) as f64) as u32).collect();
        let stiffness = (0..N_ROWS * SPRINGS).map(|_| (random() + 1.0) / SPRINGS as f64).collect();
        let constraint = |(row, &[x, y, z, _]): (usize, &[f64; 4])| {
            let unit = glam::DVec3::new(x, y, z).normalize();
            pack_constraint(&match row % 4 {
                0 => Constraint::Held,
                1 => Constraint::InPlane(unit),
                2 => Constraint::OnLine(unit),
                _ => Constraint::Free,
            })
        };
        let mut sample = Self {
            row_start: (0..=N_ROWS).map(|row| (row * SPRINGS) as u32).collect(),
            columns,
            stiffness,
            constraint: unit.iter().enumerate().map(constraint).collect(),
            load: vec![[0.0, 0.0, 0.0, 0.25]; N_ROWS],
            inverse_length: unit.iter().map(|v| v[0].abs()).collect(),
            e,
            e_previous,
            of_cycle,
        };
        let balanced: Vec<[f64; 4]> =
            (0..N_ROWS).map(|row| crate::kernels::row::residual(&sample.rows(), &sample.e, row)).collect();
        for ((load, pull), left) in sample.load.iter_mut().zip(balanced).zip(left) {
            (0..3).for_each(|axis| load[axis] = LEFT * left[axis] - pull[axis]);
        }
        sample
    }

    fn rows(&self) -> Rows<'_, f64> {
        Rows {
            row_start: &self.row_start,
            columns: &self.columns,
            stiffness: &self.stiffness,
            constraint: &self.constraint,
            load: &self.load,
            anchor: &[],
        }
    }

    fn handed_over(&self, device: &Device, kernels: &OfDoubleKernels<Pipeline>) -> Result<Vec<[f32; 4]>, BackendError> {
        let entry = |&column| Entry { column, stiffness: 0.0 };
        let entries: Vec<Entry> = self.columns.iter().map(entry).collect();
        let handed = vector(device, "handed", 16 * N_ROWS as u64);
        let params = uniform(device, 1);
        let of_dispatch = hand_over::Params { first_row: 0, n_rows: N_ROWS as u32, is_zero: 0, padding: 0 };
        device.write(&params, &slots([of_dispatch].into_iter()));
        let buffers = [
            ("params", &params),
            ("row_start", &device.filled("row_start", &self.row_start)),
            ("entries", &device.filled("entries", &entries)),
            ("stiffness", &device.filled("stiffness", &self.stiffness)),
            ("constraint", &device.filled("constraint", &self.constraint)),
            ("load", &device.filled("load", &self.load)),
            ("e", &device.filled("e", &three(&self.e))),
            ("handed", &handed),
        ];
        let group = device.bind(&kernels.hand_over, &buffers);
        let mut encoder = device.encoder();
        let mut pass = encoder.pass();
        device.dispatch(&mut pass, &kernels.hand_over, (&group, 0), N_ROWS);
        drop(pass);
        let staging = staging(device, 16 * N_ROWS);
        device.read(encoder, &handed, &staging, N_ROWS)
    }

    fn is_handed_over(&self, found: &[[f32; 4]]) -> StartTest {
        let mut expected = vec![[0f32; 4]; N_ROWS];
        hand_over::run(0, self.rows(), Some(&self.e), &mut expected);
        let numbers = expected.iter().flatten().zip(found.iter().flatten());
        let pairs = numbers.map(|(&expected, &found)| (f64::from(expected), f64::from(found)));
        compared("hand_over", pairs, |expected| ALLOWED + 2.0 * f64::from(f32::EPSILON) * expected.abs())
    }

    /// The new correction, and the largest change of each block. The last block has a NaN.
    fn accelerated(
        &self,
        device: &Device,
        kernels: &OfDoubleKernels<Pipeline>,
    ) -> Result<(Vec<[f64; 3]>, Vec<f64>), BackendError> {
        let e = vector(device, "e_previous", 24 * N_ROWS as u64);
        device.write(&e, &three(&self.e_previous));
        let mut of_cycle = self.of_cycle.clone();
        of_cycle[N_ROWS - 1][1] = f32::NAN;
        let partials = vector(device, "partials", (8 * N_ROWS / BLOCK) as u64);
        let params = uniform(device, 1);
        let of_dispatch = accelerate_double::Params {
            first_row: 0,
            n_rows: N_ROWS as u32,
            first_partial: 0,
            padding: 0,
            relaxation: FACTORS[0],
            momentum: FACTORS[1],
        };
        device.write(&params, &slots([of_dispatch].into_iter()));
        let buffers = [
            ("params", &params),
            ("of_cycle", &device.filled("of_cycle", &of_cycle)),
            ("constraint", &device.filled("constraint", &self.constraint)),
            ("inverse_length", &device.filled("inverse_length", &self.inverse_length)),
            ("e", &device.filled("e", &three(&self.e))),
            ("e_previous", &e),
            ("partials", &partials),
        ];
        let group = device.bind(&kernels.accelerate_double, &buffers);
        let mut encoder = device.encoder();
        let mut pass = encoder.pass();
        device.dispatch(&mut pass, &kernels.accelerate_double, (&group, 0), N_ROWS);
        drop(pass);
        let staging = staging(device, 24 * N_ROWS);
        let found = device.read(encoder, &e, &staging, N_ROWS)?;
        Ok((found, device.read(device.encoder(), &partials, &staging, N_ROWS / BLOCK)?))
    }

    fn is_accelerated(&self, found: &[[f64; 3]], of_blocks: &[f64]) -> StartTest {
        let (mut expected, mut largest) = (self.e_previous.clone(), vec![[0.0; 4]; N_ROWS / BLOCK]);
        let Self { inverse_length, e, of_cycle, .. } = self;
        let factors = FACTORS.map(|factor| [factor; 4]);
        accelerate_double::run(factors, 0, self.rows(), inverse_length, e, of_cycle, &mut expected, &mut largest);
        let (of_rows, last) = (N_ROWS - 1, N_ROWS / BLOCK - 1);
        let expected = three(&expected);
        let of_e = expected[..of_rows].iter().flatten().zip(found.iter().flatten());
        let largest = largest[..last].iter().map(|[of_design, ..]| of_design);
        let pairs = of_e.chain(largest.zip(of_blocks)).map(|(&expected, &found)| (expected, found));
        let mut test = compared("accelerate_double", pairs, |_| ALLOWED);
        test.passes &= of_blocks[last] >= LARGEST;
        test
    }
}

/// Compares numbers of a twin and of a device.
///
/// - `allowed`: by how much the device may be off at a number of the twin
pub(super) fn compared(
    kernel: &'static str,
    pairs: impl Iterator<Item = (f64, f64)>,
    allowed: impl Fn(f64) -> f64,
) -> StartTest {
    let mut test = StartTest { kernel, numbers: 0, differing: 0, largest: 0.0, passes: true };
    for (expected, found) in pairs {
        let difference = (expected - found).abs();
        test.numbers += 1;
        test.differing += usize::from(expected.to_bits() != found.to_bits());
        // A NaN stays in sight.
        test.largest = if difference <= test.largest { test.largest } else { difference };
        test.passes &= difference <= allowed(expected);
    }
    test
}

/// Factors of the last step of a cycle.
const FACTORS: [f64; 2] = [1.1, 0.3];

/// The first three components of vectors.
fn three(vectors: &[[f64; 4]]) -> Vec<[f64; 3]> {
    vectors.iter().map(|&[x, y, z, _]| [x, y, z]).collect()
}

pub(super) fn staging(device: &Device, bytes: usize) -> wgpu::Buffer {
    device.buffer("staging", bytes as u64, BufferUsages::MAP_READ | BufferUsages::COPY_DST)
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::super::adapter::choose;
    use super::super::{Bounds, Choice, start_tests};
    use super::*;
    use crate::kernels::DOUBLE_KERNELS;

    /// Kernels that round to f32 somewhere, or lose a NaN, do not pass; the right ones do.
    #[test]
    fn kernels_without_the_precision_of_f64_are_found() {
        if std::env::var("IDMESH_TEST_GPU").is_ok_and(|value| value == "off") {
            eprintln!("SKIPPED by IDMESH_TEST_GPU=off: kernels_without_the_precision_of_f64_are_found");
            return;
        }
        let device = Device::open(&choose(Choice::Any).unwrap(), Bounds::default()).unwrap();
        let passes = |from: &str, to: &str| {
            let changed = |source: &str| source.replace(from, to);
            let kernels = OfDoubleKernels::new(|kernel| device.compile(kernel.name, &changed(kernel.source))).unwrap();
            let tests = start_tests(&device, &kernels);
            // All numbers of all rows, but for the row with a NaN and its block.
            let numbers: Vec<usize> = tests[..2].iter().map(|test| test.numbers).collect();
            assert_eq!(numbers, [4 * N_ROWS, 3 * (N_ROWS - 1) + N_ROWS / BLOCK - 1]);
            assert_eq!(tests.iter().map(|test| test.kernel).collect::<HashSet<_>>().len(), DOUBLE_KERNELS.len());
            let all_equal = tests.iter().all(|test| test.differing == 0 && test.largest == 0.0);
            // Mesa's software adapter rounds as the CPU does.
            assert!(from.is_empty() <= (all_equal || device.info.device_type != wgpu::DeviceType::Cpu), "{tests:?}");
            tests.iter().all(|test| test.passes)
        };
        assert!(passes("", ""));
        for (from, to) in [
            ("sum += stiffness[i] *", "sum += f64(f32(stiffness[i])) *"),
            ("left = sum - pull.w * own", "left = vec3<f64>(vec3<f32>(sum)) - pull.w * own"),
            ("let new_e = now + step;", "let new_e = vec3<f64>(vec3<f32>(now + step));"),
            ("if (number <= LARGEST)", "if (true)"),
            ("sine = sine * s + 1.0lf", "sine = f64(f32(sine * s + 1.0lf))"),
            ("c = c * s - 0.5lf", "c = f64(f32(c)) * s - 0.5lf"),
            ("by_others += k *", "by_others += f64(f32(k)) *"),
            ("arms += k * arm", "arms += vec3<f64>(vec3<f32>(k * arm))"),
            ("} else if (load[row].w != 0.0lf) {", "} else if (false) {"),
            ("sum += stiffness[i] * (displacement_of", "sum += f64(f32(stiffness[i])) * (displacement_of"),
            ("if (params.has_rest == 1u)", "if (false)"),
            ("displacement[x] += allowed.x", "displacement[x] += f64(f32(allowed.x))"),
            ("sum += number;", "sum += f64(f32(number));"),
            ("largest = max(largest, number);", ""),
        ] {
            assert!(!passes(from, to), "{to}");
        }
    }
}
