//! Periodic planes: two plane families, the second of which is a shifted copy of the first, vertex
//! for vertex.
//!
//! A solver identifies the two planes, so the vector between two partners must not change. The
//! surface stages place each family on its own. After each of them partners take the mean of their
//! displacements. In the volume partners first slide freely, then take their mean displacement, and
//! the inside relaxes again with the partners held ([`crate::volume`]). Local optimisation holds
//! partners.
//!
//! Planes that are rotated copies of each other are refused. The paper has no periodic planes.

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::alike::{self, Candidate};
use super::{Families, PlacedBy, Role, SetupError, shape::FamilyShape};
use crate::geometry::{NOWHERE, bounds, triangle_normal};
use crate::mesh::Displacement;
use crate::mesh::{FamilyId, TetMesh, half_edge::Surface};

/// Largest distance between a shifted vertex and its partner, as a fraction of the larger family's
/// size.
const MATCH: f64 = 1e-6;

/// The same distance as a fraction of the families' shortest edge. The larger of the two counts, so
/// vertices in single precision still match.
const MATCH_EDGE: f64 = 1e-3;

/// Sine of the least angle between planes that are not parallel: a tenth of a degree.
const PARALLEL: f64 = 2e-3;

/// Two plane families; the second is a shifted copy of the first.
#[derive(Clone, Debug)]
pub struct Pair {
    /// The two families.
    pub families: [FamilyId; 2],
    /// Each vertex of the first family with its partner in the second.
    pub vertices: Vec<[u32; 2]>,
}

/// The periodic planes of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Partners {
    /// Pairs that the case names.
    pub pairs: Vec<Pair>,
    /// Pairs that match, but which the case does not name.
    pub alike: Vec<Pair>,
    /// Sets of at least two vertices that move alike: partners, and partners of partners.
    sets: Vec<Vec<u32>>,
    /// Whether each vertex is in a set `[n_vertices]`.
    tied: Vec<bool>,
}

impl Pair {
    /// Largest change of the vector between two partners, in the mesh's unit, and the first
    /// partner's vertex.
    ///
    /// - `vertices`, `moved` `[n_vertices]`: positions in the original and the moved mesh
    pub fn apart(&self, vertices: &[DVec3], moved: &[DVec3]) -> (f64, u32) {
        let farther = |a: (f64, u32), b: (f64, u32)| if b.0 > a.0 || b.0.is_nan() { b } else { a };
        self.changes(vertices, moved).map(|(vertex, change)| (change, vertex)).fold((0.0, 0), farther)
    }

    /// The change of the vector between each two partners, in the mesh's unit, with the first
    /// partner's vertex.
    ///
    /// - `vertices`, `moved` `[n_vertices]`: positions in the original and the moved mesh
    pub fn changes(&self, vertices: &[DVec3], moved: &[DVec3]) -> impl Iterator<Item = (u32, f64)> {
        self.vertices.iter().map(|&[a, b]| {
            let across = |at: &[DVec3]| at[b as usize] - at[a as usize];
            (a, across(moved).distance(across(vertices)))
        })
    }
}

impl Partners {
    /// Finds the partner of every vertex of periodic planes.
    ///
    /// - `shapes` `[n_families]`: the second of two partners takes the normal of the first
    /// - `placed_by` `[n_vertices]`
    ///
    /// # Errors
    /// The families do not match vertex for vertex, or partners are placed by different stages.
    pub(super) fn new(
        mesh: &TetMesh,
        surface: &Surface,
        roles: &[Role],
        shapes: &mut [Option<FamilyShape>],
        placed_by: &[PlacedBy],
    ) -> Result<Self, SetupError> {
        let finder = Finder { mesh, surface };
        let mut partner_of: BTreeMap<FamilyId, FamilyId> = BTreeMap::new();
        for (index, role) in roles.iter().enumerate() {
            let Role::Plane { partner: Some(name), .. } = role else { continue };
            let family = FamilyId(index as u16);
            let Some(partner) = mesh.family(name) else {
                return Err(SetupError::Partners {
                    family: mesh.families[index].clone(),
                    partner: name.clone(),
                    why: "the mesh has no such family".to_owned(),
                });
            };
            let why = |why: &str| finder.error([family, partner], why.to_owned());
            if partner == family {
                return Err(why("a family is not its own partner"));
            }
            if !roles[partner.index()].is_plane() {
                return Err(why("the partner has another role, expected \"plane\""));
            }
            for (one, other) in [(family, partner), (partner, family)] {
                if *partner_of.entry(one).or_insert(other) != other {
                    return Err(why("one of them has another partner already"));
                }
            }
        }
        let normal = |shapes: &[Option<FamilyShape>], family: FamilyId| match shapes[family.index()] {
            Some(FamilyShape::Plane(_, normal)) => normal,
            _ => DVec3::ZERO,
        };
        let mut pairs = Vec::new();
        for (&one, &other) in partner_of.iter().filter(|(one, other)| one < other) {
            let families = [one, other];
            let [first, second] = families.map(|family| normal(shapes, family));
            if first.cross(second).length() > PARALLEL {
                let why = "they are not parallel, expected one to be the other, shifted (rotations about an axis are not known)";
                return Err(finder.error(families, why.to_owned()));
            }
            let vertices = finder.matched(families).map_err(|unmatched| finder.unmatched(families, &unmatched))?;
            if let Some(FamilyShape::Plane(_, second)) = &mut shapes[other.index()] {
                *second = first;
            }
            pairs.push(Pair { families, vertices });
        }
        let (sets, tied) = sets(mesh.vertices.len(), &pairs);
        for set in &sets {
            let differs = |vertex: &&u32| placed_by[**vertex as usize] != placed_by[set[0] as usize];
            if let Some(&vertex) = set.iter().find(differs) {
                let [a, b] = [set[0], vertex].map(|vertex| mesh.vertices[vertex as usize]);
                let [by_a, by_b] = [set[0], vertex].map(|vertex| placed_by[vertex as usize].name());
                let of = |pair: &&Pair| pair.vertices.iter().flatten().any(|&other| other == vertex);
                let families = pairs.iter().find(of).map_or([FamilyId(0); 2], |pair| pair.families);
                let why =
                    format!("the vertex at {a} moves with the role {by_a}, its partner at {b} with the role {by_b}");
                return Err(finder.error(families, why));
            }
        }
        let planes: Vec<FamilyId> = (0..roles.len() as u16)
            .map(FamilyId)
            .filter(|family| roles[family.index()].is_plane() && !partner_of.contains_key(family))
            .collect();
        let candidates = planes.iter().map(|&family| finder.candidate(family, normal(shapes, family))).collect();
        let matching = alike::alike(candidates, PARALLEL, |families| finder.matched(families).ok());
        let alike = matching.into_iter().map(|(families, vertices)| Pair { families, vertices }).collect();
        Ok(Self { pairs, alike, sets, tied })
    }

    /// Whether a vertex has a partner.
    pub fn is_tied(&self, vertex: u32) -> bool {
        self.tied.get(vertex as usize).copied().unwrap_or(false)
    }

    /// The sets of vertices that move alike and that the plane stage places.
    pub(crate) fn sliding(&self, placed_by: &[PlacedBy]) -> Vec<Vec<u32>> {
        self.sets.iter().filter(|set| placed_by[set[0] as usize] == PlacedBy::Plane).cloned().collect()
    }

    /// Gives partners the mean of their displacements `[n_vertices]`. Fixed and prescribed vertices
    /// and inner vertices are left out.
    pub fn even(&self, families: &Families, displacement: &mut Displacement) {
        for set in &self.sets {
            if (PlacedBy::Wing..=PlacedBy::Plane).contains(&families.placed_by[set[0] as usize]) {
                let on_surface = |vertex: &u32| families.touches_surface(*vertex);
                even(set, displacement, set.iter().any(on_surface));
            }
        }
    }

    /// The transpose of [`Self::even`], for a gradient `[n_vertices]`.
    pub fn even_reverse(&self, families: &Families, gradient: &mut Displacement) {
        for set in &self.sets {
            if (PlacedBy::Wing..=PlacedBy::Plane).contains(&families.placed_by[set[0] as usize]) {
                even_reverse(set, gradient, set.iter().any(|&vertex| families.touches_surface(vertex)));
            }
        }
    }

    /// Changes `slide` so that partners among some vertices have the same total displacement.
    ///
    /// - `own`: the vertices whose slide is known, ascending
    /// - `displacement`, `slide` `[n_vertices]`: added up, in the mesh's unit
    pub fn even_slide(&self, own: &[u32], displacement: &Displacement, slide: &mut Displacement) {
        for set in self.sets.iter().filter(|set| set.iter().all(|vertex| own.binary_search(vertex).is_ok())) {
            let ends = set.iter().map(|&vertex| displacement[vertex as usize] + slide[vertex as usize]);
            let mean = ends.sum::<DVec3>() / set.len() as f64;
            set.iter().for_each(|&vertex| slide[vertex as usize] = mean - displacement[vertex as usize]);
        }
    }

    /// The transpose of [`Self::even_slide`], for the derivatives by `displacement` and by `slide`
    /// `[n_vertices]`.
    pub fn even_slide_reverse(&self, own: &[u32], by_displacement: &mut Displacement, by_slide: &mut Displacement) {
        for set in self.sets.iter().filter(|set| set.iter().all(|vertex| own.binary_search(vertex).is_ok())) {
            let mean = set.iter().map(|&vertex| by_slide[vertex as usize]).sum::<DVec3>() / set.len() as f64;
            for &vertex in set {
                by_displacement[vertex as usize] += mean - by_slide[vertex as usize];
                by_slide[vertex as usize] = mean;
            }
        }
    }
}

/// Gives some vertices the mean of their displacements, or the displacement of the first. On a
/// curved surface the first is used, because the mean of two places lies off the surface.
pub fn even(set: &[u32], displacement: &mut Displacement, by_first: bool) {
    let first = displacement[set[0] as usize];
    if set.iter().all(|&vertex| displacement[vertex as usize] == first) {
        return;
    }
    let mean = set.iter().map(|&vertex| displacement[vertex as usize]).sum::<DVec3>() / set.len() as f64;
    set.iter().for_each(|&vertex| displacement[vertex as usize] = if by_first { first } else { mean });
}

/// The transpose of [`even`]. The mean is its own transpose. Where all take the displacement of the
/// first, the first takes all gradients.
fn even_reverse(set: &[u32], gradient: &mut Displacement, by_first: bool) {
    if !by_first {
        return even(set, gradient, false);
    }
    let sum = set.iter().map(|&vertex| std::mem::take(&mut gradient[vertex as usize])).sum();
    gradient[set[0] as usize] = sum;
}

/// The sets of vertices that are partners, directly or through others, and whether each vertex is
/// in a set `[n_vertices]`.
fn sets(n_vertices: usize, pairs: &[Pair]) -> (Vec<Vec<u32>>, Vec<bool>) {
    if pairs.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let mut sets: Vec<Vec<u32>> = Vec::new();
    let mut set_of: Vec<Option<usize>> = vec![None; n_vertices];
    for &[a, b] in pairs.iter().flat_map(|pair| &pair.vertices) {
        match [a, b].map(|vertex| set_of[vertex as usize]) {
            [None, None] => {
                sets.push(vec![a, b]);
                [a, b].iter().for_each(|&vertex| set_of[vertex as usize] = Some(sets.len() - 1));
            }
            [Some(set), None] => {
                sets[set].push(b);
                set_of[b as usize] = Some(set);
            }
            [None, Some(set)] => {
                sets[set].push(a);
                set_of[a as usize] = Some(set);
            }
            [Some(set), Some(other)] if set != other => {
                let joining = std::mem::take(&mut sets[other]);
                joining.iter().for_each(|&vertex| set_of[vertex as usize] = Some(set));
                sets[set].extend(joining);
            }
            _ => {}
        }
    }
    sets.retain_mut(|set| {
        set.sort_unstable();
        !set.is_empty()
    });
    (sets, set_of.into_iter().map(|set| set.is_some()).collect())
}

struct Finder<'a> {
    mesh: &'a TetMesh,
    surface: &'a Surface,
}

impl Finder<'_> {
    fn at(&self, vertex: u32) -> DVec3 {
        self.mesh.vertices[vertex as usize]
    }

    fn bounds(&self, family: FamilyId) -> [DVec3; 2] {
        bounds(self.surface.vertices_of(family).iter().map(|&vertex| self.at(vertex))).unwrap_or(NOWHERE)
    }

    /// The shortest edge of some families.
    fn shortest_edge(&self, families: &[FamilyId]) -> f64 {
        let corners = families.iter().flat_map(|&family| self.surface.corners_of(family));
        let edges = corners.flat_map(|[a, b, c]| [[a, b], [b, c], [c, a]]);
        edges.map(|[a, b]| self.at(a).distance(self.at(b))).fold(f64::INFINITY, f64::min)
    }

    /// A plane family with its measures.
    ///
    /// - `normal`: of the fitted plane, on either side
    fn candidate(&self, family: FamilyId, normal: DVec3) -> Candidate {
        let vertices = self.surface.vertices_of(family);
        let [low, high] = self.bounds(family);
        let centre = vertices.iter().map(|&vertex| self.at(vertex)).sum::<DVec3>() / vertices.len().max(1) as f64;
        let corners = self.surface.corners_of(family);
        let area: DVec3 = corners.map(|corners| triangle_normal(corners.map(|vertex| self.at(vertex)))).sum();
        Candidate {
            family,
            // The surface's normals point into the mesh.
            outward: if area.dot(normal) > 0.0 { -normal } else { normal },
            centre,
            n_vertices: vertices.len(),
            n_triangles: self.surface.triangles_of(family).len(),
            extent: high - low,
            mean: centre - low,
            tolerance: (MATCH * low.distance(high)).max(MATCH_EDGE * self.shortest_edge(&[family])),
        }
    }

    /// The pairs of partners, or the vertices without a partner.
    fn matched(&self, families: [FamilyId; 2]) -> Result<Vec<[u32; 2]>, Vec<u32>> {
        let [[low, high], [other_low, other_high]] = families.map(|family| self.bounds(family));
        let shift = 0.5 * ((other_low - low) + (other_high - high));
        let size = low.distance(high).max(other_low.distance(other_high));
        let tolerance = (MATCH * size).max(MATCH_EDGE * self.shortest_edge(&families));
        // Below 1e-12 of the coordinates the index of a cell would no longer be exact.
        let cell = (2.0 * tolerance).max(1e-12 * other_low.abs().max(other_high.abs()).max_element());
        let key = |at: DVec3| at.to_array().map(|x| (x / cell).floor() as i64);
        let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        for &vertex in self.surface.vertices_of(families[1]) {
            cells.entry(key(self.at(vertex))).or_default().push(vertex);
        }
        let nearest = |at: DVec3| {
            let [x, y, z] = key(at);
            let around = (0..27).map(|i| [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
            let near = around.filter_map(|key| cells.get(&key)).flatten();
            let near = near.map(|&vertex| (self.at(vertex).distance(at), vertex)).filter(|near| near.0 <= tolerance);
            near.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, vertex)| vertex)
        };
        let mut taken = HashMap::new();
        let (mut pairs, mut unmatched) = (Vec::new(), Vec::new());
        for &vertex in self.surface.vertices_of(families[0]) {
            match nearest(self.at(vertex) + shift) {
                Some(partner) if taken.insert(partner, vertex).is_none() => pairs.push([vertex, partner]),
                _ => unmatched.push(vertex),
            }
        }
        unmatched.extend(self.surface.vertices_of(families[1]).iter().filter(|vertex| !taken.contains_key(vertex)));
        if unmatched.is_empty() { Ok(pairs) } else { Err(unmatched) }
    }

    fn error(&self, families: [FamilyId; 2], why: String) -> SetupError {
        let [family, partner] = families.map(|family| self.mesh.families[family.index()].clone());
        SetupError::Partners { family, partner, why }
    }

    fn unmatched(&self, families: [FamilyId; 2], unmatched: &[u32]) -> SetupError {
        let all: usize = families.iter().map(|&family| self.surface.vertices_of(family).len()).sum();
        let first = self.at(unmatched[0]);
        let why = format!("{} of their {all} vertices have no partner, the first at {first}", unmatched.len());
        self.error(families, why)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn partners_of_partners_are_one_set() {
        let pair = |vertices: &[[u32; 2]]| Pair { families: [FamilyId(0), FamilyId(1)], vertices: vertices.to_vec() };
        let (sets, tied) = sets(9, &[pair(&[[0, 1], [2, 3], [4, 5]]), pair(&[[0, 2], [1, 3], [6, 5]])]);
        assert_eq!(sets, [vec![0, 1, 2, 3], vec![4, 5, 6]]);
        assert_eq!(tied.iter().filter(|tied| **tied).count(), 7);
    }

    #[test]
    fn partners_get_the_mean_or_the_first() {
        let mut displacement = vec![DVec3::X, DVec3::Y, DVec3::Z];
        even(&[0, 2], &mut displacement, false);
        assert_eq!(displacement, [(DVec3::X + DVec3::Z) / 2.0, DVec3::Y, (DVec3::X + DVec3::Z) / 2.0]);
        even(&[1, 2], &mut displacement, true);
        assert_eq!(displacement[1..], [DVec3::Y; 2]);
    }

    /// The mean is its own transpose; taking the first is not.
    #[test]
    fn gradients_of_partners_go_back() {
        for by_first in [true, false] {
            let change: Vec<DVec3> = (1..5).map(|k| DVec3::new(f64::from(k), 0.5, f64::from(k * k))).collect();
            let seed: Vec<DVec3> = (1..5).map(|k| DVec3::new(f64::from(7 - 2 * k), f64::from(k), 0.25)).collect();
            let (mut moved, mut gradient) = (change.clone(), seed.clone());
            even(&[1, 3, 2], &mut moved, by_first);
            even_reverse(&[1, 3, 2], &mut gradient, by_first);
            let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
            assert!((dot(&seed, &moved) - dot(&gradient, &change)).abs() < 1e-12, "{by_first}");
        }
    }
}
