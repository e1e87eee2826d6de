// Rows of a spring network: bindings and the residual of a row, shared by several kernels.

struct Entry {
    // The neighbour at the spring's other end.
    column: u32,
    // Stiffness of the spring over the row's total stiffness.
    stiffness: f32,
}

// Start of each of this chunk's rows in `entries` [n_rows + 1], counted from the chunk's first
// entry.
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<Entry>;
// Per vertex [n_vertices]: xyz = load, in the unit of a displacement; w = anchor over the row's
// total.
@group(0) @binding(4) var<storage, read> load: array<vec4<f32>>;
// Correction [n_vertices]; w = 0. array<vec3<f32>> would also have stride 16, with an unused
// component.
@group(0) @binding(5) var<storage, read> e: array<vec4<f32>>;

// r_i = sum_j k_ij (e_j - e_i) - anchor_i e_i + load_i, with k and anchor over the row's total.
//
// Differences are summed instead of a weighted mean: where e is smooth, the mean of the neighbours
// would cancel against e_i in f32.
fn residual(first_row: u32, local: u32) -> vec3<f32> {
    let row = first_row + local;
    let own = e[row].xyz;
    var sum = vec3<f32>(0.0);
    let end = row_start[local + 1u];
    for (var i = row_start[local]; i < end; i++) {
        let entry = entries[i];
        sum += entry.stiffness * (e[entry.column].xyz - own);
    }
    let pull = load[row];
    return sum - pull.w * own + pull.xyz;
}
