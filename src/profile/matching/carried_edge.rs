//! [`CarriedEdge`]: the trailing edge of a new profile, where its own turns leave a doubt.
//!
//! The turns of a closed curve show its trailing edge (see `edges`). Where the edge is round,
//! single points decide. A section that is a little thicker, or sampled otherwise, may then have
//! two corners where the old section has one point. Cells at the edge would be squeezed or
//! stretched. So the old edge may be carried to the new profile:
//!
//! | new profile | its trailing edge |
//! |---|---|
//! | as many points as the old one, and the match point by point is about as near to an affine map as the measured one | at the same points |
//! | in doubt, and an affine map carries the old edge onto the new curve | where the map carries it |
//! | any other | its own |
//!
//! The paper has open sections alone, and no such choice.

use glam::DVec3;

use super::super::curve::{Outline, Ring, twice_area};
use super::super::edges::TrailingEdge;
use super::super::path_boxes::PathBoxes;
use super::super::{Plane, Profile, ProfileError};
use super::{Match, OldSection};
use crate::geometry::nearest_on_segment;

/// Iterations of fit and nearest points. An affine change is found to 1e-6 of the chord.
const TURNS: usize = 12;

/// A carried corner lies on the new curve if it is off by less than this share of the thickness of
/// the edge, or of the distance from the new profile's own corner. The corners of a blunt edge are
/// off a sharp one by half the thickness.
const ON_CURVE: f64 = 0.1;

/// A carried corner at a point of the profile makes no new point. Share of a segment.
const AT_POINT: f64 = 1e-6;

/// An old section and a new profile that is matched with it.
pub(super) struct CarriedEdge<'m> {
    pub old: &'m OldSection,
    pub new: &'m Profile,
    /// Plane of the new profile, its normal on the side of the old one's.
    pub plane: &'m Plane,
    /// The match with the new profile's own edge.
    pub own: &'m Match,
}

impl CarriedEdge<'_> {
    /// The new profile, divided at the carried edge. `None` if its own edge counts.
    ///
    /// # Errors
    /// The new profile is no plane curve.
    pub fn outline(&self) -> Result<Option<Outline>, ProfileError> {
        let (Some(old), Some(own)) = (self.old.outline.edge, self.own.outline.edge) else { return Ok(None) };
        let ring = Ring::of(self.new)?.points;
        // The ends of the sides and of the base are the same points.
        let Outline { sides, base, .. } = &self.old.outline;
        let n_old = sides.len() - 1 + base.len().saturating_sub(1);
        if ring.len() == n_old
            && !own.is_at(&old)
            && let Ok(outline) = Outline::divided(self.new.number, ring.clone(), Some(old), self.plane)
            && self.old.is_by_index(&outline, self.own.residual)
        {
            return Ok(Some(outline));
        }
        if old.is_clear && own.is_clear {
            return Ok(None);
        }
        Ok(self.carried(ring))
    }

    /// The new profile, divided where an affine map carries the old edge.
    fn carried(&self, mut ring: Vec<DVec3>) -> Option<Outline> {
        let (old, own) = (&self.old.outline, &self.own.outline);
        let mut path = self.own.new.path.clone();
        path.extend(&self.own.new_base.path[1..]);
        let boxes = PathBoxes::new(&path);
        let map = self.map(&path, &boxes)?;
        let at = |point: DVec3| point + self.old.affine.evaluate(&map, point);
        let ends = |outline: &Outline| [outline.sides[0], outline.sides[outline.sides.len() - 1]];
        let corners = ends(old).map(at);
        let apart = corners.iter().zip(ends(own)).map(|(corner, own)| corner.distance(own)).fold(0.0, f64::max);
        let thickness = old.gap().max(own.gap());
        let near = ON_CURVE * thickness.max(apart);
        let is_off = |corner: &DVec3| boxes.distance_squared(&path, *corner) > near * near;
        if apart <= ON_CURVE * thickness || corners.iter().any(is_off) {
            return None;
        }
        // The sides of an outline run counter-clockwise, and the ring as the file has it.
        let [mut first, mut last] = corners;
        if twice_area(&ring).dot(self.plane.normal) < 0.0 {
            (first, last) = (last, first);
        }
        let mut start = place(&mut ring, first);
        let n = ring.len();
        let end = if old.joined { start } else { place(&mut ring, last) };
        start += usize::from(ring.len() > n && end <= start);
        let edge = TrailingEdge { start, end, is_clear: false, ..self.own.outline.edge? };
        Outline::divided(self.new.number, ring, Some(edge), self.plane).ok()
    }

    /// The affine map that brings the old section closest to the new curve, at any place along it.
    fn map(&self, path: &[DVec3], boxes: &PathBoxes) -> Option<Vec<DVec3>> {
        let affine = &self.old.affine;
        let target = |(&step, &knot): (&usize, &DVec3)| self.own.new.point(self.own.tau[step]) - knot;
        let moved: Vec<DVec3> = self.old.sides.knot_step.iter().zip(&affine.knots).map(target).collect();
        let mut map = affine.fit(&moved).0;
        for _ in 0..TURNS {
            let nearest = |&knot: &DVec3| {
                let (step, t) = boxes.nearest(path, knot + affine.evaluate(&map, knot), 0..path.len() - 1);
                (path[step].lerp(path[step + 1], t), (path[step + 1] - path[step]).normalize_or_zero())
            };
            let targets: Vec<(DVec3, DVec3)> = affine.knots.iter().map(nearest).collect();
            map = affine.fit_across(self.plane, &targets)?;
        }
        Some(map)
    }
}

/// The index of the point of a closed curve that is nearest to `at`. A nearest place between two
/// points becomes a point of the curve.
fn place(ring: &mut Vec<DVec3>, at: DVec3) -> usize {
    let n = ring.len();
    let on_segment = |i: usize| nearest_on_segment(at, ring[i], ring[(i + 1) % n]);
    let distance = |i: &usize| on_segment(*i).0.distance_squared(at);
    let segment = (0..n).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    let (point, t) = on_segment(segment);
    if t <= AT_POINT {
        return segment;
    }
    if t >= 1.0 - AT_POINT {
        return (segment + 1) % n;
    }
    ring.insert(segment + 1, point);
    segment + 1
}
