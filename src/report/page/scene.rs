//! [`Scene`]: the part of a mesh that a page shows in three dimensions, packed for its script.
//!
//! A small mesh is shown whole. Of a large one the page holds the surfaces, the worst cells with
//! their neighbours and five slices; see [`Part`]. Positions are f32 from the middle of what moves,
//! and displacements i16. They are to look at. What the page measures again are the worst cells,
//! whose positions it gets in f64.

use std::borrow::Cow;
use std::collections::BTreeMap;

use glam::DVec3;
use serde_json::{Value, json};

use super::super::WorstCell;
use super::super::worst_cells::{lowest, ranking};
use super::coding::Packed;
use crate::mesh::{CellKind, CellName, HybridMesh, middle_of_cell};
use crate::mover::Outcome;

/// Most cells of a mesh that is shown whole.
const MOST_CELLS: usize = 200_000;

/// Most bytes of the packed arrays.
const MOST_BYTES: usize = 2_600_000;

/// The number of the worst cells that are shown of a large mesh.
const WORST: usize = 1000;

/// Most cells of a slice of a large mesh.
const IN_SLICE: usize = 6000;

/// The share of the largest displacement from which a vertex counts as moved.
const MOVED: f64 = 0.05;

/// The part of a mesh that a page holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// All cells.
    Whole,
    /// Surfaces, the worst cells with their neighbours, slices.
    Slices,
    /// Surfaces and the worst cells.
    Surfaces,
    /// The worst cells, and the surfaces near what moves.
    Near,
    /// The worst cells, and families of the surface with at most so many faces together: those that
    /// the design moves first, then the smallest.
    Families(usize),
    /// The worst cells.
    Worst,
}

/// Numbers of faces that are tried for [`Part::Families`], the most first: how many bytes a face
/// takes, with its vertices, depends on the mesh.
const IN_FAMILIES: [usize; 3] = [300_000, 120_000, 50_000];

impl Part {
    /// What a reader has to know, in words. Empty if nothing is missing.
    pub fn words(self) -> &'static str {
        match self {
            Self::Whole => "",
            Self::Slices => {
                "The mesh is large: the view has its surfaces, the worst 1 000 cells with their neighbours, and slices."
            }
            Self::Surfaces => "The mesh is large: the view has its surfaces and the worst 1 000 cells.",
            Self::Near => "The mesh is large: the view has the surfaces near what moves, and the worst 1 000 cells.",
            Self::Families(_) => {
                "The mesh is large: the view has as many families of its surface as fit, those that move and small ones \
                 first, and the worst 1 000 cells."
            }
            Self::Worst => "The mesh is large: the view has the worst 1 000 cells.",
        }
    }
}

/// What a page's script gets.
pub(super) struct Scene {
    pub part: Part,
    /// Sizes of the arrays, families and places.
    pub meta: Value,
    /// The arrays, in base64.
    pub packed: String,
}

/// What moves: the box of the families that the design moves, or of the moved surface vertices.
struct Focus {
    low: DVec3,
    high: DVec3,
}

impl Focus {
    fn of(points: impl Iterator<Item = DVec3>) -> Option<Self> {
        points.fold(None, |focus, at| match focus {
            None => Some(Self { low: at, high: at }),
            Some(Self { low, high }) => Some(Self { low: low.min(at), high: high.max(at) }),
        })
    }

    fn middle(&self) -> DVec3 {
        0.5 * (self.low + self.high)
    }

    fn size(&self) -> f64 {
        self.low.distance(self.high)
    }

    /// Whether a place is in the box, made so many times as large.
    fn has(&self, at: DVec3, times: f64) -> bool {
        let half = 0.5 * times * (self.high - self.low).max(DVec3::splat(0.05 * self.size()));
        (at - self.middle()).abs().cmple(half).all()
    }
}

/// The mesh that a scene is of. All positions are finite.
pub(super) struct Subject<'a> {
    /// The original mesh.
    pub mesh: HybridMesh<'a>,
    /// Moved positions `[n_vertices]`.
    pub moved: &'a [DVec3],
    /// The ways from the original mesh `[n_vertices]`.
    pub displacement: &'a [DVec3],
    /// The measure of each cell `[n_cells]`.
    pub values: Cow<'a, [f64]>,
    /// The distance of each vertex from its place in another result `[n_vertices]`.
    pub distances: Option<&'a [f64]>,
}

/// The mesh that is shown.
pub(super) struct Shown<'a> {
    subject: Subject<'a>,
    /// Whether the design moves a family `[n_families]`.
    is_body: Vec<bool>,
    /// The best value of the measure.
    best: f64,
    focus: Focus,
    /// Largest displacement, in the mesh's unit.
    largest: f64,
}

impl<'a> Subject<'a> {
    /// The moved mesh of an outcome.
    pub fn of(outcome: &'a Outcome) -> Self {
        Self {
            mesh: HybridMesh { mesh: outcome.mesh(), others: outcome.other_cells() },
            moved: outcome.even_if_invalid().vertices(),
            displacement: outcome.even_if_invalid().displacement(),
            values: ranking(outcome),
            distances: None,
        }
    }

    /// The scene of a mesh.
    ///
    /// - `bodies`: names of the families that the design moves
    /// - `worst`: what the rows of the table of the worst show
    pub fn scene(self, bodies: &[&str], worst: impl FnOnce(&Shown) -> Vec<Value>) -> std::io::Result<Scene> {
        let Self { mesh, moved, displacement, .. } = self;
        let lengths = displacement.iter().map(|displacement| displacement.length());
        let largest = lengths.fold(0.0, f64::max);
        let all = || 0..mesh.n_faces() as u32;
        let faces = || all().flat_map(|face| mesh.face_vertices(face));
        let is_body: Vec<bool> = mesh.mesh.families.iter().map(|name| bodies.contains(&name.as_str())).collect();
        let of_body = |face: &u32| mesh.family_of(*face).is_some_and(|family| is_body[family.index()]);
        let of_bodies: Vec<u32> = all().filter(of_body).flat_map(|face| mesh.face_vertices(face)).copied().collect();
        let is_moved = |vertex: &&u32| displacement[**vertex as usize].length() > MOVED * largest;
        let at = |vertex: &u32| moved[*vertex as usize];
        let all_faces = || Focus::of(faces().map(at));
        // A few vertices that moved alone are no place to look at the mesh from.
        let is_large = |focus: &Focus| all_faces().is_some_and(|all| focus.size() > MOVED * all.size());
        let focus = Focus::of(of_bodies.iter().map(at))
            .or_else(|| Focus::of(faces().filter(is_moved).map(at)).filter(is_large))
            .or_else(all_faces)
            .or_else(|| Focus::of(moved.iter().copied()))
            .unwrap_or(Focus { low: DVec3::ZERO, high: DVec3::ZERO });
        let is_of_tets = mesh.n_cells() == mesh.count(CellKind::Tet);
        let best = if is_of_tets { 0.117_851_130_197_757_9 } else { 1.0 };
        let shown = Shown { subject: self, is_body, best, focus, largest };
        let worst = worst(&shown);
        let parts = [Part::Whole, Part::Slices, Part::Surfaces, Part::Near];
        let parts = parts.into_iter().chain(IN_FAMILIES.map(Part::Families)).chain([Part::Worst]);
        let fitting = parts.into_iter().filter(|part| *part != Part::Whole || mesh.n_cells() <= MOST_CELLS);
        let mut scene = None;
        for part in fitting {
            if let Some(found) = shown.scene(part, &worst)? {
                scene = Some(found);
                break;
            }
        }
        scene.ok_or_else(|| std::io::Error::other("the worst cells do not fit a page"))
    }
}

impl Shown<'_> {
    /// The scene of a part of the mesh. `None` if it has too many bytes.
    fn scene(&self, part: Part, worst: &[Value]) -> std::io::Result<Option<Scene>> {
        let stops = self.stops();
        let cells = self.cells(part, &stops);
        let families = self.families(part);
        let has_face = |face: &u32| self.has_face(part, *face, &families);
        let faces: Vec<u32> = (0..self.mesh.n_faces() as u32).filter(has_face).collect();
        let numbers = self.numbers(&cells, &faces);
        let mut vertices: Vec<u32> =
            (0..numbers.len() as u32).filter(|&vertex| numbers[vertex as usize] != NONE).collect();
        vertices.sort_unstable_by_key(|&vertex| numbers[vertex as usize]);
        // Not even half of the bytes can be saved.
        if part != Part::Worst && 18 * vertices.len() + 8 * cells.len() > 3 * MOST_BYTES {
            return Ok(None);
        }
        let mut packed = Packed::default();
        let centre = self.focus.middle();
        let undeformed = &self.mesh.mesh.vertices;
        for axis in 0..3 {
            let position = |&vertex: &u32| ((undeformed[vertex as usize] - centre)[axis] as f32).to_le_bytes();
            packed.numbers(vertices.iter().map(position));
        }
        let unit = if self.largest > 0.0 { self.largest / f64::from(i16::MAX) } else { 1.0 };
        for axis in 0..3 {
            let steps =
                |&vertex: &u32| ((self.displacement[vertex as usize][axis] / unit).round() as i16).to_le_bytes();
            packed.numbers(vertices.iter().map(steps));
        }
        let families = self.pack_faces(&faces, &numbers, &mut packed);
        let kinds = self.pack_cells(&cells, &numbers, &mut packed);
        if let (Some(distances), Some(furthest)) = (self.distances, self.furthest()) {
            packed.numbers(vertices.iter().map(|&vertex| [shade(distances[vertex as usize] / furthest)]));
        }
        let is_part = part != Part::Whole;
        let meta = json!({
            "vertices": vertices.len(),
            "centre": centre.to_array(),
            "unit": unit,
            "largest": self.largest,
            "size": if self.focus.size() > 0.0 { self.focus.size() } else { 1.0 },
            "low": self.focus.low.to_array(),
            "high": self.focus.high.to_array(),
            // The ends of the whole mesh along y.
            "box": self.box_along_y(),
            "families": families,
            "cells": kinds,
            "best": self.best,
            "measure": if self.best < 1.0 { "beta" } else { "scaled Jacobian" },
            "stops": if is_part { json!(stops) } else { Value::Null },
            "far": self.furthest().map(|furthest| json!({ "largest": furthest, "decades": DECADES })),
            "worst": worst,
        });
        // Half of the bytes are saved at least.
        if part != Part::Worst && packed.len() > 3 * MOST_BYTES {
            return Ok(None);
        }
        let packed = packed.finish()?;
        let fits = part == Part::Worst || packed.len() <= MOST_BYTES;
        Ok(fits.then_some(Scene { part, meta, packed }))
    }

    /// The least and the largest y of a vertex.
    fn box_along_y(&self) -> [f64; 2] {
        let ends = Focus::of(self.mesh.vertices().iter().copied());
        ends.map_or([0.0, 0.0], |ends| [ends.low.y, ends.high.y])
    }

    /// Places of the slices of a large mesh, for each axis: through the middle of what moves, and
    /// two more across its longest side.
    fn stops(&self) -> [Vec<f64>; 3] {
        let (low, high) = (self.focus.low, self.focus.high);
        let longest = (high - low).max_position();
        std::array::from_fn(|axis| {
            let shares: &[f64] = if axis == longest { &[0.1, 0.5, 0.9] } else { &[0.5] };
            shares.iter().map(|share| low[axis] + share * (high - low)[axis]).collect()
        })
    }

    /// The cells of a part, ascending.
    fn cells(&self, part: Part, stops: &[Vec<f64>; 3]) -> Vec<usize> {
        let mesh = self.mesh;
        if part == Part::Whole {
            return (0..mesh.n_cells()).collect();
        }
        let mut cells = lowest(&self.values, WORST);
        if part == Part::Slices {
            let mut is_near = vec![false; self.moved.len()];
            let vertices = |cell: usize| mesh.cell(mesh.name(cell));
            cells.iter().flat_map(|&cell| vertices(cell)).for_each(|&vertex| is_near[vertex as usize] = true);
            let (mut near, mut slices) = (Vec::new(), vec![Vec::new(); stops.iter().map(Vec::len).sum()]);
            for cell in 0..mesh.n_cells() {
                let of_cell = vertices(cell);
                // A neighbour has a face in common.
                if of_cell.iter().filter(|&&vertex| is_near[vertex as usize]).count() >= 3 {
                    near.push(cell);
                }
                let planes = stops.iter().enumerate().flat_map(|(axis, at)| at.iter().map(move |&at| (axis, at)));
                for (slice, (axis, at)) in slices.iter_mut().zip(planes) {
                    let places = || of_cell.iter().map(|&vertex| self.moved[vertex as usize][axis]);
                    if places().any(|place| place <= at) && places().any(|place| place >= at) {
                        slice.push(cell);
                    }
                }
            }
            cells.extend(near.into_iter().take(10 * WORST));
            slices.into_iter().for_each(|slice| cells.extend(self.around_focus(slice)));
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// The cells of a slice near what moves, as many as a page holds.
    fn around_focus(&self, slice: Vec<usize>) -> Vec<usize> {
        let middle = |cell: usize| middle_of_cell(self.mesh.cell(self.mesh.name(cell)), self.moved);
        let mut near: Vec<(f64, usize)> =
            slice.into_iter().map(|cell| (middle(cell).distance_squared(self.focus.middle()), cell)).collect();
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(IN_SLICE);
        near.into_iter().map(|(_, cell)| cell).collect()
    }

    /// The families of [`Part::Families`] `[n_families]`. Empty for other parts.
    fn families(&self, part: Part) -> Vec<bool> {
        let Part::Families(most) = part else { return Vec::new() };
        let mut counts = vec![0; self.is_body.len()];
        let faces = 0..self.mesh.n_faces() as u32;
        faces.filter_map(|face| self.mesh.family_of(face)).for_each(|family| counts[family.index()] += 1);
        let mut order: Vec<usize> = (0..counts.len()).collect();
        order.sort_by_key(|&family| (!self.is_body[family], counts[family]));
        let mut left = most;
        let mut chosen = vec![false; counts.len()];
        for family in order {
            if let Some(rest) = left.checked_sub(counts[family]) {
                (left, chosen[family]) = (rest, true);
            }
        }
        chosen
    }

    /// - `families`: those of [`Part::Families`]
    fn has_face(&self, part: Part, face: u32, families: &[bool]) -> bool {
        let at = self.mesh.face_vertices(face)[0];
        match part {
            Part::Whole | Part::Slices | Part::Surfaces => true,
            Part::Near => self.focus.has(self.moved[at as usize], 1.5),
            Part::Families(_) => self.mesh.family_of(face).is_some_and(|family| families[family.index()]),
            Part::Worst => false,
        }
    }

    /// The number of each vertex in the page `[n_vertices]`, [`NONE`] for those that are left out.
    /// Neighbours have near numbers, whose differences take few bytes.
    fn numbers(&self, cells: &[usize], faces: &[u32]) -> Vec<u32> {
        let mut numbers = vec![NONE; self.moved.len()];
        let of_cells = cells.iter().flat_map(|&cell| self.mesh.cell(self.mesh.name(cell)));
        let of_faces = faces.iter().flat_map(|&face| self.mesh.face_vertices(face));
        of_cells.chain(of_faces).for_each(|&vertex| numbers[vertex as usize] = 0);
        let vertices = (0..numbers.len() as u32).filter(|&vertex| numbers[vertex as usize] == 0);
        let place = |vertex: u32| self.mesh.mesh.vertices[vertex as usize];
        let mut along: Vec<(u64, u32)> = vertices.map(|vertex| (0, vertex)).collect();
        if let Some(Focus { low, high }) = Focus::of(along.iter().map(|&(_, vertex)| place(vertex))) {
            let size = (high - low).max_element().max(f64::MIN_POSITIVE);
            along.iter_mut().for_each(|(key, vertex)| *key = z_order((place(*vertex) - low) / size));
        }
        along.sort_unstable();
        for (number, &(_, vertex)) in (0..).zip(&along) {
            numbers[vertex as usize] = number;
        }
        numbers
    }

    /// Packs the faces family by family, triangles before quadrilaterals. Returns the families.
    fn pack_faces(&self, faces: &[u32], numbers: &[u32], packed: &mut Packed) -> Vec<Value> {
        let mut by_family: BTreeMap<u16, [Vec<Vec<u32>>; 2]> = BTreeMap::new();
        let mut boxes: BTreeMap<u16, Focus> = BTreeMap::new();
        for &face in faces {
            let Some(family) = self.mesh.family_of(face).map(|family| family.0) else { continue };
            let vertices = self.mesh.face_vertices(face);
            let mut polygon: Vec<u32> = vertices.iter().map(|&vertex| numbers[vertex as usize]).collect();
            match polygon.len() {
                3 => polygon.sort_unstable(),
                _ => turn_quadrilateral(&mut polygon),
            }
            by_family.entry(family).or_default()[polygon.len() - 3].push(polygon);
            for &vertex in vertices {
                let at = self.moved[vertex as usize];
                let own = boxes.entry(family).or_insert(Focus { low: at, high: at });
                *own = Focus { low: own.low.min(at), high: own.high.max(at) };
            }
        }
        let mut families = Vec::new();
        for (family, mut polygons) in by_family {
            for (of_kind, n_vertices) in polygons.iter_mut().zip([3, 4]) {
                of_kind.sort_unstable();
                packed.polygons(of_kind, n_vertices);
            }
            // A far boundary would hide everything.
            let is_shown = boxes.get(&family).is_none_or(|own| own.size() <= 4.0 * self.focus.size());
            let name = &self.mesh.mesh.families[usize::from(family)];
            families.push(json!({
                "name": crate::text::shown(name).to_string(),
                "triangles": polygons[0].len(),
                "quadrilaterals": polygons[1].len(),
                "shown": is_shown,
            }));
        }
        families
    }

    /// Packs the cells, kind by kind, and their quality. Returns the number of each kind.
    fn pack_cells(&self, cells: &[usize], numbers: &[u32], packed: &mut Packed) -> Vec<usize> {
        let mut qualities = Vec::with_capacity(cells.len());
        let counts = CellKind::ALL.map(|kind| {
            let mut of_kind: Vec<(Vec<u32>, i8)> = Vec::new();
            for &cell in cells {
                let name = self.mesh.name(cell);
                if name.kind == kind {
                    let vertices = self.mesh.cell(name).iter().map(|&vertex| numbers[vertex as usize]);
                    let mut vertices: Vec<u32> = vertices.collect();
                    if kind == CellKind::Tet {
                        vertices.sort_unstable();
                    }
                    of_kind.push((vertices, coarse(self.values[cell] / self.best)));
                }
            }
            of_kind.sort_unstable();
            let (vertices, quality): (Vec<Vec<u32>>, Vec<i8>) = of_kind.into_iter().unzip();
            packed.polygons(&vertices, n_vertices(kind));
            qualities.extend(quality);
            vertices.len()
        });
        packed.numbers(qualities.iter().map(|quality| quality.to_le_bytes()));
        counts.to_vec()
    }

    /// The largest finite distance from another result. `None` if the scene shows no distances.
    fn furthest(&self) -> Option<f64> {
        let finite = self.distances?.iter().copied().filter(|distance| distance.is_finite());
        Some(finite.fold(f64::MIN_POSITIVE, f64::max))
    }

    /// Worst vertices.
    pub fn worst_vertices(&self, worst: &[usize]) -> Vec<Value> {
        let size = (self.focus.size() / 50.0).max(f64::MIN_POSITIVE);
        let of_vertex = |&vertex: &usize| {
            let [at, old] = [self.moved, &self.mesh.mesh.vertices[..]].map(|of| [of[vertex].to_array()]);
            json!({ "value": null, "points": at, "old": old, "size": size })
        };
        worst.iter().map(of_vertex).collect()
    }

    /// The worst cells with all digits, so that the page can measure them again.
    pub fn worst_cells(&self, worst: &[WorstCell]) -> Vec<Value> {
        let of_cell = |cell: &WorstCell| {
            let kind = CellKind::ALL.into_iter().find(|kind| kind.name() == cell.kind).unwrap_or(CellKind::Tet);
            let vertices = self.mesh.cell(CellName { kind, index: cell.index });
            let at = |of: &[DVec3]| -> Vec<[f64; 3]> {
                vertices.iter().map(|&vertex| of[vertex as usize].to_array()).collect()
            };
            json!({ "value": cell.value, "points": at(self.moved), "old": at(&self.mesh.mesh.vertices) })
        };
        worst.iter().map(of_cell).collect()
    }
}

impl<'a> std::ops::Deref for Shown<'a> {
    type Target = Subject<'a>;

    fn deref(&self) -> &Subject<'a> {
        &self.subject
    }
}

/// The powers of ten that the colours of distances span.
const DECADES: i32 = 6;

/// A distance as a share of the largest one, as a small number along a logarithmic scale. 0 stands
/// for none, and what is not a number for the largest.
fn shade(share: f64) -> u8 {
    if share.is_nan() {
        return u8::MAX;
    }
    (255.0 * (1.0 + share.log10() / f64::from(DECADES))).round().clamp(0.0, 255.0) as u8
}

/// A vertex that is not shown.
const NONE: u32 = u32::MAX;

fn n_vertices(kind: CellKind) -> usize {
    match kind {
        CellKind::Tet => 4,
        CellKind::Pyramid => 5,
        CellKind::Prism => 6,
        CellKind::Hexahedron => 8,
    }
}

/// The share of the best quality as a small number: its root, so that low qualities differ. A value
/// that is not positive stays so.
fn coarse(share: f64) -> i8 {
    let root = (127.0 * share.abs().min(1.0).sqrt()).round() as i8;
    if share > 0.0 { root.max(1) } else { -root }
}

/// Turns a quadrilateral so that its lowest vertex comes first, and the lower of its neighbours
/// second.
fn turn_quadrilateral(polygon: &mut [u32]) {
    let lowest = (0..polygon.len()).min_by_key(|&place| polygon[place]).unwrap_or(0);
    polygon.rotate_left(lowest);
    if polygon[1] > polygon[polygon.len() - 1] {
        polygon[1..].reverse();
    }
}

/// The place of a point along a curve through the unit cube that keeps neighbours near each other
/// (Morton's order).
fn z_order(point: DVec3) -> u64 {
    let spread = |value: f64| {
        let value = (value * f64::from(1 << 21)) as u64;
        (0..21).fold(0, |key, bit| key | (value >> bit & 1) << (3 * bit))
    };
    spread(point.x) | spread(point.y) << 1 | spread(point.z) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if an inverted cell passes for a valid one, a bad one for an inverted one, or what is
    /// not a number for a good one.
    #[test]
    fn coarse_quality_keeps_its_sign() {
        assert_eq!([1.0, 0.25, 1e-9, 0.0, -1e-9, -0.25, f64::NAN].map(coarse), [127, 64, 1, 0, 0, -64, -127]);
    }

    /// Fails if a distance that is not a number passes for a small one.
    #[test]
    fn shades_of_distances_span_six_decades() {
        assert_eq!([1.0, 1e-3, 1e-6, 1e-9, 0.0, f64::NAN, f64::INFINITY].map(shade), [255, 128, 0, 0, 0, 255, 255]);
    }

    /// A family of one triangle, which the design moves, and one of so many that no page holds it.
    ///
    /// Fails if a page holds all families or none.
    #[test]
    fn a_small_family_is_shown_beside_a_large_one() {
        const LARGE: u32 = 310_000;
        let at = |vertex: u32| DVec3::new(f64::from(vertex % 97), f64::from(vertex % 89), f64::from(vertex % 83));
        let wing = [DVec3::ZERO, DVec3::splat(100.0), DVec3::new(100.0, 0.0, 50.0)];
        let mesh = crate::mesh::TetMesh {
            vertices: (0..3 * LARGE + 4).map(at).chain(wing).collect(),
            tets: vec![[0, 1, 2, 3]],
            triangles: (0..LARGE)
                .map(|i| [3 * i + 4, 3 * i + 5, 3 * i + 6])
                .chain([[1, 2, 3].map(|k| 3 * LARGE + 3 + k)])
                .collect(),
            triangle_family: [vec![crate::mesh::FamilyId(0); LARGE as usize], vec![crate::mesh::FamilyId(1)]].concat(),
            families: vec!["all around".to_owned(), "wing".to_owned()],
        };
        let others = crate::mesh::OtherCells::default();
        let displacement = vec![DVec3::ZERO; mesh.vertices.len()];
        let subject = Subject {
            mesh: HybridMesh { mesh: &mesh, others: &others },
            moved: &mesh.vertices,
            displacement: &displacement,
            values: Cow::Owned(vec![0.1]),
            distances: None,
        };
        let scene = subject.scene(&["wing"], |_| Vec::new()).unwrap();
        assert_eq!(scene.part, Part::Families(IN_FAMILIES[0]));
        // Those of the tet and of the wing.
        assert_eq!(scene.meta["vertices"], 7);
    }

    #[test]
    fn a_quadrilateral_keeps_its_edges() {
        let mut polygon = [7, 9, 2, 4];
        turn_quadrilateral(&mut polygon);
        assert_eq!(polygon, [2, 4, 7, 9]);
        let mut polygon = [4, 2, 9, 7];
        turn_quadrilateral(&mut polygon);
        assert_eq!(polygon, [2, 4, 7, 9]);
    }

    /// Fails if points far apart in one direction have near numbers.
    #[test]
    fn neighbours_are_near_along_the_curve() {
        let key = |x, y, z| z_order(DVec3::new(x, y, z));
        assert_eq!(key(0.0, 0.0, 0.0), 0);
        assert!(key(0.0, 0.0, 0.0) < key(0.01, 0.01, 0.01) && key(0.01, 0.01, 0.01) < key(0.99, 0.0, 0.0));
    }
}
