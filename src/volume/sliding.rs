//! Sliding of surface vertices during local optimisation at the end of an update.
//!
//! A vertex slides on the smooth surface of its family, or along a curve. The surfaces of wings,
//! trailing edges and wingtips are the moved ones; the surface of a carenage is the original one. A
//! vertex between two families, or on a sharp edge within a family, slides along this curve only.
//!
//! These vertices stay in their places:
//!
//! - vertices where several curves meet, or where a curve ends or turns sharply
//! - vertices of fixed and prescribed families, and of periodic planes
//! - vertices of wings beside the planes of their profiles: flat facets would take them off the
//!   curved section
//!
//! Other plane families slide by the constraints of the volume. The paper has no local
//! optimisation.

use glam::DVec3;

use crate::families::Families;
use crate::families::PlacedBy;
use crate::families::shape::ShapeAtVertex;
use crate::{
    backend::Ball,
    constraint::Constraint,
    geometry::{corners, unit_normal},
    mesh::{
        TetMesh,
        csr::Csr,
        half_edge::{Surface, next},
    },
    projection::walk::{Curves, Parts},
    quality::faults,
    smoothing::SurfaceMotion,
};

/// Cosine of the least angle, 20 degrees, of a sharp edge between two triangles, or of a corner of
/// a curve.
///
/// The edges that shape an aircraft (trailing edges, tips, roots) have larger angles. On the
/// measured wing-bodies at least 98 % of the edges within families have smaller angles. The others
/// are on leading edges and noses, where it does no harm if vertices slide along them only: across
/// an edge of this angle [`TRUE_TO_SHAPE`] would allow half a percent of the shortest edge.
const SHARP: f64 = 0.939_692_620_785_908_4;

/// A vertex slides at most by this fraction of its shortest edge, divided by the angle in radians
/// between its triangles.
///
/// Facets cut the curvature of a surface, so a slide changes the shape by about this fraction of
/// the edges. With 0.005 the sections of a wing with 16 edges along its chord leave their profiles
/// by 5e-4 chords more, with 0.002 by nothing. Finer wings improve as much with either.
const TRUE_TO_SHAPE: f64 = 0.002;

/// The freedom of a surface vertex to slide.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Freedom {
    /// The vertex follows its constraint only.
    Held,
    /// The vertex slides on the smooth part of its family with this triangle.
    Surface(u32),
    /// The vertex slides along the curve through these two neighbours.
    Curve([u32; 2]),
}

/// The freedom of each surface vertex to slide. Set up once per mesh.
pub struct SurfaceFreedom {
    /// Triangles around each vertex: `n_vertices` rows.
    around: Csr,
    /// The smooth part of each triangle `[n_triangles]`.
    part: Vec<u32>,
    freedom: Vec<Freedom>,
}

impl SurfaceFreedom {
    /// Finds curves and corners on the undeformed mesh.
    ///
    /// - `shaped`: vertices of wings that stay, because the sections of wings are checked at them
    pub fn new(mesh: &TetMesh, surface: &Surface, families: &Families, shaped: &[u32]) -> Self {
        let n_vertices = mesh.vertices.len();
        let half_edges = 0..3 * surface.triangles.len() as u32;
        let starts = half_edges.clone().map(|half_edge| (surface.origin(half_edge), half_edge / 3));
        let around = Csr::from_pairs(n_vertices, starts);
        let normals: Vec<DVec3> = surface.triangles.iter().map(|triangle| normal(mesh, *triangle)).collect();
        let splits = |half_edge: u32| {
            let other = surface.opposite[half_edge as usize];
            if surface.is_diagonal(half_edge) {
                return false;
            }
            surface.family_behind(half_edge) != surface.family[half_edge as usize / 3]
                || normals[half_edge as usize / 3].dot(normals[other as usize / 3]) < SHARP
        };
        let of_curves: Vec<(u32, u32)> = half_edges
            .filter(|&half_edge| splits(half_edge))
            .map(|half_edge| (surface.origin(half_edge), surface.origin(next(half_edge))))
            .collect();
        let curves = Csr::from_pairs(n_vertices, of_curves.into_iter());
        let mut stays = vec![false; n_vertices];
        shaped.iter().for_each(|&vertex| stays[vertex as usize] = true);
        let freedom = (0..n_vertices as u32).map(|vertex| {
            if stays[vertex as usize] {
                return Freedom::Held;
            }
            let slides = families.placed_by[vertex as usize].slides() && !families.partners.is_tied(vertex);
            match curves.row(vertex as usize) {
                [] if slides && is_one_fan(surface, &around, vertex) => {
                    Freedom::Surface(around.row(vertex as usize)[0])
                }
                &[a, b] if slides && is_smooth(mesh, [a, vertex, b]) => Freedom::Curve([a, b]),
                _ => Freedom::Held,
            }
        });
        Self { freedom: freedom.collect(), part: parts(surface, splits), around }
    }

    /// The vertices that may slide, ascending.
    pub fn vertices(&self) -> Vec<u32> {
        (0..self.freedom.len() as u32).filter(|&vertex| self.freedom[vertex as usize] != Freedom::Held).collect()
    }

    /// The moved surfaces, for vertices to slide on.
    ///
    /// - `mesh`: the undeformed mesh
    /// - `at` `[n_vertices]`: positions after the surface stages, in the mesh's unit
    pub fn on<'a>(
        &'a self,
        mesh: &'a TetMesh,
        surface: &'a Surface,
        families: &'a Families,
        at: &'a [DVec3],
    ) -> SlidingSurface<'a> {
        let parts = Parts { points: at, triangles: &surface.triangles, around: &self.around, part: &self.part };
        SlidingSurface { freedom: &self.freedom, original: &mesh.vertices, surface, families, parts }
    }
}

/// Moved surfaces on which vertices slide.
pub struct SlidingSurface<'a> {
    freedom: &'a [Freedom],
    /// Undeformed positions `[n_vertices]`.
    original: &'a [DVec3],
    surface: &'a Surface,
    families: &'a Families,
    /// The moved surface in its smooth parts.
    parts: Parts<'a>,
}

impl SlidingSurface<'_> {
    fn curves(&self) -> Curves<'_, impl Fn(u32) -> Option<[u32; 2]>> {
        let beside = |vertex: u32| match self.freedom[vertex as usize] {
            Freedom::Curve(beside) => Some(beside),
            _ => None,
        };
        Curves { points: self.parts.points, beside }
    }

    /// The original surface of a vertex inside a carenage.
    fn original_surface(&self, vertex: u32) -> Option<ShapeAtVertex<'_>> {
        self.families.shapes_at(vertex).next()
    }

    /// The largest slide of a vertex, in the mesh's unit: the larger the angles between its
    /// triangles, the smaller. There is no limit on carenages and planes, which keep their shape.
    fn true_to_shape(&self, vertex: u32) -> f64 {
        if self.families.placed_by[vertex as usize] == PlacedBy::Carenage {
            return f64::INFINITY;
        }
        let point = |vertex: u32| self.parts.points[vertex as usize];
        let start = point(vertex);
        let mut turn = 0.0f64;
        if let Freedom::Curve([before, after]) = self.freedom[vertex as usize] {
            let along = [start - point(before), point(after) - start].map(DVec3::normalize_or_zero);
            turn = along[0].distance(along[1]);
        }
        let changes = |&triangle: &u32| self.families.shapes[self.surface.family[triangle as usize].index()].is_none();
        let around: Vec<u32> = self.parts.around.row(vertex as usize).iter().copied().filter(changes).collect();
        for &triangle in &around {
            let normal = self.parts.facet_normal(triangle);
            let part = |triangle: u32| self.parts.part[triangle as usize];
            let of_part = around.iter().filter(|&&other| part(other) == part(triangle));
            turn = of_part.map(|&other| normal.distance(self.parts.facet_normal(other))).fold(turn, f64::max);
        }
        let ends = around.iter().flat_map(|&triangle| self.parts.triangles[triangle as usize]);
        let lengths = ends.filter(|&end| end != vertex).map(|end| start.distance(point(end)));
        TRUE_TO_SHAPE * lengths.fold(f64::INFINITY, f64::min) / turn
    }
}

impl SurfaceMotion for SlidingSurface<'_> {
    fn tangent(&self, vertex: u32, at: DVec3) -> Constraint {
        match self.freedom[vertex as usize] {
            Freedom::Held => Constraint::Held,
            Freedom::Surface(start) => Constraint::InPlane(match self.original_surface(vertex) {
                Some(kept) => kept.normal(at),
                None => self.parts.normal(&self.parts.closest(start, at)),
            }),
            Freedom::Curve(_) => {
                let curves = self.curves();
                Constraint::OnLine(curves.direction(&curves.closest(vertex, at)))
            }
        }
    }

    fn reach(&self, vertex: u32) -> Option<Ball> {
        let radius = self.true_to_shape(vertex);
        radius.is_finite().then(|| Ball { centre: self.parts.points[vertex as usize], radius })
    }

    fn back(&self, vertex: u32, at: DVec3) -> DVec3 {
        let start = self.parts.points[vertex as usize];
        let at = start + (at - start).clamp_length_max(self.true_to_shape(vertex));
        let near = match self.freedom[vertex as usize] {
            Freedom::Held => return at,
            Freedom::Surface(_) if self.original_surface(vertex).is_some() => at,
            Freedom::Surface(start) => self.parts.closest(start, at).point,
            Freedom::Curve(_) => self.curves().closest(vertex, at).point,
        };
        let settled = self.families.settle(vertex, near);
        match self.families.plane_constraint(vertex) {
            Constraint::Free => settled,
            // Rounding must not take the vertex off its plane.
            plane => start + plane.limit(settled - start),
        }
    }

    fn folded(&self, at: &[DVec3]) -> usize {
        faults::folded(self.original, at, &self.surface.triangles, &self.surface.opposite).len()
    }
}

fn normal(mesh: &TetMesh, triangle: [u32; 3]) -> DVec3 {
    unit_normal(corners(&mesh.vertices, triangle))
}

/// Whether a curve passes its middle vertex without a corner.
fn is_smooth(mesh: &TetMesh, curve: [u32; 3]) -> bool {
    let [a, b, c] = corners(&mesh.vertices, curve);
    (b - a).normalize_or_zero().dot((c - b).normalize_or_zero()) >= SHARP
}

/// Whether the triangles around a vertex form one closed fan.
fn is_one_fan(surface: &Surface, around: &Csr, vertex: u32) -> bool {
    let row = around.row(vertex as usize);
    let Some(&first) = row.first() else { return false };
    let start = (3 * first..3 * first + 3).find(|&half_edge| surface.origin(half_edge) == vertex);
    let turn = |half_edge: &u32| Some(surface.opposite[next(next(*half_edge)) as usize]);
    let met = std::iter::successors(start, turn).skip(1).position(|half_edge| Some(half_edge) == start);
    met.is_some_and(|steps| steps + 1 == row.len())
}

/// Numbers the parts of the surface `[n_triangles]`. Edges for which `splits` is true bound the
/// parts.
fn parts(surface: &Surface, splits: impl Fn(u32) -> bool) -> Vec<u32> {
    let mut part = vec![u32::MAX; surface.triangles.len()];
    let mut front = Vec::new();
    for first in 0..surface.triangles.len() as u32 {
        if part[first as usize] != u32::MAX {
            continue;
        }
        part[first as usize] = first;
        front.push(first);
        while let Some(triangle) = front.pop() {
            for half_edge in (3 * triangle..3 * triangle + 3).filter(|&half_edge| !splits(half_edge)) {
                let other = surface.opposite[half_edge as usize] / 3;
                if part[other as usize] == u32::MAX {
                    part[other as usize] = first;
                    front.push(other);
                }
            }
        }
    }
    part
}
