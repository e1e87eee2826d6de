//! AFLR3 files, `.ugrid`: ASCII, or binary if an extension before it says so (`.b8.ugrid`). The
//! names of the families are in a `.mapbc` file beside the mesh.
//!
//! | part of the extension | meaning |
//! |---|---|
//! | `b`, `lb` | binary, big-endian or little-endian |
//! | `r`, `lr` | the same, in Fortran's records |
//! | `8`, `4` | bytes of a coordinate |
//! | `l` at the end | counts and indices with 64 bits |
//!
//! Data after the cells are kept when the file is written back.
//!
//! Source: the UG_IO documentation of the SimCenter, "3D Grid File Type UGRID".

use std::io::{self, Write};
use std::iter;
use std::path::{Path, PathBuf};

use super::document::{Companion, Conditions, Slots, SourceFile, check_single, narrow, write_shortest};
use super::error::ReadError;
use super::format::{Create, Format, Parsed};
use super::mapbc;
use super::mesh_builder::{CellKind, MOST_VERTICES, MeshBuilder};
use super::new_file::NewFile;
use super::out::Out;
use super::scanner::{Encoding, Endian, Scanner, Width};

/// The format's name in [`super::FORMATS`].
const NAME: &str = "AFLR3";

/// The extensions of the variants.
const EXTENSIONS: &[&str] = &[
    "ugrid",
    "b8.ugrid",
    "lb8.ugrid",
    "b4.ugrid",
    "lb4.ugrid",
    "b8l.ugrid",
    "lb8l.ugrid",
    "r8.ugrid",
    "lr8.ugrid",
    "r4.ugrid",
    "lr4.ugrid",
];

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: EXTENSIONS,
    description: "AFLR3, ascii or binary by extension (.b8.ugrid, ...); families are named in a .mapbc file beside",
    read,
    create: Create::File(create),
    limits,
    companion: Some(companion),
};

/// Places of a pyramid's corners in the file: its base is 2, 1, 4, 5 there, and its apex is 3.
const PYRAMID: [usize; 5] = [1, 0, 3, 4, 2];

/// The encoding of a variant.
#[derive(Clone, Copy)]
struct Variant {
    encoding: Encoding,
    width: Width,
    /// Whether counts and indices have 64 bits.
    long: bool,
    /// Whether counts and the other data are records of Fortran.
    records: bool,
}

impl Variant {
    /// The variant of an extension such as `lb8.ugrid`.
    fn of(extension: &str) -> Self {
        let code = extension.strip_suffix("ugrid").unwrap_or(extension).trim_end_matches('.');
        let endian = if code.starts_with('l') { Endian::Little } else { Endian::Big };
        Self {
            encoding: if code.is_empty() { Encoding::Text } else { Encoding::Binary(endian) },
            width: if code.contains('4') { Width::Single } else { Width::Double },
            long: code.ends_with('l'),
            records: code.contains('r'),
        }
    }

    fn index_bytes(self) -> u64 {
        if self.long { 8 } else { 4 }
    }
}

/// A position in a file of a variant.
struct Reader<'a> {
    scanner: Scanner<'a>,
    variant: Variant,
}

impl Reader<'_> {
    /// Reads a count or an index.
    #[inline]
    fn index(&mut self, what: &'static str) -> Result<i64, ReadError> {
        if self.variant.long { self.scanner.long(what) } else { self.scanner.int(what).map(i64::from) }
    }

    /// Reads a count. An entity has at least `text` bytes in a text file, and `binary` bytes in a
    /// binary one.
    fn count(&mut self, what: &'static str, text: u64, binary: u64) -> Result<usize, ReadError> {
        let count = self.index(what)?;
        let count = u64::try_from(count).map_err(|_| self.scanner.malformed(what, count.to_string()))?;
        self.scanner.checked(what, count, text, binary)
    }

    /// Reads the length that Fortran writes before and after a record, and compares it with
    /// `expected` if this is given.
    fn record(&mut self, expected: Option<i32>) -> Result<(), ReadError> {
        if self.variant.records {
            let found = self.scanner.int("the length of a record")?;
            if expected.is_some_and(|expected| expected != found) {
                let expected = "a record of 7 counts, of 28 bytes";
                return Err(self.scanner.malformed(expected, format!("a length of {found}")));
            }
        }
        Ok(())
    }

    fn elements(
        &mut self,
        shape: CellKind,
        count: usize,
        n_vertices: usize,
        mesh_builder: &mut MeshBuilder,
    ) -> Result<(), ReadError> {
        mesh_builder.reserve(shape, count);
        for element in 1..=count as u64 {
            let mut corners = [0; 8];
            for corner in &mut corners[..shape.n_vertices()] {
                let vertex = self.index("a vertex of an element")?;
                if vertex < 1 || vertex > n_vertices as i64 {
                    let place = self.scanner.place(self.scanner.last);
                    return Err(ReadError::unknown_vertex(place, shape.name(), element, vertex, n_vertices));
                }
                *corner = (vertex - 1) as u32;
            }
            if shape == CellKind::Pyramid {
                let of_file = corners;
                corners.iter_mut().zip(PYRAMID).for_each(|(corner, place)| *corner = of_file[place]);
            }
            let mut corners = corners.into_iter();
            mesh_builder.push(shape, 0, || Ok::<_, ReadError>(corners.next().unwrap_or_default()))?;
        }
        Ok(())
    }
}

/// Reads an AFLR3 file from its (decompressed) bytes. The `.mapbc` file is searched beside `path`.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let variant = Variant::of(extension);
    let scanner = match variant.encoding {
        Encoding::Text => Scanner::of_text(path, &bytes),
        Encoding::Binary(_) => Scanner::new(path, &bytes),
    };
    let mut reader = Reader { scanner, variant };
    (reader.scanner.encoding, reader.scanner.width) = (variant.encoding, variant.width);
    let wide = variant.index_bytes();
    reader.record(Some(28))?;
    let n_vertices = reader.count("the number of vertices", 6, 3 * variant.width.bytes() as u64)?;
    let n_triangles = reader.count("the number of triangles", 8, 4 * wide)?;
    let n_quadrilaterals = reader.count("the number of quadrilaterals", 10, 5 * wide)?;
    let mut n_cells = [0; 4];
    for ((count, shape), what) in n_cells.iter_mut().zip(CellKind::CELLS).zip([
        "the number of tets",
        "the number of pyramids",
        "the number of prisms",
        "the number of hexahedra",
    ]) {
        let corners = shape.n_vertices() as u64;
        *count = reader.count(what, 2 * corners, corners * wide)?;
    }
    reader.record(Some(28))?;
    reader.record(None)?;
    if n_vertices >= MOST_VERTICES {
        return Err(ReadError::TooMany {
            path: path.into(),
            what: "vertices",
            count: n_vertices,
            limit: MOST_VERTICES,
        });
    }
    let mut positions = Vec::with_capacity(n_vertices);
    let mut slots = Vec::with_capacity(n_vertices);
    for vertex in 1..=n_vertices as u64 {
        slots.push(reader.scanner.next_number());
        positions.push(reader.scanner.coordinates(vertex)?.into());
    }
    let mut mesh_builder = MeshBuilder::default();
    reader.elements(CellKind::Triangle, n_triangles, n_vertices, &mut mesh_builder)?;
    reader.elements(CellKind::Quadrilateral, n_quadrilaterals, n_vertices, &mut mesh_builder)?;
    for tag in mesh_builder.triangle_tags.iter_mut().chain(&mut mesh_builder.quadrilateral_tags) {
        let found = reader.index("the reference of a face")?;
        let out_of_range = |_| reader.scanner.malformed("the reference of a face", found.to_string());
        *tag = i32::try_from(found).map_err(out_of_range)?;
    }
    for (shape, count) in CellKind::CELLS.into_iter().zip(n_cells) {
        reader.elements(shape, count, n_vertices, &mut mesh_builder)?;
    }
    reader.record(None)?;
    let mut beside = Vec::new();
    if !bytes[reader.scanner.at()..].trim_ascii().is_empty() {
        beside.push("what follows the cells".to_string());
    }
    let mapbc = mapbc::read(&mapbc_path(path))?;
    if mapbc.has_conditions() {
        beside.push("boundary conditions of the .mapbc file".to_string());
    }
    let names = mesh_builder.used_tags().into_iter().map(|tag| (tag, mapbc.name(tag)));
    let names = names.chain(mapbc.names.clone()).collect();
    let (mesh, others) = mesh_builder.finish(path, positions, |tag| mapbc.names.get(&tag).cloned())?;
    let coordinates = Box::new(Slots { encoding: variant.encoding, width: variant.width, slots });
    let companion = Some(Companion { path: mapbc_path, bytes: mapbc.bytes, names, conditions: mapbc.conditions });
    Ok(Parsed {
        mesh,
        others,
        document: SourceFile { companion, ..SourceFile::of_file(NAME, extension, bytes, coordinates, beside) },
    })
}

/// Path of the file with the names of the families.
fn mapbc_path(path: &Path) -> PathBuf {
    mapbc::path_beside(path, EXTENSIONS)
}

/// Writes an AFLR3 file whose arrays have been checked. The references are the families' numbers,
/// counted from 1.
fn create(out: &mut Out, new_file: &NewFile) -> io::Result<()> {
    let variant = Variant::of(new_file.extension);
    let index = |out: &mut Out, value: u64, end: &str| match variant.encoding {
        Encoding::Text => write!(out, "{value}{end}"),
        Encoding::Binary(endian) => write_index(out, value, endian, variant.long),
    };
    if variant.width == Width::Single {
        check_single(new_file.vertices)?;
    }
    let n_vertices = new_file.vertices.len();
    let shapes = CellKind::FACES.into_iter().chain(CellKind::CELLS);
    let counts: Vec<usize> = iter::once(n_vertices).chain(shapes.map(|shape| new_file.of(shape).len())).collect();
    let record = |out: &mut Out, length: usize| match variant.encoding {
        // Records longer than their length field can hold get the length modulo its range, as in
        // other programs.
        Encoding::Binary(Endian::Little) if variant.records => out.write_all(&(length as u32).to_le_bytes()),
        Encoding::Binary(Endian::Big) if variant.records => out.write_all(&(length as u32).to_be_bytes()),
        _ => Ok(()),
    };
    let corners = [0, 4, 5, 4, 5, 6, 8];
    let n_indices: usize = counts.iter().zip(corners).map(|(count, corners)| count * corners).sum();
    let length = 3 * variant.width.bytes() * n_vertices + 4 * n_indices;
    record(out, 28)?;
    for (place, &count) in counts.iter().enumerate() {
        index(out, count as u64, if place == 6 { "\n" } else { " " })?;
    }
    record(out, 28)?;
    record(out, length)?;
    for vertex in new_file.vertices {
        for (axis, value) in vertex.to_array().into_iter().enumerate() {
            match (variant.encoding, variant.width) {
                (Encoding::Text, _) => {
                    write_shortest(out, value)?;
                    out.write_all(if axis == 2 { b"\n" } else { b" " })?;
                }
                (Encoding::Binary(endian), Width::Double) => out.write_all(&endian.double(value))?,
                (Encoding::Binary(endian), Width::Single) => out.write_all(&endian.single(narrow(value)?))?,
            }
        }
    }
    let element = |out: &mut Out, corners: &[u32]| {
        let last = corners.len() - 1;
        (0..=last).try_for_each(|place| {
            let end = if place == last { "\n" } else { " " };
            index(out, u64::from(corners[place]) + 1, end)
        })
    };
    for shape in CellKind::FACES {
        new_file.of(shape).try_for_each(|face| element(out, face))?;
    }
    for shape in CellKind::FACES {
        new_file.families_of(shape).iter().try_for_each(|family| index(out, family.index() as u64 + 1, "\n"))?;
    }
    for shape in CellKind::CELLS {
        for cell in new_file.of(shape) {
            if shape == CellKind::Pyramid {
                let mut of_file = [0; 5];
                PYRAMID.into_iter().zip(cell).for_each(|(place, &vertex)| of_file[place] = vertex);
                element(out, &of_file)?;
            } else {
                element(out, cell)?;
            }
        }
    }
    record(out, length)
}

fn write_index(out: &mut Out, value: u64, endian: Endian, long: bool) -> io::Result<()> {
    if long {
        return out.write_all(&match endian {
            Endian::Little => value.to_le_bytes(),
            Endian::Big => value.to_be_bytes(),
        });
    }
    let value =
        i32::try_from(value).map_err(|_| io::Error::other("more than 2^31 vertices or cells need .b8l.ugrid"))?;
    out.write_all(&match endian {
        Endian::Little => value.to_le_bytes(),
        Endian::Big => value.to_be_bytes(),
    })
}

/// The `.mapbc` file of a new mesh: the names of the families, without boundary conditions.
fn companion(new_file: &NewFile) -> Companion {
    let names = mapbc::names(new_file);
    let bytes = Some(mapbc::without_conditions(&names));
    Companion { path: mapbc_path, bytes, names, conditions: Conditions::new() }
}

/// Whether new files with an extension hold coordinates in single precision.
pub(super) fn is_single(extension: &str) -> bool {
    FORMAT.extensions.contains(&extension) && Variant::of(extension).width == Width::Single
}

/// Losses of a new file: boundary conditions, spaces in names, perhaps double precision.
fn limits(new_file: &NewFile) -> Vec<String> {
    let mut limits = mapbc::limits(new_file);
    limits.push(mapbc::NO_CONDITIONS.to_string());
    if is_single(new_file.extension) {
        limits.push("coordinates are rounded to single precision".to_string());
    }
    limits
}
