// One step that raises the worst beta around some vertices. A vertex takes a gradient step that
// lowers E, all others fixed:
//
// E = sum over its tets of max(0, 1 - beta / goal)^4
//
// One invocation per vertex of a colour. Vertices of one dispatch share no tet, so `correction` is
// updated in place. `base` holds each tet's edge vectors from its first vertex.

struct Params {
    first: u32,
    n_vertices: u32,
    // Six times the beta below which tets count.
    six_goal: f32,
    // A vertex stays if its step would lower E by less than this fraction.
    gain: f32,
}

@group(0) @binding(0) var<uniform> params: Params;

// A tet with its moving vertex: the vectors to the other three vertices, in an order that keeps the
// sign of the volume.
struct Corner {
    u: vec3<f32>,
    v: vec3<f32>,
    w: vec3<f32>,
    // Squared length of the longest edge.
    longest: f32,
}

fn corner_of(entry: u32, at: vec3<f32>) -> Corner {
    let tet = entry / 4u;
    let local = entry % 4u;
    let corners = tets[tet];
    let a1 = column_of(tet, 0u);
    let a2 = column_of(tet, 1u);
    let a3 = column_of(tet, 2u);
    // The other three vertices, and the vectors to them before any of the four moved.
    var others = corners.yzw;
    var u = a1;
    var v = a2;
    var w = a3;
    if (local == 1u) {
        others = corners.xwz;
        u = -a1;
        v = a3 - a1;
        w = a2 - a1;
    } else if (local == 2u) {
        others = corners.xyw;
        u = -a2;
        v = a1 - a2;
        w = a3 - a2;
    } else if (local == 3u) {
        others = corners.xzy;
        u = -a3;
        v = a2 - a3;
        w = a1 - a3;
    }
    var corner: Corner;
    corner.u = u + (correction[others.x].xyz - at);
    corner.v = v + (correction[others.y].xyz - at);
    corner.w = w + (correction[others.z].xyz - at);
    let opposite = longer(longer(corner.v - corner.u, corner.w - corner.v), corner.u - corner.w);
    let longest = longer(own_longest(corner), opposite);
    corner.longest = dot3(longest, longest);
    return corner;
}

fn longer(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    if (dot3(b, b) > dot3(a, a)) {
        return b;
    }
    return a;
}

// The longest edge at the moving vertex.
fn own_longest(corner: Corner) -> vec3<f32> {
    return longer(longer(corner.u, corner.v), corner.w);
}

// Six times beta: the signed volume over the cube of the longest edge. The edges are divided by the
// longest one first, so products stay in the range of f32.
fn six_beta(corner: Corner) -> f32 {
    let shrink = 1.0 / sqrt(corner.longest);
    return dot3(cross3(corner.u * shrink, corner.v * shrink), corner.w * shrink);
}

// max(0, 1 - beta / goal). A NaN stays a NaN.
fn shortfall(corner: Corner) -> f32 {
    let short = 1.0 - six_beta(corner) / params.six_goal;
    if (short < 0.0) {
        return 0.0;
    }
    return short;
}

// Gradient of six times beta with respect to the moving vertex.
fn slope(corner: Corner) -> vec3<f32> {
    let shrink = 1.0 / sqrt(corner.longest);
    let of_volume = cross3((corner.w - corner.u) * shrink, (corner.v - corner.u) * shrink) * shrink;
    let own = own_longest(corner);
    if (dot3(own, own) < corner.longest) {
        return of_volume;
    }
    return of_volume + (own * shrink) * (3.0 * six_beta(corner) * shrink);
}

// Whether E is below a bound. No term of E is negative, so the sum stops as soon as it reaches the
// bound.
fn is_below(first: u32, end: u32, at: vec3<f32>, bound: f32) -> bool {
    var sum = 0.0;
    for (var i = first; i < end; i++) {
        let short = shortfall(corner_of(vertex_tets[i], at));
        let squared = short * short;
        sum += squared * squared;
        // Not `>=`: the test is true for a NaN too.
        if (!(sum < bound)) {
            return false;
        }
    }
    return true;
}

@compute @workgroup_size(GROUP)
fn raise_worst_beta(here: Invocation) {
    let index = place(here.group, here.groups, here.lane, GROUP);
    if (index >= params.n_vertices) {
        return;
    }
    let vertex = params.first + index;
    let first = row_start[vertex];
    let end = row_start[vertex + 1u];
    let at = correction[vertex].xyz;
    var before = 0.0;
    var uphill = vec3<f32>(0.0);
    // Squared length of the shortest edge.
    var shortest = 0.0;
    for (var i = first; i < end; i++) {
        let corner = corner_of(vertex_tets[i], at);
        let short = shortfall(corner);
        let squared = short * short;
        before += squared * squared;
        uphill += slope(corner) * (squared * short);
        let own = min(min(dot3(corner.u, corner.u), dot3(corner.v, corner.v)), dot3(corner.w, corner.w));
        if (i == first || own < shortest) {
            shortest = own;
        }
    }
    let direction = project(vertex, uphill);
    let length = sqrt(dot3(direction, direction));
    // Not `<=`: the test is true for a NaN too, and the vertex stays.
    if (!(length > 0.0)) {
        return;
    }
    var step = direction * (0.25 * sqrt(shortest) / length);
    let enough = before - params.gain * before;
    for (var halving = 0u; halving < HALVINGS; halving++) {
        let trial = within(vertex, at + step);
        if (is_below(first, end, trial, enough)) {
            correction[vertex] = vec4<f32>(trial, 0.0);
            return;
        }
        step *= 0.5;
    }
}
