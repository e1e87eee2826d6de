//! Old and new profile brought to a common parameter: which point goes where.
//!
//! Both curves are measured from the trailing edge over the leading edge (see `curve`). Such a measure is not kept by an
//! affine map (a thicker section has relatively longer curves), so the best affine map of the old section onto the new
//! one is fitted first, the old section is mapped by it, and what is measured is the mapped one; fit and match take
//! turns a few times. An affine change of another sampling is thus matched to 1e-3 of the chord along the curve.
//!
//! New profiles with as many points as the old one may be meant point by point. That match is taken when it lies nearer
//! to an affine map than the measured one.

use glam::DVec3;

use super::curve::{Curve, Measured, Outline, bracket};
use super::least_squares::LeastSquares;
use super::{Plane, Profile, ProfileError};

/// Turns of fit and match. The first does most of it; for a blunt section 40 % thicker, 5 leave 1e-3 of the chord along
/// the curve and 20 leave 6e-4.
const TURNS: usize = 6;

/// New points with the old ones' count are taken point by point unless that leaves this many times more of the
/// displacement unexplained by an affine map than the measured match does.
const POINT_BY_POINT: f64 = 2.0;

/// Profiles that agree to this share of their largest coordinate are the same: files carry 12 digits.
const IDENTICAL: f64 = 1e-11;

/// One old profile, ready to be matched with any number of new ones.
#[derive(Clone, Debug)]
pub(super) struct OldSection {
    profile: Profile,
    plane: Plane,
    outline: Outline,
    sides: Curve,
    base: Option<Curve>,
    /// The two sides with parameter and arc length.
    pub measured: Measured,
    /// The base of a blunt trailing edge within the curve.
    pub measured_base: Option<Measured>,
    affine: PlaneAffine,
}

impl OldSection {
    pub fn new(profile: &Profile, plane: &Plane) -> Result<Self, ProfileError> {
        let outline = Outline::new(profile, plane)?;
        let sides = Curve::new(&outline.sides);
        let base = (outline.base.len() >= 2).then(|| Curve::new(&outline.base));
        let measured = Measured::sides(sides.path.clone());
        let measured_base = base.as_ref().map(|base| Measured::base(base.path.clone()));
        let knots: Vec<DVec3> = sides.knots.iter().map(|&i| outline.sides[i]).collect();
        let affine = PlaneAffine::new(plane, &knots);
        Ok(Self { profile: profile.clone(), plane: *plane, outline, sides, base, measured, measured_base, affine })
    }

    /// Positions of the knots, those of the sides and then those of the base.
    pub fn knots(&self) -> Vec<DVec3> {
        let side = self.sides.knots.iter().map(|&i| self.outline.sides[i]);
        let base = self.base.iter().flat_map(|base| base.knots.iter().map(|&i| self.outline.base[i]));
        side.chain(base).collect()
    }

    /// Arc length at the knots of the sides.
    pub fn side_arcs(&self) -> Vec<f64> {
        self.sides.knot_step.iter().map(|&i| self.measured.s[i]).collect()
    }

    /// Arc length at the knots of the base, if there is one.
    pub fn base_arcs(&self) -> Option<Vec<f64>> {
        let (base, measured) = (self.base.as_ref()?, self.measured_base.as_ref()?);
        Some(base.knot_step.iter().map(|&i| measured.s[i]).collect())
    }

    /// Displacement of each knot (order of [`Self::knots`]) that brings the section onto the new profile; exactly zero
    /// if that is the old one.
    pub fn displacements(&self, new: &Profile) -> Result<Vec<DVec3>, ProfileError> {
        let old = self.knots();
        if identical(&self.profile.points, &new.points) {
            return Ok(vec![DVec3::ZERO; old.len()]);
        }
        let matched = self.matched(new)?;
        let steps = self.sides.knot_step.iter().map(|&step| matched.tau[step]);
        let mut targets: Vec<DVec3> = match &matched.by_index {
            Some(outline) => self.sides.knots.iter().map(|&i| outline.sides[i]).collect(),
            None => steps.map(|tau| matched.new.point(tau)).collect(),
        };
        if self.outline.joined {
            // One vertex of a sharp edge cannot go to both corners of a blunt one.
            let last = targets.len() - 1;
            let middle = (targets[0] + targets[last]) / 2.0;
            (targets[0], targets[last]) = (middle, middle);
        }
        if let (Some(base), Some(measured)) = (&self.base, &self.measured_base) {
            match &matched.by_index {
                Some(outline) => targets.extend(base.knots.iter().map(|&i| outline.base[i])),
                None => targets.extend(base.knot_step.iter().map(|&i| matched.new_base.point(measured.tau[i]))),
            }
        }
        Ok(targets.into_iter().zip(old).map(|(new, old)| new - old).collect())
    }

    /// Unit normal of the new profile's plane, on the side of the old one's.
    pub fn new_normal(&self, new: &Profile) -> Result<DVec3, ProfileError> {
        let normal = Plane::of_profile(new)?.normal;
        Ok(if normal.dot(self.plane.normal) < 0.0 { -normal } else { normal })
    }

    fn matched(&self, new: &Profile) -> Result<Match, ProfileError> {
        let mut plane = Plane::of_profile(new)?;
        if plane.normal.dot(self.plane.normal) < 0.0 {
            plane.normal = -plane.normal;
        }
        let outline = Outline::new(new, &plane)?;
        let measured = Measured::sides(Curve::new(&outline.sides).path);
        let ends = [outline.sides[outline.sides.len() - 1], outline.sides[0]];
        let base = if outline.base.len() >= 2 { Curve::new(&outline.base).path } else { ends.to_vec() };

        let old: Vec<DVec3> = self.sides.knots.iter().map(|&i| self.outline.sides[i]).collect();
        let mut tau = self.measured.tau.clone();
        let mut best = (f64::INFINITY, tau.clone());
        for _ in 0..TURNS {
            let target = |(&step, &old): (&usize, &DVec3)| measured.point(tau[step]) - old;
            let moved: Vec<DVec3> = self.sides.knot_step.iter().zip(&old).map(target).collect();
            let (map, residual) = self.affine.fit(&moved);
            if residual < best.0 {
                best = (residual, tau);
            }
            let mapped = self.sides.path.iter().map(|&p| p + self.affine.evaluate(&map, p)).collect();
            tau = Measured::sides(mapped).tau;
        }
        let same_counts = outline.sides.len() == self.outline.sides.len()
            && outline.base.len() == self.outline.base.len()
            && outline.joined == self.outline.joined;
        let by_index = same_counts && {
            let moved: Vec<DVec3> =
                self.sides.knots.iter().zip(&old).map(|(&i, &old)| outline.sides[i] - old).collect();
            self.affine.fit(&moved).1 <= POINT_BY_POINT * best.0
        };
        Ok(Match { tau: best.1, new: measured, new_base: Measured::base(base), by_index: by_index.then_some(outline) })
    }
}

/// How an old section corresponds to a new one.
struct Match {
    /// Parameter on the new curve of each step of the old one.
    tau: Vec<f64>,
    new: Measured,
    new_base: Measured,
    /// The new points, where the match is point by point.
    by_index: Option<Outline>,
}

/// Where each point of an old profile goes on the new one, in the order of `old`.
///
/// - `old`, `new`: two profiles of one number; any counts, directions and starting points
///
/// [`super::WingLoft`] matches in the same way; this is for looking at the match itself.
///
/// # Errors
/// Those of profiles that are no plane curves, see [`Plane::of_profile`].
pub fn match_points(old: &Profile, new: &Profile) -> Result<Vec<DVec3>, ProfileError> {
    let section = OldSection::new(old, &Plane::of_profile(old)?)?;
    if identical(&old.points, &new.points) {
        return Ok(old.points.clone());
    }
    let matched = section.matched(new)?;
    let mut targets = Vec::new();
    for (i, &point) in section.outline.sides.iter().enumerate() {
        // Between knots a point stands at its share of the piece's length.
        let piece = section.sides.knots.partition_point(|&k| k <= i).clamp(1, section.sides.knots.len() - 1) - 1;
        let ends = [piece, piece + 1].map(|k| (section.sides.knots[k], section.sides.knot_step[k]));
        let [from, to] = ends.map(|(knot, _)| section.outline.sides[knot].distance(point));
        let arc = [0, 1].map(|k: usize| section.measured.s[ends[k].1]);
        let arc = arc[0] + (arc[1] - arc[0]) * if from + to > 0.0 { from / (from + to) } else { 0.0 };
        let (step, t) = bracket(&section.measured.s, arc);
        let tau = matched.tau[step] + (matched.tau[step + 1] - matched.tau[step]) * t;
        targets.push((point, matched.by_index.as_ref().map_or_else(|| matched.new.point(tau), |o| o.sides[i])));
    }
    if let Some(base) = &section.measured_base {
        for (i, &point) in section.outline.base.iter().enumerate() {
            let nearest = |a: &usize, b: &usize| {
                base.path[*a].distance_squared(point).total_cmp(&base.path[*b].distance_squared(point))
            };
            let step = (0..base.path.len()).min_by(nearest).unwrap_or(0);
            let by_measure = || matched.new_base.point(base.tau[step]);
            targets.push((point, matched.by_index.as_ref().map_or_else(by_measure, |o| o.base[i])));
        }
    }
    // Back to the order of the file: same points, other start and direction.
    let find = |p: &DVec3| {
        let found = targets.iter().min_by(|a, b| a.0.distance_squared(*p).total_cmp(&b.0.distance_squared(*p)));
        found.map_or(*p, |target| target.1)
    };
    Ok(old.points.iter().map(find).collect())
}

/// Whether two profiles have the same points, in the same or the opposite order.
fn identical(old: &[DVec3], new: &[DVec3]) -> bool {
    let largest = old.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
    let close = |(a, b): (&DVec3, &DVec3)| (*a - *b).abs().max_element() <= IDENTICAL * largest;
    old.len() == new.len() && (old.iter().zip(new).all(close) || old.iter().rev().zip(new).all(close))
}

/// Least-squares fit of a displacement that is affine in a section's plane.
#[derive(Clone, Debug)]
struct PlaneAffine {
    centre: DVec3,
    /// Two perpendicular directions of the plane, divided by the section's size.
    axes: [DVec3; 2],
    knots: Vec<DVec3>,
    squares: LeastSquares,
}

impl PlaneAffine {
    fn new(plane: &Plane, knots: &[DVec3]) -> Self {
        let centre = knots.iter().sum::<DVec3>() / knots.len() as f64;
        let size = super::extent(knots);
        let (u, v) = plane.normal.any_orthonormal_pair();
        let axes = [u / size, v / size];
        let column = |axis: DVec3| knots.iter().map(|&p| (p - centre).dot(axis)).collect::<Vec<f64>>();
        let squares = LeastSquares::new(vec![vec![1.0; knots.len()], column(axes[0]), column(axes[1])]);
        Self { centre, axes, knots: knots.to_vec(), squares }
    }

    /// Coefficients of the fit to the knots' displacements, and the root mean square of what it leaves.
    fn fit(&self, displacement: &[DVec3]) -> (Vec<DVec3>, f64) {
        let map = self.squares.solve(displacement);
        let left = |(&p, &d): (&DVec3, &DVec3)| (d - self.evaluate(&map, p)).length_squared();
        let sum: f64 = self.knots.iter().zip(displacement).map(left).sum();
        (map, (sum / self.knots.len() as f64).sqrt())
    }

    fn evaluate(&self, map: &[DVec3], point: DVec3) -> DVec3 {
        map[0] + map[1] * (point - self.centre).dot(self.axes[0]) + map[2] * (point - self.centre).dot(self.axes[1])
    }
}
