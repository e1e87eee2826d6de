//! The table of formats, and which of them a path selects.

use std::path::Path;

#[cfg(feature = "cgns")]
use super::cgns;
use super::format::Format;
use super::{aflr3, gmsh, medit, openfoam, su2, vtk};

/// The mesh file formats, in the order in which messages list them.
pub const FORMATS: &[Format] = &[
    gmsh::FORMAT,
    su2::FORMAT,
    vtk::vtu::FORMAT,
    vtk::legacy::FORMAT,
    aflr3::FORMAT,
    medit::FORMAT,
    openfoam::FORMAT,
    #[cfg(feature = "cgns")]
    cgns::FORMAT,
];

/// The format that a path's extension selects, and the extension. If several extensions fit,
/// the longest counts.
pub(super) fn format_of(path: &Path) -> Option<(&'static Format, &'static str)> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let stem = name.strip_suffix(".gz").unwrap_or(&name);
    let all = FORMATS.iter().flat_map(|format| format.extensions.iter().map(move |&extension| (format, extension)));
    let fits = |format: &Format, extension: &str| match format.is_folder() {
        // `polyMesh.invalid` is a folder of the format too.
        true => stem.strip_prefix(extension).is_some_and(|rest| matches!(rest, "" | ".invalid")),
        false => stem.strip_suffix(extension).is_some_and(|stem| stem.ends_with('.')),
    };
    all.filter(|(format, extension)| fits(format, extension)).max_by_key(|(_, extension)| extension.len())
}

/// Whether a path's extension selects a format.
pub(crate) fn has_format(path: &Path) -> bool {
    format_of(path).is_some()
}

/// The extension by which a path selects a mesh that is one file, such as `lb8.ugrid`, in lower
/// case and without `.gz`.
pub(crate) fn extension(path: &Path) -> Option<&'static str> {
    format_of(path).filter(|(format, _)| !format.is_folder()).map(|(_, extension)| extension)
}

/// The known extensions, for messages: `.msh (Gmsh), .vtu (VTU)`.
pub(super) fn known() -> String {
    let extensions = |format: &Format| {
        let shown = |extension: &&str| match *extension {
            // OpenFOAM's own spelling. Names select formats in any case of letters.
            "polymesh" => "polyMesh".to_owned(),
            name if format.is_folder() => name.to_owned(),
            extension => format!(".{extension}"),
        };
        format.extensions.iter().map(shown).collect::<Vec<_>>().join(", ")
    };
    FORMATS.iter().map(|format| format!("{} ({})", extensions(format), format.name)).collect::<Vec<_>>().join(", ")
}
