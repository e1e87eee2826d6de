//! [`CornerCells`]: which of a list of tets are corner tets, and of which cells.
//!
//! The stages see a mesh as a list of tets: first the tets of the mesh, then the corner tets of
//! its other cells, cell by cell. In a mesh of tets the list is the mesh's own.

use super::{
    CellKind, HybridMesh, OtherCells, TetMesh,
    corners::{corner_tets, is_tet},
    edges::TetEdges,
};
use crate::quality::faults::is_inverted;

/// The cells behind a list of tets and corner tets.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CornerCells {
    /// Number of the mesh's tets, which come first in the list.
    pub n_tets: usize,
    /// First corner tet of each other cell, counted from `n_tets`, and the number of corner tets
    /// `[n_others + 1]`. Empty if there are no other cells.
    first: Vec<u32>,
    /// Number of other cells up to the last one of each kind: pyramids, prisms, hexahedra.
    ends: [usize; 3],
}

impl CornerCells {
    /// The list of tets and corner tets of a mesh `[n_simplices]`, and the cells behind them.
    ///
    /// The list is returned in a copy of the mesh, which has the same vertices and triangles.
    pub fn new(mesh: HybridMesh) -> (TetMesh, Self) {
        let mut simplices = mesh.mesh.clone();
        let n_tets = simplices.tets.len();
        let mut first = Vec::new();
        if mesh.others.n_cells() > 0 {
            first.reserve(mesh.others.n_cells() + 1);
            first.push(0);
            for cell in mesh.cells().skip(n_tets) {
                let before = simplices.tets.len();
                corner_tets(cell, &mut simplices.tets);
                if is_tet(cell) {
                    // Its four corner tets are one tet. Four springs in place of one would make
                    // the cell stiffer than the same tet in the list of tets.
                    simplices.tets.truncate(before + 1);
                }
                first.push((simplices.tets.len() - n_tets) as u32);
            }
        }
        let OtherCells { pyramids, prisms, .. } = mesh.others;
        let ends = [pyramids.len(), pyramids.len() + prisms.len(), first.len().saturating_sub(1)];
        (simplices, Self { n_tets, first, ends })
    }

    /// The cells of a mesh of tets.
    pub fn of_tets(n_tets: usize) -> Self {
        Self { n_tets, ..Self::default() }
    }

    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.n_tets + self.first.len().saturating_sub(1)
    }

    /// The cells in words: `12 tets`, or `12 cells` if they are of several kinds.
    pub fn counted(&self) -> String {
        counted(self.n_tets, self.n_cells() - self.n_tets)
    }

    /// Whether all cells are tets.
    pub fn are_tets(&self) -> bool {
        self.first.is_empty()
    }

    /// Whether a tet of the list is a corner tet.
    pub fn is_corner(&self, simplex: usize) -> bool {
        simplex >= self.n_tets
    }

    /// The kind of cell of each corner tet `[n_corner_tets]`.
    pub fn kinds(&self) -> impl Iterator<Item = CellKind> + '_ {
        let kind = |cell: usize| match self.ends.iter().position(|&end| cell < end) {
            Some(0) => CellKind::Pyramid,
            Some(1) => CellKind::Prism,
            _ => CellKind::Hexahedron,
        };
        let cells = self.first.windows(2).enumerate();
        cells.flat_map(move |(cell, ends)| std::iter::repeat_n(kind(cell), (ends[1] - ends[0]) as usize))
    }

    /// Number of inverted cells: those with a beta that is not positive.
    ///
    /// - `beta` `[n_simplices]`: beta, or another number of the same sign, of each tet and corner
    ///   tet
    pub fn n_inverted(&self, beta: &[f64]) -> usize {
        let (tets, corners) = beta.split_at(self.n_tets.min(beta.len()));
        let of_tets = tets.iter().filter(|&&beta| is_inverted(beta)).count();
        let is_bad = |ends: &&[u32]| corners[ends[0] as usize..ends[1] as usize].iter().any(|&beta| is_inverted(beta));
        of_tets + self.first.windows(2).filter(is_bad).count()
    }

    /// Whether each edge of the list is an edge of a cell `[n_edges]`. Others join two neighbours
    /// of a corner. No spring runs along them.
    pub fn real_edges(&self, edges: &TetEdges) -> Vec<bool> {
        let mut is_whole = vec![true; self.n_tets];
        // A cell with one corner tet is a tet, and has all its edges.
        is_whole.extend(self.first.windows(2).flat_map(|ends| {
            let count = (ends[1] - ends[0]) as usize;
            std::iter::repeat_n(count == 1, count)
        }));
        let is_real = |&slot: &u32| {
            let (simplex, local) = (slot as usize / 6, slot % 6);
            // The first three edges of a corner tet meet at its corner.
            is_whole[simplex] || local < 3
        };
        (0..edges.edges.len()).map(|edge| edges.edge_tets.row(edge).iter().any(is_real)).collect()
    }
}

/// The cells of a mesh in words: `12 tets`, or `12 cells` if there are others than tets.
pub fn counted(n_tets: usize, n_others: usize) -> String {
    match n_others {
        0 => format!("{n_tets} tets"),
        _ => format!("{} cells", n_tets + n_others),
    }
}
