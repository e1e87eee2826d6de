//! STL files as text: a solid for each family, under its name. Coordinates have all their digits.
//!
//! Source: M. Burns, *Automated Fabrication*, section 6.5.

use std::io::{self, Write};

use super::SurfaceFile;
use crate::formats::out::Out;
use crate::text::shown;

/// Writes the surfaces.
pub(super) fn create(out: &mut Out, surface: &SurfaceFile) -> io::Result<()> {
    for (_, name, faces) in surface.families() {
        // Other programs read the name up to a space.
        let name = shown(name).to_string().split_whitespace().collect::<Vec<_>>().join("_");
        writeln!(out, "solid {name}")?;
        for triangle in surface.triangles(&faces) {
            let [a, b, c] = triangle.map(|vertex| surface.vertices[vertex as usize]);
            // A triangle without an area has no normal, for which zeros stand.
            let normal = (b - a).normalize_or_zero().cross((c - a).normalize_or_zero()).normalize_or_zero();
            writeln!(out, "facet normal {} {} {}\nouter loop", normal.x, normal.y, normal.z)?;
            for at in [a, b, c] {
                writeln!(out, "vertex {:?} {:?} {:?}", at.x, at.y, at.z)?;
            }
            writeln!(out, "endloop\nendfacet")?;
        }
        writeln!(out, "endsolid {name}")?;
    }
    Ok(())
}
