// One sweep over a spring network. One invocation per row.
//
// e_new = e + P (relaxation * r + momentum * (e - e_previous))

struct Params {
    first_row: u32,
    n_rows: u32,
    relaxation: f32,
    momentum: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// On entry e_previous, on exit e_new [n_vertices]. A row reads only its own element, so no third
// array is needed.
@group(0) @binding(6) var<storage, read_write> e_previous: array<vec4<f32>>;

@compute @workgroup_size(GROUP)
fn relax_sweep(here: Invocation) {
    let local = place(here.group, here.groups, here.lane, GROUP);
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    let own = e[row].xyz;
    let change = own - e_previous[row].xyz;
    let update = params.relaxation * residual(params.first_row, local) + params.momentum * change;
    e_previous[row] = vec4<f32>(own + project(row, update), 0.0);
}
