//! [`Sections`]: cuts families as the sections of a wing are cut, and says whether they are some.

use glam::DVec3;

use crate::profile::{Plane, Pose, Profile, align, cut, stations};

/// Thickness of a wing's section, in chords.
const THICKNESS: std::ops::RangeInclusive<f64> = 0.005..=0.5;

/// Largest distance between both sides of a section at the trailing edge, in chords.
const GAP: f64 = 0.12;

/// Least span of a wing, in mean chords. A fuselage is far longer than wide.
const SPAN: f64 = 0.3;

/// A section with so many times the chord of its neighbour passes through something else, such as
/// a fuselage.
const JUMP: f64 = 2.0;

/// Two halves of an aircraft are mirror images if places, chords and thickness of their sections
/// differ by at most this share of the chord. Their meshes need not be mirror images.
const SYMMETRIC: f64 = 2e-3;

/// The sections of a wing, by planes across its span.
#[derive(Clone, Debug)]
pub struct Sections {
    /// The planes `[n_sections]`.
    pub planes: Vec<Plane>,
    /// The sections `[n_sections]`, numbered from 0, in the mesh's unit.
    pub profiles: Vec<Profile>,
    /// Place and size of each section `[n_sections]`.
    pub poses: Vec<Pose>,
    /// Whether the shape of no section tells the leading from the trailing edge.
    pub in_doubt: bool,
    /// Unit vector along the span.
    pub normal: DVec3,
    /// First and last place of the families along the span, in the mesh's unit.
    pub span: [f64; 2],
    /// Mean direction from the leading edge to the trailing edge.
    pub chordwise: DVec3,
    /// The longest chord, in the mesh's unit.
    pub longest_chord: f64,
}

impl Sections {
    /// Cuts at evenly spaced planes. Planes that give no section, such as in a fuselage between two
    /// halves, are left out, if at least half of the planes give one.
    ///
    /// - `vertices` `[n_vertices]`, in the mesh's unit
    /// - `triangles`: of the families
    ///
    /// # Errors
    /// The first reason in words why the families are no wing.
    pub(super) fn of(vertices: &[DVec3], triangles: &[[u32; 3]], count: usize) -> Result<Self, String> {
        let planes = stations::evenly(vertices, triangles, count).map_err(|error| error.to_string())?;
        let normal = planes.first().map_or(DVec3::Y, |plane| plane.normal);
        Self::by(vertices, triangles, planes, normal)
    }

    /// Cuts a winglet at planes that need not be parallel. Planes that give no section are left out
    /// as in [`Self::of`].
    ///
    /// - `chordwise`: unit vector along the wing's chord
    ///
    /// # Errors
    /// As for [`Self::of`].
    pub(super) fn at(
        vertices: &[DVec3],
        triangles: &[[u32; 3]],
        planes: Vec<Plane>,
        chordwise: DVec3,
    ) -> Result<Self, String> {
        let [first, last] = [planes.first(), planes.last()].map(|plane| plane.copied());
        let (Some(first), Some(last)) = (first, last) else { return Err("there are no planes".to_owned()) };
        let along = (last.point - first.point).reject_from_normalized(chordwise);
        let normal = along.try_normalize().unwrap_or(last.normal);
        Self::by(vertices, triangles, planes, normal)
    }

    /// - `normal`: unit vector along the span
    fn by(vertices: &[DVec3], triangles: &[[u32; 3]], planes: Vec<Plane>, normal: DVec3) -> Result<Self, String> {
        let count = planes.len();
        let mut faults = Vec::new();
        let (mut found, mut places, mut cuts) = (Vec::new(), Vec::new(), Vec::new());
        for (place, plane) in planes.into_iter().enumerate() {
            match cut::section(vertices, triangles, &plane) {
                Ok(points) => {
                    found.push(plane);
                    places.push(place);
                    cuts.push(Profile { number: 0, points });
                }
                Err(error) => faults.push((place, error.to_string())),
            }
        }
        let agreed = align(&mut cuts, &found);
        let (mut kept, mut profiles, mut poses) = (Vec::new(), Vec::new(), Vec::new());
        for (((plane, profile), towards), place) in found.into_iter().zip(cuts).zip(agreed.towards).zip(places) {
            match pose(&profile, &plane, towards) {
                Ok(pose) => {
                    kept.push(plane);
                    profiles.push(Profile { number: profiles.len() as i64, ..profile });
                    poses.push(pose);
                }
                Err(why) => faults.push((place, why)),
            }
        }
        if 2 * kept.len() < count || kept.is_empty() || kept.len() < 2.min(count) {
            let first = faults.into_iter().min_by_key(|(place, _)| *place).map(|(_, why)| why);
            return Err(first.unwrap_or_else(|| "it has no sections".to_owned()));
        }
        let along = triangles.iter().flatten().map(|&vertex| vertices[vertex as usize].dot(normal));
        let span = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        let mean_chord = poses.iter().map(|pose| pose.chord).sum::<f64>() / poses.len() as f64;
        if span[1] - span[0] < SPAN * mean_chord {
            return Err("its sections are far longer than its span, as a fuselage's are".to_owned());
        }
        let longest_chord = poses.iter().map(|pose| pose.chord).fold(0.0, f64::max);
        let chordwise: DVec3 = profiles.iter().zip(&poses).map(|(profile, pose)| chord_of(profile, pose)).sum();
        let chordwise = chordwise.normalize_or(DVec3::X);
        let in_doubt = agreed.in_doubt;
        Ok(Self { planes: kept, profiles, poses, in_doubt, normal, span, chordwise, longest_chord })
    }

    /// The longer of two neighbouring sections of which one has more than twice the chord of the
    /// other: its number, its chord and the other's. Not where the wing is pointed: the longer one
    /// has more than the median chord.
    pub(super) fn jump(&self) -> Option<[String; 3]> {
        let mut sorted: Vec<f64> = self.poses.iter().map(|pose| pose.chord).collect();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let pairs = self.poses.windows(2).enumerate();
        let jump = |(at, pair): (usize, &[Pose])| {
            let [a, b] = [pair[0].chord, pair[1].chord];
            let (long, short) = (a.max(b), a.min(b));
            let number = if a > b { at } else { at + 1 };
            (long > JUMP * short && long > median).then(|| [number.to_string(), figure(long), figure(short)])
        };
        pairs.into_iter().find_map(jump)
    }

    /// What the sections are like, in words.
    pub fn in_words(&self) -> String {
        let gap = self.poses.iter().map(|pose| pose.trailing_edge).fold(0.0, f64::max);
        let edge = match gap {
            0.0 => "closed".to_owned(),
            gap => format!("with {:.2} % of the chord between both sides at the trailing edge", 100.0 * gap),
        };
        let thickness = self.poses.iter().map(|pose| pose.thickness).fold(0.0, f64::max);
        let is_axis = |plane: &Plane| plane.normal.abs().max_element() == 1.0;
        let planes = match self.planes.iter().all(is_axis) {
            true => format!("planes {} = const", ["x", "y", "z"][self.normal.abs().max_position()]),
            false => "planes across its span".to_owned(),
        };
        format!("{planes} cut sections up to {:.1} % thick, {edge}", 100.0 * thickness)
    }

    /// Puts the sections of a winglet after those of its wing.
    pub(super) fn join(&mut self, winglet: Self) {
        let numbered = winglet.profiles.into_iter().zip(self.profiles.len()..);
        let numbered: Vec<_> = numbered.map(|(of, number)| Profile { number: number as i64, ..of }).collect();
        self.profiles.extend(numbered);
        self.planes.extend(winglet.planes);
        self.poses.extend(winglet.poses);
        self.in_doubt &= winglet.in_doubt;
        self.longest_chord = self.longest_chord.max(winglet.longest_chord);
    }

    /// The place of the plane `normal` = const in which other sections are the mirror image of
    /// these, in the mesh's unit. `None` if they are not.
    pub(super) fn mirror(&self, other: &Self, normal: DVec3) -> Option<f64> {
        if self.poses.len() != other.poses.len() {
            return None;
        }
        let mean =
            |of: &Self| of.poses.iter().map(|pose| pose.leading_edge.dot(normal)).sum::<f64>() / of.poses.len() as f64;
        let place = 0.5 * (mean(self) + mean(other));
        let image = |at: DVec3| at - normal * (2.0 * (at.dot(normal) - place));
        let fits = |pose: &Pose| {
            let at = image(pose.leading_edge);
            let nearest = other
                .poses
                .iter()
                .min_by(|a, b| a.leading_edge.distance_squared(at).total_cmp(&b.leading_edge.distance_squared(at)));
            nearest.is_some_and(|other| {
                let off = [
                    other.leading_edge.distance(at) / pose.chord,
                    other.chord / pose.chord - 1.0,
                    other.thickness - pose.thickness,
                ];
                off.iter().all(|off| off.abs() <= SYMMETRIC)
            })
        };
        // A wing that stands in the plane is no half.
        let [low, high] = self
            .poses
            .iter()
            .map(|pose| pose.leading_edge.dot(normal) - place)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)]);
        ((low > 0.0 || high < 0.0) && self.poses.iter().all(fits)).then_some(place)
    }
}

/// A length in words.
fn figure(length: f64) -> String {
    format!("{:?}", format!("{length:.2e}").parse().unwrap_or(length))
}

/// From the leading edge to the middle of the trailing edge.
fn chord_of(profile: &Profile, pose: &Pose) -> DVec3 {
    let [first, last] = [profile.points.first(), profile.points.last()].map(|at| at.copied().unwrap_or_default());
    (0.5 * (first + last) - pose.leading_edge).normalize_or_zero()
}

/// Place and size of a section, if it may be one of a wing.
fn pose(profile: &Profile, plane: &Plane, towards: Option<DVec3>) -> Result<Pose, String> {
    let pose = Pose::towards(profile, plane, towards).map_err(|error| error.to_string())?;
    if !THICKNESS.contains(&pose.thickness) {
        return Err(format!("a section is {:.3} of its chord thick", pose.thickness));
    }
    if pose.trailing_edge > GAP {
        return Err(format!("both sides of a section end {:.3} of its chord apart", pose.trailing_edge));
    }
    Ok(pose)
}
