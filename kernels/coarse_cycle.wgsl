// The coarse levels of a multigrid cycle, one step after another: what `first_sweep`,
// `relax_sweep`, `defect` and `transfer` compute on each of them, in one dispatch of one workgroup.
// An invocation takes every 256th row of a step. All rows of a step are done before the next step.
//
// The arrays of all levels are joined, finest level first. A row and a column are places in the
// joined arrays.

struct Params {
    n_steps: u32,
    // Rows of all levels together.
    n_rows: u32,
}

struct Step {
    // One of the kinds below.
    kind: u32,
    // The rows of a level.
    first_row: u32,
    n_rows: u32,
    // Which half of `e` the step begins with: 0 or 1.
    half: u32,
    relaxation: f32,
    momentum: f32,
}

struct Entry {
    column: u32,
    // Stiffness of a spring over the row's total stiffness, or the weight of a transfer.
    value: f32,
}

const LANES = 256u;

// e_new = P (relaxation * load), e = 0
const FIRST_SWEEP = 0u;
// e_new = e + P (relaxation * r + momentum * (e - e_previous))
const RELAX_SWEEP = 1u;
// The other half = P r
const DEFECT = 2u;
// load = P sum_j w_ij defect_j, with the defect of the level above these levels
const RECEIVE = 3u;
// load = P sum_j w_ij defect_j, with the defect of the next finer level
const RESTRICT = 4u;
// e = e + P sum_j w_ij e_j, with the correction of the next coarser level
const PROLONG = 5u;

@group(0) @binding(0) var<uniform> params: Params;
// Start of each row in `entries`: of the springs [n_rows + 1], of the transfers to the loads
// [n_rows + 1], and of the transfers to the corrections [n_rows + 1].
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<Entry>;
// Per vertex [n_rows]: xyz = load, in the unit of a displacement; w = anchor over the row's total.
@group(0) @binding(4) var<storage, read_write> load: array<vec4<f32>>;
// Two halves [2][n_rows], which sweeps exchange: the correction, and the correction one sweep
// earlier or the defect. At the end the first half is the correction. w = 0.
@group(0) @binding(5) var<storage, read_write> e: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read> steps: array<Step>;
// The defect of the level above these levels; w is not used.
@group(0) @binding(7) var<storage, read> finer: array<vec4<f32>>;

fn residual(now: u32, row: u32) -> vec3<f32> {
    let own = e[now + row].xyz;
    var sum = vec3<f32>(0.0);
    let end = row_start[row + 1u];
    for (var i = row_start[row]; i < end; i++) {
        let entry = entries[i];
        sum += entry.value * (e[now + entry.column].xyz - own);
    }
    let pull = load[row];
    return sum - pull.w * own + pull.xyz;
}

// sum_j w_ij e_j, with entries from the place `start` of `row_start`.
fn gather(half: u32, start: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    let end = row_start[start + 1u];
    for (var i = row_start[start]; i < end; i++) {
        sum += entries[i].value * e[half + entries[i].column].xyz;
    }
    return sum;
}

fn gather_finer(start: u32) -> vec3<f32> {
    var sum = vec3<f32>(0.0);
    let end = row_start[start + 1u];
    for (var i = row_start[start]; i < end; i++) {
        sum += entries[i].value * finer[entries[i].column].xyz;
    }
    return sum;
}

fn run(step: Step, row: u32) {
    let now = step.half * params.n_rows;
    let other = (1u - step.half) * params.n_rows;
    let to_load = params.n_rows + 1u + row;
    let to_correction = 2u * (params.n_rows + 1u) + row;
    switch step.kind {
        case FIRST_SWEEP: {
            e[now + row] = vec4<f32>(0.0);
            e[other + row] = vec4<f32>(project(row, step.relaxation * load[row].xyz), 0.0);
        }
        case RELAX_SWEEP: {
            let own = e[now + row].xyz;
            let change = own - e[other + row].xyz;
            let update = step.relaxation * residual(now, row) + step.momentum * change;
            e[other + row] = vec4<f32>(own + project(row, update), 0.0);
        }
        case DEFECT: {
            e[other + row] = vec4<f32>(project(row, residual(now, row)), 0.0);
        }
        case RECEIVE: {
            load[row] = vec4<f32>(project(row, gather_finer(to_load)), load[row].w);
        }
        case RESTRICT: {
            load[row] = vec4<f32>(project(row, gather(now, to_load)), load[row].w);
        }
        default: {
            // The correction of the coarser level is in the first half.
            e[now + row] = vec4<f32>(e[now + row].xyz + project(row, gather(0u, to_correction)), 0.0);
        }
    }
}

@compute @workgroup_size(LANES)
fn coarse_cycle(here: Invocation) {
    for (var at = 0u; at < params.n_steps; at++) {
        let step = steps[at];
        for (var local = here.lane; local < step.n_rows; local += LANES) {
            run(step, step.first_row + local);
        }
        storageBarrier();
    }
}
