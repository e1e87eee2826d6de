// Torsional stiffness of each edge: the sum over its tets of 1 / sin^2 of the dihedral angle that
// faces the edge. One invocation per edge.

struct Params {
    n_edges: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
// Start of each edge's tets in `edge_tets` [n_edges + 1].
@group(0) @binding(1) var<storage, read> edge_start: array<u32>;
// Tets around each edge, each stored as tet * 6 + local edge.
@group(0) @binding(2) var<storage, read> edge_tets: array<u32>;
// Edges 01 02 03 12 13 23 of each tet [n_tets * 6], each stored as edge * 2 + reversed.
@group(0) @binding(3) var<storage, read> tet_edges: array<u32>;
// Edge vectors [n_vectors]; w = 0. The first n_edges belong to the edges computed here.
@group(0) @binding(4) var<storage, read> edge_vector: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read_write> stiffness: array<f32>;

// Upper bound of 1 / sin^2 of a dihedral angle: sin^2 is clamped below at 1e-6, also in a flat tet.
const LARGEST = 1e6;

// Local vertices of each local edge. The edge with number 5 - local has the other two.
const ENDS = array<array<u32, 2>, 6>(
    array<u32, 2>(0u, 1u),
    array<u32, 2>(0u, 2u),
    array<u32, 2>(0u, 3u),
    array<u32, 2>(1u, 2u),
    array<u32, 2>(1u, 3u),
    array<u32, 2>(2u, 3u),
);

// Local edges of the face opposite each local vertex.
const FACE = array<array<u32, 3>, 4>(
    array<u32, 3>(3u, 4u, 5u),
    array<u32, 3>(1u, 2u, 5u),
    array<u32, 3>(0u, 2u, 4u),
    array<u32, 3>(0u, 1u, 3u),
);

// Local edges at each local vertex.
const STAR = array<array<u32, 3>, 4>(
    array<u32, 3>(0u, 1u, 2u),
    array<u32, 3>(0u, 3u, 4u),
    array<u32, 3>(1u, 3u, 5u),
    array<u32, 3>(2u, 4u, 5u),
);

// Twice the area vector, up to its sign, of the triangle with these three edges.
//
// The two shorter edges are used. The angle between them is the triangle's largest, so a needle
// loses no digits to cancellation.
fn area_vector(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let aa = dot3(a, a);
    let bb = dot3(b, b);
    let cc = dot3(c, c);
    if (cc >= aa && cc >= bb) {
        return cross3(a, b);
    }
    if (bb >= aa) {
        return cross3(a, c);
    }
    return cross3(b, c);
}

fn shortest(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let aa = dot3(a, a);
    let bb = dot3(b, b);
    let cc = dot3(c, c);
    if (aa <= bb && aa <= cc) {
        return a;
    }
    if (bb <= cc) {
        return b;
    }
    return c;
}

// 1 / sin^2 of the dihedral angle that faces an edge of a tet. The angle at the opposite edge faces
// an edge.
//
// For edge ij and opposite edge kl: sin^2 = 36 V^2 l_kl^2 / (S_i S_j), with S_i = 4 A_i^2 of the
// face opposite i. The formula has squares only, so the direction in which an edge is stored does
// not matter.
fn inverse_sin_squared(entry: u32) -> f32 {
    let local = entry % 6u;
    let first = entry - local;
    var vectors: array<vec3<f32>, 6>;
    // The angle has no unit. The longest edge is scaled to 1, so squares of squares stay in the
    // range of f32.
    var longest = 0.0;
    for (var k = 0u; k < 6u; k++) {
        vectors[k] = edge_vector[tet_edges[first + k] / 2u].xyz;
        longest = max(longest, dot3(vectors[k], vectors[k]));
    }
    if (longest == 0.0) {
        return LARGEST;
    }
    let scale = 1.0 / sqrt(longest);
    for (var k = 0u; k < 6u; k++) {
        vectors[k] *= scale;
    }
    let kl = vectors[5u - local];
    let of_i = FACE[ENDS[local][0]];
    let of_j = FACE[ENDS[local][1]];
    let at_j = STAR[ENDS[local][1]];
    let normal_i = area_vector(vectors[of_i[0]], vectors[of_i[1]], vectors[of_i[2]]);
    let normal_j = area_vector(vectors[of_j[0]], vectors[of_j[1]], vectors[of_j[2]]);
    let s_i = dot3(normal_i, normal_i);
    let s_j = dot3(normal_j, normal_j);
    let l_kl = dot3(kl, kl);
    let volume = dot3(shortest(vectors[at_j[0]], vectors[at_j[1]], vectors[at_j[2]]), normal_j);
    if (s_j == 0.0 || l_kl == 0.0) {
        return LARGEST;
    }
    // Squared distances of j from line kl and from plane ikl. Two quotients keep every product in
    // the range of f32.
    let to_line = s_i / l_kl;
    let to_plane = volume * volume / s_j;
    if (to_line < LARGEST * to_plane) {
        return to_line / to_plane;
    }
    return LARGEST;
}

@compute @workgroup_size(GROUP)
fn edge_stiffness(here: Invocation) {
    let edge = place(here.group, here.groups, here.lane, GROUP);
    if (edge >= params.n_edges) {
        return;
    }
    var sum = 0.0;
    let end = edge_start[edge + 1u];
    for (var i = edge_start[edge]; i < end; i++) {
        sum += inverse_sin_squared(edge_tets[i]);
    }
    stiffness[edge] = sum;
}
