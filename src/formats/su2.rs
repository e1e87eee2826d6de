//! SU2's native mesh files, `.su2`.
//!
//! A family is a marker. Comments, FFD boxes and other contents are skipped. The skipped contents
//! survive because the file is written back with only its coordinates replaced, see
//! [`super::document`].
//!
//! Source: the SU2 documentation, "Mesh File".

use std::io::{self, Write};
use std::path::Path;

use glam::DVec3;

use super::document::{Slots, SourceFile, write_shortest};
use super::error::ReadError;
use super::format::{Create, Format, Parsed};
use super::lines::{Line, Lines};
use super::mesh_builder::{Kind, MOST_VERTICES, MeshBuilder, check_finite_at};
use super::new_file::{NewFile, clean_names, renamed};
use super::out::Out;
use super::scanner::{Encoding, Width, parse_signed, shown};
use super::vtk::{vtk_kind, vtk_number};
use crate::text::decode;

/// The format's name in [`super::FORMATS`].
const NAME: &str = "SU2";

/// The marker of vertices whose values another part of a divided mesh sends, or a periodic marker
/// of the same mesh. The marker has no faces.
const SEND_RECEIVE: &str = "SEND_RECEIVE";

/// Keywords before the partner of a marker [`SEND_RECEIVE`]: of SU2's output, and of its
/// documentation.
const PARTNER: [&[u8]; 2] = [b"SEND_TO", b"SEND_RECV"];

/// The type of a vertex as an element.
const VERTEX: u64 = 1;

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["su2"],
    description: "SU2 native; families are the markers",
    read,
    create: Create::File(create),
    limits,
    companion: None,
};

/// The parts of a mesh read so far.
#[derive(Default)]
struct Parts {
    three_dimensional: bool,
    has_cells: bool,
    has_points: bool,
    positions: Vec<DVec3>,
    slots: Vec<usize>,
    mesh_builder: MeshBuilder,
    /// For each section of elements, its greatest vertex and the offset of its lines.
    greatest: Vec<(u64, usize)>,
    n_markers: Option<u64>,
    markers: Vec<String>,
    /// Whether the last marker has no elements yet.
    open_marker: bool,
    /// Number of markers [`SEND_RECEIVE`], and of their vertices.
    shared: [usize; 2],
    beside: Vec<String>,
}

/// Reads an SU2 file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let mut parts = Parts::default();
    let mut lines = Lines::new(path, &bytes, b"%");
    // Whether the last keyword is unknown to idmesh. Lines without a keyword may follow it.
    let mut foreign = false;
    while let Some(line) = lines.next_line() {
        match line.split(b'=') {
            Some((key, mut value)) => foreign = !read_section(&mut lines, key, &mut value, &mut parts)?,
            None if foreign => {}
            None => return Err(lines.malformed(line.start, "a keyword such as NPOIN=", shown(line.text))),
        }
    }
    let missing = |what, hint| ReadError::Missing { path: path.into(), what, hint };
    if !parts.has_points {
        return Err(missing("NPOIN=", "is it a complete SU2 mesh?"));
    }
    if !parts.has_cells {
        return Err(missing("NELEM=", "is it a complete SU2 mesh?"));
    }
    if let Some(declared) = parts.n_markers.filter(|&declared| declared != parts.markers.len() as u64) {
        let found = format!("{} of them", parts.markers.len());
        return Err(lines.malformed(bytes.len(), format!("{declared} MARKER_TAG=, as NMARK= declares"), found));
    }
    check_open_marker(&lines, &parts, bytes.len())?;
    let Parts { positions, slots, mut mesh_builder, greatest, markers, mut beside, shared, .. } = parts;
    if let Some(&(_, start)) = greatest.iter().find(|&&(vertex, _)| vertex >= positions.len() as u64) {
        return Err(unknown_vertex(path, &bytes, start, positions.len() as u64));
    }
    mesh_builder.orient_prisms(&positions);
    beside.extend(mesh_builder.passed_over());
    let used = mesh_builder.used_tags();
    let is_empty = |(tag, name): &(i32, &String)| !used.contains(tag) && *name != SEND_RECEIVE;
    beside
        .extend((0..).zip(&markers).filter(is_empty).map(|(_, name)| format!("the marker '{name}' without elements")));
    let (mesh, others) = mesh_builder.finish(path, positions, |marker| Some(markers[marker as usize].clone()))?;
    let coordinates = Box::new(Slots { encoding: Encoding::Text, width: Width::Double, slots });
    let mut document = SourceFile::of_file(NAME, extension, bytes, coordinates, beside);
    let [n_markers, n_vertices] = shared;
    if n_markers > 0 {
        let what = format!("{n_markers} markers {SEND_RECEIVE} with {n_vertices} vertices");
        document.warnings.push(format!(
            "{what} are shared with other parts of a divided mesh, or are periodic: they are no family, and idmesh does not \
             move their partners alike"
        ));
        document.beside.push(what);
    }
    Ok(Parsed { mesh, others, document })
}

/// Reads the section of a keyword. Returns `false` for an unknown keyword.
fn read_section(lines: &mut Lines, key: &[u8], value: &mut Line, parts: &mut Parts) -> Result<bool, ReadError> {
    let unsupported =
        |lines: &Lines, found: String, hint| ReadError::Unsupported { path: lines.path().into(), found, hint };
    let start = value.start;
    let once = |lines: &Lines, before: bool| match before {
        true => Err(lines.malformed(start, format!("one {}=", String::from_utf8_lossy(key)), "a second one")),
        false => Ok(()),
    };
    match key {
        b"NDIME" => match lines.unsigned(value, "the number of dimensions")? {
            3 => parts.three_dimensional = true,
            other => {
                let found = format!("a mesh of {other} dimensions");
                return Err(unsupported(lines, found, "idmesh moves meshes of 3 dimensions"));
            }
        },
        b"NZONE" if lines.unsigned(value, "the number of zones")? != 1 => {
            return Err(unsupported(lines, "a mesh of several zones".into(), "give each zone a file of its own"));
        }
        b"NZONE" | b"IZONE" => {}
        b"NELEM" => {
            once(lines, parts.has_cells)?;
            parts.has_cells = true;
            read_elements(lines, value, None, parts)?;
        }
        b"NPOIN" => {
            once(lines, parts.has_points)?;
            parts.has_points = true;
            read_points(lines, value, parts)?;
        }
        b"NMARK" => parts.n_markers = Some(lines.unsigned(value, "the number of markers")?),
        b"MARKER_TAG" => {
            if value.text.is_empty() {
                return Err(lines.malformed(value.start, "the name of a marker", "the end of the line"));
            }
            check_open_marker(lines, parts, value.start)?;
            parts.markers.push(decode(value.text).into_owned());
            parts.open_marker = true;
        }
        b"MARKER_ELEMS" => {
            if !std::mem::take(&mut parts.open_marker) {
                return Err(lines.malformed(value.start, "MARKER_TAG= before MARKER_ELEMS=", "none"));
            }
            let marker = parts.markers.len() - 1;
            if parts.markers[marker] == SEND_RECEIVE {
                read_shared_vertices(lines, value, parts)?;
            } else {
                read_elements(lines, value, Some(marker), parts)?;
            }
        }
        // SU2 writes the partner after the number of elements, other programs before it.
        key if PARTNER.contains(&key) => {
            if !parts.open_marker || parts.markers.last().is_none_or(|marker| marker != SEND_RECEIVE) {
                let expected = format!("{}= in a marker {SEND_RECEIVE}", String::from_utf8_lossy(key));
                return Err(lines.malformed(value.start, expected, "another marker, or none"));
            }
            read_partner(lines, value)?;
        }
        _ => {
            let words = match key.starts_with(b"FFD_") {
                true => "FFD boxes".to_string(),
                false => format!("{}=", String::from_utf8_lossy(key)),
            };
            if !parts.beside.contains(&words) {
                parts.beside.push(words);
            }
            return Ok(false);
        }
    }
    Ok(true)
}

fn check_open_marker(lines: &Lines, parts: &Parts, at: usize) -> Result<(), ReadError> {
    match parts.markers.last().filter(|_| parts.open_marker) {
        Some(marker) => Err(lines.malformed(at, format!("MARKER_ELEMS= of the marker {marker}"), "none")),
        None => Ok(()),
    }
}

/// Reads the partner of a marker: its number from 1, negative where the marker receives.
fn read_partner(lines: &Lines, value: &mut Line) -> Result<(), ReadError> {
    let (at, word) = value.word();
    match parse_signed(word) {
        Some(partner) if partner != 0 => lines.ends(value, 0),
        _ => Err(lines.malformed(at, "the partner of a marker, from 1 or from -1", shown(word))),
    }
}

/// Reads the vertices of a marker [`SEND_RECEIVE`]: lines of `1 vertex`, which may end with the
/// number of a rotation. Before them the partner of the marker may stand.
fn read_shared_vertices(lines: &mut Lines, value: &mut Line, parts: &mut Parts) -> Result<(), ReadError> {
    let at = value.start;
    let count = lines.unsigned(value, "the number of elements")?;
    let count = lines.checked(at, "the number of elements", count, 4)?;
    let before = lines.at();
    match lines.next_line().and_then(|line| line.split(b'=')) {
        Some((key, mut value)) if PARTNER.contains(&key) => read_partner(lines, &mut value)?,
        _ => lines.go_to(before),
    }
    let mut greatest = 0;
    let mut start = None;
    for _ in 0..count {
        let mut line = lines.demand("a vertex of a marker SEND_RECEIVE")?;
        start.get_or_insert(line.start);
        let number = lines.unsigned(&mut line, "the type of an element")?;
        if number != VERTEX {
            let expected = format!("a vertex ({VERTEX}), because {SEND_RECEIVE} is a marker of vertices");
            return Err(lines.malformed(line.start, expected, format!("type {number}")));
        }
        greatest = lines.unsigned(&mut line, "a vertex")?.max(greatest);
        lines.ends(&mut line, 1)?;
    }
    parts.shared[0] += 1;
    parts.shared[1] += count;
    parts.greatest.extend(start.map(|start| (greatest, start)));
    Ok(())
}

/// Reads lines of `x y z`, which may end with the vertex's index.
fn read_points(lines: &mut Lines, value: &mut Line, parts: &mut Parts) -> Result<(), ReadError> {
    if !parts.three_dimensional {
        return Err(lines.malformed(value.start, "NDIME= 3 before NPOIN=", "none"));
    }
    let at = value.start;
    let count = lines.unsigned(value, "the number of points")?;
    let count = lines.checked(at, "the number of points", count, 6)?;
    if count >= MOST_VERTICES {
        let path = lines.path().into();
        return Err(ReadError::TooMany { path, what: "vertices", count, limit: MOST_VERTICES });
    }
    parts.positions.reserve(count);
    parts.slots.reserve(count);
    for vertex in 0..count {
        let mut line = lines.demand("the coordinates of a point")?;
        parts.slots.push(line.start);
        let mut position = [0.0; 3];
        for coordinate in &mut position {
            *coordinate = lines.double(&mut line, "a coordinate")?;
        }
        check_finite_at(position, vertex as u64, || lines.place(line.start))?;
        parts.positions.push(position.into());
        lines.ends(&mut line, 2)?;
    }
    Ok(())
}

/// Reads lines of `type vertices...`, which may end with the element's index: cells, or the faces
/// of a marker.
fn read_elements(
    lines: &mut Lines,
    value: &mut Line,
    marker: Option<usize>,
    parts: &mut Parts,
) -> Result<(), ReadError> {
    let at = value.start;
    let count = lines.unsigned(value, "the number of elements")?;
    let count = lines.checked(at, "the number of elements", count, 4)?;
    let mut greatest = 0;
    let mut start = None;
    for _ in 0..count {
        let mut line = lines.demand("an element")?;
        start.get_or_insert(line.start);
        let number = lines.unsigned(&mut line, "the type of an element")?;
        let shape = match vtk_kind(number) {
            Some((Kind::Mesh(shape), _)) if shape.is_face() == marker.is_some() => shape,
            Some((Kind::PassOver(name), Some(n_vertices))) if marker.is_some() => {
                parts.mesh_builder.pass_over(name, 1);
                // A vertex that another part of a divided mesh owns has a second number.
                lines.ends(&mut line, n_vertices + 1)?;
                continue;
            }
            Some((Kind::Refuse(name), _)) => {
                parts.mesh_builder.refuse(name, 1);
                continue;
            }
            _ => {
                let expected = match marker {
                    Some(_) => "a boundary element (5: triangle, 9: quadrilateral)",
                    None => "a cell (10: tet, 12: hexahedron, 13: prism, 14: pyramid)",
                };
                return Err(lines.malformed(line.start, expected, format!("type {number}")));
            }
        };
        let tag = marker.map_or(0, |marker| marker as i32);
        parts.mesh_builder.push(shape, tag, || {
            let vertex = lines.unsigned(&mut line, "a vertex")?;
            greatest = vertex.max(greatest);
            Ok(vertex as u32)
        })?;
        lines.ends(&mut line, 1)?;
    }
    if let Some(start) = start {
        parts.greatest.push((greatest, start));
    }
    Ok(())
}

/// The error of the first element from `start` on that names a vertex beyond the last one.
fn unknown_vertex(path: &Path, bytes: &[u8], start: usize, n_vertices: u64) -> ReadError {
    let mut lines = Lines::new(path, bytes, b"%");
    lines.go_to(start);
    for element in 0.. {
        let Some(mut line) = lines.next_line() else { break };
        let (entity, corners) = match lines.unsigned(&mut line, "") {
            Ok(VERTEX) => ("element", 1),
            Ok(number) => match vtk_kind(number) {
                Some((Kind::Mesh(shape), _)) => (shape.name(), shape.n_vertices()),
                _ => continue,
            },
            Err(_) => continue,
        };
        for _ in 0..corners {
            let Ok(vertex) = lines.unsigned(&mut line, "") else { break };
            if vertex >= n_vertices {
                let defined = format!("{n_vertices} points, numbered from 0");
                let place = lines.place(line.start);
                let vertex = vertex.to_string();
                return ReadError::UnknownVertex { place, entity, element, vertex, defined };
            }
        }
    }
    lines.malformed(start, "vertices below the number of points", "a greater one")
}

/// Writes an SU2 file whose arrays have been checked.
fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let element = |out: &mut Out, number: u8, corners: &[u32]| {
        write!(out, "{number}")?;
        corners.iter().try_for_each(|vertex| write!(out, " {vertex}"))
    };
    write!(out, "NDIME= 3\nNELEM= {}\n", new_file.volume_cells().count())?;
    for (index, (shape, corners)) in new_file.volume_cells().enumerate() {
        element(out, vtk_number(shape), corners)?;
        writeln!(out, " {index}")?;
    }
    writeln!(out, "NPOIN= {}", new_file.vertices.len())?;
    for (index, vertex) in new_file.vertices.iter().enumerate() {
        for coordinate in vertex.to_array() {
            write_shortest(out, coordinate)?;
            out.write_all(b" ")?;
        }
        writeln!(out, "{index}")?;
    }
    let names = clean_names(new_file.cells.families, clean);
    writeln!(out, "NMARK= {}", names.len())?;
    for (name, faces) in names.iter().zip(new_file.faces_by_family()) {
        write!(out, "MARKER_TAG= {name}\nMARKER_ELEMS= {}\n", faces.len())?;
        for (shape, corners) in faces {
            element(out, vtk_number(shape), corners)?;
            out.write_all(b"\n")?;
        }
    }
    Ok(())
}

/// Losses of a new file: spaces in names.
fn limits(new_file: &NewFile) -> Vec<String> {
    renamed(new_file.cells.families, &clean_names(new_file.cells.families, clean))
}

/// SU2 removes white space from a marker's name, and `%` begins a comment. A byte order mark is no
/// part of a name.
fn clean(letter: char) -> bool {
    !letter.is_whitespace() && !letter.is_control() && !matches!(letter, '%' | '\u{feff}')
}
