//! CGNS files in HDF5, of one unstructured zone.
//!
//! A family is a boundary condition (`BC_t`), called as its family says (`FamilyName_t`, and the name that the `Family_t`
//! may carry itself), else as the condition; faces of no condition belong to a family of their section's name. Written
//! back, the numbers of the coordinates are replaced where they stand, and nothing else.
//!
//! Source: the CGNS standard, SIDS and "SIDS file mapping, HDF5".

mod columns;
mod create;

use std::ops::RangeInclusive;
use std::path::Path;

use glam::DVec3;
use hdf5_pure::{AttrValue, Dataset, File, Group, Layout};

use super::assembly::{Assembly, Kind, MOST_VERTICES, Shape, check_finite_at};
use super::document::Document;
use super::error::{Place, ReadError};
use super::table::Parsed;

pub(super) use create::{create, limits};

use columns::Columns;

/// The format's name in [`super::FORMATS`].
pub(super) const NAME: &str = "CGNS";

/// CGNS's number for a type of element: how many vertices it has, and what it is.
fn element_type(number: i64) -> Option<(usize, Kind)> {
    let mesh = |shape: Shape| (shape.n_vertices(), Kind::Mesh(shape));
    Some(match number {
        2 => (1, Kind::PassOver("points")),
        3 => (2, Kind::PassOver("lines")),
        5 => mesh(Shape::Triangle),
        7 => mesh(Shape::Quadrilateral),
        10 => mesh(Shape::Tet),
        12 => mesh(Shape::Pyramid),
        14 => mesh(Shape::Prism),
        17 => mesh(Shape::Hexahedron),
        4 | 6 | 8 | 9 | 11 | 13 | 15 | 16 | 18 | 19 | 21 | 24..=56 => (0, Kind::Refuse("elements of higher order")),
        22 | 23 => (0, Kind::Refuse("polyhedra")),
        _ => return None,
    })
}

/// CGNS's number for a type of element.
fn element_number(shape: Shape) -> i32 {
    match shape {
        Shape::Triangle => 5,
        Shape::Quadrilateral => 7,
        Shape::Tet => 10,
        Shape::Pyramid => 12,
        Shape::Prism => 14,
        Shape::Hexahedron => 17,
    }
}

/// A section whose elements have types of their own.
const MIXED: i64 = 20;

/// A node of the file and its name.
struct Node {
    name: String,
    group: Group,
}

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

    /// The places of these among faces whose numbers ascend.
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

/// What is read from.
struct Reader<'a> {
    path: &'a Path,
    /// Bytes of the file: no array has more values.
    length: usize,
    assembly: Assembly,
    n_vertices: usize,
    /// The number of each face in the zone, of triangles and of quadrilaterals, with its section; ascending.
    faces: [Vec<(i64, usize)>; 2],
    sections: Vec<String>,
}

/// Reads a CGNS file from its (decompressed) bytes; `path` is for messages.
pub(super) fn read(path: &Path, extension: &'static str, bytes: Vec<u8>) -> Result<Parsed, ReadError> {
    let unsupported = |found: &str, hint| ReadError::Unsupported { path: path.into(), found: found.into(), hint };
    if bytes.windows(4).take(64).any(|window| window == b"@(#)") {
        return Err(unsupported("CGNS in ADF", "turn it into HDF5: adf2hdf old.cgns new.cgns"));
    }
    let file = File::from_bytes(bytes.clone()).map_err(|error| broken(path, "an HDF5 file", &error))?;
    let length = file.superblock().eof_address;
    if length > bytes.len() as u64 {
        let expected = format!("the rest of its {length} bytes");
        return Err(ReadError::Truncated { place: Place::Byte(path.into(), bytes.len()), expected });
    }
    let mut reader = Reader {
        path,
        length: bytes.len(),
        assembly: Assembly::default(),
        n_vertices: 0,
        faces: [Vec::new(), Vec::new()],
        sections: Vec::new(),
    };
    let base = reader.only(&file.root(), "CGNSBase_t", "base", "leave one base in it")?;
    let zone = reader.only(&base.group, "Zone_t", "zone", "merge them into one in which they share vertices")?;
    for kind in reader.children(&zone.group, "ZoneType_t")? {
        if reader.text(&kind)? != "Unstructured" {
            return Err(unsupported("a structured zone", "convert it to an unstructured mesh"));
        }
    }
    let grid = reader.children(&zone.group, "GridCoordinates_t")?;
    let grid = grid.first().ok_or_else(|| reader.missing("grid coordinates"))?;
    let (positions, columns) = reader.coordinates(&grid.group, &bytes)?;
    reader.n_vertices = positions.len();
    for section in reader.sorted_sections(&zone.group)? {
        reader.elements(&section)?;
    }
    let names = reader.tag_faces(&base.group, &zone.group)?;
    let beside = Vec::new();
    let (mesh, others) = reader.assembly.finish(path, positions, |tag| names[tag as usize].clone())?;
    let coordinates = Box::new(columns);
    let document =
        Document { format: NAME, extension, bytes, coordinates, beside, companion: None, siblings: Vec::new() };
    Ok(Parsed { mesh, others, document })
}

/// The error that HDF5 or what it holds is not `expected`.
fn broken(path: &Path, expected: &str, found: &dyn std::fmt::Display) -> ReadError {
    ReadError::Malformed { place: Place::Byte(path.into(), 0), expected: expected.into(), found: found.to_string() }
}

impl Reader<'_> {
    fn missing(&self, what: &'static str) -> ReadError {
        ReadError::Missing { path: self.path.into(), what, hint: "is it a complete CGNS file?" }
    }

    /// The nodes of that label in a node, by name: HDF5 keeps no other order.
    fn children(&self, parent: &Group, label: &str) -> Result<Vec<Node>, ReadError> {
        let mut nodes = Vec::new();
        for name in parent.groups().map_err(|error| broken(self.path, "nodes of CGNS", &error))? {
            let group =
                parent.group(&name).map_err(|error| broken(self.path, &format!("the node '{name}'"), &error))?;
            let attributes = group.attrs().map_err(|error| broken(self.path, &format!("the node '{name}'"), &error))?;
            let found = match attributes.get("label") {
                Some(AttrValue::String(text) | AttrValue::AsciiString(text)) => text.trim_end_matches('\0'),
                Some(AttrValue::AsciiStringSized { value, .. } | AttrValue::StringSized { value, .. }) => {
                    value.trim_end_matches('\0')
                }
                _ => "",
            };
            if found == label {
                nodes.push(Node { name, group });
            }
        }
        nodes.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(nodes)
    }

    /// The only node of that label; `hint` says what to do about several.
    fn only(&self, parent: &Group, label: &str, what: &'static str, hint: &'static str) -> Result<Node, ReadError> {
        let mut nodes = self.children(parent, label)?;
        match (nodes.pop(), nodes.len()) {
            (Some(node), 0) => Ok(node),
            (None, _) => Err(self.missing(what)),
            (_, more) => {
                let found = format!("CGNS with {} {what}s", more + 1);
                Err(ReadError::Unsupported { path: self.path.into(), found, hint })
            }
        }
    }

    fn child(&self, parent: &Group, name: &str) -> Option<Group> {
        parent.group(name).ok()
    }

    fn data(&self, node: &Group, what: &str) -> Result<Dataset, ReadError> {
        // The name begins with a space.
        let data = node.dataset(" data").map_err(|error| broken(self.path, what, &error))?;
        let shape = data.shape().map_err(|error| broken(self.path, what, &error))?;
        let n_values = shape.iter().try_fold(1u64, |product, &size| product.checked_mul(size)).unwrap_or(u64::MAX);
        if n_values > self.length as u64 {
            let expected = format!("{what} within the {} bytes of the file", self.length);
            return Err(broken(self.path, &expected, &format_args!("{n_values} values")));
        }
        Ok(data)
    }

    fn integers(&self, node: &Group, what: &str) -> Result<Vec<i64>, ReadError> {
        self.data(node, what)?.read_i64().map_err(|error| broken(self.path, what, &error))
    }

    fn text(&self, node: &Node) -> Result<String, ReadError> {
        let bytes =
            self.data(&node.group, &node.name)?.read_i8().map_err(|error| broken(self.path, &node.name, &error))?;
        let bytes: Vec<u8> = bytes.into_iter().map(|byte| byte as u8).collect();
        Ok(String::from_utf8_lossy(&bytes).trim_end_matches(['\0', ' ']).to_string())
    }

    /// The vertices, and where their coordinates stand in the file.
    fn coordinates(&self, grid: &Group, bytes: &[u8]) -> Result<(Vec<DVec3>, Columns), ReadError> {
        let mut values = Vec::new();
        let mut starts = [0; 3];
        let mut kinds = Vec::new();
        for (axis, start) in ["X", "Y", "Z"].into_iter().zip(&mut starts) {
            let what = format!("Coordinate{axis}");
            let node =
                self.child(grid, &what).ok_or_else(|| self.missing("CoordinateX, CoordinateY and CoordinateZ"))?;
            let data = self.data(&node, &what)?;
            let layout = data.layout().map_err(|error| broken(self.path, &what, &error))?;
            let Layout::Contiguous { address: Some(address), size } = layout else {
                return Err(ReadError::Unsupported {
                    path: self.path.into(),
                    found: format!("{what} in pieces or compressed"),
                    hint: "save it without compression (h5repack -l CONTI old.cgns new.cgns)",
                });
            };
            let column = data.read_f64().map_err(|error| broken(self.path, &what, &error))?;
            *start = address as usize;
            let stored = usize::try_from(size).ok().and_then(|size| bytes.get(*start..start.checked_add(size)?));
            let stored = stored.ok_or_else(|| broken(self.path, &what, &"an end of the file"))?;
            let kind = Columns::KINDS.into_iter().find(|&kind| Columns::holds(kind, stored, &column));
            kinds.push(kind.ok_or_else(|| broken(self.path, &format!("{what} of 4 or 8 bytes"), &"other numbers"))?);
            values.push(column);
        }
        let n_vertices = values[0].len();
        if values.iter().any(|column| column.len() != n_vertices) || kinds.iter().any(|kind| *kind != kinds[0]) {
            return Err(broken(self.path, "three coordinates of one kind for every vertex", &"others"));
        }
        if n_vertices >= MOST_VERTICES {
            let path = self.path.into();
            return Err(ReadError::TooMany { path, what: "vertices", count: n_vertices, limit: MOST_VERTICES });
        }
        let mut positions = Vec::with_capacity(n_vertices);
        for (vertex, ((&x, &y), &z)) in (1..).zip(values[0].iter().zip(&values[1]).zip(&values[2])) {
            let position = [x, y, z];
            check_finite_at(position, vertex, || Place::Byte(self.path.into(), starts[0]))?;
            positions.push(position.into());
        }
        Ok((positions, Columns { starts, kind: kinds[0] }))
    }

    /// The sections of elements by their first number.
    fn sorted_sections(&self, zone: &Group) -> Result<Vec<(RangeInclusive<i64>, Node)>, ReadError> {
        let mut sections = Vec::new();
        for node in self.children(zone, "Elements_t")? {
            let range = self.child(&node.group, "ElementRange").ok_or_else(|| self.missing("ElementRange"))?;
            let range = self.integers(&range, "ElementRange")?;
            let &[first, last] = &range[..] else {
                return Err(broken(self.path, "two numbers in ElementRange", &range.len()));
            };
            if first < 1 || last < first || last == i64::MAX {
                let expected = format!("an ElementRange of '{}' that ascends from 1 or more", node.name);
                return Err(broken(self.path, &expected, &format_args!("{first} to {last}")));
            }
            sections.push((first..=last, node));
        }
        sections.sort_by_key(|(range, _)| *range.start());
        Ok(sections)
    }

    /// Reads a section of elements.
    fn elements(&mut self, (range, node): &(RangeInclusive<i64>, Node)) -> Result<(), ReadError> {
        let path = self.path;
        let name = &node.name;
        let kind = self.integers(&node.group, name)?.first().copied().unwrap_or_default();
        let connectivity =
            self.child(&node.group, "ElementConnectivity").ok_or_else(|| self.missing("ElementConnectivity"))?;
        let connectivity = self.integers(&connectivity, "ElementConnectivity")?;
        self.sections.push(name.clone());
        let mut rest = connectivity.iter().copied();
        if let Some((count, Kind::Mesh(shape))) = element_type(kind) {
            self.assembly.reserve(shape, connectivity.len() / count);
        }
        let mut element = *range.start();
        while rest.len() > 0 && range.contains(&element) {
            let kind = if kind == MIXED { rest.next().unwrap_or_default() } else { kind };
            let known = element_type(kind);
            let (count, kind) = known.ok_or_else(|| broken(path, &format!("a type of element in '{name}'"), &kind))?;
            match kind {
                Kind::Refuse(what) => {
                    self.assembly.refuse(what, 1);
                    return self.assembly.check_refused(path);
                }
                Kind::PassOver(what) => {
                    self.assembly.pass_over(what, 1);
                    rest.by_ref().take(count).for_each(drop);
                }
                Kind::Mesh(shape) => {
                    if shape.is_face() {
                        let place = usize::from(shape == Shape::Quadrilateral);
                        self.faces[place].push((element, self.sections.len() - 1));
                    }
                    let n_vertices = self.n_vertices;
                    self.assembly.push(shape, 0, || {
                        let vertex = rest.next().unwrap_or_default();
                        match u32::try_from(vertex - 1) {
                            Ok(vertex) if (vertex as usize) < n_vertices => Ok(vertex),
                            _ => {
                                let expected = format!("a vertex of element {element} in '{name}', 1 to {n_vertices}");
                                Err(broken(path, &expected, &vertex))
                            }
                        }
                    })?;
                }
            }
            element += 1;
        }
        if element != range.end() + 1 || rest.len() > 0 {
            let expected = format!("the elements {} to {} in '{name}'", range.start(), range.end());
            let found = if rest.len() > 0 { "more" } else { "fewer" };
            return Err(broken(path, &expected, &found));
        }
        Ok(())
    }

    /// Gives every face the number of its boundary condition or section, and the names of both. Conditions come in the
    /// order of their lowest faces, as the programs that wrote them numbered them.
    fn tag_faces(&mut self, base: &Group, zone: &Group) -> Result<Vec<String>, ReadError> {
        let mut conditions = Vec::new();
        for zone_bc in self.children(zone, "ZoneBC_t")? {
            for bc in self.children(&zone_bc.group, "BC_t")? {
                conditions.push((self.faces_of(&bc)?, self.family_name(base, &bc)?));
            }
        }
        conditions.sort_by_key(|(faces, _)| faces.lowest());
        let mut names: Vec<String> = conditions.iter().map(|(_, name)| name.clone()).collect();
        let tags = self.faces.each_ref().map(|of_shape| {
            let mut tags: Vec<i32> = of_shape.iter().map(|&(_, section)| (names.len() + section) as i32).collect();
            // Where conditions overlap, the first counts.
            for (tag, (faces, _)) in conditions.iter().enumerate().rev() {
                faces.places(of_shape).for_each(|place| tags[place] = tag as i32);
            }
            tags
        });
        [self.assembly.triangle_tags, self.assembly.quadrilateral_tags] = tags;
        names.extend(self.sections.iter().cloned());
        Ok(names)
    }

    /// The faces of a boundary condition.
    fn faces_of(&self, bc: &Node) -> Result<Numbers, ReadError> {
        let integers = |name: &str| -> Result<Option<Vec<i64>>, ReadError> {
            self.child(&bc.group, name).map(|node| self.integers(&node, name)).transpose()
        };
        let on_vertices = match self.children(&bc.group, "GridLocation_t")?.first() {
            Some(location) => self.text(location)? == "Vertex",
            None => integers("ElementRange")?.is_none() && integers("ElementList")?.is_none(),
        };
        if on_vertices {
            return Err(ReadError::Unsupported {
                path: self.path.into(),
                found: format!("the boundary condition '{}', which is given on vertices,", bc.name),
                hint: "save boundary conditions on faces (GridLocation FaceCenter)",
            });
        }
        let list = integers("PointList")?.or(integers("ElementList")?);
        match integers("PointRange")?.or(integers("ElementRange")?).as_deref() {
            Some(&[first, last]) => Ok(Numbers::Range(first, last)),
            Some(other) => Err(broken(self.path, &format!("two numbers in the range of '{}'", bc.name), &other.len())),
            None => Ok(Numbers::List(list.unwrap_or_default())),
        }
    }

    /// What a boundary condition's family is called: two hops to the name, where there are.
    fn family_name(&self, base: &Group, bc: &Node) -> Result<String, ReadError> {
        let names = self.children(&bc.group, "FamilyName_t")?;
        let Some(family) = names.first().map(|name| self.text(name)).transpose()? else { return Ok(bc.name.clone()) };
        let Some(node) = self.child(base, &family) else { return Ok(family) };
        match self.children(&node, "FamilyName_t")?.first() {
            Some(name) => self.text(name),
            None => Ok(family),
        }
    }
}
