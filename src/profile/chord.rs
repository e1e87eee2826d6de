//! The chord of a section: its direction, its two ends at the trailing edge, and the camber about
//! it. A new section is compared with its old one by these.

use glam::DVec3;

use super::curve::Outline;
use super::edges::{farthest, thinner_end};
use super::{ProfileError, Remark};

/// A new chord that points away from the old one by a greater angle, in degrees, is reversed. A
/// wing may turn so far, and a file with swapped edges always does.
const REVERSED: f64 = 120.0;

/// The camber lines of a reversed section and its old one are opposite if their correlation is
/// below this negative share. A section that turns keeps its camber line, and a mirrored one has
/// the opposite.
const OPPOSITE: f64 = -0.7;

/// Least camber, root mean square and as a share of the chord, that tells a mirrored section from
/// one that has turned: of a parabola 0.4 % of the chord high.
const CAMBERED: f64 = 0.001;

/// One end of the new section may lie before the other, along the chord, by this share of the
/// length and the thickness of the trailing edge: a base that stands aslant. Beyond it the section
/// lacks points.
const LACKS: f64 = 0.02;
/// A smaller share, if the mesh's trailing edge is sharp: then both ends of an open section mean
/// one point.
const LACKS_AT_SHARP: f64 = 0.005;

/// A new trailing edge is worth a remark if its thickness is less than this share of the old one's.
const THIN: f64 = 1.0 / 3.0;
/// Least thickness, as a share of the length, of an open section that is worth a remark on a mesh
/// with a sharp trailing edge.
const OPEN: f64 = 1e-3;

/// Stations of the camber line, as shares of the chord from the leading edge.
const STATIONS: [f64; 9] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];

/// The chord of a section. Lengths are in the mesh's unit, shares of the chord's length.
#[derive(Clone, Debug)]
pub(super) struct Chord {
    /// From the middle of the trailing edge to the leading edge.
    forward: DVec3,
    /// Middle of the chord.
    pub middle: DVec3,
    /// The end of the sides that lies farther before the section's rear, and by which share.
    short: (DVec3, f64),
    /// Thickness of the trailing edge across the chord, as a share.
    base: f64,
    /// Whether the trailing edge is sharp.
    is_sharp: bool,
    /// Height of the camber line at [`STATIONS`], as shares, off a straight line fitted to it. So
    /// the place of the leading edge does not matter, which two corners of a blunt nose leave open.
    camber: [f64; STATIONS.len()],
}

impl Chord {
    /// - `normal`: of the section's plane; the sides run counter-clockwise about it
    pub fn new(outline: &Outline, normal: DVec3) -> Self {
        let sides = &outline.sides;
        let (first, last) = (sides[0], sides[sides.len() - 1]);
        let trailing = (first + last) / 2.0;
        let nose = farthest(sides, trailing);
        let forward = sides[nose] - trailing;
        let length = forward.length().max(f64::MIN_POSITIVE);
        let (back, up) = (-forward / length, normal.cross(forward / length));
        let along = |point: DVec3| (point - sides[nose]).dot(back) / length;
        let height = |point: DVec3| (point - sides[nose]).dot(up) / length;
        let rear = sides.iter().map(|&point| along(point)).fold(f64::NEG_INFINITY, f64::max);
        let short = if along(first) < along(last) { first } else { last };
        let side = |points: &mut dyn Iterator<Item = DVec3>, station: f64| {
            let mut before: Option<DVec3> = None;
            for point in points {
                if let (true, Some(before)) = (along(point) <= station, before) {
                    let share = (along(before) - station) / (along(before) - along(point)).max(f64::MIN_POSITIVE);
                    return height(before.lerp(point, share.clamp(0.0, 1.0)));
                }
                before = Some(point);
            }
            before.map_or(0.0, height)
        };
        let camber = STATIONS.map(|station| {
            let one = side(&mut sides[..=nose].iter().copied(), station);
            let other = side(&mut sides[nose..].iter().rev().copied(), station);
            (one + other) / 2.0
        });
        let camber = without_line(camber);
        Self {
            forward,
            middle: trailing + forward / 2.0,
            short: (short, rear - along(short)),
            base: (height(first) - height(last)).abs(),
            is_sharp: outline.joined,
            camber,
        }
    }

    /// The angle between the chords of the section and of a new one, in degrees.
    fn degrees(&self, new: &Self) -> f64 {
        self.forward.angle_between(new.forward).to_degrees()
    }

    /// From the leading edge to the middle of the trailing edge.
    pub fn back(&self) -> DVec3 {
        -self.forward
    }

    /// Whether the chord of a new section points the other way.
    pub fn is_reversed(&self, new: &Self) -> bool {
        self.degrees(new) > REVERSED
    }

    /// Compares a new section with its old one. Returns what is worth a remark.
    ///
    /// - `gaps`: thickness of the old and of the new trailing edge, in the mesh's unit
    ///
    /// # Errors
    /// - [`ProfileError::Swapped`]: the new section is a mirror image with leading and trailing
    ///   edge swapped
    /// - [`ProfileError::LacksPoints`]: one side of the new section ends far before the other
    pub fn compare(&self, new: &Self, profile: i64, gaps: [f64; 2]) -> Result<Vec<Remark>, ProfileError> {
        let mut remarks = Vec::new();
        if self.is_reversed(new) {
            if opposite(&self.camber, &new.camber) {
                return Err(ProfileError::Swapped { profile });
            }
            remarks.push(Remark::Reversed { profile, degrees: self.degrees(new) });
        }
        let (at, share) = (new.short.0, new.short.1 - self.short.1);
        let allowed = match self.is_sharp {
            true => LACKS_AT_SHARP + new.base,
            false => LACKS + f64::max(self.base, new.base / 2.0),
        };
        if share > allowed {
            return Err(ProfileError::LacksPoints { profile, at, share, sharp: self.is_sharp });
        }
        let [old_gap, new_gap] = gaps;
        if self.is_sharp && !new.is_sharp && new.base > OPEN {
            remarks.push(Remark::Open { profile, gap: new_gap });
        }
        if !self.is_sharp && new_gap < THIN * old_gap {
            remarks.push(Remark::Thin { profile, old: old_gap, new: new_gap });
        }
        Ok(remarks)
    }
}

/// Whether an open section begins at its leading edge: the other end is the thinner one.
pub(super) fn begins_at_nose(outline: &Outline) -> bool {
    let sides = &outline.sides;
    if outline.joined || !outline.base.is_empty() {
        return false;
    }
    let (first, last) = (sides[0], sides[sides.len() - 1]);
    let thin = sides[thinner_end(sides)];
    let far = sides.iter().map(|point| point.distance(first)).fold(0.0, f64::max);
    thin.distance(first).min(thin.distance(last)) > far / 2.0
}

/// Heights at [`STATIONS`] without the straight line fitted to them.
fn without_line(heights: [f64; STATIONS.len()]) -> [f64; STATIONS.len()] {
    let n = STATIONS.len() as f64;
    let (mean, middle) = (heights.iter().sum::<f64>() / n, STATIONS.iter().sum::<f64>() / n);
    let moment: f64 = heights.iter().zip(STATIONS).map(|(height, at)| height * (at - middle)).sum();
    let slope = moment / STATIONS.iter().map(|at| (at - middle).powi(2)).sum::<f64>();
    std::array::from_fn(|i| heights[i] - mean - slope * (STATIONS[i] - middle))
}

/// Whether two camber lines are opposite to each other.
fn opposite(old: &[f64], new: &[f64]) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let size = |of: &[f64]| dot(of, of).sqrt();
    let least = CAMBERED * (old.len() as f64).sqrt();
    size(old) > least && size(new) > least && dot(old, new) < OPPOSITE * size(old) * size(new)
}
