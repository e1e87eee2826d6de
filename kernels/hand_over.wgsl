// Hands the load of the next cycle over: the residual of the correction, computed in f64 and
// rounded to f32. One invocation per row.
//
// handed_i = P (sum_j k_ij (e_j - e_i) - anchor_i e_i + load_i), with k and anchor over the row's
// total.

struct Params {
    first_row: u32,
    n_rows: u32,
    // 1 if the correction is zero everywhere. The residual is then the load, and no spring is read.
    is_zero: u32,
    padding: u32,
}

struct Entry {
    // The neighbour at the spring's other end.
    column: u32,
    // Stiffness of the spring in f32. Not used.
    stiffness: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Start of each of this chunk's rows in `entries` and `stiffness` [n_rows + 1], counted from the
// chunk's first entry.
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<Entry>;
// Stiffness of each spring over the row's total.
@group(0) @binding(4) var<storage, read> stiffness: array<f64>;
// Per row of the chunk [n_rows]: xyz = load, in the unit of a displacement; w = anchor over the
// row's total. `constraint` is that of the chunk's rows too.
@group(0) @binding(5) var<storage, read> load: array<vec4<f64>>;
// Correction [n_vertices * 3].
@group(0) @binding(6) var<storage, read> e: array<f64>;
// The load of the cycle [n_vertices]; w does not change.
@group(0) @binding(7) var<storage, read_write> handed: array<vec4<f32>>;

fn correction(row: u32) -> vec3<f64> {
    let x = 3u * row;
    return vec3<f64>(e[x], e[x + 1u], e[x + 2u]);
}

@compute @workgroup_size(GROUP)
fn hand_over(here: Invocation) {
    let local = place(here.group, here.groups, here.lane, GROUP);
    if (local >= params.n_rows) {
        return;
    }
    let row = params.first_row + local;
    let pull = load[local];
    var left = pull.xyz;
    if (params.is_zero == 0u) {
        let own = correction(row);
        var sum = vec3<f64>(0.0);
        let end = row_start[local + 1u];
        for (var i = row_start[local]; i < end; i++) {
            sum += stiffness[i] * (correction(entries[i].column) - own);
        }
        left = sum - pull.w * own + pull.xyz;
    }
    handed[row] = vec4<f32>(vec3<f32>(project(local, left)), handed[row].w);
}
