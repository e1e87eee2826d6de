// The first sweep over a spring network from a correction of zero. The residual is then the load,
// and no spring is read. One invocation per row.
//
// e_new = P (relaxation * load), e = 0

struct Params {
    first_row: u32,
    n_rows: u32,
    relaxation: f32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Per vertex [n_vertices]: xyz = load, in the unit of a displacement.
@group(0) @binding(4) var<storage, read> load: array<vec4<f32>>;
// On exit zero [n_vertices].
@group(0) @binding(5) var<storage, read_write> e: array<vec4<f32>>;
// On exit e_new [n_vertices]; w = 0.
@group(0) @binding(6) var<storage, read_write> e_previous: array<vec4<f32>>;

@compute @workgroup_size(GROUP)
fn first_sweep(here: Invocation) {
    let local = place(here.group, here.groups, here.lane, GROUP);
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    e[row] = vec4<f32>(0.0);
    e_previous[row] = vec4<f32>(project(row, params.relaxation * load[row].xyz), 0.0);
}
