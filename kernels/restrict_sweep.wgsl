// The load of a coarser level of a multigrid hierarchy, from the defect of the next finer level,
// and the level's first sweep from a correction of zero. One invocation per row.
//
// load_i = P_i sum_j w_ij defect_j, e_new = P (relaxation * load), e = 0

struct Params {
    first_row: u32,
    n_rows: u32,
    relaxation: f32,
    padding: u32,
}

struct Weight {
    // The source vertex.
    column: u32,
    weight: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Start of each of this chunk's rows in `weights` [n_rows + 1], counted from the chunk's first
// entry.
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<Weight>;
// Defect of the finer level [n_sources]; w is not used.
@group(0) @binding(4) var<storage, read> source: array<vec4<f32>>;
// Per vertex [n_targets]: xyz = load, in the unit of a displacement; w does not change.
@group(0) @binding(5) var<storage, read_write> load: array<vec4<f32>>;
// On exit zero [n_targets].
@group(0) @binding(6) var<storage, read_write> e: array<vec4<f32>>;
// On exit e_new [n_targets]; w = 0.
@group(0) @binding(7) var<storage, read_write> e_previous: array<vec4<f32>>;

@compute @workgroup_size(GROUP)
fn restrict_sweep(here: Invocation) {
    let local = place(here.group, here.groups, here.lane, GROUP);
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    var sum = vec3<f32>(0.0);
    let end = row_start[local + 1u];
    for (var i = row_start[local]; i < end; i++) {
        sum += weights[i].weight * source[weights[i].column].xyz;
    }
    let own = project(row, sum);
    load[row] = vec4<f32>(own, load[row].w);
    e[row] = vec4<f32>(0.0);
    e_previous[row] = vec4<f32>(project(row, params.relaxation * own), 0.0);
}
