// Sums of squares of a residual. One invocation per vertex, one sum per block of 256 vertices.

struct Params {
    n_vertices: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// xyz = residual [n_vertices].
@group(0) @binding(1) var<storage, read> load: array<vec4<f64>>;
// Sum of each block [ceil(n_vertices / 256)]; LARGEST if it is not finite.
@group(0) @binding(2) var<storage, read_write> partials: array<f64>;

@compute @workgroup_size(BLOCK)
fn squares(here: Invocation) {
    let row = place(here.group, here.groups, here.lane, BLOCK);
    var sum = 0.0lf;
    if (row < params.n_vertices) {
        let r = load[row];
        sum = r.x * r.x + r.y * r.y + r.z * r.z;
    }
    let of_block = sum_of_block(here.lane, sum);
    // The last row of workgroups in y may be longer than needed.
    if (here.lane == 0u && row < params.n_vertices) {
        partials[row / BLOCK] = bounded(of_block);
    }
}
