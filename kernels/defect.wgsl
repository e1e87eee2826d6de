// The projected residual P r of a correction. One invocation per row.

struct Params {
    first_row: u32,
    n_rows: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// P r [n_vertices]; w = 0.
@group(0) @binding(6) var<storage, read_write> rest: array<vec4<f32>>;

@compute @workgroup_size(GROUP)
fn defect(here: Invocation) {
    let local = place(here.group, here.groups, here.lane, GROUP);
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    rest[row] = vec4<f32>(project(row, residual(params.first_row, local)), 0.0);
}
