//! The coarse levels of a hierarchy in a GPU's memory, and their part of a cycle in one dispatch.
//!
//! The networks of these levels are so small that a GPU takes longer to start a kernel than to run
//! it. Their arrays are joined, and one workgroup takes one step after another.

use wgpu::{BindGroup, Buffer};

use super::commands::Commands;
use super::device::{Device, MAX_ROW};
use super::levels::{uniform, vector};
use super::network::slots;
use crate::backend::packed::Packed;
use crate::backend::{LevelData, Transfer};
use crate::constraint::Constraint;
use crate::kernels::coarse_cycle::{LANES, Params, Step, kind};
use crate::kernels::row::Entry;

/// A level with more vertices has dispatches of its own: one workgroup uses a small part of a GPU.
/// Not measured on hardware.
const MOST_VERTICES: usize = 2000;

/// The coarse levels.
pub(super) struct Coarse {
    /// Finest first.
    packed: Vec<Packed<f32>>,
    constraint: Buffer,
    /// The correction of all levels, finest first. After a cycle it is in the first half.
    pub(super) e: Buffer,
    bound: BindGroup,
}

/// The arrays of the coarse levels, as the kernel reads them.
pub(super) struct Joined {
    packed: Vec<Packed<f32>>,
    steps: Vec<Step>,
    row_start: Vec<u32>,
    entries: Vec<Entry>,
    constraint: Vec<[f32; 4]>,
    load: Vec<[f32; 4]>,
}

impl Joined {
    /// Joins as many of a hierarchy's levels as one dispatch takes. The finest level is never
    /// among them. Returns the first of them too; `None` if there is none.
    ///
    /// - `data`: all levels, finest first
    pub(super) fn new(device: &Device, data: &[LevelData]) -> Option<(usize, Self)> {
        (1..data.len()).find_map(|first| {
            let n_vertices = data[first].network.graph.n_rows();
            let joined = (n_vertices <= MOST_VERTICES).then(|| Self::of(&data[first - 1], &data[first..]))?;
            joined.fits(device.max_chunk.min(device.max_array)).then_some((first, joined))
        })
    }

    /// - `finer`: the level above
    fn of(finer: &LevelData, data: &[LevelData]) -> Self {
        let mut packed: Vec<Packed<f32>> = data.iter().map(|level| Packed::new(&level.network)).collect();
        let mut first_rows = vec![0];
        for of_level in &packed {
            first_rows.push(first_rows[first_rows.len() - 1] + of_level.n_vertices());
        }
        let mut rows = JoinedRows::default();
        for (of_level, &first) in packed.iter().zip(&first_rows) {
            let springs = of_level.rows();
            rows.add(springs.row_start, springs.columns, springs.stiffness, first);
        }
        rows.end();
        let transfers = [finer].into_iter().chain(data).map(|level| level.transfers);
        for ([to_load, _], &first) in transfers.clone().flatten().zip([0].iter().chain(&first_rows)) {
            rows.add_transfer(to_load, first);
        }
        rows.end();
        for ([_, to_correction], &first) in transfers.flatten().skip(1).zip(&first_rows[1..]) {
            rows.add_transfer(to_correction, first);
        }
        let of_coarsest = packed.last().map_or(0, Packed::n_vertices);
        rows.add(&vec![0; of_coarsest + 1], &[], &[], 0);
        rows.end();
        let joined = |of: fn(&Packed<f32>) -> &[[f32; 4]]| packed.iter().flat_map(of).copied().collect();
        let (constraint, load) = (joined(|of| of.rows().constraint), joined(|of| of.rows().load));
        packed.iter_mut().for_each(Packed::forget_received);
        let JoinedRows { row_start, entries } = rows;
        Self { steps: steps(data, &first_rows), packed, row_start, entries, constraint, load }
    }

    /// Whether one dispatch takes these levels.
    ///
    /// - `max_bytes`: of an array
    fn fits(&self, max_bytes: u64) -> bool {
        let bytes = size_of_val(&self.entries[..]).max(2 * size_of_val(&self.load[..])) as u64;
        bytes <= max_bytes && self.iterations() <= u64::from(MAX_ROW)
    }

    /// An upper bound of the loop iterations of an invocation, and of invocations that a processor
    /// runs as one.
    fn iterations(&self) -> u64 {
        let n_rows = self.load.len();
        let of_step = |step: &Step| {
            let list = match step.kind {
                kind::FIRST_SWEEP => None,
                kind::RELAX_SWEEP | kind::DEFECT => Some(0),
                kind::RECEIVE | kind::RESTRICT => Some(1),
                _ => Some(2),
            };
            let first = step.first_row as usize;
            let rows: Vec<usize> = (first..first + step.n_rows as usize).collect();
            let longest = |rows: &[usize]| {
                let length = |&row: &usize| {
                    let at = list.map(|list| list * (n_rows + 1) + row);
                    at.map_or(0, |at| self.row_start[at + 1] - self.row_start[at])
                };
                1 + u64::from(rows.iter().map(length).max().unwrap_or(0))
            };
            1 + rows.chunks(LANES).map(longest).sum::<u64>()
        };
        self.steps.iter().map(of_step).sum()
    }
}

/// Lists of rows, one after another, with the starts of each in common entries.
#[derive(Default)]
struct JoinedRows {
    row_start: Vec<u32>,
    entries: Vec<Entry>,
}

impl JoinedRows {
    /// Adds the rows of a level to a list.
    ///
    /// - `first_column`: place of the column 0 in the joined arrays
    fn add(&mut self, row_start: &[u32], columns: &[u32], values: &[f32], first_column: usize) {
        let before = self.entries.len() as u32;
        self.row_start.extend(row_start[..row_start.len() - 1].iter().map(|start| before + start));
        let entry = |(&column, &stiffness): (&u32, &f32)| Entry { column: first_column as u32 + column, stiffness };
        self.entries.extend(columns.iter().zip(values).map(entry));
    }

    fn add_transfer(&mut self, transfer: &Transfer, first_column: usize) {
        let weights: Vec<f32> = transfer.weights.iter().map(|&weight| weight as f32).collect();
        self.add(&transfer.sources.row_start, &transfer.sources.entries, &weights, first_column);
    }

    /// Ends a list.
    fn end(&mut self) {
        self.row_start.push(self.entries.len() as u32);
    }
}

/// The steps of a cycle over the levels.
///
/// - `first_rows`: place of each level in the joined arrays, and their length
fn steps(data: &[LevelData], first_rows: &[usize]) -> Vec<Step> {
    let mut down = Vec::new();
    // From the coarsest level's to the finest level's.
    let mut up = Vec::new();
    // Where the defect of the next finer level is.
    let mut of_defect = None;
    for (level, rows) in data.iter().zip(first_rows.windows(2)) {
        let (first_row, n_rows) = (rows[0] as u32, (rows[1] - rows[0]) as u32);
        let step = |kind, half: usize| {
            let half = half as u32 % 2;
            Step { kind, first_row, n_rows, half, relaxation: 0.0, momentum: 0.0 }
        };
        let n_sweeps = level.sweeps.len();
        // The last sweep of a level ends in the first half. A level with a coarser one has as many
        // sweeps on its way up as on its way down.
        let start = if level.transfers.is_some() { 0 } else { n_sweeps };
        let sweeps = |first: usize, start: usize| {
            level.sweeps.iter().enumerate().skip(first).map(move |(at, sweep)| Step {
                relaxation: sweep.relaxation as f32,
                momentum: sweep.momentum as f32,
                ..step(kind::RELAX_SWEEP, start + at)
            })
        };
        down.push(of_defect.map_or(step(kind::RECEIVE, 0), |half| step(kind::RESTRICT, half)));
        // The first sweep sets the corrections to zero, even where a level has no sweeps.
        let relaxation = level.sweeps.first().map_or(0.0, |sweep| sweep.relaxation as f32);
        down.push(Step { relaxation, ..step(kind::FIRST_SWEEP, start) });
        down.extend(sweeps(1, start));
        if level.transfers.is_some() {
            let middle = start + n_sweeps;
            down.push(step(kind::DEFECT, middle));
            of_defect = Some(middle + 1);
            up.push([step(kind::PROLONG, middle)].into_iter().chain(sweeps(0, middle)).collect::<Vec<_>>());
        }
    }
    down.into_iter().chain(up.into_iter().rev().flatten()).collect()
}

impl Coarse {
    /// Brings the levels to the device.
    ///
    /// - `finer`: the defect of the level above
    pub(super) fn new(device: &Device, joined: Joined, finer: &Buffer) -> Self {
        let Joined { packed, steps, row_start, entries, constraint, load } = joined;
        let params = uniform(device, 1);
        let of_dispatch = Params { n_steps: steps.len() as u32, n_rows: load.len() as u32 };
        device.write(&params, &slots([of_dispatch].into_iter()));
        let constraint = device.filled("constraint", &constraint);
        let e = vector(device, "e", 2 * size_of_val(&load[..]) as u64);
        let buffers = [
            ("params", &params),
            ("row_start", &device.filled("row_start", &row_start)),
            ("entries", &device.filled("entries", &entries)),
            ("constraint", &constraint),
            ("load", &device.filled("load", &load)),
            ("e", &e),
            ("steps", &device.filled("steps", &steps)),
            ("finer", finer),
        ];
        let bound = device.bind(&device.pipelines.coarse_cycle, &buffers);
        Self { packed, constraint, e, bound }
    }

    /// Replaces the constraints of the levels, one level after another.
    pub(super) fn constrain(&mut self, device: &Device, mut constraint: &[Constraint]) {
        let mut joined = Vec::new();
        for of_level in &mut self.packed {
            let (own, coarser) = constraint.split_at(of_level.n_vertices());
            of_level.constrain(own);
            joined.extend_from_slice(of_level.rows().constraint);
            of_level.forget_received();
            constraint = coarser;
        }
        device.write(&self.constraint, &joined);
    }

    /// Records the levels' part of a cycle.
    pub(super) fn record(&self, device: &Device, encoder: &mut Commands) {
        device.dispatch(&mut encoder.pass(), &device.pipelines.coarse_cycle, (&self.bound, 0), LANES);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use wgpu::BufferUsages;

    use super::super::adapter::choose;
    use super::super::{Bounds, Choice};
    use super::*;
    use crate::backend::{NetworkData, Sweep};
    use crate::kernels::coarse_cycle;
    use crate::kernels::row::Rows;
    use crate::kernels::transfer::Weights;
    use crate::mesh::csr::Csr;

    /// Vertices of the level above, and of three levels of which two take several rounds of the
    /// workgroup.
    const SIZES: [usize; 4] = [900, 700, 300, 7];

    /// Numbers in -1..1.
    struct Random(u64);

    impl Random {
        fn number(&mut self) -> f64 {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }

        fn below(&mut self, n: usize) -> u32 {
            ((self.number() + 1.0) * 0.5 * n as f64) as u32
        }

        fn vectors(&mut self, n: usize) -> Vec<[f32; 4]> {
            (0..n).map(|_| [self.number(), self.number(), self.number(), 0.0].map(|x| x as f32)).collect()
        }

        /// Rows of 0 to 12 entries.
        fn rows(&mut self, n_rows: usize, n_columns: usize) -> Csr {
            let lengths: Vec<u32> = (0..n_rows).map(|_| self.below(13)).collect();
            let pairs: Vec<(u32, u32)> = lengths
                .iter()
                .zip(0..)
                .flat_map(|(&length, row)| (0..length).map(move |_| row))
                .map(|row| (row, self.below(n_columns)))
                .collect();
            Csr::from_pairs(n_rows, pairs.into_iter())
        }

        fn transfer(&mut self, n_targets: usize, n_sources: usize) -> Transfer {
            let sources = self.rows(n_targets, n_sources);
            let weights = sources.entries.iter().map(|_| self.number()).collect();
            Transfer { sources, weights }
        }
    }

    /// Random networks, transfers, constraints of all kinds and factors: not a bit differs from the
    /// twin on a software adapter.
    #[test]
    fn the_kernel_matches_its_twin() {
        if std::env::var("IDMESH_TEST_GPU").is_ok_and(|value| value == "off") {
            eprintln!("SKIPPED by IDMESH_TEST_GPU=off: the_kernel_matches_its_twin");
            return;
        }
        let device = Device::open(&choose(Choice::Any).unwrap(), Bounds::default()).unwrap();
        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let graphs = SIZES.map(|n| Arc::new(random.rows(n, n)));
        let stiffness =
            graphs.each_ref().map(|of| of.entries.iter().map(|_| random.number().abs()).collect::<Vec<_>>());
        let anchor = SIZES.map(|n| (0..n).map(|_| random.number().abs()).collect::<Vec<_>>());
        let constraint = SIZES.map(|n| {
            let of = |row: usize, [x, y, z, _]: [f32; 4]| {
                let unit = glam::DVec3::new(x.into(), y.into(), z.into()).normalize();
                let all = [Constraint::Free, Constraint::InPlane(unit), Constraint::Held, Constraint::OnLine(unit)];
                all[row % 4]
            };
            random.vectors(n).into_iter().enumerate().map(|(row, v)| of(row, v)).collect::<Vec<_>>()
        });
        let transfers = [0, 1, 2].map(|at| {
            let [fine, coarse] = [SIZES[at], SIZES[at + 1]];
            [random.transfer(coarse, fine), random.transfer(fine, coarse)]
        });
        // The level above, one with an odd number of sweeps, one without, and the coarsest with an
        // odd number.
        let sweeps = [0, 3, 0, 5].map(|n| {
            let sweep = |_| Sweep { relaxation: 0.6 + 0.3 * random.number(), momentum: 0.2 * random.number() };
            (0..n).map(sweep).collect::<Vec<_>>()
        });
        let lengths = SIZES.map(|n| vec![1.0; n]);
        let data = [0, 1, 2, 3].map(|at| LevelData {
            network: NetworkData {
                graph: &graphs[at],
                stiffness: &stiffness[at],
                anchor: &anchor[at],
                inverse_length: &lengths[at],
                constraint: &constraint[at],
            },
            sweeps: &sweeps[at],
            transfers: transfers.get(at).map(|both| [&both[0], &both[1]]),
        });
        let (first, joined) = Joined::new(&device, &data).unwrap();
        assert_eq!(first, 1);
        let finer = random.vectors(SIZES[0]);

        let n_rows: usize = SIZES[1..].iter().sum();
        let columns: Vec<u32> = joined.entries.iter().map(|entry| entry.column).collect();
        let values: Vec<f32> = joined.entries.iter().map(|entry| entry.stiffness).collect();
        let list = |at: usize| &joined.row_start[at * (n_rows + 1)..(at + 1) * (n_rows + 1)];
        let weights = |at| Weights { row_start: list(at), columns: &columns, weights: &values };
        let of_twin = coarse_cycle::Joined {
            springs: Rows {
                row_start: list(0),
                columns: &columns,
                stiffness: &values,
                constraint: &joined.constraint,
                load: &[],
                anchor: &[],
            },
            to_load: weights(1),
            to_correction: weights(2),
        };
        let (mut load, mut expected) = (joined.load.clone(), [0, 1].map(|_| vec![[0f32; 4]; n_rows]));
        let [e, spare] = &mut expected;
        coarse_cycle::run(&joined.steps, &of_twin, &finer, &mut load, [e, spare]);
        assert!(e.iter().filter(|v| v[0] != 0.0).count() > n_rows / 2, "most vertices moved");

        let coarse = Coarse::new(&device, joined, &device.filled("finer", &finer));
        let staging = device.buffer("staging", 16 * n_rows as u64, BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        // Twice: nothing of a cycle is left for the next one.
        for _ in 0..2 {
            let found: Vec<[f32; 4]> = device
                .guarded(|| {
                    let mut encoder = device.encoder();
                    coarse.record(&device, &mut encoder);
                    device.read(encoder, &coarse.e, &staging, n_rows)
                })
                .unwrap();
            let greatest = e.iter().flatten().fold(0f32, |greatest, x| greatest.max(x.abs()));
            let is_software = device.info.device_type == wgpu::DeviceType::Cpu;
            for (row, (expected, found)) in e.iter().zip(&found).enumerate() {
                for axis in 0..4 {
                    let [expected, found] = [expected[axis], found[axis]];
                    // Signs of zeros show in no correction of the finest level.
                    let agrees =
                        if is_software { expected == found } else { (expected - found).abs() <= 1e-4 * greatest };
                    assert!(agrees, "row {row}: {expected} {found}");
                }
            }
        }
    }

    /// A long row in a network that is swept often takes too many iterations. Fails if `MAX_ROW` is
    /// 65 000.
    #[test]
    fn iterations_are_counted() {
        let step = |kind, n_rows| Step { kind, first_row: 0, n_rows, half: 0, relaxation: 1.0, momentum: 0.0 };
        // 300 rows of three springs, but for the last one of 1000; transfers of one entry each.
        let starts = |of: fn(u32) -> u32| (0..=300).map(of).collect::<Vec<u32>>();
        let lists =
            [starts(|row| if row == 300 { 3 * 299 + 1000 } else { 3 * row }), starts(|row| row), starts(|row| row)];
        let joined = |steps| Joined {
            packed: Vec::new(),
            steps,
            row_start: lists.concat(),
            entries: Vec::new(),
            constraint: Vec::new(),
            load: vec![[0.0; 4]; 300],
        };
        // The step itself, and for each round of 256 rows the round and its longest row.
        for (kind, expected) in [
            (kind::FIRST_SWEEP, 1 + 2),
            (kind::RELAX_SWEEP, 1 + 2 + 3 + 1000),
            (kind::DEFECT, 1 + 2 + 3 + 1000),
            (kind::RECEIVE, 1 + 2 + 2),
            (kind::PROLONG, 1 + 2 + 2),
        ] {
            assert_eq!(joined(vec![step(kind, 300); 7]).iterations(), 7 * expected, "{kind}");
        }
        let sweeps = |n: usize| joined(vec![step(kind::RELAX_SWEEP, 300); n]);
        // 59 sweeps of 1006 iterations are below 60 000, 60 are not. The two halves of 300
        // corrections take 9600 bytes.
        for (n, max_bytes, expected) in [(59, 9600, true), (60, 9600, false), (59, 9599, false)] {
            assert_eq!(sweeps(n).fits(max_bytes), expected, "{n} {max_bytes}");
        }
    }
}
