// Measures of the distance of a network from equilibrium. One invocation per row.
//
// Each workgroup of 256 rows finds the sum of |P r|^2, and the largest squared change since the
// snapshot, in shortest edges.

struct Params {
    first_row: u32,
    n_rows: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// e at the last measure [n_vertices].
@group(0) @binding(6) var<storage, read> snapshot: array<vec4<f32>>;
// One over the length of each vertex's shortest edge [n_vertices].
@group(0) @binding(7) var<storage, read> inverse_length: array<f32>;
// Sum of |P r|^2 and largest squared change of each block of 256 rows [ceil(n_vertices / 256)].
@group(0) @binding(8) var<storage, read_write> partials: array<vec2<f32>>;

const BLOCK = 256u;

var<workgroup> sums: array<f32, BLOCK>;
// Bits of numbers >= 0, which have the order of the numbers, with NaN above infinity. WGSL's max
// would drop a NaN.
var<workgroup> largest: array<u32, BLOCK>;

@compute @workgroup_size(BLOCK)
fn convergence(here: Invocation) {
    let lane = here.lane;
    let local = place(here.group, here.groups, lane, BLOCK);
    let block = local / BLOCK;
    var sum = 0.0;
    var change = 0.0;
    if (local < params.n_rows) {
        let row = params.first_row + local;
        let r = project(row, residual(params.first_row, local));
        sum = r.x * r.x + r.y * r.y + r.z * r.z;
        let d = (e[row].xyz - snapshot[row].xyz) * inverse_length[row];
        change = d.x * d.x + d.y * d.y + d.z * d.z;
    }
    sums[lane] = sum;
    largest[lane] = bitcast<u32>(change) & 0x7fffffffu;
    workgroupBarrier();
    for (var half = BLOCK / 2u; half > 0u; half /= 2u) {
        if (lane < half) {
            sums[lane] += sums[lane + half];
            largest[lane] = max(largest[lane], largest[lane + half]);
        }
        workgroupBarrier();
    }
    // The last row of workgroups in y may be longer than needed.
    if (lane == 0u && block * BLOCK < params.n_rows) {
        partials[params.first_row / BLOCK + block] = vec2<f32>(sums[0], bitcast<f32>(largest[0]));
    }
}
