//! [`OpenFoam`]: the measures of faces and cells that OpenFOAM's `checkMesh` prints.
//!
//! With a face's centre `f` and area vector `A`, the centres `c` of its cells and `d = c2 - c1`:
//!
//! | measure | formula |
//! |---|---|
//! | `f`, `A` of a triangle | the mean of the corners; half the cross product of two edges |
//! | `f`, `A` of a quadrilateral | of the triangles around the mean of the corners: the sum of their area vectors, and the mean of their centres, weighted by area |
//! | `c`, `V` of a cell | of the pyramids from the mean of the face centres to the faces: the sum of their volumes, and the mean of their centres, weighted by volume |
//! | non-orthogonality, of a face between two cells | the angle between `d` and `A`; the mean is that of the angle's cosine |
//! | skewness of a face between two cells | the distance of `f` from the point where the line through `c1` and `c2` meets the face, over the larger of `0.2 \|d\|` and the face's extent in this direction from `f` |
//! | skewness of a boundary face | the same for the line from `c` along the normal, with `0.4 \|d\|`, where `d` ends on the face |
//! | aspect ratio of a cell | the larger of two: the largest over the smallest component of the sum of `\|A\|` by components; and a sixth of the sum of the components over `V^(2/3)` |
//! | face pyramid | the pyramid from `c` to a face of its cell; a wrong one has a negative volume |
//!
//! Source: OpenFOAM v1912, `primitiveMeshTools`, `primitiveMeshCheck` and
//! `primitiveMeshFaceCentresAndAreas`, for meshes without `empty`, `wedge` and coupled patches.
//! `checkMesh` counts face pyramids below -1e-15 in the cube of the mesh's unit. Here all negative
//! ones count, so that the unit does not matter. The paper has beta alone.

use std::ops::Range;

use glam::DVec3;

use super::{Bad, Connections, Limits, Tally, limits::Limited};
use crate::mesh::{
    HybridMesh,
    corners::faces_of,
    half_face::{BOUNDARY, FACE, cell_of, face_vertices},
    in_pieces,
};

/// A face beyond this angle is severely non-orthogonal, in degrees: `checkMesh` counts such faces,
/// and passes them.
pub const SEVERE: f64 = 70.0;

/// A face whose cosine is not above this is taken to be beyond a right angle.
const RIGHT: f64 = 1e-15;

/// The measures of `checkMesh`. Volumes are in the cube of the mesh's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenFoam {
    /// Non-orthogonality of the faces between two cells, in degrees, at the first cell of the face.
    pub non_orthogonality: Tally,
    /// The angle whose cosine is the mean of the faces' cosines, in degrees. NaN if no face lies
    /// between two cells.
    pub non_orthogonality_mean: f64,
    /// Number of faces beyond [`SEVERE`].
    pub severely_non_orthogonal: usize,
    /// Skewness of all faces, at the first cell of the face.
    pub skewness: Tally,
    /// Aspect ratio of the cells.
    pub aspect_ratio: Tally,
    /// Volumes of the face pyramids, at their cells. [`Tally::beyond`] counts the negative ones.
    pub pyramids: Tally,
    /// Smallest and largest volume of a cell.
    pub volume: [f64; 2],
}

impl OpenFoam {
    /// Measures a mesh.
    ///
    /// - `vertices` `[n_vertices]`: in the order of the connections, as are all places
    /// - others: as for [`super::SolverMeasures::of`]
    pub(super) fn of(connections: &Connections, vertices: &[DVec3], limits: &Limits) -> Self {
        let mesh = connections.mesh();
        let cells = in_pieces(mesh.n_cells(), |range| OfCells::of(mesh, vertices, limits, range));
        let mut all = OfCells::new(limits);
        let mut centres = Vec::with_capacity(mesh.n_cells());
        for mut of_piece in cells {
            centres.append(&mut of_piece.centres);
            all.aspect_ratio.join(&of_piece.aspect_ratio);
            all.pyramids.join(&of_piece.pyramids);
            all.volume = [all.volume[0].min(of_piece.volume[0]), all.volume[1].max(of_piece.volume[1])];
        }
        let n_half_faces = connections.faces.opposite.len();
        let faces = in_pieces(n_half_faces, |range| OfFaces::of(mesh, connections, vertices, &centres, limits, range));
        let mut of_faces = OfFaces::new(limits);
        faces.iter().for_each(|of_piece| of_faces.join(of_piece));
        Self {
            non_orthogonality: of_faces.non_orthogonality,
            non_orthogonality_mean: degrees(of_faces.sum_of_cosines / of_faces.n_inner as f64),
            severely_non_orthogonal: of_faces.severe,
            skewness: of_faces.skewness,
            aspect_ratio: all.aspect_ratio,
            pyramids: all.pyramids,
            volume: all.volume,
        }
    }

    /// Gives all places the names that they have in another order.
    pub(super) fn rename(&mut self, cell: impl Fn(u32) -> u32) {
        [&mut self.non_orthogonality, &mut self.skewness, &mut self.aspect_ratio, &mut self.pyramids]
            .into_iter()
            .for_each(|tally| tally.rename(&cell));
    }
}

/// The angle with this cosine, in degrees.
fn degrees(cosine: f64) -> f64 {
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

/// The measures of some cells.
struct OfCells {
    centres: Vec<DVec3>,
    aspect_ratio: Tally,
    pyramids: Tally,
    volume: [f64; 2],
}

impl OfCells {
    fn new(limits: &Limits) -> Self {
        Self {
            centres: Vec::new(),
            aspect_ratio: limits.tally(Limited::AspectRatio),
            pyramids: Tally::new(Bad::Small, Some(0.0)),
            volume: [f64::INFINITY, f64::NEG_INFINITY],
        }
    }

    fn of(mesh: HybridMesh, vertices: &[DVec3], limits: &Limits, cells: Range<usize>) -> Self {
        let mut all = Self::new(limits);
        all.centres.reserve_exact(cells.len());
        for cell in cells {
            all.add(mesh.cell(mesh.name(cell)), cell as u32, vertices);
        }
        all
    }

    fn add(&mut self, cell: &[u32], number: u32, vertices: &[DVec3]) {
        let mut faces = [FacePlace::default(); 6];
        let mut n_faces = 0;
        if let &[a, b, c, d] = cell {
            for face in FACE {
                faces[n_faces] = FacePlace::of(&face.map(|local| [a, b, c, d][local]), vertices);
                n_faces += 1;
            }
        } else {
            for face in faces_of(cell) {
                faces[n_faces] = FacePlace::of(face.vertices(), vertices);
                n_faces += 1;
            }
        }
        let faces = &faces[..n_faces];
        let middle = faces.iter().map(|face| face.centre).sum::<DVec3>() / n_faces as f64;
        let (mut volume, mut moment, mut areas) = (0.0, DVec3::ZERO, DVec3::ZERO);
        for face in faces {
            let triple = face.area.dot(face.centre - middle);
            volume += triple;
            moment += triple * (0.75 * face.centre + 0.25 * middle);
            areas += face.area.abs();
        }
        let centre = if volume == 0.0 { middle } else { moment / volume };
        volume /= 3.0;
        for face in faces {
            self.pyramids.add(face.area.dot(face.centre - centre) / 3.0, number);
        }
        let by_axis = areas.max_element() / areas.min_element();
        let by_volume = if volume > 0.0 { areas.element_sum() / 6.0 / volume.powf(2.0 / 3.0) } else { f64::INFINITY };
        // Nothing is left of a cell without areas.
        let ratio = if areas == DVec3::ZERO { f64::INFINITY } else { by_axis.max(by_volume) };
        self.aspect_ratio.add(if volume.is_nan() { f64::NAN } else { ratio }, number);
        self.volume = [self.volume[0].min(volume), self.volume[1].max(volume)];
        self.centres.push(centre);
    }
}

/// Centre and area vector of a face.
#[derive(Clone, Copy, Default)]
struct FacePlace {
    centre: DVec3,
    area: DVec3,
}

impl FacePlace {
    fn of(face: &[u32], vertices: &[DVec3]) -> Self {
        let at = |place: usize| vertices[face[place] as usize];
        if face.len() == 3 {
            let [a, b, c] = [at(0), at(1), at(2)];
            return Self { centre: (a + b + c) / 3.0, area: 0.5 * (b - a).cross(c - a) };
        }
        let n = face.len();
        let middle = (0..n).map(at).sum::<DVec3>() / n as f64;
        let (mut area, mut weight, mut moment) = (DVec3::ZERO, 0.0, DVec3::ZERO);
        for place in 0..n {
            let (a, b) = (at(place), at((place + 1) % n));
            let normal = (b - a).cross(middle - a);
            let length = normal.length();
            area += 0.5 * normal;
            weight += length;
            moment += length * (a + b + middle) / 3.0;
        }
        Self { centre: if weight > 0.0 { moment / weight } else { middle }, area }
    }
}

/// The measures of some faces.
struct OfFaces {
    non_orthogonality: Tally,
    /// The cosine of the worst face.
    least_cosine: f64,
    skewness: Tally,
    sum_of_cosines: f64,
    n_inner: usize,
    severe: usize,
}

impl OfFaces {
    fn new(limits: &Limits) -> Self {
        Self {
            non_orthogonality: limits.tally(Limited::NonOrthogonality),
            least_cosine: f64::INFINITY,
            skewness: limits.tally(Limited::Skewness),
            sum_of_cosines: 0.0,
            n_inner: 0,
            severe: 0,
        }
    }

    fn join(&mut self, other: &Self) {
        self.non_orthogonality.join(&other.non_orthogonality);
        self.skewness.join(&other.skewness);
        self.sum_of_cosines += other.sum_of_cosines;
        self.n_inner += other.n_inner;
        self.severe += other.severe;
    }

    /// - `centres` `[n_cells]`: of the cells
    fn of(
        mesh: HybridMesh,
        connections: &Connections,
        vertices: &[DVec3],
        centres: &[DVec3],
        limits: &Limits,
        half_faces: Range<usize>,
    ) -> Self {
        let mut all = Self::new(limits);
        // Angles a little below the least limit count as beyond it here.
        let least_limit = all.non_orthogonality.limit().unwrap_or(SEVERE).min(SEVERE);
        let calm = (least_limit - 1e-3).to_radians().cos();
        for half_face in half_faces.start as u32..half_faces.end as u32 {
            let opposite = connections.faces.opposite[half_face as usize];
            // Of two half-faces the lower one counts.
            if !connections.faces.is_face(half_face) || (opposite != BOUNDARY && opposite < half_face) {
                continue;
            }
            let cell = cell_of(mesh, half_face);
            let corners = face_vertices(mesh, half_face);
            let face = FacePlace::of(corners.vertices(), vertices);
            let own = centres[cell as usize];
            let to_face = face.centre - own;
            let (between, part) = match opposite {
                BOUNDARY => {
                    let normal = face.area.normalize_or_zero();
                    (normal * normal.dot(to_face), 0.4)
                }
                other => {
                    let between = centres[cell_of(mesh, other) as usize] - own;
                    let lengths = between.length() * face.area.length();
                    let cosine = if lengths == 0.0 { 0.0 } else { between.dot(face.area) / lengths };
                    // `checkMesh` takes a face with such a cosine for an error.
                    let least = if cosine <= RIGHT { 90.0_f64.next_up() } else { 0.0 };
                    // Most faces are neither the worst so far nor beyond a limit, and an angle
                    // takes time.
                    if cosine.is_nan() || cosine < calm || cosine < all.least_cosine {
                        let angle = degrees(cosine).max(least);
                        all.non_orthogonality.add(angle, cell);
                        all.severe += usize::from(angle > SEVERE);
                        all.least_cosine = all.least_cosine.min(cosine);
                    }
                    all.sum_of_cosines += cosine;
                    all.n_inner += 1;
                    (between, 0.2)
                }
            };
            let off = to_face - between * (face.area.dot(to_face) / face.area.dot(between));
            let distance = off.length();
            let direction = off.normalize_or_zero();
            let extent = |vertex: &u32| direction.dot(vertices[*vertex as usize] - face.centre).abs();
            let size = corners.vertices().iter().map(extent).fold(part * between.length(), f64::max);
            all.skewness.add(if distance == 0.0 { 0.0 } else { distance / size }, cell);
        }
        all
    }
}
