//! Legacy VTK files, `.vtk`: unstructured grids as text or binary (big-endian), versions up to 5.1.
//!
//! Families are as in VTU files. Files written by idmesh hold the names in the title, if they fit.
//!
//! Source: K. Martin and others, *VTK File Formats*, "Simple Legacy Formats".

use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::cells::{self, Corners, Table};
use super::create::families_of_cells;
use super::names::{list_names, listed_names, parse_names};
use super::own_points::{Shared, share};
use super::types::{FAMILY_ARRAYS, vtk_number};
use crate::formats::document::{Slots, SourceFile};
use crate::formats::error::ReadError;
use crate::formats::format::{Create, Format, Parsed};
use crate::formats::mesh_builder::MeshBuilder;
use crate::formats::new_file::{NewFile, renamed};
use crate::formats::number::{Integers, Number};
use crate::formats::out::Out;
use crate::formats::scanner::{Encoding, Endian, Scanner, Width, shown};

/// The format's name in [`super::super::FORMATS`].
const NAME: &str = "VTK";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(in crate::formats) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["vtk"],
    description: "legacy VTK unstructured grid, ascii or binary; families as in VTU",
    read,
    create: Create::File(create),
    limits,
    companion: None,
};

/// Longest title that VTK reads, in bytes.
const TITLE: usize = 255;

/// The parts of a mesh read so far.
#[derive(Default)]
struct Parts<'a> {
    points: Option<(Vec<DVec3>, Slots)>,
    corners: Option<Corners<'a>>,
    types: Option<Integers<'a>>,
    /// Offset of the cells in the file.
    cells_at: usize,
    /// Whether the current data belong to cells, and the number of their entries.
    data: Option<(bool, usize)>,
    /// Cell arrays that may hold the families.
    families: Vec<(String, Integers<'a>)>,
    beside: Vec<String>,
}

/// Reads a legacy VTK file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let mut scanner = Scanner::of_text(path, &bytes);
    let (names, parts) = read_sections(&mut scanner, "UNSTRUCTURED_GRID")?;
    let missing = |what| ReadError::Missing { path: path.into(), what, hint: "is it a complete VTK file?" };
    let Parts { points, corners, types, cells_at, mut families, mut beside, .. } = parts;
    let (positions, slots) = points.ok_or_else(|| missing("POINTS"))?;
    let corners = corners.ok_or_else(|| missing("CELLS"))?;
    let types = types.ok_or_else(|| missing("CELL_TYPES"))?;
    let malformed =
        |expected: String, found: String| ReadError::Malformed { place: scanner.place(cells_at), expected, found };
    let of_name = |name: &&str| families.iter().position(|(array, _)| array == name);
    let family = FAMILY_ARRAYS.iter().find_map(of_name).map(|place| families.swap_remove(place).1);
    let (table, n_vertices, mut mesh_builder) = (Table { types, corners }, positions.len(), MeshBuilder::default());
    cells::assemble(path, table, family, n_vertices, |vertex| vertex as u32, malformed, &mut mesh_builder)?;
    let Shared { positions, coordinates, warning } = share(positions, Box::new(slots), &mut mesh_builder);
    mesh_builder.orient_prisms(&positions);
    beside.extend(mesh_builder.passed_over());
    let name = |tag: i32| names.iter().find(|(number, _)| *number == tag).map(|(_, name)| name.clone());
    let (mesh, others) = mesh_builder.finish(path, positions, name)?;
    let mut document = SourceFile::of_file(NAME, extension, bytes, coordinates, beside);
    document.warnings.extend(warning);
    Ok(Parsed { mesh, others, document })
}

/// The points and lines of a poly data file.
pub(super) fn read_lines<'a>(path: &'a Path, bytes: &'a [u8]) -> Result<(Vec<DVec3>, Corners<'a>), ReadError> {
    let (_, parts) = read_sections(&mut Scanner::of_text(path, bytes), "POLYDATA")?;
    let missing = |what| ReadError::Missing { path: path.into(), what, hint: "is it a complete VTK file?" };
    let (points, _) = parts.points.ok_or_else(|| missing("POINTS"))?;
    Ok((points, parts.corners.ok_or_else(|| missing("LINES"))?))
}

/// Reads a file with this kind of data set. Also returns the names in its title.
fn read_sections<'a>(scanner: &mut Scanner<'a>, kind: &str) -> Result<(Vec<(i32, String)>, Parts<'a>), ReadError> {
    let path = scanner.path();
    if !scanner.line().starts_with(b"# vtk DataFile Version") {
        let what = "line '# vtk DataFile Version'";
        return Err(ReadError::Missing { path: path.into(), what, hint: "is it a legacy VTK file?" });
    }
    let names = parse_names(&String::from_utf8_lossy(scanner.line()));
    let encoding = match scanner.line() {
        b"ASCII" => Encoding::Text,
        b"BINARY" => Encoding::Binary(Endian::Big),
        other => return Err(scanner.malformed("ASCII or BINARY", shown(other))),
    };
    let dataset = scanner.filled_line();
    if !dataset.eq_ignore_ascii_case(format!("DATASET {kind}").as_bytes()) {
        let found = String::from_utf8_lossy(dataset).into_owned();
        let hint = if kind == "POLYDATA" { "save the lines as poly data" } else { "save it as an unstructured grid" };
        return Err(ReadError::Unsupported { path: path.into(), found, hint });
    }
    scanner.encoding = encoding;
    let mut parts = Parts::default();
    loop {
        let line = scanner.filled_line();
        if line.is_empty() {
            return Ok((names, parts));
        }
        let words: Vec<&str> = std::str::from_utf8(line).unwrap_or_default().split_ascii_whitespace().collect();
        read_section(scanner, &words, line, &mut parts)?;
    }
}

/// Reads the section of a line of keywords.
fn read_section<'a>(
    scanner: &mut Scanner<'a>,
    words: &[&str],
    line: &[u8],
    parts: &mut Parts<'a>,
) -> Result<(), ReadError> {
    let count = |scanner: &Scanner, word: Option<&&str>, what: &'static str| {
        let word = word.copied().unwrap_or_default();
        word.parse::<usize>().map_err(|_| scanner.malformed(what, shown(word.as_bytes())))
    };
    let number = |scanner: &Scanner, word: Option<&&str>| {
        let word = word.copied().unwrap_or_default();
        Number::named(word).ok_or_else(|| scanner.malformed("a type such as double", shown(word.as_bytes())))
    };
    let keyword = words.first().map(|word| word.to_ascii_uppercase()).unwrap_or_default();
    let entries = parts.data.map_or(0, |(_, entries)| entries);
    match keyword.as_str() {
        "POINTS" => {
            let n_points = count(scanner, words.get(1), "the number of points")?;
            let number = number(scanner, words.get(2))?;
            if parts.points.is_some() {
                return Err(scanner.malformed("one POINTS section", "a second one"));
            }
            parts.points = Some(read_points(scanner, n_points, number)?);
        }
        "CELLS" | "LINES" => {
            let first = count(scanner, words.get(1), "the number of cells")?;
            let second = count(scanner, words.get(2), "the size of the cells")?;
            if parts.corners.is_some() {
                return Err(scanner.malformed(format!("one {keyword} section"), "a second one"));
            }
            parts.cells_at = scanner.at();
            parts.corners = Some(read_cells(scanner, first, second)?);
        }
        "CELL_TYPES" => {
            let n_cells = count(scanner, words.get(1), "the number of cells")?;
            parts.types = Some(integers(scanner, Number::I32, n_cells, "a cell type")?);
        }
        "CELL_DATA" => parts.data = Some((true, count(scanner, words.get(1), "the number of cells")?)),
        "POINT_DATA" => parts.data = Some((false, count(scanner, words.get(1), "the number of points")?)),
        "METADATA" => skip_metadata(scanner),
        "SCALARS" => {
            let number = number(scanner, words.get(2))?;
            let components =
                if words.len() > 3 { count(scanner, words.get(3), "the number of components")? } else { 1 };
            if scanner.peek_line().starts_with(b"LOOKUP_TABLE") {
                scanner.line();
            }
            read_array(scanner, words.get(1).copied(), number, entries, components, parts)?;
        }
        "VECTORS" | "NORMALS" => {
            read_array(scanner, words.get(1).copied(), number(scanner, words.get(2))?, entries, 3, parts)?;
        }
        "TENSORS" => read_array(scanner, words.get(1).copied(), number(scanner, words.get(2))?, entries, 9, parts)?,
        "TENSORS6" => read_array(scanner, words.get(1).copied(), number(scanner, words.get(2))?, entries, 6, parts)?,
        "GLOBAL_IDS" | "PEDIGREE_IDS" => {
            read_array(scanner, words.get(1).copied(), number(scanner, words.get(2))?, entries, 1, parts)?;
        }
        "TEXTURE_COORDINATES" => {
            let components = count(scanner, words.get(2), "the number of components")?;
            read_array(scanner, words.get(1).copied(), number(scanner, words.get(3))?, entries, components, parts)?;
        }
        "COLOR_SCALARS" | "LOOKUP_TABLE" => {
            let size = count(scanner, words.get(2), "the number of values")?;
            let (entries, components) = if keyword == "LOOKUP_TABLE" { (size, 4) } else { (entries, size) };
            // Bytes in a binary file, numbers up to 1 in a text file.
            let number = if scanner.encoding == Encoding::Text { Number::F32 } else { Number::U8 };
            read_array(scanner, words.get(1).copied(), number, entries, components, parts)?;
        }
        "FIELD" => {
            for _ in 0..count(scanner, words.get(2), "the number of arrays")? {
                let mut line = scanner.filled_line();
                while line == b"METADATA" {
                    skip_metadata(scanner);
                    line = scanner.filled_line();
                }
                if line.is_empty() {
                    return Err(scanner.truncated("an array of a FIELD"));
                }
                let words: Vec<&str> = std::str::from_utf8(line).unwrap_or_default().split_ascii_whitespace().collect();
                let components = count(scanner, words.get(1), "the number of components")?;
                let entries = count(scanner, words.get(2), "the number of entries")?;
                let number = number(scanner, words.get(3))?;
                read_array(scanner, words.first().copied(), number, entries, components, parts)?;
            }
        }
        _ => return Err(scanner.malformed("a section such as POINTS or CELL_DATA", shown(line))),
    }
    Ok(())
}

fn read_points(scanner: &mut Scanner, n_points: usize, number: Number) -> Result<(Vec<DVec3>, Slots), ReadError> {
    scanner.width = match number {
        Number::F32 => Width::Single,
        Number::F64 => Width::Double,
        // A moved point does not fit a list of whole numbers, even where it is text.
        _ => return Err(scanner.malformed("points of type float or double", format!("{number:?}"))),
    };
    let n_points = scanner.checked("the number of points", n_points as u64, 5, 3 * scanner.width.bytes() as u64)?;
    let mut positions = Vec::with_capacity(n_points);
    let mut slots = Vec::with_capacity(n_points);
    for vertex in 0..n_points {
        slots.push(scanner.next_number());
        positions.push(scanner.coordinates(vertex as u64)?.into());
    }
    Ok((positions, Slots { encoding: scanner.encoding, width: scanner.width, slots }))
}

/// Reads `CELLS`. Before version 5 there are `n_cells` runs of a count and vertices, `size` numbers
/// together. From version 5 on there are two arrays: `n_cells` offsets, one more than cells, and
/// `size` vertices.
fn read_cells<'a>(scanner: &mut Scanner<'a>, n_cells: usize, size: usize) -> Result<Corners<'a>, ReadError> {
    if scanner.peek_line().starts_with(b"OFFSETS") {
        let mut array = |keyword: &str, count: usize, what: &'static str| {
            let line = String::from_utf8_lossy(scanner.filled_line()).into_owned();
            match line.split_ascii_whitespace().collect::<Vec<_>>()[..] {
                [found, number] if found == keyword && Number::named(number).is_some() => {
                    integers(scanner, Number::named(number).unwrap_or(Number::I64), count, what)
                }
                _ => Err(scanner.malformed(format!("{keyword} and a type"), shown(line.as_bytes()))),
            }
        };
        let mut offsets = array("OFFSETS", n_cells, "a cell offset")?;
        let vertices = array("CONNECTIVITY", size, "a vertex of a cell")?;
        if offsets.get(0).is_some_and(|first| first != 0) {
            return Err(scanner.malformed("cell offsets from 0 on", "another start"));
        }
        return Ok(Corners::Bounds(offsets, vertices));
    }
    Ok(Corners::Runs(n_cells, integers(scanner, Number::I32, size, "a vertex of a cell")?))
}

/// Reads an array of data. It is kept if it may hold the families.
fn read_array<'a>(
    scanner: &mut Scanner<'a>,
    name: Option<&str>,
    number: Number,
    entries: usize,
    components: usize,
    parts: &mut Parts<'a>,
) -> Result<(), ReadError> {
    let name = name.unwrap_or_default();
    let count = entries.saturating_mul(components);
    if FAMILY_ARRAYS.contains(&name) && components == 1 && parts.data.is_some_and(|(of_cells, _)| of_cells) {
        parts.families.push((name.to_string(), integers(scanner, number, count, "the family of a cell")?));
        return Ok(());
    }
    parts.beside.push(format!("the array '{name}'"));
    if scanner.encoding == Encoding::Text {
        scanner.checked("the number of values", count as u64, 1, 1)?;
        for _ in 0..count {
            if scanner.token().is_empty() {
                return Err(scanner.truncated(format!("a value of '{name}'")));
            }
        }
        return Ok(());
    }
    let count = scanner.checked("the number of values", count as u64, 1, number.bytes() as u64)?;
    scanner.take(count * number.bytes(), "values of an array").map(drop)
}

/// Reads whole numbers.
fn integers<'a>(
    scanner: &mut Scanner<'a>,
    number: Number,
    count: usize,
    what: &'static str,
) -> Result<Integers<'a>, ReadError> {
    let count = scanner.checked("the number of values", count as u64, 1, number.bytes() as u64)?;
    if let Encoding::Binary(endian) = scanner.encoding {
        let bytes = scanner.take(count * number.bytes(), what)?;
        let values = Integers::stored(Cow::Borrowed(bytes), number, endian);
        return values.ok_or_else(|| scanner.malformed(what, "no whole number"));
    }
    let mut values = Vec::with_capacity(count);
    for _ in 0..count {
        values.push(scanner.long(what)?);
    }
    Ok(values.into())
}

/// Skips a block that ends with an empty line.
fn skip_metadata(scanner: &mut Scanner) {
    while !scanner.line().is_empty() {}
}

/// Writes a binary file of version 3.0, which every reader of VTK files reads.
fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let names = list_names(new_file.cells.families);
    let title = if names.len() <= TITLE { names.as_str() } else { "a mesh by idmesh" };
    write!(out, "# vtk DataFile Version 3.0\n{title}\nBINARY\nDATASET UNSTRUCTURED_GRID\n")?;
    writeln!(out, "POINTS {} double", new_file.vertices.len())?;
    for value in new_file.vertices.iter().flat_map(|vertex| vertex.to_array()) {
        out.write_all(&value.to_be_bytes())?;
    }
    let n_cells = new_file.n_elements();
    let size: usize = new_file.elements().map(|(_, corners)| 1 + corners.len()).sum();
    write!(out, "\nCELLS {n_cells} {size}\n")?;
    for (_, corners) in new_file.elements() {
        out.write_all(&(corners.len() as u32).to_be_bytes())?;
        for &vertex in corners {
            let vertex =
                i32::try_from(vertex).map_err(|_| io::Error::other("legacy VTK numbers at most 2^31 vertices"))?;
            out.write_all(&vertex.to_be_bytes())?;
        }
    }
    write!(out, "\nCELL_TYPES {n_cells}\n")?;
    for (shape, _) in new_file.elements() {
        out.write_all(&u32::from(vtk_number(shape)).to_be_bytes())?;
    }
    write!(out, "\nCELL_DATA {n_cells}\nSCALARS family int 1\nLOOKUP_TABLE default\n")?;
    for family in families_of_cells(new_file) {
        out.write_all(&family.to_be_bytes())?;
    }
    out.write_all(b"\n")
}

/// Losses of a new file: letters of names; all names, if there are many or long ones.
fn limits(new_file: &NewFile) -> Vec<String> {
    let names = list_names(new_file.cells.families);
    if names.len() <= TITLE {
        renamed(new_file.cells.families, &listed_names(new_file.cells.families))
    } else {
        vec![format!("names of families: only their numbers are held ({names})")]
    }
}
