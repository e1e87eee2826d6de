// Quaternions of rotation vectors, by polynomials: no function is used that devices compute
// differently. One invocation per place.
//
// The vector is divided by 8 and its sine and cosine are doubled twice, because a quaternion has
// half of the angle. Vectors up to 2 pi are right to 1.3e-15.

struct Params {
    n_places: u32,
    padding: u32,
    // Unit of the vectors, in radians.
    unit: f64,
}

@group(0) @binding(0) var<uniform> params: Params;
// Which of the vectors belongs to a place [n_places].
@group(0) @binding(1) var<storage, read> source: array<u32>;
// Rotation vectors [n_vectors * 3].
@group(0) @binding(2) var<storage, read> vectors: array<f64>;
// Quaternion of each place [n_places]: xyz = vector part, w = scalar part.
@group(0) @binding(3) var<storage, read_write> turns: array<vec4<f64>>;

@compute @workgroup_size(GROUP)
fn turn(here: Invocation) {
    let at = place(here.group, here.groups, here.lane, GROUP);
    if (at >= params.n_places) {
        return;
    }
    let x = 3u * source[at];
    let v = vec3<f64>(vectors[x], vectors[x + 1u], vectors[x + 2u]) * params.unit * 0.125lf;
    let s = v.x * v.x + v.y * v.y + v.z * v.z;
    var sine = -7.647163731819816e-13lf;
    sine = sine * s + 1.6059043836821613e-10lf;
    sine = sine * s - 2.505210838544172e-08lf;
    sine = sine * s + 2.7557319223985893e-06lf;
    sine = sine * s - 0.0001984126984126984lf;
    sine = sine * s + 0.008333333333333333lf;
    sine = sine * s - 0.16666666666666666lf;
    sine = sine * s + 1.0lf;
    // The cosine minus 1.
    var c = 4.779477332387385e-14lf;
    c = c * s - 1.1470745597729725e-11lf;
    c = c * s + 2.08767569878681e-09lf;
    c = c * s - 2.755731922398589e-07lf;
    c = c * s + 2.48015873015873e-05lf;
    c = c * s - 0.001388888888888889lf;
    c = c * s + 0.041666666666666664lf;
    c = c * s - 0.5lf;
    c = c * s;
    var t = sine * v;
    for (var doubled = 0u; doubled < 2u; doubled++) {
        let squared = t.x * t.x + t.y * t.y + t.z * t.z;
        t = (2.0lf * (1.0lf + c)) * t;
        c = -2.0lf * squared;
    }
    turns[at] = vec4<f64>(t, 1.0lf + c);
}
