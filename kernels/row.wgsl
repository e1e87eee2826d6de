// What the kernels that walk the rows of a spring network share: its bindings, the residual of a row and the
// projection on a vertex's constraint. Prepended to relax_sweep.wgsl and convergence.wgsl.

struct Entry {
    // The neighbour.
    column: u32,
    // Stiffness of the spring to it, >= 0; each row carries its own power of two.
    stiffness: f32,
}

// Where each row of this chunk starts in `entries` [n_rows + 1]; counted from the chunk's first entry.
@group(0) @binding(1) var<storage, read> row_start: array<u32>;
@group(0) @binding(2) var<storage, read> entries: array<Entry>;
// Per vertex [n_vertices]: xyz = unit normal or direction, w = one of the kinds below.
@group(0) @binding(3) var<storage, read> constraint: array<vec4<f32>>;
// Per vertex [n_vertices]: xyz = load, a displacement; w = anchor, a stiffness.
@group(0) @binding(4) var<storage, read> load: array<vec4<f32>>;
// Correction [n_vertices]; w = 0. array<vec3<f32>> would have stride 16 too, with a hole.
@group(0) @binding(5) var<storage, read> e: array<vec4<f32>>;

const FREE = 0.0;
const HELD = 1.0;
const IN_PLANE = 2.0;
const ON_LINE = 3.0;

// r_i = (sum_j k_ij (e_j - e_i) - anchor_i e_i) / (sum_j k_ij + anchor_i) + load_i; zero in a row without stiffness.
//
// Differences, not a weighted mean: where e is smooth the mean of neighbours would cancel against e_i in f32.
fn residual(first_row: u32, local: u32) -> vec3<f32> {
    let row = first_row + local;
    let own = e[row].xyz;
    var sum = vec3<f32>(0.0);
    var total = 0.0;
    let end = row_start[local + 1u];
    for (var i = row_start[local]; i < end; i++) {
        let entry = entries[i];
        sum += entry.stiffness * (e[entry.column].xyz - own);
        total += entry.stiffness;
    }
    let pull = load[row];
    sum -= pull.w * own;
    total += pull.w;
    // Equality, not `total > 0`: a NaN must go on into the result, where the measure finds it.
    if (total == 0.0) {
        return vec3<f32>(0.0);
    }
    return sum / total + pull.xyz;
}

// The part of a vector its vertex may follow.
fn project(row: u32, v: vec3<f32>) -> vec3<f32> {
    let c = constraint[row];
    let along = c.x * v.x + c.y * v.y + c.z * v.z;
    if (c.w == FREE) {
        return v;
    }
    if (c.w == IN_PLANE) {
        return v - along * c.xyz;
    }
    if (c.w == ON_LINE) {
        return along * c.xyz;
    }
    return vec3<f32>(0.0);
}
