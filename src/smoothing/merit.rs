//! [`Merit`]: the number by which local optimisation tells good tets from bad ones.
//!
//! The merit of a tet is its beta. The merit of a corner tet of another cell is beta too while the
//! corner is inverted. Otherwise it is a multiple of the lesser of two ratios: its shape q against
//! the undeformed corner, over [`SHAPE`], and its scaled Jacobian over the share [`JACOBIAN`] of
//! the worst of its kind in the undeformed mesh. Beta would be no measure there: in a thin layer
//! beta is the layer's thickness over its width, and to raise it is to thicken the layer.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::corners;
use crate::mesh::CornerCells;
use crate::quality::{self, determinant, edges_of_corner, faults::is_inverted, scaled_jacobian, shape_cubed};

/// Least shape q of a corner against the undeformed mesh. Springs alone keep 0.45 to 0.99 on
/// meshes with layers whose wings are thinned to half, swept or turned. A layer sheared by 60
/// degrees has 0.5. With 0.3, optimisation makes layers thicker and thinner without need.
const SHAPE: f64 = 0.2;

/// Least scaled Jacobian of a corner, as a share of the worst of its kind in the undeformed mesh.
/// With 0.5, optimisation changes layers by up to 15 % of their thickness where the springs keep
/// them to 0.3 %.
const JACOBIAN: f64 = 0.2;

/// The measure of tets and corner tets, by the undeformed mesh.
#[derive(Clone, Debug)]
pub struct Merit {
    cells: Arc<CornerCells>,
    /// Undeformed positions `[n_vertices]`. Empty if all cells are tets.
    undeformed: Arc<[DVec3]>,
    /// The merit of a corner tet just good enough.
    enough: f64,
    /// The least scaled Jacobian that is good enough, of each corner tet `[n_corner_tets]`.
    least_jacobian: Arc<[f64]>,
    /// The worst scaled Jacobian of a tet in the undeformed mesh, at any of its corners.
    worst_of_tets: f64,
}

impl Merit {
    /// The merit of tets: beta.
    pub fn of_tets() -> Self {
        let (undeformed, least_jacobian) = (Arc::from([]), Arc::from([]));
        let cells = Arc::new(CornerCells::of_tets(usize::MAX));
        Self { cells, undeformed, enough: 1.0, least_jacobian, worst_of_tets: f64::NAN }
    }

    /// The merit of tets and corner tets.
    ///
    /// - `tets` `[n_simplices]`, `undeformed` `[n_vertices]`: the undeformed mesh
    /// - `enough`: the beta below which tets are optimised
    pub fn new(cells: Arc<CornerCells>, tets: &[[u32; 4]], undeformed: &[DVec3], enough: f64) -> Self {
        if cells.are_tets() {
            return Self { enough, ..Self::of_tets() };
        }
        let jacobian = |tet: &[u32; 4]| scaled_jacobian(corners(undeformed, *tet));
        let of_corners: Vec<f64> = tets[cells.n_tets..].par_iter().map(jacobian).collect();
        let mut worst = [f64::INFINITY; 4];
        for (kind, &jacobian) in cells.kinds().zip(&of_corners) {
            let worst = &mut worst[kind as usize];
            *worst = worst.min(jacobian);
        }
        let least_jacobian = cells.kinds().map(|kind| JACOBIAN * worst[kind as usize]).collect();
        let of_tet = |tet: &[u32; 4]| flattest_corner(corners(undeformed, *tet)).0;
        let worst_of_tets = tets[..cells.n_tets].par_iter().map(of_tet).reduce(|| f64::INFINITY, f64::min);
        Self { cells, undeformed: undeformed.into(), enough, least_jacobian, worst_of_tets }
    }

    /// Whether a tet of the list is a corner tet of another cell.
    pub fn is_corner(&self, simplex: usize) -> bool {
        self.cells.is_corner(simplex)
    }

    /// The worst scaled Jacobian of the kind of a tet or corner tet in the undeformed mesh. NaN in
    /// a mesh of tets.
    pub fn worst_jacobian(&self, simplex: usize) -> f64 {
        match simplex.checked_sub(self.cells.n_tets) {
            Some(corner) => self.least_jacobian[corner] / JACOBIAN,
            None => self.worst_of_tets,
        }
    }

    /// Whether a corner tet of this merit can have less than a share of the worst scaled Jacobian
    /// of its kind. This is quicker to see than the scaled Jacobian.
    pub fn may_be_below(&self, merit: f64, share: f64) -> bool {
        !self.is_of_tets() && merit * JACOBIAN < share * self.enough
    }

    /// Whether all cells are tets.
    pub fn is_of_tets(&self) -> bool {
        self.least_jacobian.is_empty()
    }

    /// The merit of one tet or corner tet.
    ///
    /// - `at` `[n_vertices]`: positions, in the mesh's unit
    pub fn of(&self, simplex: usize, tet: [u32; 4], at: &[DVec3]) -> f64 {
        let now = corners(at, tet);
        let Some(corner) = simplex.checked_sub(self.cells.n_tets) else { return quality::beta(now) };
        let edges = edges_of_corner(now);
        if is_inverted(determinant(edges)) {
            return quality::beta(now);
        }
        let jacobian = scaled_jacobian(now) / self.least_jacobian[corner];
        let cubed = shape_cubed(edges, edges_of_corner(corners(&self.undeformed, tet)));
        // The root is taken only where the shape is the lesser ratio, which is seldom.
        let lesser = if cubed < (SHAPE * jacobian).powi(3) { cubed.cbrt() / SHAPE } else { jacobian };
        self.enough * lesser
    }

    /// The merit of every tet and corner tet `[n_simplices]`.
    ///
    /// - `at` `[n_vertices]`: positions, in the mesh's unit
    pub fn of_all(&self, tets: &[[u32; 4]], at: &[DVec3]) -> Vec<f64> {
        if self.is_of_tets() {
            return quality::betas(at, tets);
        }
        tets.par_iter().enumerate().map(|(simplex, tet)| self.of(simplex, *tet, at)).collect()
    }
}

/// The scaled Jacobian of a tet at its flattest corner, and its vertices in an order of the same
/// orientation that begins there.
pub(super) fn flattest_corner(tet: [DVec3; 4]) -> (f64, [usize; 4]) {
    let of = |order: [usize; 4]| (scaled_jacobian(order.map(|vertex| tet[vertex])), order);
    let others = [[1, 2, 0, 3], [2, 0, 1, 3], [3, 2, 1, 0]].map(of);
    others.into_iter().fold(of([0, 1, 2, 3]), |flattest, other| if other.0 < flattest.0 { other } else { flattest })
}
