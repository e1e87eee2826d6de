// One sweep over a spring network: e_new = e + P (relaxation * r + momentum * (e - e_previous)).
// One invocation per row. Needs row.wgsl before it.

struct Params {
    first_row: u32,
    n_rows: u32,
    relaxation: f32,
    momentum: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// On entry e_previous, on exit e_new [n_vertices]: a row reads no other row of it, so no third array is needed.
@group(0) @binding(6) var<storage, read_write> e_previous: array<vec4<f32>>;

@compute @workgroup_size(64)
fn relax_sweep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    // Groups fill the x dimension first, then y: one dimension holds 65 535 of them.
    let local = (group.y * groups.x + group.x) * 64u + lane;
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    let own = e[row].xyz;
    let change = own - e_previous[row].xyz;
    let update = params.relaxation * residual(params.first_row, local) + params.momentum * change;
    e_previous[row] = vec4<f32>(own + project(row, update), 0.0);
}
