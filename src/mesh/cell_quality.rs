//! Quality of cells of all kinds, by their corner tets ([`super::corners`]).
//!
//! | measure | formula |
//! |---|---|
//! | volume of a corner | `det(e1, e2, e3) / 6`, with the corner's edges `e` |
//! | scaled Jacobian of a corner | `det(e1, e2, e3) / (\|e1\| \|e2\| \|e3\|)` |
//! | scaled Jacobian of a cell | the smallest of its corners |
//! | shape q of a corner | `3 s^(2/3) / \|S\|^2`, with `S = A W^-1`, `s = det S`, and the edges `A` now and `W` in the undeformed mesh |
//! | volume of a cell | the divergence theorem; a quadrilateral counts as the mean of its two divisions |
//!
//! A cell is *inverted* if the volume of a corner or of the cell is not positive. For a tet the
//! three volumes are one. A cell without corners, which names too few different vertices, is
//! inverted, and its measures are 0. P. Knupp, *Achieving finite element mesh quality via
//! optimization of the Jacobian matrix norm and associated quantities* (Int. J. Numer. Meth. Engng
//! 48, 2000), has the measures. The paper has tets only.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    CellKind, HybridMesh,
    corners::{corner_tets, faces_of},
};
use crate::geometry;
use crate::quality::{self, determinant, edges_of_corner, faults::is_inverted, lesser, scaled_jacobian, shape_cubed};

/// The worst corner of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorstCorner {
    /// The vertex of the corner. `None` if all corners are good, and the volume of the whole cell
    /// is not.
    pub corner: Option<u32>,
    /// Volume of the corner tet or of the cell, in the cube of the mesh's unit. NaN if one is NaN.
    pub volume: f64,
}

/// The smallest volume of a cell's corners; or the cell's own, if it is not positive and those of
/// the corners are.
///
/// - `vertices` `[n_vertices]`: positions, in any unit
pub fn worst_corner(cell: &[u32], vertices: &[DVec3]) -> WorstCorner {
    if let [a, b, c, d] = *cell {
        let volume = quality::volume(geometry::corners(vertices, [a, b, c, d]));
        return WorstCorner { corner: Some(a), volume };
    }
    let mut tets = Vec::with_capacity(8);
    corner_tets(cell, &mut tets);
    let volume = |tet: [u32; 4]| quality::volume(geometry::corners(vertices, tet));
    let worse = |a: WorstCorner, b: WorstCorner| if a.volume.is_nan() || a.volume <= b.volume { a } else { b };
    let corners = tets.into_iter().map(|tet| WorstCorner { corner: Some(tet[0]), volume: volume(tet) });
    // Nothing is left of a cell without corners.
    let Some(worst) = corners.reduce(worse) else { return WorstCorner { corner: None, volume: 0.0 } };
    let whole = if worst.volume > 0.0 { cell_volume(cell, vertices) } else { f64::INFINITY };
    if whole > 0.0 { worst } else { WorstCorner { corner: None, volume: whole } }
}

/// Volume of a cell by the divergence theorem, in the cube of the mesh's unit. A quadrilateral
/// counts as the mean of its two divisions into triangles.
///
/// - `vertices` `[n_vertices]`: positions, in any unit
pub fn cell_volume(cell: &[u32], vertices: &[DVec3]) -> f64 {
    let centre = middle_of_cell(cell, vertices);
    let at = |vertex: u32| vertices[vertex as usize] - centre;
    let of_triangle = |a: u32, b: u32, c: u32| at(a).dot(at(b).cross(at(c))) / 6.0;
    let of_face = |face: &[u32]| match *face {
        [a, b, c, d] => {
            let both = of_triangle(a, b, c) + of_triangle(a, c, d) + of_triangle(b, c, d) + of_triangle(b, d, a);
            0.5 * both
        }
        [a, b, c] => of_triangle(a, b, c),
        _ => 0.0,
    };
    faces_of(cell).map(|face| of_face(face.vertices())).sum()
}

/// The mean of a cell's vertices, in the mesh's unit.
///
/// - `vertices` `[n_vertices]`: positions, in any unit
pub fn middle_of_cell(cell: &[u32], vertices: &[DVec3]) -> DVec3 {
    cell.iter().map(|&vertex| vertices[vertex as usize]).sum::<DVec3>() / cell.len() as f64
}

/// The quality of all cells of one kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KindQuality {
    /// The kind.
    pub kind: CellKind,
    /// Number of cells.
    pub count: usize,
    /// Number of inverted cells.
    pub inverted: usize,
    /// Smallest scaled Jacobian. NaN if one is NaN.
    pub jacobian_min: f64,
    /// Mean scaled Jacobian.
    pub jacobian_mean: f64,
    /// Smallest shape against the undeformed mesh. `None` if there is none to compare with.
    pub shape_min: Option<f64>,
}

/// The measures of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellMeasures {
    /// Scaled Jacobian of the worst corner. NaN if one is NaN.
    pub jacobian: f64,
    /// The cube of [`CellMeasures::shape`]. Most callers ask for the smallest shape alone, and a
    /// root for each cell would take longer than the rest.
    shape_cubed: f64,
    /// Whether the cell is inverted.
    pub inverted: bool,
}

impl CellMeasures {
    /// Shape q of the worst corner against the undeformed mesh; 1 without one. NaN if one is NaN.
    pub fn shape(&self) -> f64 {
        self.shape_cubed.cbrt()
    }
}

/// The measures of all cells `[n_cells]`, in the order of [`HybridMesh`].
///
/// - `vertices` `[n_vertices]`: positions, in the mesh's unit
/// - `undeformed` `[n_vertices]`: positions in the undeformed mesh, if `vertices` come from a
///   motion
pub fn measures(mesh: HybridMesh, vertices: &[DVec3], undeformed: Option<&[DVec3]>) -> Vec<CellMeasures> {
    let measure = |tets: &mut Vec<[u32; 4]>, cell: usize| measure(mesh, cell, vertices, undeformed, tets);
    (0..mesh.n_cells()).into_par_iter().map_init(|| Vec::with_capacity(8), measure).collect()
}

/// [`measures()`] of one cell.
///
/// - `cell`: its number in the order of [`HybridMesh`]
pub fn measures_of_cell(
    mesh: HybridMesh,
    cell: usize,
    vertices: &[DVec3],
    undeformed: Option<&[DVec3]>,
) -> CellMeasures {
    measure(mesh, cell, vertices, undeformed, &mut Vec::with_capacity(8))
}

/// The measures of a cell.
///
/// - `tets`: room for its corner tets
fn measure(
    mesh: HybridMesh,
    cell: usize,
    vertices: &[DVec3],
    undeformed: Option<&[DVec3]>,
    tets: &mut Vec<[u32; 4]>,
) -> CellMeasures {
    match mesh.cell(mesh.name(cell)) {
        &[a, b, c, d] => measures_of_tet([a, b, c, d], vertices, undeformed),
        cell => {
            tets.clear();
            corner_tets(cell, tets);
            measures_by_corners(cell, tets, vertices, undeformed)
        }
    }
}

/// The measures of a tet. Its four corners share one volume and one shape, but not one scaled
/// Jacobian.
fn measures_of_tet([a, b, c, d]: [u32; 4], vertices: &[DVec3], undeformed: Option<&[DVec3]>) -> CellMeasures {
    let corners = [[a, b, c, d], [b, a, d, c], [c, d, a, b], [d, c, b, a]];
    let jacobians = corners.map(|tet| scaled_jacobian(geometry::corners(vertices, tet)));
    let edges = |from: &[DVec3]| edges_of_corner(geometry::corners(from, corners[0]));
    CellMeasures {
        jacobian: jacobians.into_iter().fold(f64::INFINITY, lesser),
        shape_cubed: undeformed.map_or(1.0, |from| shape_cubed(edges(vertices), edges(from))),
        inverted: is_inverted(determinant(edges(vertices))),
    }
}

/// The measures of a cell that is no tet.
///
/// - `tets`: its corner tets, of [`corner_tets`]
fn measures_by_corners(
    cell: &[u32],
    tets: &[[u32; 4]],
    vertices: &[DVec3],
    undeformed: Option<&[DVec3]>,
) -> CellMeasures {
    let mut least = CellMeasures { jacobian: f64::INFINITY, shape_cubed: f64::INFINITY, inverted: false };
    for &tet in tets {
        let now = geometry::corners(vertices, tet);
        let edges = edges_of_corner(now);
        let cubed = undeformed.map_or(1.0, |from| shape_cubed(edges, edges_of_corner(geometry::corners(from, tet))));
        least.jacobian = lesser(least.jacobian, scaled_jacobian(now));
        least.shape_cubed = lesser(least.shape_cubed, cubed);
        least.inverted |= is_inverted(determinant(edges));
    }
    if tets.is_empty() {
        // Nothing is left of a cell without corners. Its volume of 0 carries rounding errors.
        return CellMeasures { jacobian: 0.0, shape_cubed: 0.0, inverted: true };
    }
    least.inverted |= is_inverted(cell_volume(cell, vertices));
    least
}

/// The quality of each kind of cell that a mesh has.
///
/// - `measures` `[n_cells]`: of [`measures()`]
/// - `is_moved`: whether the shapes compare with an undeformed mesh
pub fn by_kind(mesh: HybridMesh, measures: &[CellMeasures], is_moved: bool) -> Vec<KindQuality> {
    let mut rest = measures;
    let of_kind = |kind: CellKind| {
        let (of_kind, others) = rest.split_at(mesh.count(kind));
        rest = others;
        let jacobians = || of_kind.iter().map(|cell| cell.jacobian);
        KindQuality {
            kind,
            count: of_kind.len(),
            inverted: of_kind.iter().filter(|cell| cell.inverted).count(),
            jacobian_min: jacobians().fold(f64::INFINITY, lesser),
            jacobian_mean: jacobians().sum::<f64>() / of_kind.len() as f64,
            shape_min: is_moved.then(|| of_kind.iter().map(|cell| cell.shape_cubed).fold(f64::INFINITY, lesser).cbrt()),
        }
    };
    let all: Vec<KindQuality> = CellKind::ALL.into_iter().map(of_kind).collect();
    all.into_iter().filter(|quality| quality.count > 0).collect()
}
