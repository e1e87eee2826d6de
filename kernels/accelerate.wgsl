// The last step of a multigrid cycle: acceleration by Chebyshev's coefficients.
//
// e_new = start + P (relaxation (e - start) + momentum (start - previous))
//
// Each workgroup of 256 vertices also finds its largest squared change, in shortest edges. One
// invocation per vertex.

struct Params {
    n_vertices: u32,
    relaxation: f32,
    momentum: f32,
    // Place of the cycle's first block in `partials`.
    first_partial: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// The correction before the cycle, and one cycle earlier [n_vertices].
@group(0) @binding(1) var<storage, read> start: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> previous: array<vec4<f32>>;
// One over the length of each vertex's shortest edge [n_vertices].
@group(0) @binding(4) var<storage, read> inverse_length: array<f32>;
// On entry the correction at the end of the cycle, on exit the new correction [n_vertices]; w = 0.
@group(0) @binding(5) var<storage, read_write> e: array<vec4<f32>>;
// Largest squared change of each block of 256 vertices [cycles of a batch][ceil(n_vertices / 256)].
@group(0) @binding(6) var<storage, read_write> partials: array<f32>;

const BLOCK = 256u;

// Bits of numbers >= 0, which have the order of the numbers, with NaN above infinity. WGSL's max
// would drop a NaN.
var<workgroup> largest: array<u32, BLOCK>;

@compute @workgroup_size(BLOCK)
fn accelerate(here: Invocation) {
    let lane = here.lane;
    let row = place(here.group, here.groups, lane, BLOCK);
    let block = row / BLOCK;
    var change = 0.0;
    if (row < params.n_vertices) {
        let origin = start[row].xyz;
        let update = params.relaxation * (e[row].xyz - origin) + params.momentum * (origin - previous[row].xyz);
        let step = project(row, update);
        e[row] = vec4<f32>(origin + step, 0.0);
        let d = step * inverse_length[row];
        change = d.x * d.x + d.y * d.y + d.z * d.z;
    }
    largest[lane] = bitcast<u32>(change) & 0x7fffffffu;
    workgroupBarrier();
    for (var half = BLOCK / 2u; half > 0u; half /= 2u) {
        if (lane < half) {
            largest[lane] = max(largest[lane], largest[lane + half]);
        }
        workgroupBarrier();
    }
    // The last row of workgroups in y may be longer than needed.
    if (lane == 0u && block * BLOCK < params.n_vertices) {
        partials[params.first_partial + block] = bitcast<f32>(largest[0]);
    }
}
