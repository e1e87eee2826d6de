//! The sections of elements of a zone.

use std::ops::{Range, RangeInclusive};
use std::path::Path;

use super::tree::Node;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::{CellKind, Kind, MeshBuilder};
use crate::formats::number::Integers;

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
pub(super) fn element_number(shape: CellKind) -> i32 {
    match shape {
        CellKind::Triangle => 5,
        CellKind::Quadrilateral => 7,
        CellKind::Tet => 10,
        CellKind::Pyramid => 12,
        CellKind::Prism => 14,
        CellKind::Hexahedron => 17,
    }
}

/// The type of a section whose elements have types of their own.
const MIXED: i64 = 20;

/// The vertices of a zone.
pub(super) struct Vertices {
    pub count: usize,
    /// Vertex of the mesh for each vertex of the zone `[count]`. `None`: they are the same.
    pub of_mesh: Option<Vec<u32>>,
}

impl Vertices {
    /// The vertex of the mesh for a vertex's number in the zone, from 1.
    #[inline]
    pub fn of(&self, number: i64) -> Option<u32> {
        let index = usize::try_from(number.checked_sub(1)?).ok().filter(|&index| index < self.count)?;
        match &self.of_mesh {
            Some(of_mesh) => of_mesh.get(index).copied(),
            None => Some(index as u32),
        }
    }
}

/// The parts of a mesh read so far, and what is needed of the zone that is read.
pub(super) struct Reader<'a> {
    path: &'a Path,
    pub mesh_builder: MeshBuilder,
    /// Name of each tag of the faces.
    pub names: Vec<String>,
    /// Tags of the faces without a condition, of each zone.
    pub of_sections: Vec<Range<usize>>,
    /// What the user should know of the file.
    pub warnings: Vec<String>,
    pub vertices: Vertices,
    /// Number of each face in the zone, and index of its section, for triangles and for
    /// quadrilaterals; ascending.
    pub faces: [Vec<(i64, usize)>; 2],
    /// Number of triangles and of quadrilaterals of the zones before.
    pub n_before: [usize; 2],
    /// Number of cells of each of [`CellKind::CELLS`] of the zones before.
    pub n_cells_before: [usize; 4],
    /// Names of the zone's sections.
    pub sections: Vec<String>,
    /// Numbers of the elements of the zone's sections, ascending.
    pub ranges: Vec<RangeInclusive<i64>>,
}

impl<'a> Reader<'a> {
    /// - `path`: for messages
    pub fn new(path: &'a Path) -> Self {
        Self {
            path,
            mesh_builder: MeshBuilder::default(),
            names: Vec::new(),
            of_sections: Vec::new(),
            warnings: Vec::new(),
            vertices: Vertices { count: 0, of_mesh: None },
            faces: [Vec::new(), Vec::new()],
            n_before: [0; 2],
            n_cells_before: [0; 4],
            sections: Vec::new(),
            ranges: Vec::new(),
        }
    }

    /// Reads all sections of a zone.
    ///
    /// # Errors
    /// [`ReadError`]
    pub fn zone(&mut self, zone: &Node, vertices: Vertices) -> Result<(), ReadError> {
        self.vertices = vertices;
        self.n_before = [self.mesh_builder.triangles.len(), self.mesh_builder.others.quadrilaterals.len()];
        let others = &self.mesh_builder.others;
        self.n_cells_before =
            [self.mesh_builder.tets.len(), others.pyramids.len(), others.prisms.len(), others.hexahedra.len()];
        self.faces = [Vec::new(), Vec::new()];
        self.sections.clear();
        let sections = sorted_sections(zone)?;
        self.ranges = sections.iter().map(|(range, _)| range.clone()).collect();
        sections.iter().try_for_each(|section| self.elements(section))
    }

    /// The cells of the zone.
    pub fn cells(&self) -> impl Iterator<Item = &[u32]> {
        let [tets, pyramids, prisms, hexahedra] = self.n_cells_before;
        let others = &self.mesh_builder.others;
        (self.mesh_builder.tets[tets..].iter().map(|cell| &cell[..]))
            .chain(others.pyramids[pyramids..].iter().map(|cell| &cell[..]))
            .chain(others.prisms[prisms..].iter().map(|cell| &cell[..]))
            .chain(others.hexahedra[hexahedra..].iter().map(|cell| &cell[..]))
    }

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
                    return self.mesh_builder.check_refused(self.path).map_err(|error| section.named(error));
                }
                Kind::PassOver(what) => self.mesh_builder.pass_over(what, 1),
                Kind::Mesh(shape) => {
                    if shape.is_face() {
                        let place = usize::from(shape == CellKind::Quadrilateral);
                        self.faces[place].push((element, self.sections.len() - 1));
                    }
                    let vertices = &self.vertices;
                    let mut places = at..;
                    self.mesh_builder.push(shape, 0, || {
                        let vertex = places.next().and_then(|place| connectivity.get(place)).unwrap_or_default();
                        vertices.of(vertex).ok_or_else(|| {
                            let expected = format!("a vertex of element {element}, 1 to {}", vertices.count);
                            node.malformed(expected, vertex)
                        })
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
}

/// The two numbers of a range.
pub(super) fn range(node: &Node) -> Result<(i64, i64), ReadError> {
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
    // Boundary conditions name elements by their numbers.
    if let Some([(before, other), (range, section)]) =
        sections.array_windows().find(|[(before, _), (range, _)]| range.start() <= before.end())
    {
        let found = format!(
            "{} to {}, and {} has {} to {}",
            range.start(),
            range.end(),
            other.path(),
            before.start(),
            before.end()
        );
        return Err(section.malformed("numbers of its elements that no other section has", found));
    }
    Ok(sections)
}
