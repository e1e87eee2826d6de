//! Finds plane families that may be periodic planes although the case does not say so.
//!
//! Any two planes may be such a pair, and a mesh may have tens of thousands of plane families. So
//! measures that are the same for shifted copies come first, and only families with equal measures
//! are compared vertex for vertex.

use glam::DVec3;

use crate::mesh::FamilyId;

/// Families with fewer triangles are not compared: many triangles of a mesh are shifted copies of
/// others by chance.
const LEAST_TRIANGLES: usize = 2;

/// Most families with which one family is compared vertex for vertex.
const MOST_TRIES: usize = 8;

/// Sizes that differ by more than this share belong to families that do not match: the tolerance of
/// a match is a thousandth of the shortest edge at most.
const SIZES: f64 = 0.01;

/// A plane family with the measures that a shifted copy shares.
pub(super) struct Candidate {
    pub family: FamilyId,
    /// Unit normal, out of the mesh.
    pub outward: DVec3,
    /// Mean of the vertices, in the mesh's unit.
    pub centre: DVec3,
    pub n_vertices: usize,
    pub n_triangles: usize,
    /// Extent of the bounding box, in the mesh's unit.
    pub extent: DVec3,
    /// The mean of the vertices, from the lowest corner of the bounding box.
    pub mean: DVec3,
    /// Largest distance between a shifted vertex and its partner.
    pub tolerance: f64,
}

impl Candidate {
    /// Whether the mesh lies between two parallel planes, so that one may be the other's partner.
    fn faces(&self, other: &Self, parallel: f64) -> bool {
        let across = (self.centre - other.centre).dot(self.outward);
        self.outward.dot(other.outward) < 0.0
            && self.outward.cross(other.outward).length() < parallel
            && across > self.tolerance.max(other.tolerance)
    }
}

/// Pairs of families that match, in the order of the families. Each family is in one pair at most.
///
/// - `parallel`: sine of the least angle between planes that are not parallel
/// - `matched`: the pairs of partners of two families, if each vertex has one
pub(super) fn alike<M>(
    mut candidates: Vec<Candidate>,
    parallel: f64,
    mut matched: impl FnMut([FamilyId; 2]) -> Option<M>,
) -> Vec<([FamilyId; 2], M)> {
    candidates.retain(|candidate| candidate.n_triangles >= LEAST_TRIANGLES);
    let mut pairs = Vec::new();
    for mut group in groups(candidates) {
        group.sort_by_key(|candidate| candidate.family);
        let mut is_paired = vec![false; group.len()];
        for one in 0..group.len() {
            if is_paired[one] {
                continue;
            }
            let others = (one + 1..group.len()).filter(|&other| !is_paired[other]);
            let facing = others.filter(|&other| group[one].faces(&group[other], parallel));
            let found = facing.take(MOST_TRIES).find_map(|other| {
                let families = [group[one].family, group[other].family];
                Some((other, (families, matched(families)?)))
            });
            if let Some((other, pair)) = found {
                is_paired[other] = true;
                pairs.push(pair);
            }
        }
    }
    pairs.sort_by_key(|pair| pair.0);
    pairs
}

/// Divides families into groups outside which none matches. Each measure cuts the groups where its
/// values, in order, have a gap wider than two matching families may have.
fn groups(candidates: Vec<Candidate>) -> Vec<Vec<Candidate>> {
    type Measure = fn(&Candidate) -> f64;
    let exact: [Measure; 2] = [|family| family.n_vertices as f64, |family| family.n_triangles as f64];
    let lengths: [Measure; 6] = [
        |family| family.extent.x,
        |family| family.extent.y,
        |family| family.extent.z,
        |family| family.mean.x,
        |family| family.mean.y,
        |family| family.mean.z,
    ];
    let mut groups = vec![candidates];
    for measure in exact {
        groups = cut(groups, measure, |_| 0.5);
    }
    groups = cut(groups, |family| family.extent.length().max(f64::MIN_POSITIVE).ln(), |_| SIZES);
    for measure in lengths {
        let widest = |group: &[Candidate]| 2.0 * group.iter().map(|family| family.tolerance).fold(0.0, f64::max);
        groups = cut(groups, measure, widest);
    }
    groups
}

/// Cuts each group where the values of a measure have a gap wider than `widest` of the group.
fn cut(
    groups: Vec<Vec<Candidate>>,
    measure: impl Fn(&Candidate) -> f64,
    widest: impl Fn(&[Candidate]) -> f64,
) -> Vec<Vec<Candidate>> {
    let mut parts: Vec<Vec<Candidate>> = Vec::new();
    for mut group in groups {
        let widest = widest(&group);
        group.sort_by(|a, b| measure(a).total_cmp(&measure(b)));
        let mut last = f64::NEG_INFINITY;
        for family in group {
            let value = measure(&family);
            match parts.last_mut() {
                Some(part) if value - last <= widest => part.push(family),
                _ => parts.push(vec![family]),
            }
            last = value;
        }
    }
    // A family alone matches none.
    parts.retain(|part| part.len() > 1);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of two triangles in a plane y.
    fn square(family: u16, y: f64, outward: f64, size: f64) -> Candidate {
        let half = DVec3::new(0.5 * size, 0.0, 0.5 * size);
        Candidate {
            family: FamilyId(family),
            outward: outward * DVec3::Y,
            centre: y * DVec3::Y + half,
            n_vertices: 4,
            n_triangles: 2,
            extent: 2.0 * half,
            mean: half,
            tolerance: 1e-3 * size,
        }
    }

    /// Squares of one size in two planes, and many of other sizes: each pair is compared once, and
    /// no family with one of another size.
    #[test]
    fn few_families_are_compared() {
        let n = 3000;
        let same = (0..n).map(|i| square(i, f64::from(i % 2), f64::from(i % 2) - 0.5, 1.0));
        let growing =
            (0..n).map(|i| square(n + i, f64::from(i % 2), f64::from(i % 2) - 0.5, 1.02f64.powi(1 + i32::from(i))));
        let mut n_compared = 0;
        let pairs = alike(same.chain(growing).collect(), 2e-3, |families| {
            n_compared += 1;
            Some(families)
        });
        assert_eq!(pairs.len(), usize::from(n) / 2);
        assert!(pairs.iter().all(|([one, other], _)| one.0 < n && other.0 < n && one.0 % 2 != other.0 % 2));
        assert_eq!(n_compared, pairs.len());
        // Nor where none matches at last.
        let group = (0..n).map(|i| square(i, f64::from(i % 2), f64::from(i % 2) - 0.5, 1.0));
        n_compared = 0;
        alike(group.collect(), 2e-3, |_| {
            n_compared += 1;
            None::<()>
        });
        assert!(n_compared <= MOST_TRIES * usize::from(n), "{n_compared}");
    }

    #[test]
    fn only_planes_with_the_mesh_between_them_are_a_pair() {
        let pairs = |candidates: Vec<Candidate>| alike(candidates, 2e-3, Some).len();
        assert_eq!(pairs(vec![square(0, 0.0, -1.0, 1.0), square(1, 1.0, 1.0, 1.0)]), 1);
        // Beside each other, the two faces of a plate, one place, and single triangles.
        assert_eq!(pairs(vec![square(0, 0.0, 1.0, 1.0), square(1, 1.0, 1.0, 1.0)]), 0);
        assert_eq!(pairs(vec![square(0, 0.0, 1.0, 1.0), square(1, 1.0, -1.0, 1.0)]), 0);
        assert_eq!(pairs(vec![square(0, 0.0, 1.0, 1.0), square(1, 0.0, -1.0, 1.0)]), 0);
        let triangle = |candidate| Candidate { n_triangles: 1, ..candidate };
        assert_eq!(pairs(vec![triangle(square(0, 0.0, -1.0, 1.0)), triangle(square(1, 1.0, 1.0, 1.0))]), 0);
        // Sizes within the tolerance.
        assert_eq!(pairs(vec![square(0, 0.0, -1.0, 1.0), square(1, 1.0, 1.0, 1.0005)]), 1);
        assert_eq!(pairs(vec![square(0, 0.0, -1.0, 1.0), square(1, 1.0, 1.0, 1.01)]), 0);
    }
}
