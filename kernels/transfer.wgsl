// Transfer between two levels of a multigrid hierarchy, in either direction. One invocation per
// row.
//
// gathered_i = keep gathered_i + P_i sum_j w_ij source_j
//
// The constraints belong to the level that receives.

struct Params {
    first_row: u32,
    n_rows: u32,
    keep: f32,
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
// [n_sources]; w is not used.
@group(0) @binding(4) var<storage, read> source: array<vec4<f32>>;
// [n_targets]; w does not change.
@group(0) @binding(5) var<storage, read_write> gathered: array<vec4<f32>>;

@compute @workgroup_size(GROUP)
fn transfer(here: Invocation) {
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
    let before = gathered[row];
    var kept = vec3<f32>(0.0);
    // What is not kept is not read either: a pass that diverged may have left a NaN.
    if (params.keep != 0.0) {
        kept = before.xyz;
    }
    gathered[row] = vec4<f32>(params.keep * kept + project(row, sum), before.w);
}
