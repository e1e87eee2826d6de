// The last step of a multigrid cycle whose correction is in f64: acceleration by Chebyshev's
// coefficients.
//
// e_new = e + P (relaxation c + momentum (e - e_previous)), with the correction c of the cycle.
//
// Each workgroup of 256 vertices also finds its largest squared change, in shortest edges. One
// invocation per vertex.

struct Params {
    first_row: u32,
    n_rows: u32,
    // Place of the cycle's first block in `partials`.
    first_partial: u32,
    padding: u32,
    relaxation: f64,
    momentum: f64,
}

@group(0) @binding(0) var<uniform> params: Params;
// Correction of the cycle, which began at zero [n_vertices]; w = 0.
@group(0) @binding(1) var<storage, read> of_cycle: array<vec4<f32>>;
// One over the length of each vertex's shortest edge [n_vertices].
@group(0) @binding(4) var<storage, read> inverse_length: array<f64>;
// The correction before the cycle [n_vertices * 3].
@group(0) @binding(5) var<storage, read> e: array<f64>;
// On entry the correction one cycle earlier, on exit the new correction [n_vertices * 3].
@group(0) @binding(6) var<storage, read_write> e_previous: array<f64>;
// Largest squared change of each block of 256 vertices [cycles of a batch][ceil(n_vertices / 256)];
// LARGEST if the block has a change that is not finite.
@group(0) @binding(7) var<storage, read_write> partials: array<f64>;

@compute @workgroup_size(BLOCK)
fn accelerate_double(here: Invocation) {
    let lane = here.lane;
    let local = place(here.group, here.groups, lane, BLOCK);
    let block = local / BLOCK;
    var change = 0.0lf;
    if (local < params.n_rows) {
        let row = params.first_row + local;
        let x = 3u * row;
        let now = vec3<f64>(e[x], e[x + 1u], e[x + 2u]);
        let earlier = vec3<f64>(e_previous[x], e_previous[x + 1u], e_previous[x + 2u]);
        let found = vec3<f64>(of_cycle[row].xyz);
        let step = project(local, params.relaxation * found + params.momentum * (now - earlier));
        let new_e = now + step;
        e_previous[x] = new_e.x;
        e_previous[x + 1u] = new_e.y;
        e_previous[x + 2u] = new_e.z;
        let d = step * inverse_length[row];
        let squared = d.x * d.x + d.y * d.y + d.z * d.z;
        change = bounded(squared);
    }
    let largest = largest_of_block(lane, change);
    // The last row of workgroups in y may be longer than needed.
    if (lane == 0u && block * BLOCK < params.n_rows) {
        partials[params.first_partial + params.first_row / BLOCK + block] = largest;
    }
}
