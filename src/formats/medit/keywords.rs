//! The keywords of Medit files and their numbers in binary files, and the file of names beside.

use std::path::{Path, PathBuf};

use crate::formats::mapbc;
use crate::formats::mesh_builder::CellKind;

/// The extensions: text, then binary.
pub(super) const EXTENSIONS: &[&str] = &["mesh", "meshb"];

/// A kind of section: its keyword, and its number in a binary file.
pub(super) struct Keyword {
    pub name: &'static str,
    pub number: i32,
    pub section: MeditSection,
}

/// The contents of a section.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum MeditSection {
    Vertices,
    Elements(CellKind),
    /// Elements that are refused, with their name.
    Refused(&'static str),
    /// Elements that do not belong to the mesh, with their name.
    PassedOver(&'static str),
}

const fn keyword(name: &'static str, number: i32, section: MeditSection) -> Keyword {
    Keyword { name, number, section }
}

/// The sections that belong to the mesh. Other sections are skipped.
pub(super) const KEYWORDS: [Keyword; 12] = [
    keyword("Vertices", 4, MeditSection::Vertices),
    keyword("Edges", 5, MeditSection::PassedOver("edges")),
    keyword("Triangles", 6, MeditSection::Elements(CellKind::Triangle)),
    keyword("Quadrilaterals", 7, MeditSection::Elements(CellKind::Quadrilateral)),
    keyword("Tetrahedra", 8, MeditSection::Elements(CellKind::Tet)),
    keyword("Prisms", 9, MeditSection::Elements(CellKind::Prism)),
    keyword("Hexahedra", 10, MeditSection::Elements(CellKind::Hexahedron)),
    keyword("Pyramids", 49, MeditSection::Elements(CellKind::Pyramid)),
    keyword("TrianglesP2", 24, MeditSection::Refused("second-order triangles")),
    keyword("QuadrilateralsQ2", 27, MeditSection::Refused("second-order quadrilaterals")),
    keyword("TetrahedraP2", 30, MeditSection::Refused("second-order tets")),
    keyword("HexahedraQ2", 33, MeditSection::Refused("second-order hexahedra")),
];

/// Numbers of the section that ends a binary file, and of the section with the number of
/// dimensions.
pub(super) const END: i32 = 54;
pub(super) const DIMENSION: i32 = 3;

/// Path of the file that may hold names of families.
pub(super) fn mapbc_path(path: &Path) -> PathBuf {
    mapbc::path_beside(path, EXTENSIONS)
}
