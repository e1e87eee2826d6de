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
//! three volumes are one. P. Knupp, *Achieving finite element mesh quality via optimization of the
//! Jacobian matrix norm and associated quantities* (Int. J. Numer. Meth. Engng 48, 2000), has the
//! measures. The paper has tets only.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    CellKind, HybridMesh,
    corners::{corner_tets, faces_of},
};
use crate::geometry;
use crate::quality::{self, faults::is_inverted, lesser, scaled_jacobian, shape};

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
    let worst = corners.reduce(worse).unwrap_or(WorstCorner { corner: None, volume: f64::INFINITY });
    let whole = if worst.volume > 0.0 { cell_volume(cell, vertices) } else { f64::INFINITY };
    if whole > 0.0 { worst } else { WorstCorner { corner: None, volume: whole } }
}

/// Volume of a cell by the divergence theorem, in the cube of the mesh's unit. A quadrilateral
/// counts as the mean of its two divisions into triangles.
///
/// - `vertices` `[n_vertices]`: positions, in any unit
pub fn cell_volume(cell: &[u32], vertices: &[DVec3]) -> f64 {
    let centre = cell.iter().map(|&vertex| vertices[vertex as usize]).sum::<DVec3>() / cell.len() as f64;
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

/// Adds a tet for each corner of a cell, with the corner in front. A tet has four corners, which
/// share one volume, but not one scaled Jacobian.
fn all_corners(cell: &[u32], tets: &mut Vec<[u32; 4]>) {
    match *cell {
        [a, b, c, d] => tets.extend([[a, b, c, d], [b, a, d, c], [c, d, a, b], [d, c, b, a]]),
        _ => corner_tets(cell, tets),
    }
}

/// The measures of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellMeasures {
    /// Scaled Jacobian of the worst corner. NaN if one is NaN.
    pub jacobian: f64,
    /// Shape q of the worst corner against the undeformed mesh; 1 without one. NaN if one is NaN.
    pub shape: f64,
    /// Whether the cell is inverted.
    pub inverted: bool,
}

/// The measures of all cells `[n_cells]`, in the order of [`HybridMesh`].
///
/// - `vertices` `[n_vertices]`: positions, in the mesh's unit
/// - `undeformed` `[n_vertices]`: positions in the undeformed mesh, if `vertices` come from a
///   motion
pub fn measures(mesh: HybridMesh, vertices: &[DVec3], undeformed: Option<&[DVec3]>) -> Vec<CellMeasures> {
    let measure = |cell: usize| {
        let cell = mesh.cell(mesh.name(cell));
        let mut tets = Vec::with_capacity(8);
        all_corners(cell, &mut tets);
        let at = |tet: &[u32; 4], vertices: &[DVec3]| geometry::corners(vertices, *tet);
        let jacobian = tets.iter().map(|tet| scaled_jacobian(at(tet, vertices))).fold(f64::INFINITY, lesser);
        let of_tet = |tet: &[u32; 4], from: &[DVec3]| shape(at(tet, vertices), at(tet, from));
        let least = |from: &[DVec3]| tets.iter().map(|tet| of_tet(tet, from)).fold(f64::INFINITY, lesser);
        let shape = undeformed.map_or(1.0, least);
        CellMeasures { jacobian, shape, inverted: is_inverted(worst_corner(cell, vertices).volume) }
    };
    (0..mesh.n_cells()).into_par_iter().map(measure).collect()
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
            shape_min: is_moved.then(|| of_kind.iter().map(|cell| cell.shape).fold(f64::INFINITY, lesser)),
        }
    };
    let all: Vec<KindQuality> = CellKind::ALL.into_iter().map(of_kind).collect();
    all.into_iter().filter(|quality| quality.count > 0).collect()
}
