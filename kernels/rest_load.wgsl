// Loads of springs whose rest edges turn with their ends. One invocation per row.
//
// rest_i = sum_j k_ij ((R_i + R_j) / 2 - 1) (X_i - X_j), with k over the row's total.
//
// The rows of a chunk, without those beside held vertices; or a list of rows beside held vertices,
// with springs of their own.

struct Params {
    first_row: u32,
    n_rows: u32,
    // 1 if the rows are listed.
    is_listed: u32,
    padding: u32,
    // One over the unit of the loads, in the unit of the positions.
    scale: f64,
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
@group(0) @binding(3) var<storage, read> stiffness: array<f64>;
// The listed rows [n_rows].
@group(0) @binding(4) var<storage, read> rows: array<u32>;
// Undeformed position of each place [n_places * 3].
@group(0) @binding(5) var<storage, read> positions: array<f64>;
// Quaternion of each place [n_places].
@group(0) @binding(6) var<storage, read> turns: array<vec4<f64>>;
// w = anchor over the total of each row [n_vertices]: not zero beside held vertices.
@group(0) @binding(7) var<storage, read> load: array<vec4<f64>>;
// The loads [n_vertices * 3].
@group(0) @binding(8) var<storage, read_write> rest: array<f64>;

fn position(at: u32) -> vec3<f64> {
    let x = 3u * at;
    return vec3<f64>(positions[x], positions[x + 1u], positions[x + 2u]);
}

fn cross_product(a: vec3<f64>, b: vec3<f64>) -> vec3<f64> {
    return vec3<f64>(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

// Half of the displacement of an arm by a rotation.
fn half_displacement(turn: vec4<f64>, arm: vec3<f64>) -> vec3<f64> {
    let t = cross_product(turn.xyz, arm);
    return turn.w * t + cross_product(turn.xyz, t);
}

@compute @workgroup_size(GROUP)
fn rest_load(here: Invocation) {
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
    let own = position(row);
    var by_others = vec3<f64>(0.0);
    var arms = vec3<f64>(0.0);
    let end = row_start[local + 1u];
    for (var i = row_start[local]; i < end; i++) {
        let other = entries[i].column;
        let arm = own - position(other);
        let k = stiffness[i];
        arms += k * arm;
        by_others += k * half_displacement(turns[other], arm);
    }
    let sum = (half_displacement(turns[row], arms) + by_others) * params.scale;
    let x = 3u * row;
    rest[x] = sum.x;
    rest[x + 1u] = sum.y;
    rest[x + 2u] = sum.z;
}
