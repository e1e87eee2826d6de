//! CGNS files in HDF5, with one unstructured zone.
//!
//! A family is a boundary condition (`BC_t`). Its name is the name of the condition's family:
//! `FamilyName_t` of the condition, or the full name in the `Family_t`. Without a family it is the
//! name of the condition. Faces without a condition belong to a family with their section's name.
//!
//! When a file is written back, the numbers of the coordinates are replaced in their places, and
//! everything else is kept.
//!
//! Source: the CGNS standard, SIDS and "SIDS file mapping, HDF5".

mod apart;
mod columns;
mod create;
mod tree;

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hdf5_pure::File;

use super::document::SourceFile;
use super::error::{Location, ReadError};
use super::format::{Create, Format, Parsed};
use super::mesh_builder::{CellKind, Kind, MOST_VERTICES, MeshBuilder, check_finite_at};
use super::number::Integers;

use columns::Columns;
use create::{create, limits};
use tree::{Node, Shared};

/// The format's name in [`super::FORMATS`].
const NAME: &str = "CGNS";

/// The format, as a row of [`FORMATS`](crate::formats::FORMATS).
pub(super) const FORMAT: Format = Format {
    name: NAME,
    extensions: &["cgns"],
    description: "CGNS in HDF5, one unstructured zone; families are the boundary conditions",
    read,
    create: Create::File(create),
    limits,
    companion: None,
};

/// Number of vertices and kind of an element, from CGNS's number for its type.
fn element_type(number: i64) -> Option<(usize, Kind)> {
    let mesh = |shape: CellKind| (shape.n_vertices(), Kind::Mesh(shape));
    Some(match number {
        2 => (1, Kind::PassOver("points")),
        3 => (2, Kind::PassOver("lines")),
        5 => mesh(CellKind::Triangle),
        7 => mesh(CellKind::Quadrilateral),
        10 => mesh(CellKind::Tet),
        12 => mesh(CellKind::Pyramid),
        14 => mesh(CellKind::Prism),
        17 => mesh(CellKind::Hexahedron),
        4 | 6 | 8 | 9 | 11 | 13 | 15 | 16 | 18 | 19 | 21 | 24..=56 => (0, Kind::Refuse("elements of higher order")),
        22 | 23 => (0, Kind::Refuse("polyhedra")),
        _ => return None,
    })
}

/// CGNS's number for the type of an element.
fn element_number(shape: CellKind) -> i32 {
    match shape {
        CellKind::Triangle => 5,
        CellKind::Quadrilateral => 7,
        CellKind::Tet => 10,
        CellKind::Pyramid => 12,
        CellKind::Prism => 14,
        CellKind::Hexahedron => 17,
    }
}

/// Labels of nodes in a base or zone that are read, or that hold nothing about the mesh.
const READ: [&str; 7] =
    ["Zone_t", "Family_t", "ZoneType_t", "GridCoordinates_t", "Elements_t", "ZoneBC_t", "Ordinal_t"];

/// The type of a section whose elements have types of their own.
const MIXED: i64 = 20;

/// Numbers of elements.
enum Numbers {
    Range(i64, i64),
    List(Vec<i64>),
}

impl Numbers {
    fn lowest(&self) -> i64 {
        match self {
            Numbers::Range(first, _) => *first,
            Numbers::List(list) => list.iter().copied().min().unwrap_or(i64::MAX),
        }
    }

    /// Indices of these elements among faces in ascending order of their numbers.
    fn places<'a>(&'a self, faces: &'a [(i64, usize)]) -> Box<dyn Iterator<Item = usize> + 'a> {
        let below = |number: i64| faces.partition_point(|&(face, _)| face < number);
        match self {
            Numbers::Range(first, last) => Box::new(below(*first)..below(last.saturating_add(1)).max(below(*first))),
            Numbers::List(list) => {
                Box::new(list.iter().filter_map(|number| faces.binary_search_by_key(number, |&(face, _)| face).ok()))
            }
        }
    }
}

/// The parts of a mesh read so far.
struct Reader<'a> {
    path: &'a Path,
    mesh_builder: MeshBuilder,
    n_vertices: usize,
    /// Number of each face in the zone, and index of its section, for triangles and for
    /// quadrilaterals; ascending.
    faces: [Vec<(i64, usize)>; 2],
    sections: Vec<String>,
}

/// Reads a CGNS file from its (decompressed) bytes. `path` is for messages.
fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let shared = Shared::new(bytes);
    let zone = read_zone(path, &shared)?;
    apart::check(path, &shared, &zone)?;
    let Zone { mesh_builder, positions, columns, names, beside } = zone;
    let (mesh, others) = mesh_builder.finish(path, positions, |tag| names[tag as usize].clone())?;
    // HDF5 has released the bytes.
    let bytes = Arc::unwrap_or_clone(shared.bytes);
    let coordinates = Box::new(columns);
    let document = SourceFile::of_file(NAME, extension, bytes, coordinates, beside);
    Ok(Parsed { mesh, others, document })
}

/// The contents of a zone.
struct Zone {
    mesh_builder: MeshBuilder,
    positions: Vec<DVec3>,
    columns: Columns,
    /// Name of each tag of the faces.
    names: Vec<String>,
    beside: Vec<String>,
}

fn read_zone(path: &Path, shared: &Shared) -> Result<Zone, ReadError> {
    let bytes = &shared.bytes[..];
    let unsupported = |found: &str, hint| ReadError::Unsupported { path: path.into(), found: found.into(), hint };
    if bytes.windows(4).take(64).any(|window| window == b"@(#)") {
        return Err(unsupported("CGNS in ADF", "turn it into HDF5: adf2hdf old.cgns new.cgns"));
    }
    let file = File::from_source(shared.clone()).map_err(|error| ReadError::Malformed {
        place: Location::File(path.into()),
        expected: "an HDF5 file".into(),
        found: error.to_string(),
    })?;
    let length = file.superblock().eof_address;
    if length > bytes.len() as u64 {
        let expected = format!("the rest of its {length} bytes");
        return Err(ReadError::Truncated { place: Location::Byte(path.into(), bytes.len()), expected });
    }
    let root = Node::root(path, shared, &file);
    let base = root.only("CGNSBase_t", "base", "leave one base in it")?;
    let zone = base.only("Zone_t", "zone", "merge them into one in which they share vertices")?;
    for kind in zone.children("ZoneType_t")? {
        if kind.text()? != "Unstructured" {
            return Err(unsupported("a structured zone", "convert it to an unstructured mesh"));
        }
    }
    let grid = zone.children("GridCoordinates_t")?;
    let grid = grid.first().ok_or_else(|| zone.malformed("grid coordinates in it", "none"))?;
    let (positions, columns) = read_coordinates(path, grid)?;
    let mut reader = Reader {
        path,
        mesh_builder: MeshBuilder::default(),
        n_vertices: positions.len(),
        faces: [Vec::new(), Vec::new()],
        sections: Vec::new(),
    };
    for section in sorted_sections(&zone)? {
        reader.elements(&section)?;
    }
    let names = reader.tag_faces(&base, &zone)?;
    let mut beside = reader.mesh_builder.passed_over();
    beside.extend(types_of_conditions(&zone)?);
    for (label, node) in base.labelled()?.into_iter().chain(zone.labelled()?) {
        if !READ.contains(&&*label) {
            beside.push(format!("the node '{}'", node.name()));
        }
    }
    Ok(Zone { mesh_builder: reader.mesh_builder, positions, columns, names, beside })
}

/// The types of the boundary conditions, in words. Conditions without a type of their own do not
/// count.
fn types_of_conditions(zone: &Node) -> Result<Option<String>, ReadError> {
    let mut types = Vec::new();
    for zone_bc in zone.children("ZoneBC_t")? {
        for bc in zone_bc.children("BC_t")? {
            types.extend(bc.text());
        }
    }
    types.retain(|kind| !matches!(&**kind, "FamilySpecified" | "Null" | "UserDefined"));
    types.sort_unstable();
    types.dedup();
    Ok((!types.is_empty()).then(|| format!("types of boundary conditions ({})", types.join(", "))))
}

/// The vertices, and the places of their coordinates in the file.
fn read_coordinates(path: &Path, grid: &Node) -> Result<(Vec<DVec3>, Columns), ReadError> {
    let mut values = Vec::new();
    let mut starts = [0; 3];
    let mut kinds = Vec::new();
    let axes = ["CoordinateX", "CoordinateY", "CoordinateZ"];
    for (axis, start) in axes.into_iter().zip(&mut starts) {
        let node = grid.child(axis)?;
        let data = node.data()?;
        let Some((address, stored)) = node.stored(&data)? else {
            return Err(ReadError::Unsupported {
                path: path.into(),
                found: format!("{axis} in pieces or compressed"),
                hint: "save it without compression (h5repack -l CONTI old.cgns new.cgns)",
            });
        };
        *start = address;
        let column = data.read_f64().map_err(|error| node.malformed("coordinates", error))?;
        let kind = Columns::KINDS.into_iter().find(|&kind| Columns::holds(kind, stored, &column));
        kinds.push(kind.ok_or_else(|| node.malformed("coordinates of 4 or 8 bytes", "other numbers"))?);
        values.push(column);
    }
    let lengths: Vec<usize> = values.iter().map(Vec::len).collect();
    let n_vertices = lengths[0];
    if lengths.iter().any(|&length| length != n_vertices) || kinds.iter().any(|kind| *kind != kinds[0]) {
        let found = format!("{lengths:?} of {kinds:?}");
        return Err(grid.malformed("three coordinates of one kind for every vertex", found));
    }
    if n_vertices >= MOST_VERTICES {
        let path = path.into();
        return Err(ReadError::TooMany { path, what: "vertices", count: n_vertices, limit: MOST_VERTICES });
    }
    let mut positions = Vec::with_capacity(n_vertices);
    for (vertex, ((&x, &y), &z)) in (1..).zip(values[0].iter().zip(&values[1]).zip(&values[2])) {
        check_finite_at([x, y, z], vertex, || grid.place())?;
        positions.push([x, y, z].into());
    }
    Ok((positions, Columns { starts, kind: kinds[0] }))
}

/// The two numbers of a range.
fn range(node: &Node) -> Result<(i64, i64), ReadError> {
    let mut range = node.integers()?;
    match (range.len(), range.get(0), range.get(1)) {
        (2, Some(first), Some(last)) => Ok((first, last)),
        (count, ..) => Err(node.malformed("two numbers", count)),
    }
}

/// The sections of elements, in the order of their first numbers.
fn sorted_sections<'a>(zone: &Node<'a>) -> Result<Vec<(RangeInclusive<i64>, Node<'a>)>, ReadError> {
    let mut sections = Vec::new();
    for section in zone.children("Elements_t")? {
        let node = section.child("ElementRange")?;
        let (first, last) = range(&node)?;
        if first < 1 || last < first || last == i64::MAX {
            return Err(node.malformed("a range that ascends from 1 or more", format_args!("{first} to {last}")));
        }
        sections.push((first..=last, section));
    }
    sections.sort_by_key(|(range, _)| *range.start());
    Ok(sections)
}

impl Reader<'_> {
    /// Reads a section of elements.
    fn elements(&mut self, (range, section): &(RangeInclusive<i64>, Node)) -> Result<(), ReadError> {
        let of_section = section.integers()?.get(0).unwrap_or_default();
        let is_mixed = of_section == MIXED;
        let node = section.child("ElementConnectivity")?;
        let mut connectivity: Integers = node.integers()?;
        let length = connectivity.len();
        self.sections.push(section.name().to_owned());
        if let Some((count, Kind::Mesh(shape))) = element_type(of_section) {
            self.mesh_builder.reserve(shape, length / count);
        }
        // CGNS before 3.4 has no offsets. The types of the elements also give each element's begin.
        let offsets = if is_mixed { section.find("ElementStartOffset") } else { None };
        let mut offsets = offsets.map(|node| Ok((node.integers()?, node))).transpose()?;
        let mut begins = |at: usize, element: i64| match &mut offsets {
            Some((offsets, node)) => {
                let place = usize::try_from(element - range.start()).unwrap_or(usize::MAX);
                match offsets.get(place) {
                    Some(offset) if offset == at as i64 => Ok(()),
                    found => {
                        let found = found.map_or_else(|| "none".to_owned(), |offset| offset.to_string());
                        Err(node
                            .malformed(format!("{at}, where the types of the elements have element {element}"), found))
                    }
                }
            }
            None => Ok(()),
        };
        let (mut at, mut element) = (0, *range.start());
        while at < length && range.contains(&element) {
            begins(at, element)?;
            // In a mixed section the type of an element stands before its vertices.
            let kind = if is_mixed { connectivity.get(at).unwrap_or_default() } else { of_section };
            at += usize::from(is_mixed);
            let known = element_type(kind);
            let (count, kind) = known
                .ok_or_else(|| node.malformed(format!("the type of element {element}"), format_args!("{kind}")))?;
            match kind {
                Kind::Refuse(what) => {
                    self.mesh_builder.refuse(what, 1);
                    return self.mesh_builder.check_refused(self.path);
                }
                Kind::PassOver(what) => self.mesh_builder.pass_over(what, 1),
                Kind::Mesh(shape) => {
                    if shape.is_face() {
                        let place = usize::from(shape == CellKind::Quadrilateral);
                        self.faces[place].push((element, self.sections.len() - 1));
                    }
                    let n_vertices = self.n_vertices;
                    let mut places = at..;
                    self.mesh_builder.push(shape, 0, || {
                        let vertex = places.next().and_then(|place| connectivity.get(place)).unwrap_or_default();
                        match u32::try_from(vertex - 1) {
                            Ok(vertex) if (vertex as usize) < n_vertices => Ok(vertex),
                            _ => {
                                let expected = format!("a vertex of element {element}, 1 to {n_vertices}");
                                Err(node.malformed(expected, vertex))
                            }
                        }
                    })?;
                }
            }
            at += count;
            element += 1;
        }
        if element != range.end() + 1 || at != length {
            let expected = format!("the elements {} to {}", range.start(), range.end());
            return Err(node.malformed(expected, if at < length { "more" } else { "fewer" }));
        }
        begins(at, element)
    }

    /// Gives every face the tag of its boundary condition or section, and returns the names of the
    /// tags. Conditions are ordered by their lowest faces, as the programs that wrote them numbered
    /// them.
    fn tag_faces(&mut self, base: &Node, zone: &Node) -> Result<Vec<String>, ReadError> {
        let mut conditions = Vec::new();
        for zone_bc in zone.children("ZoneBC_t")? {
            for bc in zone_bc.children("BC_t")? {
                conditions.push((self.faces_of(&bc)?, family_name(base, &bc)?));
            }
        }
        conditions.sort_by_key(|(faces, _)| faces.lowest());
        let mut names: Vec<String> = conditions.iter().map(|(_, name)| name.clone()).collect();
        let tags = self.faces.each_ref().map(|of_shape| {
            let mut tags: Vec<i32> = of_shape.iter().map(|&(_, section)| (names.len() + section) as i32).collect();
            // If conditions overlap, the first one counts.
            for (tag, (faces, _)) in conditions.iter().enumerate().rev() {
                faces.places(of_shape).for_each(|place| tags[place] = tag as i32);
            }
            tags
        });
        [self.mesh_builder.triangle_tags, self.mesh_builder.quadrilateral_tags] = tags;
        names.extend(self.sections.iter().cloned());
        Ok(names)
    }

    /// The faces of a boundary condition.
    fn faces_of(&self, bc: &Node) -> Result<Numbers, ReadError> {
        let on_vertices = match bc.children("GridLocation_t")?.first() {
            Some(location) => location.text()? == "Vertex",
            None => bc.find("ElementRange").is_none() && bc.find("ElementList").is_none(),
        };
        if on_vertices {
            return Err(ReadError::Unsupported {
                path: self.path.into(),
                found: format!("the boundary condition '{}', which is given on vertices,", bc.name()),
                hint: "save boundary conditions on faces (GridLocation FaceCenter)",
            });
        }
        if let Some(node) = bc.find("PointRange").or_else(|| bc.find("ElementRange")) {
            let (first, last) = range(&node)?;
            return Ok(Numbers::Range(first, last));
        }
        let list = bc.find("PointList").or_else(|| bc.find("ElementList"));
        let mut list = list.map_or_else(|| Ok(Vec::new().into()), |node| node.integers())?;
        Ok(Numbers::List((0..list.len()).filter_map(|place| list.get(place)).collect()))
    }
}

/// Name of a boundary condition's family. There may be two levels of names.
fn family_name(base: &Node, bc: &Node) -> Result<String, ReadError> {
    let names = bc.children("FamilyName_t")?;
    let Some(family) = names.first().map(Node::text).transpose()? else { return Ok(bc.name().to_owned()) };
    let Some(node) = base.find(&family) else { return Ok(family) };
    match node.children("FamilyName_t")?.first() {
        Some(name) => name.text(),
        None => Ok(family),
    }
}
