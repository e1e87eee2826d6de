//! The derivative of [`CurvedSurface`]: of the points that close its holes ([`CurvedChange`]), and
//! of the foot and the height of a point beside it ([`BesideChange`]).
//!
//! With `b` the shares of the corners `c` in the point `q = sum b c` of the flat triangle, and `N`
//! the normals at the corners, the foot is
//!
//! `q + 1/2 sum b ((c - q) . N) N`
//!
//! `b` follows the point on a triangle, stays on an edge that the point is pressed to from beyond
//! both triangles, and stays at such a corner.
//!
//! # Kinks
//!
//! Where the foot goes on to the next triangle, its derivative jumps by about the square of the
//! angle between the two. A point that lies on a corner itself, as each vertex that has not slid,
//! gets the derivative of the tangent plane there ([`CurvedSurface::tangent_change`]).

use std::ops::Deref;

use glam::{DMat3, DVec3};

use super::super::continuation::{ContinuationError, FillingChange};
use super::{Closest, CurvedSurface, Start};
use crate::geometry::{self, rotation_vectors::outer, triangle_normal};

/// A [`CurvedSurface`] with the derivative of its points.
#[derive(Debug)]
pub struct CurvedChange {
    surface: CurvedSurface,
    n_own: usize,
    fillings: Vec<FillingChange>,
}

impl Deref for CurvedChange {
    type Target = CurvedSurface;

    fn deref(&self) -> &CurvedSurface {
        &self.surface
    }
}

impl CurvedChange {
    /// Makes the surface.
    ///
    /// - arguments and errors: as for [`CurvedSurface::new`]
    pub fn new(points: Vec<DVec3>, triangles: Vec<[u32; 3]>, rims: &[Vec<u32>]) -> Result<Self, ContinuationError> {
        let fillings = rims.iter().map(|rim| FillingChange::new(&points, &triangles, rim));
        let fillings = fillings.collect::<Result<Vec<_>, _>>()?;
        Ok(Self { n_own: points.len(), fillings, surface: CurvedSurface::new(points, triangles, rims)? })
    }

    /// Change of all points of the surface.
    ///
    /// - `own` `[n_points]`: changes of the points that were given
    pub fn forward(&self, own: &[DVec3]) -> Vec<DVec3> {
        let mut all = own.to_vec();
        self.fillings.iter().for_each(|filling| all.extend(filling.forward(own)));
        all
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `all`: the derivative of a number by all points; on return by the points that were given
    pub fn reverse(&self, mut all: Vec<DVec3>) -> Vec<DVec3> {
        let new = all.split_off(self.n_own);
        let mut rest = &new[..];
        for filling in &self.fillings {
            let (own, others) = rest.split_at(filling.n_points());
            filling.reverse(own, &mut all);
            rest = others;
        }
        all
    }

    /// A derivative of zero by all points of the surface.
    pub fn none(&self) -> Vec<DVec3> {
        vec![DVec3::ZERO; self.surface.points.len()]
    }
}

/// The derivative of the foot and of the height of a point beside a surface.
#[derive(Clone, Debug)]
pub struct BesideChange {
    triangle: u32,
    /// By the point itself.
    pub by_at: Slopes,
    corners: [Corner; 3],
}

/// The derivatives of foot and height by a vector.
#[derive(Clone, Copy, Debug)]
pub struct Slopes {
    /// Of the foot.
    pub foot: DMat3,
    /// Of the height.
    pub height: DVec3,
}

/// The derivatives by a corner, and by the normal there.
#[derive(Clone, Copy, Debug)]
struct Corner {
    place: Slopes,
    normal: Slopes,
}

impl Slopes {
    const ZERO: Self = Self { foot: DMat3::ZERO, height: DVec3::ZERO };

    /// Change of foot and height.
    fn forward(&self, change: DVec3) -> (DVec3, f64) {
        (self.foot * change, self.height.dot(change))
    }

    /// The transpose of [`Self::forward`].
    pub fn reverse(&self, by_foot: DVec3, by_height: f64) -> DVec3 {
        self.foot.transpose() * by_foot + self.height * by_height
    }
}

impl CurvedSurface {
    /// The derivative of [`Self::beside`].
    pub fn beside_change(&self, start: Start, at: DVec3) -> BesideChange {
        let (on, beside) = self.found(start, at);
        let parts = self.parts();
        let own = self.triangles[on.triangle as usize];
        let corners = geometry::corners(&self.points, own);
        let normals = own.map(|point| parts.point_normal(point, on.triangle));
        let shares = Shares::new(at, corners, &on);
        let b = on.barycentric;
        let rises: [f64; 3] = std::array::from_fn(|k| (corners[k] - on.point).dot(normals[k]));
        let straight = (0..3).fold(DMat3::IDENTITY, |sum, k| sum - outer(normals[k], normals[k]) * (0.5 * b[k]));
        let foot_by_share = |k: usize| straight * corners[k] + normals[k] * (0.5 * rises[k]);
        let sum = (0..3).map(|k| normals[k] * b[k]).sum::<DVec3>();
        let normal = sum.normalize_or_zero();
        let offset = at - beside.foot;
        // The height by the sum of the normals.
        let by_sum = offset.reject_from_normalized(normal) / sum.length();
        let foot_by_shares: [DVec3; 3] = std::array::from_fn(foot_by_share);
        let height_by_shares: [f64; 3] =
            std::array::from_fn(|k| normals[k].dot(by_sum) - normal.dot(foot_by_shares[k]));
        // Adds what the shares do to the direct derivative of the foot.
        let with_shares = |direct: DMat3, by: [DVec3; 3]| Slopes {
            foot: (0..3).fold(direct, |sum, k| sum + outer(foot_by_shares[k], by[k])),
            height: (0..3).map(|k| by[k] * height_by_shares[k]).sum::<DVec3>() - direct.transpose() * normal,
        };
        let mut by_at = with_shares(DMat3::ZERO, shares.by_at);
        by_at.height += normal;
        let corner = |k: usize| {
            let direct = (straight + outer(normals[k], normals[k]) * 0.5) * b[k];
            let bend = DMat3::from_diagonal(DVec3::splat(rises[k])) + outer(normals[k], corners[k] - on.point);
            let bend = bend * (0.5 * b[k]);
            let height = by_sum * b[k] - bend.transpose() * normal;
            Corner { place: with_shares(direct, shares.by_corner[k]), normal: Slopes { foot: bend, height } }
        };
        BesideChange { triangle: on.triangle, by_at, corners: std::array::from_fn(corner) }
    }

    /// The derivative of [`Self::beside`] at the start itself: that of the tangent plane there.
    pub fn tangent_change(&self, start: Start) -> BesideChange {
        let normal = self.parts().point_normal(start.point, start.triangle);
        let own = self.triangles[start.triangle as usize];
        let across = outer(normal, normal);
        let corner = |k: usize| {
            let is_start = own[k] == start.point;
            let place = Slopes { foot: across, height: -normal };
            Corner { place: if is_start { place } else { Slopes::ZERO }, normal: Slopes::ZERO }
        };
        BesideChange {
            triangle: start.triangle,
            by_at: Slopes { foot: DMat3::IDENTITY - across, height: normal },
            corners: std::array::from_fn(corner),
        }
    }

    /// Change of the unit normal at a point of the part of `triangle`.
    fn normal_forward(&self, point: u32, triangle: u32, changes: &[DVec3]) -> DVec3 {
        let (normal, length) = self.area(point, triangle);
        let of_area = self.sides(point, triangle).map(|(vertex, side)| side.cross(changes[vertex as usize]));
        of_area.sum::<DVec3>().reject_from_normalized(normal) / length
    }

    /// The transpose of [`Self::normal_forward`].
    fn normal_reverse(&self, point: u32, triangle: u32, by_normal: DVec3, gradient: &mut [DVec3]) {
        let (normal, length) = self.area(point, triangle);
        let by_area = by_normal.reject_from_normalized(normal) / length;
        for (vertex, side) in self.sides(point, triangle) {
            gradient[vertex as usize] += by_area.cross(side);
        }
    }

    /// The unit normal at a point of the part of `triangle`, and the length of the area vector
    /// whose direction it has.
    fn area(&self, point: u32, triangle: u32) -> (DVec3, f64) {
        let parts = self.parts();
        let corners = |other: u32| geometry::corners(&self.points, self.triangles[other as usize]);
        let area: DVec3 = parts.of_part(point, triangle).map(|other| triangle_normal(corners(other))).sum();
        (area.normalize_or_zero(), area.length())
    }

    /// The vertices of the triangles around a point in the part of `triangle`, each with the side
    /// across from it. The area vector of a triangle changes by the cross product of the side with
    /// the vertex's change.
    fn sides(&self, point: u32, triangle: u32) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        let of_triangle = |other: u32| {
            let own = self.triangles[other as usize];
            let [a, b, c] = geometry::corners(&self.points, own);
            [(own[0], c - b), (own[1], a - c), (own[2], b - a)]
        };
        let around = self.around.row(point as usize).iter().copied();
        let of_part = around.filter(move |&other| self.part[other as usize] == self.part[triangle as usize]);
        of_part.flat_map(of_triangle)
    }
}

impl BesideChange {
    /// Change of foot and height with the surface, the point at rest.
    ///
    /// - `changes` `[n_points]`: of all points of the surface
    pub fn of_surface(&self, surface: &CurvedSurface, changes: &[DVec3]) -> (DVec3, f64) {
        let mut sum = (DVec3::ZERO, 0.0);
        for (point, Corner { place, normal }) in
            surface.triangles[self.triangle as usize].into_iter().zip(&self.corners)
        {
            let by_place = place.forward(changes[point as usize]);
            let by_normal = normal.forward(surface.normal_forward(point, self.triangle, changes));
            sum = (sum.0 + by_place.0 + by_normal.0, sum.1 + by_place.1 + by_normal.1);
        }
        sum
    }

    /// The transpose of [`Self::of_surface`].
    ///
    /// - `gradient` `[n_points]`: the derivative by all points of the surface, to which is added
    pub fn add(&self, surface: &CurvedSurface, by_foot: DVec3, by_height: f64, gradient: &mut [DVec3]) {
        for (point, Corner { place, normal }) in
            surface.triangles[self.triangle as usize].into_iter().zip(&self.corners)
        {
            gradient[point as usize] += place.reverse(by_foot, by_height);
            surface.normal_reverse(point, self.triangle, normal.reverse(by_foot, by_height), gradient);
        }
    }
}

/// The derivatives of the shares of a triangle's corners in its point closest to another point.
#[derive(Clone, Copy, Debug, Default)]
struct Shares {
    by_at: [DVec3; 3],
    /// By the place of each corner, of each share.
    by_corner: [[DVec3; 3]; 3],
}

impl Shares {
    fn new(at: DVec3, corners: [DVec3; 3], on: &Closest) -> Self {
        let b = on.barycentric;
        let inside: Vec<usize> = (0..3).filter(|&k| b[k] != 0.0).collect();
        let mut shares = Self::default();
        match inside[..] {
            [_, _, _] => {
                let area = triangle_normal(corners);
                let facet = area.normalize_or_zero();
                let height = (at - on.point).dot(facet);
                let slopes: [DVec3; 3] = std::array::from_fn(|k| {
                    area.cross(corners[(k + 2) % 3] - corners[(k + 1) % 3]) / area.length_squared()
                });
                shares.by_at = slopes;
                for (j, by_corner) in shares.by_corner.iter_mut().enumerate() {
                    *by_corner = slopes.map(|slope| facet * (height * slope.dot(slopes[j])) - slope * b[j]);
                }
            }
            [first, second] => {
                let along = corners[second] - corners[first];
                let square = along.length_squared();
                let by_at = along / square;
                let by_second = (at - corners[first] - along * (2.0 * b[second])) / square;
                let by_first = -by_at - by_second;
                for (k, sign) in [(second, 1.0), (first, -1.0)] {
                    shares.by_at[k] = by_at * sign;
                    shares.by_corner[first][k] = by_first * sign;
                    shares.by_corner[second][k] = by_second * sign;
                }
            }
            _ => {}
        }
        shares
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::projection::curved::Beside;
    use crate::projection::tests::{lattice, noise};

    const HEIGHT: fn(f64, f64) -> f64 = |x, y| -0.6 * x * x - 0.3 * x * y - 0.5 * y * y;

    /// Points above triangles, the hole, an edge and a corner, which bulge, and points below
    /// triangles: central differences of foot and height by the point and by the surface, and the
    /// transpose.
    ///
    /// Fails if the normals at corners, or the turn of the facet, count for nothing.
    #[test]
    fn foot_and_height_follow_the_point_and_the_surface() {
        let (points, triangles, rim) = lattice(HEIGHT);
        let rims = [rim];
        let made = |by: f64| {
            let moved = points.iter().enumerate().map(|(k, at)| *at + noise(k) * by).collect();
            CurvedSurface::new(moved, triangles.clone(), &rims).unwrap()
        };
        let change = CurvedChange::new(points.clone(), triangles.clone(), &rims).unwrap();
        let own: Vec<DVec3> = (0..points.len()).map(noise).collect();
        let of_points = change.forward(&own);
        let above = |x: f64, y: f64, up: f64| DVec3::new(x, y, -0.6 * x * x - 0.4 * x * y - 0.5 * y * y + up);
        let corner = points[22];
        let mut places = vec![
            (above(0.13, 0.17, 0.03), 3),
            (above(0.21, 0.12, -0.01), 3),
            (above(0.34, 0.43, 0.02), 3),
            (above(0.41, 0.39, 0.02), 3),
        ];
        let normal = change.parts().point_normal(22, change.start_at(22).unwrap().triangle);
        // Farther off than the wedges beyond edges and corners are wide.
        places.push((corner + normal * 0.3, 1));
        places.push((corner.lerp(points[23], 0.4) + normal * 0.3, 2));
        let start = change.start_at(22).unwrap();
        for (at, inside) in places {
            let (on, _) = change.found(start, at);
            assert_eq!(on.barycentric.iter().filter(|share| **share != 0.0).count(), inside, "{at}: {on:?}");
            let found = change.beside_change(start, at);
            let h = 1e-6;
            let check = |what: &str, ends: [Beside; 2], (foot, height): (DVec3, f64)| {
                let of_foot = (ends[0].foot - ends[1].foot) / (2.0 * h);
                let of_height = (ends[0].height - ends[1].height) / (2.0 * h);
                assert!(foot.distance(of_foot) < 1e-7, "{at}, {what}: {foot} instead of {of_foot}");
                assert!((height - of_height).abs() < 1e-7, "{at}, {what}: {height} instead of {of_height}");
            };
            for axis in DVec3::AXES {
                let ends = [h, -h].map(|h| change.beside(start, at + axis * h));
                check("point", ends, (found.by_at.foot * axis, found.by_at.height.dot(axis)));
            }
            let ends = [h, -h].map(|h| made(h).beside(start, at));
            let of_surface = found.of_surface(&change, &of_points);
            check("surface", ends, of_surface);
            let (seed, by_height) = (noise(900), 0.7);
            let mut by_points = change.none();
            found.add(&change, seed, by_height, &mut by_points);
            let gradient = change.reverse(by_points);
            let one = seed.dot(of_surface.0) + by_height * of_surface.1;
            let other: f64 = gradient.iter().zip(&own).map(|(by, of)| by.dot(*of)).sum();
            assert!((one - other).abs() < 1e-12 * one.abs().max(1.0), "{at}: {one} {other}");
        }
    }

    /// At a point of the surface itself the derivative lies between those of the triangles around
    /// it, which differ by the square of the angles between them.
    #[test]
    fn at_a_point_the_tangent_plane_counts() {
        let (points, triangles, rim) = lattice(HEIGHT);
        let change = CurvedChange::new(points.clone(), triangles, &[rim]).unwrap();
        let start = change.start_at(22).unwrap();
        let found = change.tangent_change(start);
        for along in [DVec3::X, DVec3::Y, DVec3::new(-1.0, 0.5, 0.3)] {
            let h = 1e-5;
            let ends = [h, -h].map(|h| change.beside(start, points[22] + along * h));
            let foot = (ends[0].foot - ends[1].foot) / (2.0 * h);
            assert!(foot.distance(found.by_at.foot * along) < 0.03, "{along}: {foot} {}", found.by_at.foot * along);
            let height = (ends[0].height - ends[1].height) / (2.0 * h);
            assert!((height - found.by_at.height.dot(along)).abs() < 0.03, "{along}: {height}");
            // A surface that shifts takes the point along.
            let all = vec![along; change.none().len()];
            let (with, height) = found.of_surface(&change, &all);
            assert!((with + found.by_at.foot * along).distance(along) < 1e-12);
            assert!((height + found.by_at.height.dot(along)).abs() < 1e-12);
        }
    }
}
