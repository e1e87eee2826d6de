// One Newton step of local optimisation: a vertex moves to lower E, all others fixed.
//
// E = sum over its tets of (27 q w^size)^power, q = f^3 / (27 h^2), w = (h + 1 / h) / 2
//
// For a tet with edge vectors A (columns) and target W: S = A W^-1, f = |S|_F^2, sigma = det S, r =
// sqrt(sigma^2 + 4 delta^2), h = (sigma + r) / 2. `base` holds S.
//
// One invocation per vertex of a colour. Vertices of one dispatch share no tet, so `correction` is
// updated in place.

struct Params {
    first: u32,
    n_vertices: u32,
    // 1 to 15.
    power: u32,
    // 0 to 15; 0: only the shape counts.
    size: u32,
    // With 0 all tets are valid and must stay valid.
    delta_squared: f32,
    // A vertex stays if its step would lower E by less than this fraction.
    tolerance: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
// W^-1 of each tet [n_tets * 9], its rows one after another.
@group(0) @binding(7) var<storage, read> inverse_target: array<f32>;

const SHIFTS = 6u;

struct Shape {
    // Columns of S.
    s0: vec3<f32>,
    s1: vec3<f32>,
    s2: vec3<f32>,
    // Gradient of each column with respect to the vertex. All components of a column have the same
    // gradient.
    g: vec3<f32>,
    // s0 x s1.
    normal: vec3<f32>,
    f: f32,
    sigma: f32,
}

struct Local {
    energy: f32,
    gradient: vec3<f32>,
    // xx, yy, zz of the Hessian.
    diagonal: vec3<f32>,
    // xy, xz, yz of the Hessian.
    off_diagonal: vec3<f32>,
    // Mean height of the target tets over the face opposite the vertex.
    size: f32,
}

// `x^n` for `n` from 0 to 15.
fn power(x: f32, n: u32) -> f32 {
    let squared = x * x;
    let fourth = squared * squared;
    var result = 1.0;
    if ((n & 1u) != 0u) {
        result = x;
    }
    if ((n & 2u) != 0u) {
        result *= squared;
    }
    if ((n & 4u) != 0u) {
        result *= fourth;
    }
    if ((n & 8u) != 0u) {
        result *= fourth * fourth;
    }
    return result;
}

fn row_of(tet: u32, row: u32) -> vec3<f32> {
    let first = 9u * tet + 3u * row;
    return vec3<f32>(inverse_target[first], inverse_target[first + 1u], inverse_target[first + 2u]);
}

// A tet with one of its vertices at `at`.
fn shape_of(entry: u32, at: vec3<f32>) -> Shape {
    let tet = entry / 4u;
    let local = entry % 4u;
    let corners = tets[tet];
    let c0 = select(correction[corners.x].xyz, at, local == 0u);
    let d1 = select(correction[corners.y].xyz, at, local == 1u) - c0;
    let d2 = select(correction[corners.z].xyz, at, local == 2u) - c0;
    let d3 = select(correction[corners.w].xyz, at, local == 3u) - c0;
    let w0 = row_of(tet, 0u);
    let w1 = row_of(tet, 1u);
    let w2 = row_of(tet, 2u);
    var shape: Shape;
    shape.s0 = column_of(tet, 0u) + d1 * w0.x + d2 * w1.x + d3 * w2.x;
    shape.s1 = column_of(tet, 1u) + d1 * w0.y + d2 * w1.y + d3 * w2.y;
    shape.s2 = column_of(tet, 2u) + d1 * w0.z + d2 * w1.z + d3 * w2.z;
    if (local == 0u) {
        shape.g = -(w0 + w1 + w2);
    } else if (local == 1u) {
        shape.g = w0;
    } else if (local == 2u) {
        shape.g = w1;
    } else {
        shape.g = w2;
    }
    shape.normal = cross3(shape.s0, shape.s1);
    shape.f = dot3(shape.s0, shape.s0) + dot3(shape.s1, shape.s1) + dot3(shape.s2, shape.s2);
    shape.sigma = dot3(shape.normal, shape.s2);
    return shape;
}

// r and h. h is computed without cancellation.
fn regularised(sigma: f32) -> vec2<f32> {
    let r = sqrt(sigma * sigma + 4.0 * params.delta_squared);
    if (sigma > 0.0) {
        return vec2<f32>(r, 0.5 * (sigma + r));
    }
    return vec2<f32>(r, 2.0 * params.delta_squared / (r - sigma));
}

// 27 q w^size.
fn measure(f: f32, h: f32) -> f32 {
    let to_h = f / h;
    return to_h * to_h * f * power(0.5 * (h + 1.0 / h), params.size);
}

// 27 q w^size, or -1 if it is infinite.
fn quality_of(entry: u32, at: vec3<f32>) -> f32 {
    let shape = shape_of(entry, at);
    if (params.delta_squared == 0.0 && shape.sigma <= 0.0) {
        return -1.0;
    }
    return measure(shape.f, regularised(shape.sigma).y);
}

// Greatest 27 q w^size around a vertex, or -1 if one is infinite. E is computed from the quotients
// by this number, so powers stay in the range of f32.
fn greatest_quality(first: u32, end: u32, at: vec3<f32>) -> f32 {
    var greatest = 0.0;
    for (var i = first; i < end; i++) {
        let q = quality_of(vertex_tets[i], at);
        if (q < 0.0) {
            return -1.0;
        }
        greatest = max(greatest, q);
    }
    return greatest;
}

// E around a vertex, or -1 if it is infinite.
fn energy(first: u32, end: u32, at: vec3<f32>, scale: f32) -> f32 {
    var sum = 0.0;
    for (var i = first; i < end; i++) {
        let q = quality_of(vertex_tets[i], at);
        if (q < 0.0) {
            return -1.0;
        }
        sum += power(q * scale, params.power);
    }
    return sum;
}

fn derivatives(first: u32, end: u32, at: vec3<f32>, scale: f32) -> Local {
    let m = f32(params.power);
    let size = f32(params.size);
    var local: Local;
    var count = 0.0;
    for (var i = first; i < end; i++) {
        let shape = shape_of(vertex_tets[i], at);
        let g = shape.g;
        let r_h = regularised(shape.sigma);
        let f = shape.f;
        let h = r_h.y;
        let weight = power(measure(f, h) * scale, params.power);
        let of_f = 2.0 * (shape.s0 * g.x + shape.s1 * g.y + shape.s2 * g.z);
        let cofactor0 = cross3(shape.s1, shape.s2);
        let cofactor1 = cross3(shape.s2, shape.s0);
        let of_sigma = cofactor0 * g.x + cofactor1 * g.y + shape.normal * g.z;
        let to_f = 1.0 / f;
        let to_r = 1.0 / r_h.x;
        // d ln w / d ln h, and - d ln (q w^size) / d ln h.
        let h_squared = h * h;
        let to_one = 1.0 / (h_squared + 1.0);
        let grows = (h_squared - 1.0) * to_one;
        let of_h = 2.0 - size * grows;
        // Gradient of ln (q w^size), and the factors of its Hessian's parts.
        let a = 3.0 * to_f * of_f - of_h * to_r * of_sigma;
        let g_squared = dot3(g, g);
        let by_unit = 6.0 * g_squared * to_f;
        let by_f = 3.0 * to_f * to_f;
        let of_size = size * (1.0 - grows * grows);
        let by_sigma = (of_h * (shape.sigma * to_r) + of_size) * to_r * to_r;
        local.energy += weight;
        let by_weight = weight * m;
        local.gradient += by_weight * a;
        let of_log = by_unit + by_sigma * (of_sigma * of_sigma) - by_f * (of_f * of_f);
        local.diagonal += by_weight * (m * (a * a) + of_log);
        let mixed = by_sigma * (of_sigma.xxy * of_sigma.yzz) - by_f * (of_f.xxy * of_f.yzz);
        local.off_diagonal += by_weight * (m * (a.xxy * a.yzz) + mixed);
        local.size += 1.0 / sqrt(g_squared);
        count += 1.0;
    }
    local.size /= count;
    return local;
}

// The Newton step in the subspace of the constraint, by Cholesky's factors of the Hessian plus a
// shift. The shift is the least one tried for which the factors exist; the step is zero if they
// exist for no shift.
fn newton(vertex: u32, local: Local) -> vec3<f32> {
    let c = constraint[vertex];
    var d = local.diagonal;
    var o = local.off_diagonal;
    let gradient = project(vertex, local.gradient);
    let of_diagonal = abs(d.x) + abs(d.y) + abs(d.z);
    let size = of_diagonal + 2.0 * (abs(o.x) + abs(o.y) + abs(o.z));
    let n = c.xyz;
    // P H P. The directions that P removes get the Hessian's size instead.
    let v = vec3<f32>(
        d.x * n.x + o.x * n.y + o.y * n.z,
        o.x * n.x + d.y * n.y + o.z * n.z,
        o.y * n.x + o.z * n.y + d.z * n.z,
    );
    let along = n.x * v.x + n.y * v.y + n.z * v.z;
    if (c.w == IN_PLANE) {
        let k = along + size;
        d = d - 2.0 * (n * v) + k * (n * n);
        o = o - (n.xxy * v.yzz + n.yzz * v.xxy) + k * (n.xxy * n.yzz);
    }
    if (c.w == ON_LINE) {
        let k = along - size;
        d = size + k * (n * n);
        o = k * (n.xxy * n.yzz);
    }
    var shift = 0.0;
    for (var attempt = 0u; attempt < SHIFTS; attempt++) {
        let a = d.x + shift;
        if (a > 0.0) {
            let l11 = sqrt(a);
            let l21 = o.x / l11;
            let l31 = o.y / l11;
            let b = d.y + shift - l21 * l21;
            if (b > 0.0) {
                let l22 = sqrt(b);
                let l32 = (o.z - l31 * l21) / l22;
                let e = d.z + shift - l31 * l31 - l32 * l32;
                if (e > 0.0) {
                    let l33 = sqrt(e);
                    let p = -gradient.x / l11;
                    let q = (-gradient.y - l21 * p) / l22;
                    let r = (-gradient.z - l31 * p - l32 * q) / l33;
                    let z = r / l33;
                    let y = (q - l32 * z) / l22;
                    let x = (p - l21 * y - l31 * z) / l11;
                    return vec3<f32>(x, y, z);
                }
            }
        }
        if (attempt == 0u) {
            shift = 1e-3 * size;
        } else {
            shift = 10.0 * shift;
        }
    }
    return vec3<f32>(0.0);
}

@compute @workgroup_size(GROUP)
fn smooth_vertices(here: Invocation) {
    let index = place(here.group, here.groups, here.lane, GROUP);
    if (index >= params.n_vertices) {
        return;
    }
    let vertex = params.first + index;
    let first = row_start[vertex];
    let end = row_start[vertex + 1u];
    let at = correction[vertex].xyz;
    let greatest = greatest_quality(first, end, at);
    if (!(greatest > 0.0)) {
        return;
    }
    let scale = 1.0 / greatest;
    let local = derivatives(first, end, at, scale);
    var step = project(vertex, newton(vertex, local));
    let falls = -dot3(local.gradient, step) * 0.5;
    // Not `<=`: the test is true for a NaN too, and the vertex stays.
    if (!(falls > params.tolerance * local.energy)) {
        return;
    }
    let length = sqrt(dot3(step, step));
    let longest = 0.5 * local.size;
    if (length > longest) {
        step *= longest / length;
    }
    for (var i = 0u; i < HALVINGS; i++) {
        let trial = within(vertex, at + step);
        let lower = energy(first, end, trial, scale);
        if (lower >= 0.0 && lower < local.energy) {
            correction[vertex] = vec4<f32>(trial, 0.0);
            return;
        }
        step *= 0.5;
    }
}
