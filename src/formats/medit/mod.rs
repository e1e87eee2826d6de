//! Medit files: `.mesh` as text, `.meshb` as binary in versions 1 to 4 and both byte orders.
//!
//! A family is a reference of faces. Text files written by idmesh hold the names in a comment.
//! Other files may have names in a `.mapbc` file beside them.
//!
//! Source: L. Maréchal, *Handling unstructured meshes with the libMeshb library*.

mod create;
mod keywords;

use std::path::Path;

use glam::DVec3;

use super::document::{Companion, Names, Slots, SourceFile};
use super::error::ReadError;
use super::format::{Create, Format, Parsed};
use super::mapbc::{self, Mapbc};
use super::mesh_builder::{CellKind, MOST_VERTICES, MeshBuilder};
use super::scanner::{Encoding, Endian, Scanner, Width, shown};
use super::vtk::parse_names;
use create::{companion, create, limits};
use keywords::{DIMENSION, END, EXTENSIONS, KEYWORDS, Keyword, MeditSection, mapbc_path};

/// The format's name in [`super::FORMATS`].
const NAME: &str = "Medit";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: EXTENSIONS,
    description: "Medit, text (.mesh) or binary (.meshb); families are references, named in a .mapbc file beside",
    read,
    create: Create::File(create),
    limits,
    companion: Some(companion),
};

/// The parts of a mesh read so far.
struct Reader<'a> {
    scanner: Scanner<'a>,
    /// Whether indices and counts of a binary file have 64 bits.
    long: bool,
    dimension: bool,
    positions: Option<Vec<DVec3>>,
    slots: Vec<usize>,
    mesh_builder: MeshBuilder,
    names: Vec<(i32, String)>,
    beside: Vec<String>,
}

/// Reads a Medit file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let is_text = extension == "mesh";
    let mut reader = Reader {
        scanner: if is_text { Scanner::of_text(path, &bytes) } else { Scanner::new(path, &bytes) },
        long: false,
        dimension: false,
        positions: None,
        slots: Vec::new(),
        mesh_builder: MeshBuilder::default(),
        names: Vec::new(),
        beside: Vec::new(),
    };
    if is_text {
        reader.text()?;
    } else {
        reader.binary()?;
    }
    let Reader { scanner, positions, slots, mesh_builder, names, mut beside, .. } = reader;
    let (encoding, width) = (scanner.encoding, scanner.width);
    let missing = |what, hint| ReadError::Missing { path: path.into(), what, hint };
    let positions = positions.ok_or_else(|| missing("Vertices", "is it a complete Medit file?"))?;
    beside.extend(mesh_builder.passed_over());
    let of_comment = |tag: i32| names.iter().find(|(number, _)| *number == tag).map(|(_, name)| name.clone());
    let used = mesh_builder.used_tags();
    let all_named = used.iter().all(|&tag| of_comment(tag).is_some());
    // The comment belongs to the same file. If it names all references, a `.mapbc` file beside may
    // belong to another mesh.
    let mapbc = if all_named { Mapbc::default() } else { mapbc::read(&mapbc_path(path))? };
    if mapbc.has_conditions() {
        beside.push("boundary conditions of the .mapbc file".to_string());
    }
    let name = |tag: i32| of_comment(tag).unwrap_or_else(|| mapbc.name(tag));
    let of_companion: Names = used.into_iter().map(|tag| (tag, name(tag))).chain(mapbc.names.clone()).collect();
    let (mesh, others) =
        mesh_builder.finish(path, positions, |tag| of_comment(tag).or_else(|| mapbc.names.get(&tag).cloned()))?;
    let coordinates = Box::new(Slots { encoding, width, slots });
    let (bytes_beside, conditions) = (mapbc.bytes, mapbc.conditions);
    let companion = Some(Companion { path: mapbc_path, bytes: bytes_beside, names: of_companion, conditions });
    let document = SourceFile { companion, ..SourceFile::of_file(NAME, extension, bytes, coordinates, beside) };
    Ok(Parsed { mesh, others, document })
}

impl Reader<'_> {
    /// Reads the sections of a text file.
    fn text(&mut self) -> Result<(), ReadError> {
        let mut begun = false;
        loop {
            let token = self.scanner.token();
            match token {
                b"" => return Ok(()),
                _ if token[0] == b'#' => {
                    let comment = [token, self.scanner.rest_of_line()].concat();
                    self.comment(&comment);
                }
                _ if token.eq_ignore_ascii_case(b"MeshVersionFormatted") => {
                    begun = true;
                    self.version()?;
                }
                _ if !begun => return Err(self.scanner.malformed("MeshVersionFormatted", shown(token))),
                _ if token.eq_ignore_ascii_case(b"Dimension") => self.dimensions()?,
                _ if token.eq_ignore_ascii_case(b"End") => return Ok(()),
                _ => {
                    let name = String::from_utf8_lossy(token).into_owned();
                    match KEYWORDS.iter().find(|keyword| keyword.name.eq_ignore_ascii_case(&name)) {
                        Some(keyword) => self.section(keyword)?,
                        None if token[0].is_ascii_alphabetic() => {
                            // Skips the numbers of an unknown section.
                            self.comments();
                            while self.scanner.peek_byte().is_some_and(|byte| !byte.is_ascii_alphabetic()) {
                                self.scanner.token();
                                self.comments();
                            }
                            self.beside.push(name);
                        }
                        None => return Err(self.scanner.malformed("a keyword such as Vertices", shown(token))),
                    }
                }
            }
        }
    }

    fn comment(&mut self, comment: &[u8]) {
        self.names.extend(parse_names(&String::from_utf8_lossy(comment)));
    }

    /// Reads the comments before the next number of a text file.
    #[inline]
    fn comments(&mut self) {
        while self.scanner.encoding == Encoding::Text && self.scanner.peek_byte() == Some(b'#') {
            let comment = self.scanner.rest_of_line().trim_ascii_start().to_vec();
            if comment.is_empty() {
                continue;
            }
            self.comment(&comment);
        }
    }

    /// Reads the sections of a binary file: number, offset of the next section, contents.
    fn binary(&mut self) -> Result<(), ReadError> {
        self.scanner.encoding = Encoding::Binary(Endian::Little);
        let one = self.scanner.block::<4>("the number 1")?;
        self.scanner.encoding = Encoding::Binary(match one {
            [1, 0, 0, 0] => Endian::Little,
            [0, 0, 0, 1] => Endian::Big,
            _ => return Err(self.scanner.malformed("the number 1 of a binary Medit file", shown(&one))),
        });
        let version = self.version()?;
        loop {
            let number = self.scanner.int("the number of a section")?;
            let place = self.scanner.last;
            if number == END {
                return Ok(());
            }
            let next = match version {
                ..3 => self.scanner.int("where the next section begins").map(i64::from)?,
                _ => self.scanner.long("where the next section begins")?,
            };
            let next = usize::try_from(next).ok().filter(|&next| next == 0 || next > self.scanner.at());
            let next = next.ok_or_else(|| self.scanner.malformed("where the next section begins", "a place before"))?;
            match KEYWORDS.iter().find(|keyword| keyword.number == number) {
                Some(keyword) => self.section(keyword)?,
                None if number == DIMENSION => self.dimensions()?,
                None => {
                    if next == 0 {
                        return Ok(());
                    }
                    self.beside.push(format!("section {number}"));
                    self.scanner.go_to(next)?;
                }
            }
            if next != 0 && next != self.scanner.at() {
                self.scanner.last = place;
                let expected = format!("a section up to byte {next}");
                return Err(self.scanner.malformed(expected, format!("one up to byte {}", self.scanner.at())));
            }
        }
    }

    fn version(&mut self) -> Result<i32, ReadError> {
        let version = self.scanner.int("the version of the format, 1 to 4")?;
        if !(1..=4).contains(&version) {
            return Err(self.scanner.malformed("the version of the format, 1 to 4", version.to_string()));
        }
        self.scanner.width = if version == 1 { Width::Single } else { Width::Double };
        self.long = version == 4;
        Ok(version)
    }

    fn dimensions(&mut self) -> Result<(), ReadError> {
        let dimensions = self.scanner.int("the number of dimensions")?;
        if dimensions == 3 {
            self.dimension = true;
            return Ok(());
        }
        let found = format!("a mesh of {dimensions} dimensions");
        let hint = "idmesh moves meshes of 3 dimensions";
        Err(ReadError::Unsupported { path: self.scanner.path().into(), found, hint })
    }

    #[inline]
    fn index(&mut self, what: &'static str) -> Result<i64, ReadError> {
        if self.long { self.scanner.long(what) } else { self.scanner.int(what).map(i64::from) }
    }

    /// Reads a count and as many vertices or elements, each with its reference.
    fn section(&mut self, keyword: &Keyword) -> Result<(), ReadError> {
        let index_bytes = if self.long { 8 } else { 4 };
        let (text, binary) = match keyword.section {
            MeditSection::Vertices => (8, 3 * self.scanner.width.bytes() as u64 + index_bytes),
            MeditSection::Elements(shape) => {
                (2 * (shape.n_vertices() as u64 + 1), (shape.n_vertices() as u64 + 1) * index_bytes)
            }
            MeditSection::PassedOver(_) => (6, 3 * index_bytes),
            MeditSection::Refused(_) => (2, index_bytes),
        };
        self.comments();
        let count = self.index("the number of entries of a section")?;
        let count = u64::try_from(count)
            .map_err(|_| self.scanner.malformed("the number of entries of a section", count.to_string()))?;
        let count = self.scanner.checked("the number of entries of a section", count, text, binary)?;
        match keyword.section {
            MeditSection::Vertices => self.vertices(count),
            MeditSection::Elements(shape) => self.elements(shape, count),
            MeditSection::PassedOver(name) => {
                self.mesh_builder.pass_over(name, count);
                for number in 0..3 * count {
                    if number % 3 == 0 {
                        self.comments();
                    }
                    self.index("a vertex of an edge")?;
                }
                Ok(())
            }
            MeditSection::Refused(name) => {
                self.mesh_builder.refuse(name, count);
                self.mesh_builder.check_refused(self.scanner.path())
            }
        }
    }

    fn vertices(&mut self, count: usize) -> Result<(), ReadError> {
        if self.positions.is_some() {
            return Err(self.scanner.malformed("one section of vertices", "a second one"));
        }
        if !self.dimension {
            return Err(self.scanner.malformed("Dimension 3 before the vertices", "none"));
        }
        if count >= MOST_VERTICES {
            let path = self.scanner.path().into();
            return Err(ReadError::TooMany { path, what: "vertices", count, limit: MOST_VERTICES });
        }
        let mut positions = Vec::with_capacity(count);
        self.slots.reserve(count);
        for vertex in 1..=count as u64 {
            self.comments();
            self.slots.push(self.scanner.next_number());
            positions.push(self.scanner.coordinates(vertex)?.into());
            self.index("the reference of a vertex")?;
        }
        self.positions = Some(positions);
        Ok(())
    }

    fn elements(&mut self, shape: CellKind, count: usize) -> Result<(), ReadError> {
        let Some(n_vertices) = self.positions.as_ref().map(|positions| positions.len()) else {
            return Err(self.scanner.malformed("the vertices before the elements", "none"));
        };
        self.mesh_builder.reserve(shape, count);
        for element in 1..=count as u64 {
            self.comments();
            let mut corners = [0; 8];
            for corner in &mut corners[..shape.n_vertices()] {
                let vertex = self.index("a vertex of an element")?;
                if vertex < 1 || vertex > n_vertices as i64 {
                    let place = self.scanner.place(self.scanner.last);
                    return Err(ReadError::unknown_vertex(place, shape.name(), element, vertex, n_vertices));
                }
                *corner = (vertex - 1) as u32;
            }
            let found = self.index("the reference of an element")?;
            let tag = i32::try_from(found)
                .map_err(|_| self.scanner.malformed("the reference of an element", found.to_string()))?;
            let mut corners = corners.into_iter();
            self.mesh_builder.push(shape, tag, || Ok::<_, ReadError>(corners.next().unwrap_or_default()))?;
        }
        Ok(())
    }
}
