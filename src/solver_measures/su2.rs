//! [`Su2`]: the measures of the dual volumes that SU2 prints.
//!
//! The dual volume of a vertex is bounded by facets between the middles of edges, faces and cells
//! at the vertex. A middle is the mean of the corners. An edge has one dual face, the sum of the
//! facets of all cells around it, with the area vector `A` along the edge `e` from the vertex.
//!
//! | measure of a vertex | formula |
//! |---|---|
//! | orthogonality, in degrees | 90 minus the angle between `A` and `e`, the mean over the edges, weighted by `\|A\|` |
//! | aspect ratio | largest over smallest `\|A\|`, of the edges and of the vertex's part in each family |
//! | volume ratio | largest over smallest of the tets vertex, edge, face and cell that make up the dual volume |
//! | dual volume | the sum of these tets |
//!
//! In a tet with the volume `V` all parts are `V / 24`, and the dual face of the edge from `v` to
//! `w` has the area vector `(p + q - v - w) x (q - p) / 24`, where `v w p q` turn as in the tet.
//!
//! SU2 takes volumes of the tets without their sign, so an inverted cell does not show in them.
//! SU2 prints orthogonality, aspect ratio and volume ratio ("Mesh Quality Metric"), each with its
//! smallest and its largest value. A family inside the volume is taken for an `INTERNAL_BOUNDARY`.
//! SU2 begins the search of a smallest area or volume at 1e6; here the unit does not matter.
//!
//! Source: SU2 8, `CEdge` and `CPhysicalGeometry` with `ComputeMeshQualityStatistics`,
//! `SetControlVolume` and `SetBoundControlVolume`, for three dimensions. The paper has beta alone.

use std::ops::Range;

use glam::DVec3;

use super::{Connections, Limits, Tally, limits::Limited};
use crate::mesh::{FamilyId, HybridMesh, corners::faces_of, in_pieces, middle_of_cell};

/// The measures of SU2. Their places are vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Su2 {
    /// Orthogonality of the dual volumes, in degrees; 90 is best.
    pub orthogonality: Tally,
    /// Largest orthogonality.
    pub orthogonality_max: f64,
    /// Aspect ratio of the areas of a dual volume; 1 is best.
    pub aspect_ratio: Tally,
    /// Smallest aspect ratio.
    pub aspect_ratio_min: f64,
    /// Ratio of the tets of a dual volume; 1 is best.
    pub volume_ratio: Tally,
    /// Smallest ratio.
    pub volume_ratio_min: f64,
    /// Smallest and largest dual volume, in the cube of the mesh's unit.
    pub volume: [f64; 2],
}

impl Su2 {
    /// Measures a mesh.
    ///
    /// - `vertices` `[n_vertices]`: in the order of the connections, as are all places
    /// - others: as for [`super::SolverMeasures::of`]
    pub(super) fn of(connections: &Connections, vertices: &[DVec3], limits: &Limits) -> Self {
        let mesh = connections.mesh();
        let mut all = Self::new(limits);
        let of_pieces = in_pieces(vertices.len(), |range| Self::of_some(mesh, connections, vertices, limits, range));
        of_pieces.iter().for_each(|of_piece| all.join(of_piece));
        all
    }

    fn new(limits: &Limits) -> Self {
        Self {
            orthogonality: limits.tally(Limited::DualOrthogonality),
            orthogonality_max: f64::NEG_INFINITY,
            aspect_ratio: limits.tally(Limited::DualAspectRatio),
            aspect_ratio_min: f64::INFINITY,
            volume_ratio: limits.tally(Limited::DualVolumeRatio),
            volume_ratio_min: f64::INFINITY,
            volume: [f64::INFINITY, f64::NEG_INFINITY],
        }
    }

    fn of_some(
        mesh: HybridMesh,
        connections: &Connections,
        vertices: &[DVec3],
        limits: &Limits,
        some: Range<usize>,
    ) -> Self {
        let mut all = Self::new(limits);
        let mut room = Room::default();
        for vertex in some {
            if let Some(dual) = Dual::of(mesh, connections, vertices, vertex as u32, &mut room) {
                all.add(&dual, vertex as u32);
            }
        }
        all
    }

    fn add(&mut self, dual: &Dual, vertex: u32) {
        let Dual { orthogonality, aspect_ratio, volume_ratio, volume } = *dual;
        self.orthogonality.add(orthogonality, vertex);
        self.aspect_ratio.add(aspect_ratio, vertex);
        self.volume_ratio.add(volume_ratio, vertex);
        self.orthogonality_max = self.orthogonality_max.max(orthogonality);
        self.aspect_ratio_min = self.aspect_ratio_min.min(aspect_ratio);
        self.volume_ratio_min = self.volume_ratio_min.min(volume_ratio);
        self.volume = [self.volume[0].min(volume), self.volume[1].max(volume)];
    }

    /// Gives all places the names that they have in another order.
    pub(super) fn rename(&mut self, vertex: impl Fn(u32) -> u32) {
        [&mut self.orthogonality, &mut self.aspect_ratio, &mut self.volume_ratio]
            .into_iter()
            .for_each(|tally| tally.rename(&vertex));
    }

    fn join(&mut self, other: &Self) {
        self.orthogonality.join(&other.orthogonality);
        self.aspect_ratio.join(&other.aspect_ratio);
        self.volume_ratio.join(&other.volume_ratio);
        self.orthogonality_max = self.orthogonality_max.max(other.orthogonality_max);
        self.aspect_ratio_min = self.aspect_ratio_min.min(other.aspect_ratio_min);
        self.volume_ratio_min = self.volume_ratio_min.min(other.volume_ratio_min);
        self.volume = [self.volume[0].min(other.volume[0]), self.volume[1].max(other.volume[1])];
    }
}

/// Room for the parts of one dual volume.
#[derive(Default)]
struct Room {
    /// By the other end of each edge, the area vector of its dual face.
    edges: Sums<u32>,
    /// By family, the area vector of the vertex's part in it.
    families: Sums<FamilyId>,
}

/// Area vectors by a key. The few keys of a vertex stand close together, so a search is fast.
struct Sums<K> {
    keys: Vec<K>,
    areas: Vec<DVec3>,
}

impl<K> Default for Sums<K> {
    fn default() -> Self {
        Self { keys: Vec::new(), areas: Vec::new() }
    }
}

impl<K: Copy + PartialEq> Sums<K> {
    fn clear(&mut self) {
        self.keys.clear();
        self.areas.clear();
    }

    /// Adds an area vector to the sum of its edge or family.
    fn add(&mut self, key: K, area: DVec3) {
        match self.keys.iter().position(|&other| other == key) {
            Some(place) => self.areas[place] += area,
            None => {
                self.keys.push(key);
                self.areas.push(area);
            }
        }
    }
}

/// The measures of one dual volume.
struct Dual {
    orthogonality: f64,
    aspect_ratio: f64,
    volume_ratio: f64,
    volume: f64,
}

impl Dual {
    /// The dual volume of a vertex. `None` if no cell has the vertex.
    fn of(
        mesh: HybridMesh,
        connections: &Connections,
        vertices: &[DVec3],
        vertex: u32,
        room: &mut Room,
    ) -> Option<Self> {
        let Room { edges, families } = room;
        edges.clear();
        families.clear();
        let at = |vertex: u32| vertices[vertex as usize];
        let own = at(vertex);
        let (mut volume, mut least, mut most) = (0.0, f64::INFINITY, 0.0_f64);
        for &cell in connections.cells_at.row(vertex as usize) {
            let cell = mesh.cell(mesh.name(cell as usize));
            if let &[a, b, c, d] = cell {
                let [w, p, q] = turned_to(vertex, [a, b, c, d]);
                let [ew, ep, eq] = [w, p, q].map(|other| at(other) - own);
                for (other, along, [p, q]) in [(w, ew, [ep, eq]), (p, ep, [eq, ew]), (q, eq, [ew, ep])] {
                    edges.add(other, (1.0 / 24.0) * (p + q - along).cross(q - p));
                }
                let part = ew.cross(ep).dot(eq).abs() / 144.0;
                volume += 6.0 * part;
                (least, most) = (least.min(part), most.max(part));
                continue;
            }
            let centre = middle_of_cell(cell, vertices);
            for face in faces_of(cell) {
                let corners = face.vertices();
                let n = corners.len();
                let Some(place) = corners.iter().position(|&corner| corner == vertex) else { continue };
                let middle = corners.iter().map(|&corner| at(corner)).sum::<DVec3>() / n as f64;
                // Seen from outside, the face runs from the vertex to the next corner, and from the
                // last one to the vertex.
                for (other, sign) in [(corners[(place + 1) % n], 0.5), (corners[(place + n - 1) % n], -0.5)] {
                    let of_edge = 0.5 * (own + at(other));
                    let area = sign * (centre - of_edge).cross(middle - of_edge);
                    edges.add(other, area);
                    let tet = (of_edge - own).cross(middle - own).dot(centre - own).abs() / 6.0;
                    volume += tet;
                    (least, most) = (least.min(tet), most.max(tet));
                }
            }
        }
        for &face in connections.boundary_at.row(vertex as usize) {
            let (face, family) = connections.boundary[face as usize];
            let corners = face.vertices();
            let n = corners.len();
            let place = corners.iter().position(|&corner| corner == vertex)?;
            let centre = corners.iter().map(|&corner| at(corner)).sum::<DVec3>() / n as f64 - own;
            let [next, last] = [place + 1, place + n - 1].map(|place| 0.5 * (at(corners[place % n]) - own));
            families.add(family, 0.5 * (next.cross(centre) + centre.cross(last)));
        }
        let (mut sum, mut whole) = (0.0, 0.0);
        let mut areas = [f64::INFINITY, 0.0_f64];
        let mut count = |area: f64| areas = [areas[0].min(area), areas[1].max(area)];
        for (&other, normal) in edges.keys.iter().zip(&edges.areas) {
            let edge = at(other) - own;
            let area = normal.length();
            let cosine = normal.dot(edge) / (area * edge.length());
            sum += area * (90.0 - cosine.clamp(-1.0, 1.0).acos().to_degrees());
            whole += area;
            count(area);
        }
        families.areas.iter().for_each(|normal| count(normal.length()));
        let [smallest, largest] = areas;
        (!edges.keys.is_empty()).then(|| Self {
            orthogonality: sum / whole,
            aspect_ratio: largest / smallest,
            volume_ratio: most / least,
            volume,
        })
    }
}

/// The other vertices of a tet, which turn with the vertex as the tet does.
fn turned_to(vertex: u32, [a, b, c, d]: [u32; 4]) -> [u32; 3] {
    match vertex {
        _ if vertex == a => [b, c, d],
        _ if vertex == b => [a, d, c],
        _ if vertex == c => [d, a, b],
        _ => [c, b, a],
    }
}
