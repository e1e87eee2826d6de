//! One Newton step of local optimisation at some vertices. Twin of `kernels/smooth_vertices.wgsl`.
//!
//! A vertex moves to lower `E = sum over its tets of (q w^size)^power`. All other vertices stay
//! fixed. For a tet with edge vectors `A` (columns) and target `W`:
//!
//! | symbol | formula | meaning |
//! |---|---|---|
//! | `S` | `A W^-1` | map from the target to the tet |
//! | `f` | `\|S\|_F^2` | |
//! | `sigma` | `det S` | volume over the target's volume |
//! | `r` | `sqrt(sigma^2 + 4 delta^2)` | |
//! | `h` | `(sigma + r) / 2` | regularised volume, positive for `delta > 0` |
//! | `q` | `f^3 / (27 h^2)` | shape: 1 for the target's shape in any size, else greater |
//! | `w` | `(h + 1 / h) / 2` | size: 1 for the target's volume, else greater |
//!
//! The values for shape and size hold for `delta = 0`. `delta > 0` keeps `q` and `w` finite in an
//! inverted tet.
//!
//! Source: regularised inverse mean ratio, Escobar et al. 2003 (CMAME 192, 2775-2787). Their
//! measure is `|S|^2 / (3 h^(2/3))`; `q` is its third power and needs no cube root. Size as a
//! factor beside the shape: Knupp 2003 (Finite Elements in Analysis and Design 39, 217-241), with
//! `min(sigma, 1 / sigma)`, which is not smooth.

use bytemuck::{Pod, Zeroable};

use super::Real;
use super::constraint::{kind, project};
use super::star::{HALVINGS, Star};
use super::vector::{cross, difference, dot, each, scaled, sum};

/// Parameters of one dispatch.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Params {
    /// First vertex of the dispatch.
    pub first: u32,
    /// Number of the dispatch's vertices.
    pub n_vertices: u32,
    /// Power of `q w^size`, 1 to 15.
    pub power: u32,
    /// Power of `w`, 0 to 15.
    pub size: u32,
    /// Square of the regularisation `delta`, without unit.
    pub delta_squared: f32,
    /// A vertex stays if its step would lower `E` by less than this fraction.
    pub tolerance: f32,
}

/// Loop iterations of one invocation per tet around its vertex.
pub const PASSES: u32 = 2 + HALVINGS;

/// Shifts of the Hessian tried: none, then from 1e-3 of its size upwards by factors of ten, until
/// it is positive definite.
const SHIFTS: u32 = 6;

/// Tets in the layout of the twin. `base` of the star holds `S` of each tet, without unit.
#[derive(Clone, Copy, Debug)]
pub struct Tets<'a, T> {
    /// The tets around the moving vertices.
    pub star: Star<'a, T>,
    /// `W^-1` of each tet `[n_tets]`, its three rows one after another, in one over the unit of a
    /// correction.
    pub inverse_target: &'a [[T; 9]],
}

/// The objective `E`.
#[derive(Clone, Copy, Debug)]
pub struct MeanRatioObjective<T> {
    /// Power of `q w^size`, 1 to 15.
    pub power: u32,
    /// Power of `w`, 0 to 15. With 0 only the shape counts.
    pub size: u32,
    /// Square of the regularisation `delta`. With 0 all tets must be valid, and they stay valid.
    pub delta_squared: T,
    /// A vertex stays if its step would lower `E` by less than this fraction.
    pub tolerance: T,
}

/// Moves some vertices that share no tet, each by a Newton step in the directions of its
/// constraint.
///
/// A step is at most half as long as the size of the vertex's tets. It is halved until `E` falls,
/// at most 8 times; otherwise the vertex stays.
///
/// - `first`: the first of the vertices, which follow one another; no two of them share a tet
/// - `correction` `[n_vertices]`: displacements of all vertices since `base` was taken; the fourth
///   component is not used
/// - `moved` `[n]`: receives the new corrections of the vertices
pub fn run<T: Real>(
    first: usize,
    tets: &Tets<T>,
    objective: &MeanRatioObjective<T>,
    correction: &[[T; 4]],
    moved: &mut [[T; 4]],
) {
    for (place, moved) in moved.iter_mut().enumerate() {
        let vertex = first + place;
        let at = correction[vertex];
        let new = step(vertex, tets, objective, correction, [at[0], at[1], at[2]]);
        *moved = [new[0], new[1], new[2], T::ZERO];
    }
}

fn step<T: Real>(
    vertex: usize,
    tets: &Tets<T>,
    objective: &MeanRatioObjective<T>,
    correction: &[[T; 4]],
    at: [T; 3],
) -> [T; 3] {
    let Some(greatest) = greatest(vertex, tets, objective, correction, at) else { return at };
    let scale = T::ONE / greatest;
    let local = derivatives(vertex, tets, objective, correction, at, scale);
    let constraint = &tets.star.constraint[vertex];
    let Some(step) = newton(constraint, &local) else { return at };
    let mut step = project(constraint, step);
    let half = T::from_f64(0.5);
    let falls = -dot(local.gradient, step) * half;
    // Also false for a NaN.
    let worthwhile = falls > objective.tolerance * local.energy;
    if !worthwhile {
        return at;
    }
    let length = dot(step, step).sqrt();
    let longest = half * local.size;
    if length > longest {
        step = scaled(step, longest / length);
    }
    for _ in 0..HALVINGS {
        let trial = tets.star.within(vertex, sum(at, step));
        if let Some(energy) = energy(vertex, tets, objective, correction, trial, scale)
            && energy < local.energy
        {
            return trial;
        }
        step = scaled(step, half);
    }
    at
}

/// `E` around a vertex, its gradient and Hessian with respect to the vertex, and the size of the
/// tets there.
#[derive(Clone, Copy, Debug)]
pub struct Local<T> {
    /// `E` of the scaled measures, see [`energy`].
    pub energy: T,
    /// Gradient of `E`.
    pub gradient: [T; 3],
    /// Entries xx, yy, zz of the Hessian.
    pub diagonal: [T; 3],
    /// Entries xy, xz, yz of the Hessian.
    pub off_diagonal: [T; 3],
    /// Mean height of the target tets over the face opposite the vertex, in the unit of a
    /// correction.
    pub size: T,
}

/// `E` for a vertex at `at`, from `27 q w^size` times `scale` of each tet. `None` if a tet must be
/// valid and is not.
pub fn energy<T: Real>(
    vertex: usize,
    tets: &Tets<T>,
    objective: &MeanRatioObjective<T>,
    correction: &[[T; 4]],
    at: [T; 3],
    scale: T,
) -> Option<T> {
    let mut sum = T::ZERO;
    for &entry in tets.star.around(vertex) {
        let q = TetShape::new(tets, correction, entry, at).quality(objective)?;
        sum = sum + power(q * scale, objective.power);
    }
    Some(sum)
}

/// [`energy`] with its derivatives. With `delta = 0` all tets around the vertex must be valid.
pub fn derivatives<T: Real>(
    vertex: usize,
    tets: &Tets<T>,
    objective: &MeanRatioObjective<T>,
    correction: &[[T; 4]],
    at: [T; 3],
    scale: T,
) -> Local<T> {
    let m = T::from_f64(f64::from(objective.power));
    let size = T::from_f64(f64::from(objective.size));
    let (two, three, six) = (T::from_f64(2.0), T::from_f64(3.0), T::from_f64(6.0));
    let mut local = Local {
        energy: T::ZERO,
        gradient: [T::ZERO; 3],
        diagonal: [T::ZERO; 3],
        off_diagonal: [T::ZERO; 3],
        size: T::ZERO,
    };
    let mut count = T::ZERO;
    for &entry in tets.star.around(vertex) {
        let shape = TetShape::new(tets, correction, entry, at);
        let (s, g) = (shape.s, shape.g);
        let (r, h) = regularised(shape.sigma, objective.delta_squared);
        let f = shape.f;
        let weight = power(measure(f, h, objective.size) * scale, objective.power);
        let of_f = each(|axis| two * (s[0][axis] * g[0] + s[1][axis] * g[1] + s[2][axis] * g[2]));
        let cofactor = [cross(s[1], s[2]), cross(s[2], s[0]), shape.normal];
        let of_sigma = each(|axis| cofactor[0][axis] * g[0] + cofactor[1][axis] * g[1] + cofactor[2][axis] * g[2]);
        let (to_f, to_r) = (T::ONE / f, T::ONE / r);
        // `d ln w / d ln h`, and `- d ln (q w^size) / d ln h`.
        let h_squared = h * h;
        let to_one = T::ONE / (h_squared + T::ONE);
        let grows = (h_squared - T::ONE) * to_one;
        let of_h = two - size * grows;
        // Gradient of `ln (q w^size)`, and the factors of its Hessian's parts.
        let a = each(|axis| three * to_f * of_f[axis] - of_h * to_r * of_sigma[axis]);
        let g_squared = dot(g, g);
        let by_unit = six * g_squared * to_f;
        let by_f = three * to_f * to_f;
        let of_size = size * (T::ONE - grows * grows);
        let by_sigma = (of_h * (shape.sigma * to_r) + of_size) * to_r * to_r;
        local.energy = local.energy + weight;
        let first = weight * m;
        for axis in 0..3 {
            local.gradient[axis] = local.gradient[axis] + first * a[axis];
            let of_log = by_unit + by_sigma * (of_sigma[axis] * of_sigma[axis]) - by_f * (of_f[axis] * of_f[axis]);
            local.diagonal[axis] = local.diagonal[axis] + first * (m * (a[axis] * a[axis]) + of_log);
        }
        for (place, (i, j)) in [(0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            let of_log = by_sigma * (of_sigma[i] * of_sigma[j]) - by_f * (of_f[i] * of_f[j]);
            local.off_diagonal[place] = local.off_diagonal[place] + first * (m * (a[i] * a[j]) + of_log);
        }
        local.size = local.size + T::ONE / g_squared.sqrt();
        count = count + T::ONE;
    }
    local.size = local.size / count;
    local
}

/// Greatest `27 q w^size` around a vertex. `E` is computed from the quotients by this number, so
/// powers stay in the range of f32.
fn greatest<T: Real>(
    vertex: usize,
    tets: &Tets<T>,
    objective: &MeanRatioObjective<T>,
    correction: &[[T; 4]],
    at: [T; 3],
) -> Option<T> {
    let mut greatest = T::ZERO;
    for &entry in tets.star.around(vertex) {
        greatest = greatest.max(TetShape::new(tets, correction, entry, at).quality(objective)?);
    }
    (greatest > T::ZERO).then_some(greatest)
}

/// A tet with its moving vertex at a given place.
struct TetShape<T> {
    /// Columns of `S`.
    s: [[T; 3]; 3],
    /// Gradient of each of `S`'s columns with respect to the vertex. All components of a column
    /// have the same gradient.
    g: [T; 3],
    /// Cross product of the first two columns.
    normal: [T; 3],
    f: T,
    sigma: T,
}

impl<T: Real> TetShape<T> {
    #[inline(always)]
    fn new(tets: &Tets<T>, correction: &[[T; 4]], entry: u32, at: [T; 3]) -> Self {
        let (tet, local) = (entry as usize / 4, entry as usize % 4);
        let point = |vertex: u32| {
            let c = &correction[vertex as usize];
            [c[0], c[1], c[2]]
        };
        let [a, b, c, d] = tets.star.tets[tet];
        let mut corner = [point(a), point(b), point(c), point(d)];
        corner[local] = at;
        let [a, b, c, d] = corner;
        let d = [difference(b, a), difference(c, a), difference(d, a)];
        let (base, w) = (&tets.star.base[tet], &tets.inverse_target[tet]);
        let s = each(|column: usize| {
            each(|axis: usize| {
                base[3 * column + axis]
                    + d[0][axis] * w[column]
                    + d[1][axis] * w[3 + column]
                    + d[2][axis] * w[6 + column]
            })
        });
        let g = if local == 0 {
            each(|column| -(w[column] + w[3 + column] + w[6 + column]))
        } else {
            each(|column| w[3 * local - 3 + column])
        };
        let normal = cross(s[0], s[1]);
        Self { s, g, normal, f: dot(s[0], s[0]) + dot(s[1], s[1]) + dot(s[2], s[2]), sigma: dot(normal, s[2]) }
    }

    /// `27 q w^size`, or `None` if it is infinite.
    #[inline(always)]
    fn quality(&self, objective: &MeanRatioObjective<T>) -> Option<T> {
        if objective.delta_squared == T::ZERO && self.sigma <= T::ZERO {
            return None;
        }
        let (_, h) = regularised(self.sigma, objective.delta_squared);
        Some(measure(self.f, h, objective.size))
    }
}

/// `27 q w^size`.
#[inline(always)]
fn measure<T: Real>(f: T, h: T, size: u32) -> T {
    let to_h = f / h;
    to_h * to_h * f * power(T::from_f64(0.5) * (h + T::ONE / h), size)
}

/// `r = sqrt(sigma^2 + 4 delta^2)` and `h = (sigma + r) / 2`. `h` is computed without cancellation.
#[inline(always)]
fn regularised<T: Real>(sigma: T, delta_squared: T) -> (T, T) {
    let r = (sigma * sigma + T::from_f64(4.0) * delta_squared).sqrt();
    let h =
        if sigma > T::ZERO { T::from_f64(0.5) * (sigma + r) } else { T::from_f64(2.0) * delta_squared / (r - sigma) };
    (r, h)
}

/// The Newton step in the subspace of the constraint: `-(H + shift)^-1 gradient` by Cholesky's
/// factors. The shift is the least one tried for which the factors exist; `None` if they exist for
/// no shift.
fn newton<T: Real>(constraint: &[T; 4], local: &Local<T>) -> Option<[T; 3]> {
    let [mut xx, mut yy, mut zz] = local.diagonal;
    let [mut xy, mut xz, mut yz] = local.off_diagonal;
    let gradient = project(constraint, local.gradient);
    let magnitude = |x: T| x.max(-x);
    let of_diagonal = magnitude(xx) + magnitude(yy) + magnitude(zz);
    let size = of_diagonal + T::from_f64(2.0) * (magnitude(xy) + magnitude(xz) + magnitude(yz));
    let [x, y, z, of_kind] = *constraint;
    // `P H P`. The directions that `P` removes get the Hessian's size instead.
    let v = [xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z];
    let along = x * v[0] + y * v[1] + z * v[2];
    if of_kind == T::from_f64(kind::IN_PLANE) {
        let k = along + size;
        let two = T::from_f64(2.0);
        xx = xx - two * (x * v[0]) + k * (x * x);
        yy = yy - two * (y * v[1]) + k * (y * y);
        zz = zz - two * (z * v[2]) + k * (z * z);
        xy = xy - (x * v[1] + y * v[0]) + k * (x * y);
        xz = xz - (x * v[2] + z * v[0]) + k * (x * z);
        yz = yz - (y * v[2] + z * v[1]) + k * (y * z);
    }
    if of_kind == T::from_f64(kind::ON_LINE) {
        let k = along - size;
        xx = size + k * (x * x);
        yy = size + k * (y * y);
        zz = size + k * (z * z);
        xy = k * (x * y);
        xz = k * (x * z);
        yz = k * (y * z);
    }
    let mut shift = T::ZERO;
    for attempt in 0..SHIFTS {
        let a = xx + shift;
        if a > T::ZERO {
            let l11 = a.sqrt();
            let l21 = xy / l11;
            let l31 = xz / l11;
            let b = yy + shift - l21 * l21;
            if b > T::ZERO {
                let l22 = b.sqrt();
                let l32 = (yz - l31 * l21) / l22;
                let c = zz + shift - l31 * l31 - l32 * l32;
                if c > T::ZERO {
                    let l33 = c.sqrt();
                    let u = -gradient[0] / l11;
                    let v = (-gradient[1] - l21 * u) / l22;
                    let w = (-gradient[2] - l31 * u - l32 * v) / l33;
                    let z = w / l33;
                    let y = (v - l32 * z) / l22;
                    let x = (u - l21 * y - l31 * z) / l11;
                    return Some([x, y, z]);
                }
            }
        }
        shift = if attempt == 0 { T::from_f64(1e-3) * size } else { T::from_f64(10.0) * shift };
    }
    None
}

/// `x^n` for `n` from 0 to 15.
#[inline(always)]
fn power<T: Real>(x: T, n: u32) -> T {
    let squared = x * x;
    let fourth = squared * squared;
    let mut result = if n & 1 != 0 { x } else { T::ONE };
    if n & 2 != 0 {
        result = result * squared;
    }
    if n & 4 != 0 {
        result = result * fourth;
    }
    if n & 8 != 0 {
        result = result * (fourth * fourth);
    }
    result
}
