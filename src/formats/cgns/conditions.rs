//! The boundary conditions of a zone, which give its faces their families.
//!
//! A condition may be given on faces, on vertices or on edges. Conditions on faces count. If a zone
//! has none, a condition on vertices has the faces all of whose vertices it holds. They may be the
//! sides of cells on the zone's boundary, where no section has faces.

use glam::DVec3;

use super::elements::{Reader, range};
use super::tree::Node;
use crate::formats::error::ReadError;

/// Numbers of elements or vertices.
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

/// What a condition is given on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Vertices,
    Edges,
    Faces,
    /// Elements that need not be faces.
    Cells,
}

/// A boundary condition.
struct Condition<'a> {
    node: Node<'a>,
    kind: Kind,
    numbers: Numbers,
    family: String,
}

impl<'a> Condition<'a> {
    fn read(base: &Node, node: Node<'a>) -> Result<Self, ReadError> {
        let kind = match node.children("GridLocation_t")?.first() {
            Some(location) => match &*location.text()? {
                "Vertex" => Kind::Vertices,
                "EdgeCenter" => Kind::Edges,
                "CellCenter" => Kind::Cells,
                _ => Kind::Faces,
            },
            None if node.find("ElementRange").is_none() && node.find("ElementList").is_none() => Kind::Vertices,
            None => Kind::Faces,
        };
        let numbers = match node.find("PointRange").or_else(|| node.find("ElementRange")) {
            Some(node) => {
                let (first, last) = range(&node)?;
                Numbers::Range(first, last)
            }
            None => {
                let list = node.find("PointList").or_else(|| node.find("ElementList"));
                let mut list = list.map_or_else(|| Ok(Vec::new().into()), |node| node.integers())?;
                Numbers::List((0..list.len()).filter_map(|place| list.get(place)).collect())
            }
        };
        let family = family_name(base, &node)?;
        Ok(Self { node, kind, numbers, family })
    }

    /// The error of a face that a condition of another family holds too.
    fn shares(&self, earlier: &Self, face: i64) -> ReadError {
        let found = format!(
            "face {face} of the family '{}', which {} puts into the family '{}'; leave each face in one condition, or give \
             both conditions one FamilyName",
            self.family,
            earlier.node.path(),
            earlier.family
        );
        self.node.malformed("faces that no condition of another family holds", found)
    }
}

impl Reader<'_> {
    /// Gives every face of the zone the tag of its boundary condition or section, and adds the
    /// names of the tags. Conditions are ordered by their lowest faces, as the programs that wrote
    /// them numbered them.
    ///
    /// - `positions`: positions of the mesh's vertices `[n_vertices]`, for messages
    /// - `prefix`: beginning of the names of families that are called after their section
    ///
    /// # Errors
    /// [`ReadError`]
    pub fn tag_faces(&mut self, base: &Node, zone: &Node, positions: &[DVec3], prefix: &str) -> Result<(), ReadError> {
        let mut conditions = Vec::new();
        for zone_bc in zone.children("ZoneBC_t")? {
            for bc in zone_bc.children("BC_t")? {
                conditions.push(Condition::read(base, bc)?);
            }
        }
        conditions.sort_by_key(|condition| condition.numbers.lowest());
        let (on_faces, others): (Vec<_>, Vec<_>) =
            conditions.into_iter().partition(|condition| matches!(condition.kind, Kind::Faces | Kind::Cells));
        let (on_vertices, on_edges): (Vec<_>, Vec<_>) =
            others.into_iter().partition(|condition| condition.kind == Kind::Vertices);
        for condition in &on_edges {
            self.remark(condition, "a boundary condition on edges is passed over");
        }
        let is_bare = !self.has_faces() && !on_vertices.is_empty();
        if is_bare {
            self.add_boundary()?;
        }
        // Indices of the conditions.
        let mut of_faces = self.faces.each_ref().map(|of_shape| vec![None; of_shape.len()]);
        let mut has_faces = vec![false; on_faces.len()];
        for (index, condition) in on_faces.iter().enumerate() {
            self.check_elements(condition)?;
            for (of_faces, of_shape) in of_faces.iter_mut().zip(&self.faces) {
                for place in condition.numbers.places(of_shape) {
                    let earlier = *of_faces[place].get_or_insert(index);
                    if on_faces[earlier].family != condition.family {
                        return Err(condition.shares(&on_faces[earlier], of_shape[place].0));
                    }
                    has_faces[index] = true;
                }
            }
        }
        for (condition, has_faces) in on_faces.iter().zip(&has_faces) {
            if !has_faces && condition.kind == Kind::Faces {
                self.remark(condition, "a boundary condition that holds no face of a section is passed over");
            }
        }
        let conditions = if has_faces.contains(&true) {
            for condition in &on_vertices {
                self.remark(condition, "a boundary condition on vertices, beside those on faces, is passed over");
            }
            on_faces
        } else {
            for (index, condition) in on_vertices.iter().enumerate() {
                self.faces_between(condition, index, &on_vertices, &mut of_faces, positions)?;
            }
            on_vertices
        };
        let first = self.names.len();
        self.of_sections.push(first + conditions.len()..first + conditions.len() + self.sections.len());
        let of_section = |section: usize| first + conditions.len() + section;
        let tags = self.faces.each_ref().map(|of_shape| of_shape.iter().map(|&(_, section)| section));
        let mut n_without = vec![0; self.sections.len()];
        let builder = &mut self.mesh_builder;
        let all_tags = [&mut builder.triangle_tags, &mut builder.quadrilateral_tags];
        for (((all_tags, n_before), sections), of_faces) in
            all_tags.into_iter().zip(self.n_before).zip(tags).zip(&of_faces)
        {
            let tags = all_tags[n_before..].iter_mut().zip(sections).zip(of_faces);
            for ((tag, section), condition) in tags {
                n_without[section] += usize::from(condition.is_none());
                *tag = condition.map_or_else(|| of_section(section), |condition| first + condition) as i32;
            }
        }
        let names = self.sections.iter().map(|section| format!("{prefix}{section}"));
        if conditions.first().is_some_and(|condition| condition.kind == Kind::Vertices) {
            for (count, name) in n_without.iter().zip(names.clone()).filter(|(count, _)| **count > 0) {
                let what = "faces have no boundary condition that holds all their vertices: their family is";
                let why = if is_bare { "" } else { ", as their section" };
                self.warnings.push(format!("{count} {what} '{name}'{why}"));
            }
        }
        self.names.extend(conditions.into_iter().map(|condition| condition.family));
        self.names.extend(names);
        Ok(())
    }

    /// Checks that the elements of a condition are there.
    ///
    /// # Errors
    /// [`ReadError::Malformed`]
    fn check_elements(&self, condition: &Condition) -> Result<(), ReadError> {
        let is_there = |&number: &i64| {
            let after = self.ranges.partition_point(|range| *range.start() <= number);
            after.checked_sub(1).is_some_and(|place| self.ranges[place].contains(&number))
        };
        let wrong = match &condition.numbers {
            Numbers::Range(first, last) if first > last => {
                return Err(condition.node.malformed("a range that ascends", format_args!("{first} to {last}")));
            }
            Numbers::Range(first, last) => [*first, *last].into_iter().find(|number| !is_there(number)),
            Numbers::List(list) => list.iter().copied().find(|number| !is_there(number)),
        };
        let Some(wrong) = wrong else { return Ok(()) };
        let last = self.ranges.last().map_or(0, |range| *range.end());
        let what = format!("elements of the zone, 1 to {last} (is it on vertices, with another GridLocation?)");
        Err(condition.node.malformed(what, wrong))
    }

    fn remark(&mut self, condition: &Condition, what: &str) {
        self.warnings.push(format!("{}: {what}", condition.node.path()));
    }

    /// Gives a condition on vertices the faces all of whose vertices it holds.
    ///
    /// - `of_faces`: index of the condition of each triangle and each quadrilateral, if it has one
    fn faces_between(
        &self,
        condition: &Condition,
        index: usize,
        all: &[Condition],
        of_faces: &mut [Vec<Option<usize>>; 2],
        positions: &[DVec3],
    ) -> Result<(), ReadError> {
        let count = self.vertices.count;
        let malformed = |found: i64| {
            let what = format!("vertices of a condition, 1 to {count} (is it on faces, without a GridLocation?)");
            condition.node.malformed(what, found)
        };
        let mut is_held = vec![false; positions.len()];
        let mut hold = |number: i64| {
            let vertex = self.vertices.of(number).ok_or_else(|| malformed(number))?;
            is_held[vertex as usize] = true;
            Ok(())
        };
        match &condition.numbers {
            // A range that is too long ends at once.
            &Numbers::Range(first, last) => [first, last].into_iter().chain(first..=last).try_for_each(&mut hold)?,
            Numbers::List(list) => list.iter().try_for_each(|&number| hold(number))?,
        }
        let builder = &self.mesh_builder;
        let [triangles, quadrilaterals] = self.n_before;
        let faces = (builder.triangles[triangles..].iter().map(|face| &face[..]))
            .chain(builder.others.quadrilaterals[quadrilaterals..].iter().map(|face| &face[..]))
            .zip(of_faces.iter_mut().flatten());
        for (face, of_face) in faces.filter(|(face, _)| face.iter().all(|&vertex| is_held[vertex as usize])) {
            match of_face.map(|earlier: usize| &all[earlier]) {
                Some(earlier) if earlier.family != condition.family => {
                    let middle =
                        face.iter().map(|&vertex| positions[vertex as usize]).sum::<DVec3>() / face.len() as f64;
                    let [name, expected] =
                        [earlier.node.name(), "faces all of whose vertices no other condition holds"];
                    let found = format!(
                        "the face at {middle}, whose vertices '{name}' holds too; save boundary conditions on faces \
                         (GridLocation FaceCenter)"
                    );
                    return Err(condition.node.malformed(expected, found));
                }
                Some(_) => {}
                None => *of_face = Some(index),
            }
        }
        Ok(())
    }
}

/// The types of the boundary conditions, in words. Conditions without a type of their own do not
/// count.
pub(super) fn types_of_conditions<'a>(zones: impl Iterator<Item = &'a Node<'a>>) -> Result<Option<String>, ReadError> {
    let mut types = Vec::new();
    for zone in zones {
        for zone_bc in zone.children("ZoneBC_t")? {
            for bc in zone_bc.children("BC_t")? {
                types.extend(bc.text());
            }
        }
    }
    types.retain(|kind| !matches!(&**kind, "FamilySpecified" | "Null" | "UserDefined"));
    types.sort_unstable();
    types.dedup();
    Ok((!types.is_empty()).then(|| format!("types of boundary conditions ({})", types.join(", "))))
}

/// The families of a zone with a symmetry condition, of their own or of their `Family_t`.
pub(super) fn symmetries(base: &Node, zone: &Node) -> Result<Vec<String>, ReadError> {
    let mut found = Vec::new();
    for zone_bc in zone.children("ZoneBC_t")? {
        for bc in zone_bc.children("BC_t")? {
            let family = family_name(base, &bc)?;
            let mut kinds = vec![bc.text().unwrap_or_default()];
            if let Some(node) = base.find(&family) {
                kinds.extend(node.children("FamilyBC_t")?.iter().filter_map(|of_family| of_family.text().ok()));
            }
            if kinds.iter().any(|kind| kind == "BCSymmetryPlane") && !found.contains(&family) {
                found.push(family);
            }
        }
    }
    Ok(found)
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
