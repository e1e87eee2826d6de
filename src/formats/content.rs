//! What goes into a new file.

use std::collections::HashSet;

use glam::DVec3;

use super::assembly::Shape;
use crate::mesh::{FamilyId, OtherCells, TetMesh};

/// Cells of a mesh: all of them, or the few worth looking at.
#[derive(Clone, Copy, Debug)]
pub struct Cells<'a> {
    /// Vertices of each tet `[n_tets]`.
    pub tets: &'a [[u32; 4]],
    /// Vertices of each triangle `[n_triangles]`.
    pub triangles: &'a [[u32; 3]],
    /// Family of each triangle `[n_triangles]`.
    pub triangle_family: &'a [FamilyId],
    /// Names of the families.
    pub families: &'a [String],
}

impl<'a> Cells<'a> {
    /// All cells of a mesh.
    pub fn of(mesh: &'a TetMesh) -> Self {
        let TetMesh { tets, triangles, triangle_family, families, .. } = mesh;
        Self { tets, triangles, triangle_family, families }
    }
}

/// Results written beside the mesh by the formats that can hold them (new VTU files; others keep only the mesh).
#[derive(Clone, Copy, Debug, Default)]
pub struct Fields<'a> {
    /// New minus old position `[n_vertices]`, in the unit of the mesh.
    pub displacement: Option<&'a [DVec3]>,
    /// Quality `V / l_max^3` of each tet `[n_tets]`.
    pub beta: Option<&'a [f64]>,
}

/// A mesh as a new file gets it.
#[derive(Clone, Copy)]
pub(super) struct Content<'a> {
    pub vertices: &'a [DVec3],
    pub cells: Cells<'a>,
    pub others: &'a OtherCells,
    pub fields: Fields<'a>,
    /// The extension that selected the format, and in some formats the variant.
    pub extension: &'static str,
}

impl<'a> Content<'a> {
    /// The cells that fill the volume: tets, pyramids, prisms, hexahedra, each in their order.
    pub fn volume_cells(&self) -> impl Iterator<Item = (Shape, &'a [u32])> + use<'a> {
        let Content { cells, others, .. } = *self;
        let tets = cells.tets.iter().map(|cell| (Shape::Tet, &cell[..]));
        let pyramids = others.pyramids.iter().map(|cell| (Shape::Pyramid, &cell[..]));
        let prisms = others.prisms.iter().map(|cell| (Shape::Prism, &cell[..]));
        let hexahedra = others.hexahedra.iter().map(|cell| (Shape::Hexahedron, &cell[..]));
        tets.chain(pyramids).chain(prisms).chain(hexahedra)
    }

    /// The boundary faces with their families: triangles, quadrilaterals, each in their order.
    pub fn faces(&self) -> impl Iterator<Item = (Shape, &'a [u32], FamilyId)> + use<'a> {
        let Content { cells, others, .. } = *self;
        let triangles = cells.triangles.iter().map(|face| (Shape::Triangle, &face[..]));
        let quadrilaterals = others.quadrilaterals.iter().map(|face| (Shape::Quadrilateral, &face[..]));
        let families = cells.triangle_family.iter().chain(&others.quadrilateral_family);
        triangles.chain(quadrilaterals).zip(families).map(|((shape, face), &family)| (shape, face, family))
    }

    /// The boundary faces of each family `[n_families]`: its triangles, then its quadrilaterals.
    pub fn faces_by_family(&self) -> Vec<Vec<(Shape, &'a [u32])>> {
        let mut faces = vec![Vec::new(); self.cells.families.len()];
        self.faces().for_each(|(shape, face, family)| faces[family.index()].push((shape, face)));
        faces
    }

    /// Cells, then faces.
    pub fn elements(&self) -> impl Iterator<Item = (Shape, &'a [u32])> + use<'a> {
        self.volume_cells().chain(self.faces().map(|(shape, face, _)| (shape, face)))
    }
}

/// Names with every letter replaced by `_` that the format does not take, and all different.
pub(super) fn clean_names(names: &[String], takes: impl Fn(char) -> bool) -> Vec<String> {
    let mut seen = HashSet::new();
    let clean = |name: &String| {
        let name: String = name.chars().map(|letter| if takes(letter) { letter } else { '_' }).collect();
        let mut names = (1..).map(|count| if count == 1 { name.clone() } else { format!("{name}_{count}") });
        names.find(|name| seen.insert(name.clone())).unwrap_or_default()
    };
    names.iter().map(clean).collect()
}

/// Says which families get another name.
pub(super) fn renamed(names: &[String], new: &[String]) -> Vec<String> {
    let changed = names.iter().zip(new).filter(|(old, new)| old != new);
    changed.map(|(old, new)| format!("the family '{old}' is called '{new}'")).collect()
}
