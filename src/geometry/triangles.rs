//! Normals of triangles, and the closest point of a triangle.

use glam::DVec3;

use super::corners;

/// Normal of a triangle by the right-hand rule. Its length is twice the triangle's area.
#[inline]
pub fn triangle_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Unit normal of a triangle by the right-hand rule. Zero for a triangle without area.
#[inline]
pub fn unit_normal(corners: [DVec3; 3]) -> DVec3 {
    triangle_normal(corners).normalize_or_zero()
}

/// Unit normals of a surface at its points `[n_points]`: the normals of the triangles around each
/// point, weighted by area. Zero where the normals cancel, and where a point has no triangle.
///
/// - `points` `[n_points]`: in any unit
/// - `triangles` `[n_triangles]`: indices into `points`, all with the same orientation
pub fn vertex_normals(points: &[DVec3], triangles: &[[u32; 3]]) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; points.len()];
    for triangle in triangles {
        let normal = triangle_normal(corners(points, *triangle));
        triangle.iter().for_each(|&vertex| normals[vertex as usize] += normal);
    }
    normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
    normals
}

/// The point of a triangle closest to `p`, and the barycentric coordinates of that point.
///
/// The signs of edge products tell in which region of the plane `p` lies (Ericson, Real-Time
/// Collision Detection, section 5.1.5). For a degenerate triangle the closest point lies on one of
/// its edges.
pub fn closest_on_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> (DVec3, [f64; 3]) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, [0.0, 1.0, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, [0.0, 0.0, 1.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return (a + t * ab, [1.0 - t, t, 0.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return (a + t * ac, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (b + t * (c - b), [0.0, 1.0 - t, t]);
    }
    let scale = 1.0 / (va + vb + vc);
    let (v, w) = (vb * scale, vc * scale);
    (a + v * ab + w * ac, [1.0 - v - w, v, w])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_normal_is_twice_the_area_by_the_right_hand() {
        let triangle = [DVec3::ONE, DVec3::new(4.0, 1.0, 1.0), DVec3::new(1.0, 3.0, 1.0)];
        assert_eq!(triangle_normal(triangle), DVec3::new(0.0, 0.0, 6.0));
        let [a, b, c] = triangle;
        assert_eq!(unit_normal([b, a, c]), DVec3::NEG_Z);
        assert_eq!(unit_normal([a, b, b]), DVec3::ZERO);
    }

    /// Two triangles of areas 1/2 and 3/2 that meet at a right angle.
    #[test]
    fn normals_of_points_are_weighted_by_area() {
        let points = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(0.0, 0.0, 3.0), DVec3::ONE];
        let normals = vertex_normals(&points, &[[0, 1, 2], [0, 3, 1]]);
        let both = DVec3::new(0.0, 3.0, 1.0).normalize();
        for (normal, expected) in normals.iter().zip([both, both, DVec3::Z, DVec3::Y, DVec3::ZERO]) {
            assert!(normal.distance(expected) < 1e-15, "{normal} instead of {expected}");
        }
    }
}
