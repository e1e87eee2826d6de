//! The winglets: families that go on from a wing's end, turning up or down, with sections of their
//! own.
//!
//! Wing and winglet are one loft. The planes of a winglet's sections stand across its centreline:
//! its vertices, seen along the wing's chord, lie in a narrow strip that leads from the wing's end
//! to the winglet's. The length along this strip is found along the edges of the surface, with each
//! edge as long as it looks from there.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};

use glam::DVec3;

use super::words::Named;
use super::{Certainty, GuessedWing, Guesser, Sections};
use crate::families::Role;
use crate::mesh::{FamilyId, triangles_of_families};
use crate::profile::Plane;

/// The wing ends at a winglet, and does not go on beyond it: no vertex of the wing lies farther out
/// than their common curve by more than this share of the span.
const BEYOND: f64 = 1e-3;

/// The common curve lies within this share of the span at the wing's end.
const AT_END: f64 = 0.15;

/// A winglet's first section has a chord of at least this share of the wing's last one, and the
/// wing's last one at least this share of it.
const LIKE_WING: f64 = 0.4;

/// Places of a winglet's first and last section, as shares of its length: the first of these with a
/// section. Oblique ends may cut a section short.
const FIRST: [f64; 4] = [0.12, 0.2, 0.3, 0.4];
const LAST: [f64; 4] = [0.95, 0.92, 0.86, 0.78];

/// The centreline at a place is the line fitted to the vertices within this share of the length.
const FITTED: f64 = 0.2;

/// The centreline of a winglet.
struct Centreline {
    /// Length from the wing, and place across the chord, of each vertex `[n_vertices]`, in the
    /// mesh's unit.
    points: Vec<(f64, DVec3)>,
    /// The whole length, in the mesh's unit.
    length: f64,
}

impl Centreline {
    /// The plane across the centreline at a share of its length.
    fn plane(&self, share: f64) -> Option<Plane> {
        let at = share * self.length;
        let near = |length: f64| (1.0 - (length - at).abs() / (FITTED * self.length)).max(0.0);
        let sum = |of: &dyn Fn(f64, DVec3) -> DVec3| -> DVec3 {
            self.points.iter().map(|&(length, place)| near(length) * of(length, place)).sum()
        };
        let weight = sum(&|_, _| DVec3::X).x;
        if weight <= 0.0 {
            return None;
        }
        let centre = sum(&|_, place| place) / weight;
        let mean = sum(&|length, _| DVec3::X * length).x / weight;
        let square = sum(&|length, _| DVec3::X * (length - mean).powi(2)).x;
        let slope = sum(&|length, place| (place - centre) * (length - mean)) / square;
        let normal = slope.try_normalize()?;
        Some(Plane { point: centre + slope * (at - mean), normal })
    }
}

impl Guesser<'_> {
    /// Finds the winglets of the wings. Families of a winglet get the role wing.
    pub(super) fn guess_winglets(&mut self) {
        for wing in 0..self.wings.len() {
            let is_asked = |family: &FamilyId| self.known.wing.contains(family);
            if self.wings[wing].families.iter().any(is_asked) {
                continue;
            }
            let is_free = |guesser: &Self, family: usize| {
                let named = guesser.named[family].is_none_or(|(named, _)| named == Named::Carried);
                named && guesser.is_open(family)
            };
            let own = self.wings[wing].families.iter().flat_map(|family| self.neighbours[family.index()].clone());
            let around: BTreeSet<usize> = own.filter(|&family| is_free(self, family)).collect();
            // One family, or all that are joined, such as an upper and a lower side.
            let mut tried: Vec<Vec<usize>> = around.iter().map(|&family| vec![family]).collect();
            let parts = self.parts(is_free).into_iter();
            tried.extend(parts.filter(|part| part.len() > 1 && part.iter().any(|family| around.contains(family))));
            for families in tried {
                if !families.iter().all(|&family| self.is_open(family)) {
                    continue;
                }
                let Some(sections) = self.winglet(wing, &families) else { continue };
                let carrier = self.name(self.wings[wing].families[0].index());
                let reason = format!(
                    "it goes on from the end of {carrier}, with which it is one loft, and has sections of a wing itself; {}",
                    sections.in_words()
                );
                for &family in &families {
                    self.set(family, Role::Wing, Certainty::Likely, reason.clone());
                }
                let families = families.into_iter().map(|family| FamilyId(family as u16)).collect();
                self.wings.push(GuessedWing { families, sections, continues: Some(wing), mirror: None });
            }
        }
    }

    /// The sections of families as a winglet of a wing. `None` if they are none.
    fn winglet(&self, wing: usize, families: &[usize]) -> Option<Sections> {
        let GuessedWing { families: of_wing, sections, .. } = &self.wings[wing];
        let own: BTreeSet<u32> = self.vertices_of(families.iter().copied());
        let shared: Vec<u32> =
            self.vertices_of(of_wing.iter().map(|family| family.index())).intersection(&own).copied().collect();
        let at = |vertex: &u32| self.mesh.vertices()[*vertex as usize];
        let extent = |direction: DVec3| {
            let along = shared.iter().map(|vertex| at(vertex).dot(direction));
            along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
        };
        let [from, to] = sections.span;
        let [low, high] = extent(sections.normal);
        let [beyond, reach] = [BEYOND, AT_END].map(|share| share * (to - from));
        let last = match () {
            () if high >= to - beyond && low >= to - reach => sections.poses.last()?,
            () if low <= from + beyond && high <= from + reach => sections.poses.first()?,
            () => return None,
        };
        // The curve runs round the wing's section, not along one edge of it.
        let [front, back] = extent(sections.chordwise);
        if back - front < 0.5 * last.chord {
            return None;
        }
        let line = self.centreline(&own, &shared, sections.chordwise)?;
        let ids: Vec<FamilyId> = families.iter().map(|&family| FamilyId(family as u16)).collect();
        let triangles = triangles_of_families(self.mesh, &ids);
        let vertices = self.mesh.vertices();
        let is_section = |share: &f64| {
            let plane = line.plane(*share);
            plane.is_some_and(|plane| Sections::at(vertices, &triangles, vec![plane], sections.chordwise).is_ok())
        };
        let first = FIRST.into_iter().find(is_section)?;
        let end = LAST.into_iter().find(is_section)?;
        let count = self.known.planes.div_ceil(2);
        let share = |k: usize| match count {
            1 => 0.5,
            _ => first + (end - first) * k as f64 / (count - 1) as f64,
        };
        let planes = (0..count).map(|k| line.plane(share(k))).collect::<Option<Vec<_>>>()?;
        let found = Sections::at(vertices, &triangles, planes, sections.chordwise).ok()?;
        let [chord, of_wing] = [found.poses.first()?.chord, last.chord];
        (found.profiles.len() == count && chord > LIKE_WING * of_wing && of_wing > LIKE_WING * chord).then_some(found)
    }

    fn vertices_of(&self, families: impl Iterator<Item = usize>) -> BTreeSet<u32> {
        families.flat_map(|family| self.surface.vertices_of(FamilyId(family as u16)).iter().copied()).collect()
    }

    /// The centreline of a piece of the surface.
    ///
    /// - `own`: its vertices
    /// - `start`: those on its first curve
    /// - `chordwise`: the direction in which the surface is looked at
    fn centreline(&self, own: &BTreeSet<u32>, start: &[u32], chordwise: DVec3) -> Option<Centreline> {
        let across = |vertex: u32| self.mesh.vertices()[vertex as usize].reject_from_normalized(chordwise);
        let mut beside: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for corners in &self.surface.triangles {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                if own.contains(&a) && own.contains(&b) {
                    beside.entry(a).or_default().push(b);
                    beside.entry(b).or_default().push(a);
                }
            }
        }
        // Lengths are not negative, so their bits are in their order.
        let mut lengths: BTreeMap<u32, f64> = start.iter().map(|&vertex| (vertex, 0.0)).collect();
        let mut next: BinaryHeap<Reverse<(u64, u32)>> = start.iter().map(|&vertex| Reverse((0, vertex))).collect();
        while let Some(Reverse((bits, vertex))) = next.pop() {
            if lengths[&vertex].to_bits() != bits {
                continue;
            }
            for &other in beside.get(&vertex).into_iter().flatten() {
                let length = lengths[&vertex] + across(vertex).distance(across(other));
                if lengths.get(&other).is_none_or(|&known| length < known) {
                    lengths.insert(other, length);
                    next.push(Reverse((length.to_bits(), other)));
                }
            }
        }
        let length = lengths.values().copied().fold(0.0, f64::max);
        let points = lengths.into_iter().map(|(vertex, length)| (length, across(vertex))).collect();
        (length > 0.0).then_some(Centreline { points, length })
    }
}
