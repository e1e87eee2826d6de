// Residual of a displacement in f64. One invocation per row.
//
// load_i = P (sum_j k_ij (u_j - u_i) + rest_i), with k over the row's total.
//
// The rows of a chunk, without those beside held vertices; or a list of rows beside held vertices,
// with springs of their own.

struct Params {
    first_row: u32,
    n_rows: u32,
    // 1 if the rows are listed.
    is_listed: u32,
    // 1 if the springs have loads of their own.
    has_rest: u32,
}

struct Entry {
    // Place of the spring's other end.
    column: u32,
    // Stiffness of the spring in f32. Not used.
    stiffness: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Start of each row in `entries` and `stiffness` [n_rows + 1].
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<Entry>;
// Stiffness of each spring over the row's total.
@group(0) @binding(4) var<storage, read> stiffness: array<f64>;
// The listed rows [n_rows].
@group(0) @binding(5) var<storage, read> rows: array<u32>;
// Displacement of each place [n_places * 3].
@group(0) @binding(6) var<storage, read> displacement: array<f64>;
// Loads of the springs [n_vertices * 3].
@group(0) @binding(7) var<storage, read> rest: array<f64>;
// On exit xyz = residual [n_vertices]. w = anchor over the row's total, not zero beside held
// vertices; it does not change.
@group(0) @binding(8) var<storage, read_write> load: array<vec4<f64>>;

fn displacement_of(at: u32) -> vec3<f64> {
    let x = 3u * at;
    return vec3<f64>(displacement[x], displacement[x + 1u], displacement[x + 2u]);
}

@compute @workgroup_size(GROUP)
fn residual_double(here: Invocation) {
    let local = place(here.group, here.groups, here.lane, GROUP);
    if (local >= params.n_rows) {
        return;
    }
    var row = params.first_row + local;
    if (params.is_listed == 1u) {
        row = rows[local];
    } else if (load[row].w != 0.0lf) {
        return;
    }
    let own = displacement_of(row);
    var sum = vec3<f64>(0.0);
    let end = row_start[local + 1u];
    for (var i = row_start[local]; i < end; i++) {
        sum += stiffness[i] * (displacement_of(entries[i].column) - own);
    }
    if (params.has_rest == 1u) {
        let x = 3u * row;
        sum += vec3<f64>(rest[x], rest[x + 1u], rest[x + 2u]);
    }
    load[row] = vec4<f64>(project(row, sum), load[row].w);
}
