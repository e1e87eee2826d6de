//! [`Junctions`]: where a wing's surface ends on other families.
//!
//! The edge of a wing's surface is a set of closed loops of edges. A loop runs round the hole under
//! a pylon, or along root, trailing edge and tip, with an arc on each fairing that crosses the
//! trailing edge. Each edge knows the family on its other side. So an end of a section tells on
//! what it stands, and where the wing goes on beyond it.

use std::collections::{BTreeMap, HashMap};

use super::crossings::Crossing;
use crate::mesh::{FamilyId, HybridMesh};

/// The edges of a wing's surface, in loops.
#[derive(Clone, Debug, Default)]
pub struct Junctions {
    /// The names of the mesh's families, and whether sections may be bridged through each.
    families: Vec<(String, bool)>,
    /// The vertices of each loop in order, each with the family beyond the edge to the next one.
    loops: Vec<Vec<(u32, FamilyId)>>,
    /// The loop of each edge, with the lower vertex first, and the place of the edge in the loop.
    place: HashMap<[u32; 2], (usize, usize)>,
}

/// A place on the edge of a wing's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct JunctionPlace {
    /// The loop.
    pub of_loop: usize,
    /// The edge in the loop.
    pub edge: usize,
    /// The family beyond the edge.
    pub family: FamilyId,
}

impl Junctions {
    /// The junctions of a wing with all other families of its mesh.
    ///
    /// - `wing`: the wing's families
    /// - `is_bridged`: whether sections of the wing may be bridged through a family
    pub fn of_mesh(mesh: HybridMesh, wing: &[FamilyId], is_bridged: impl Fn(FamilyId) -> bool) -> Self {
        let faces = |of_wing: bool| {
            let of = (0..mesh.n_faces() as u32).filter_map(move |face| Some((mesh.face(face)?, mesh.family_of(face)?)));
            of.filter(move |(_, family)| wing.contains(family) == of_wing)
        };
        let edges = |corners: &[u32]| -> Vec<[u32; 2]> {
            (0..corners.len()).map(|k| sorted([corners[k], corners[(k + 1) % corners.len()]])).collect()
        };
        let mut count: HashMap<[u32; 2], usize> = HashMap::new();
        for (face, _) in faces(true) {
            edges(face.vertices()).into_iter().for_each(|edge| *count.entry(edge).or_default() += 1);
        }
        count.retain(|_, count| *count == 1);
        let beyond = faces(false).flat_map(|(face, family)| {
            let own = edges(face.vertices()).into_iter().filter(|edge| count.contains_key(edge));
            own.map(|edge| (edge, family)).collect::<Vec<_>>()
        });
        Self::new(beyond, &mesh.mesh.families, is_bridged)
    }

    /// The junctions with these edges.
    ///
    /// - `edges`: the edges of the wing's surface, each with the family on its other side
    /// - `families`: the names of all families
    /// - `is_bridged`: as for [`Self::of_mesh`]
    pub(crate) fn new(
        edges: impl IntoIterator<Item = ([u32; 2], FamilyId)>,
        families: &[String],
        is_bridged: impl Fn(FamilyId) -> bool,
    ) -> Self {
        let mut beyond: BTreeMap<[u32; 2], FamilyId> = edges.into_iter().map(|(ends, of)| (sorted(ends), of)).collect();
        let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &[a, b] in beyond.keys() {
            around.entry(a).or_default().push(b);
            around.entry(b).or_default().push(a);
        }
        let mut loops = Vec::new();
        while let Some((&[start, _], _)) = beyond.first_key_value() {
            let mut walk: Vec<(u32, FamilyId)> = Vec::new();
            let mut at = start;
            loop {
                // Where several loops touch in a vertex, the walk stays with its family.
                let last = walk.last().map(|&(_, family)| family);
                let next = around[&at].iter().filter_map(|&next| Some((next, *beyond.get(&sorted([at, next]))?)));
                let Some((next, family)) = next.min_by_key(|&(_, family)| Some(family) != last) else { break };
                beyond.remove(&sorted([at, next]));
                walk.push((at, family));
                at = next;
                if at == start {
                    break;
                }
            }
            // A surface with a part of its edge unknown has no loop there.
            if at == start {
                loops.push(walk);
            }
        }
        let families = families.iter().enumerate();
        let families = families.map(|(index, name)| (name.clone(), is_bridged(FamilyId(index as u16))));
        let families = families.collect();
        let mut place = HashMap::new();
        for (of_loop, vertices) in loops.iter().enumerate() {
            for edge in 0..vertices.len() {
                place.insert(sorted([vertices[edge].0, vertices[(edge + 1) % vertices.len()].0]), (of_loop, edge));
            }
        }
        Self { families, loops, place }
    }

    /// The place of an edge. `None` if the wing's surface does not end there.
    pub(super) fn place(&self, edge: [u32; 2]) -> Option<JunctionPlace> {
        let &(of_loop, edge) = self.place.get(&sorted(edge))?;
        Some(JunctionPlace { of_loop, edge, family: self.loops[of_loop][edge].1 })
    }

    /// The names of the families on which some crossings lie, each once.
    pub(super) fn families_at<'a>(&self, ends: impl Iterator<Item = &'a Crossing>) -> Vec<String> {
        let place = |end: &Crossing| end.edges.iter().find_map(|&edge| self.place(edge));
        let mut families: Vec<FamilyId> = ends.filter_map(place).map(|place| place.family).collect();
        families.sort_unstable();
        families.dedup();
        families.into_iter().map(|family| self.name(family).to_owned()).collect()
    }

    /// The name of a family.
    pub(super) fn name(&self, family: FamilyId) -> &str {
        &self.families[family.index()].0
    }

    /// Whether sections may be bridged through a family.
    pub(super) fn is_bridged(&self, family: FamilyId) -> bool {
        self.families[family.index()].1
    }

    /// The vertices of the run of edges round a place that do not border on a family, in order.
    /// `None` if no edge of the loop borders on it.
    pub(super) fn run_beside(&self, at: JunctionPlace, other: FamilyId) -> Option<Vec<u32>> {
        let vertices = &self.loops[at.of_loop];
        let n = vertices.len();
        let is_end = |edge: usize| vertices[edge % n].1 == other;
        let forward = (1..n).find(|step| is_end(at.edge + step))?;
        let backward = (1..n).find(|step| is_end(at.edge + n - step))?;
        // From the end of the edge before the run to the start of the edge after it.
        Some((at.edge + n + 1 - backward..=at.edge + n + forward).map(|i| vertices[i % n].0).collect())
    }

    /// The vertices of the run of edges round a place that border on its family.
    pub(super) fn run_of(&self, at: JunctionPlace) -> Vec<u32> {
        let (vertices, [backward, forward]) = (&self.loops[at.of_loop], self.steps_of_run(at));
        let n = vertices.len();
        (at.edge + n + 1 - backward..=at.edge + n + forward).map(|i| vertices[i % n].0).collect()
    }

    /// The family on both sides of the run of edges round a place that border on its family. `None`
    /// if these are two, or if the run is the whole loop.
    pub(super) fn beside_run(&self, at: JunctionPlace) -> Option<FamilyId> {
        let (vertices, [backward, forward]) = (&self.loops[at.of_loop], self.steps_of_run(at));
        let n = vertices.len();
        let [before, after] = [at.edge + n - backward, at.edge + forward].map(|edge| vertices[edge % n].1);
        (before == after && before != at.family).then_some(before)
    }

    /// Whether another place lies on the run of edges round a place that border on its family.
    pub(super) fn is_on_run(&self, at: JunctionPlace, other: JunctionPlace) -> bool {
        let [backward, forward] = self.steps_of_run(at);
        let n = self.loops[at.of_loop].len();
        let ahead = (other.edge + n - at.edge) % n;
        at.of_loop == other.of_loop && (ahead < forward || n - ahead < backward)
    }

    /// Steps backward and forward from a place to the next edges that border on another family.
    fn steps_of_run(&self, at: JunctionPlace) -> [usize; 2] {
        let vertices = &self.loops[at.of_loop];
        let n = vertices.len();
        let is_end = |edge: usize| vertices[edge % n].1 != at.family;
        let forward = (1..n).find(|step| is_end(at.edge + step)).unwrap_or(n);
        [(1..n).find(|step| is_end(at.edge + n - step)).unwrap_or(n), forward]
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const PART: FamilyId = FamilyId(0);
    const EDGE: FamilyId = FamilyId(1);

    /// A loop of ten vertices whose edges from 3 to 6 border on a part, and a hole of four.
    fn junctions() -> Junctions {
        let outer = (0..10).map(|k: u32| ([k, (k + 1) % 10], if (3..6).contains(&k) { PART } else { EDGE }));
        let hole = (0..4).map(|k: u32| ([20 + k, 20 + (k + 1) % 4], PART));
        Junctions::new(outer.chain(hole), &["part".to_owned(), "edge".to_owned()], |family| family == PART)
    }

    #[test]
    fn edges_are_sorted_into_loops() {
        let junctions = junctions();
        let at = junctions.place([5, 4]).unwrap();
        assert_eq!((junctions.name(at.family), junctions.is_bridged(at.family)), ("part", true));
        let mut run = junctions.run_beside(at, EDGE).unwrap();
        run.sort_unstable();
        assert_eq!(run, [3, 4, 5, 6]);
        assert_eq!(junctions.place([4, 6]), None);
        let mut run = junctions.run_of(at);
        run.sort_unstable();
        assert_eq!((run, junctions.beside_run(at)), (vec![3, 4, 5, 6], Some(EDGE)));
        let on_run = |edge| junctions.is_on_run(at, junctions.place(edge).unwrap());
        assert!(on_run([3, 4]) && on_run([5, 6]) && !on_run([6, 7]) && !on_run([2, 3]) && !on_run([20, 21]));
        let of_hole = [junctions.place([20, 21]).unwrap(), junctions.place([22, 23]).unwrap()];
        assert!(of_hole[0].of_loop == of_hole[1].of_loop && of_hole[0].of_loop != at.of_loop);
        assert_eq!(junctions.run_beside(of_hole[0], EDGE), None);
        assert_eq!(junctions.run_of(of_hole[0]).len(), 8);
    }

    /// The edge of an open surface is no loop.
    #[test]
    fn a_broken_loop_is_left_out() {
        let edges = (0..9).map(|k: u32| ([k, k + 1], PART));
        let junctions = Junctions::new(edges, &["part".to_owned()], |_| true);
        assert_eq!(junctions.place([3, 4]), None);
    }
}
