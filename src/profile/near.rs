//! Distances of many points from one section.

use glam::DVec3;

use super::distance::{Polyline, distance};
use super::matching::OldSection;

/// A section, prepared for the distances of many points of its plane.
pub(super) struct Near<'a> {
    /// The smooth curve through the section's points: the sides, and the base if there is one.
    curve: [Option<Polyline<'a>>; 2],
    /// The straight lines between the section's points: the sides, and the base if there is one.
    lines: [Option<Polyline<'a>>; 2],
    /// Ends of the sides.
    ends: [DVec3; 2],
}

impl<'a> Near<'a> {
    pub fn new(section: &'a OldSection) -> Self {
        let outline = section.outline();
        let base = Some(outline.base.as_slice()).filter(|base| !base.is_empty());
        let (first, last) = (outline.sides[0], outline.sides[outline.sides.len() - 1]);
        Self {
            curve: [Some(section.path()), section.base_path()].map(|path| path.map(Polyline::new)),
            lines: [Some(outline.sides.as_slice()), base].map(|lines| lines.map(Polyline::new)),
            ends: [last, first],
        }
    }

    /// Distance of a point from the smooth curve through the section's points.
    pub fn curve(&self, point: DVec3) -> f64 {
        least(&self.curve, point)
    }

    /// Distance of a point from the straight lines between the section's points.
    pub fn lines(&self, point: DVec3) -> f64 {
        least(&self.lines, point)
    }

    /// [`Self::lines`], including the line between the ends of an open section.
    pub fn closed_lines(&self, point: DVec3) -> f64 {
        self.lines(point).min(distance(point, &self.ends))
    }
}

fn least(lines: &[Option<Polyline>; 2], point: DVec3) -> f64 {
    lines.iter().flatten().map(|line| line.distance(point)).fold(f64::INFINITY, f64::min)
}
