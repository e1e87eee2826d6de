// What a correction leaves of the load: P r. One invocation per row. Needs constraint.wgsl and row.wgsl before it.

struct Params {
    first_row: u32,
    n_rows: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// P r [n_vertices]; w = 0.
@group(0) @binding(6) var<storage, read_write> rest: array<vec4<f32>>;

@compute @workgroup_size(64)
fn defect(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let local = (group.y * groups.x + group.x) * 64u + lane;
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    rest[row] = vec4<f32>(project(row, residual(params.first_row, local)), 0.0);
}
