// The end of a pass: its correction is added to the displacement. One invocation per vertex.
//
// u_i <- u_i + P e_i
//
// Each workgroup of 256 vertices also finds its largest squared correction, in shortest edges.

struct Params {
    n_vertices: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Correction [n_vertices * 3].
@group(0) @binding(1) var<storage, read> e: array<f64>;
// One over the length of each vertex's shortest edge [n_vertices].
@group(0) @binding(2) var<storage, read> inverse_length: array<f64>;
// Displacement of each place [n_places * 3]; the vertices come first.
@group(0) @binding(4) var<storage, read_write> displacement: array<f64>;
// Largest squared correction of each block of 256 vertices [ceil(n_vertices / 256)]; LARGEST if the
// block has a correction that is not finite.
@group(0) @binding(5) var<storage, read_write> partials: array<f64>;

@compute @workgroup_size(BLOCK)
fn add_correction(here: Invocation) {
    let row = place(here.group, here.groups, here.lane, BLOCK);
    var change = 0.0lf;
    if (row < params.n_vertices) {
        let x = 3u * row;
        let correction = vec3<f64>(e[x], e[x + 1u], e[x + 2u]);
        let allowed = project(row, correction);
        displacement[x] += allowed.x;
        displacement[x + 1u] += allowed.y;
        displacement[x + 2u] += allowed.z;
        let d = correction * inverse_length[row];
        change = bounded(d.x * d.x + d.y * d.y + d.z * d.z);
    }
    let largest = largest_of_block(here.lane, change);
    // The last row of workgroups in y may be longer than needed.
    if (here.lane == 0u && row < params.n_vertices) {
        partials[row / BLOCK] = largest;
    }
}
