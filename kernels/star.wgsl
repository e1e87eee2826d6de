// The tets around moving vertices, shared by the kernels of local optimisation: bindings, and the
// reach of a vertex.

// Start of each moving vertex's tets in `vertex_tets` [n_moving + 1].
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
// Tets around each moving vertex, each stored as tet * 4 + local vertex.
@group(0) @binding(2) var<storage, read> vertex_tets: array<u32>;
// Vertices of each tet [n_tets].
@group(0) @binding(4) var<storage, read> tets: array<vec4<u32>>;
// A matrix of each tet at zero correction [n_tets * 9], its columns one after another. Each kernel
// defines its matrix.
@group(0) @binding(5) var<storage, read> base: array<f32>;
// Displacement of each vertex since `base` was taken [n_vertices], the moving vertices first;
// w = 0.
@group(0) @binding(6) var<storage, read_write> correction: array<vec4<f32>>;

// A ball for each moving vertex [n_moving]: xyz = centre, from the same origin as a correction; w =
// radius, at most 1e18. The vertex stays inside the ball.
@group(0) @binding(8) var<storage, read> reach: array<vec4<f32>>;

const HALVINGS = 8u;

// The point of the vertex's ball that is nearest to `at`.
fn within(vertex: u32, at: vec3<f32>) -> vec3<f32> {
    let ball = reach[vertex];
    let away = at - ball.xyz;
    let squared = dot3(away, away);
    if (squared > ball.w * ball.w) {
        return ball.xyz + away * (ball.w / sqrt(squared));
    }
    return at;
}

fn column_of(tet: u32, column: u32) -> vec3<f32> {
    let first = 9u * tet + 3u * column;
    return vec3<f32>(base[first], base[first + 1u], base[first + 2u]);
}
