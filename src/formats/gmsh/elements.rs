//! The `$Elements` section as cells and faces, and the mesh that they make.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

use glam::DVec3;

use super::Version;
use super::families::Groups;
use super::vertices::Vertices;
use crate::formats::assembly::{Assembly, Kind, Shape};
use crate::formats::error::ReadError;
use crate::formats::scanner::Scanner;
use crate::mesh::{OtherCells, TetMesh};

/// An element type of Gmsh.
pub(super) struct ElementType {
    kind: Kind,
    /// How many vertices an element has.
    pub n_vertices: usize,
}

const fn refused(name: &'static str, n_vertices: usize) -> ElementType {
    ElementType { kind: Kind::Refuse(name), n_vertices }
}

const fn passed_over(name: &'static str, n_vertices: usize) -> ElementType {
    ElementType { kind: Kind::PassOver(name), n_vertices }
}

const fn mesh(shape: Shape) -> ElementType {
    ElementType { kind: Kind::Mesh(shape), n_vertices: shape.n_vertices() }
}

/// The element types from number 1 on; later ones are of third order and more.
const TYPES: [ElementType; 19] = [
    passed_over("lines", 2),
    mesh(Shape::Triangle),
    mesh(Shape::Quadrilateral),
    mesh(Shape::Tet),
    mesh(Shape::Hexahedron),
    mesh(Shape::Prism),
    mesh(Shape::Pyramid),
    passed_over("second-order lines", 3),
    refused("second-order triangles", 6),
    refused("second-order quadrilaterals", 9),
    refused("second-order tets", 10),
    refused("second-order hexahedra", 27),
    refused("second-order prisms", 18),
    refused("second-order pyramids", 14),
    passed_over("points", 1),
    refused("second-order quadrilaterals", 8),
    refused("second-order hexahedra", 20),
    refused("second-order prisms", 15),
    refused("second-order pyramids", 13),
];

impl ElementType {
    /// Reads the number of an element type.
    pub fn read(scanner: &mut Scanner) -> Result<&'static ElementType, ReadError> {
        let number = scanner.unsigned_int("an element type")?;
        TYPES.get((number as usize).wrapping_sub(1)).ok_or_else(|| {
            scanner.malformed("an element type that idmesh reads (2: triangle, 4: tet)", format!("type {number}"))
        })
    }
}

/// The elements of a file, in its order. Faces are tagged with where they belong: their surface entity (4.1) or signed
/// physical tag (2.2).
#[derive(Default)]
pub(super) struct Elements {
    assembly: Assembly,
    /// Where cells belong: their volume entity (4.1) or physical tag (2.2).
    cell_owners: BTreeSet<i32>,
    last_owner: Option<i32>,
}

impl Elements {
    /// Makes room for `count` elements, a count that was checked against the size of the file.
    pub fn begin(&mut self, of: &ElementType, count: usize) {
        if let Kind::Mesh(shape) = of.kind {
            self.assembly.reserve(shape, count);
        }
    }

    /// Reads the vertices of one element with `node`, which reads a tag.
    #[inline]
    pub fn read<'a>(
        &mut self,
        scanner: &mut Scanner<'a>,
        of: &ElementType,
        vertices: &Vertices,
        element: u64,
        owner: i32,
        node: impl Fn(&mut Scanner<'a>) -> Result<u64, ReadError>,
    ) -> Result<(), ReadError> {
        let shape = match of.kind {
            Kind::Mesh(shape) => shape,
            Kind::PassOver(name) | Kind::Refuse(name) => {
                for _ in 0..of.n_vertices {
                    node(scanner)?;
                }
                match of.kind {
                    Kind::Refuse(_) => self.assembly.refuse(name, 1),
                    _ => self.assembly.pass_over(name, 1),
                }
                return Ok(());
            }
        };
        if !shape.is_face() && self.last_owner != Some(owner) {
            self.last_owner = Some(owner);
            self.cell_owners.insert(owner);
        }
        self.assembly.push(shape, owner, || {
            let tag = node(scanner)?;
            vertices.find(tag).ok_or_else(|| ReadError::UnknownVertex {
                place: scanner.place(scanner.last),
                entity: shape.name(),
                element,
                vertex: tag.to_string(),
                defined: vertices.described(),
            })
        })
    }

    /// What does not belong to the mesh.
    pub fn passed_over(&self) -> Vec<String> {
        let mut words = self.assembly.passed_over();
        if self.cell_owners.len() > 1 {
            words.push(format!("the division of the cells into {} volumes", self.cell_owners.len()));
        }
        words
    }

    /// Joins the parts to a mesh.
    pub fn into_mesh(
        mut self,
        path: &Path,
        version: Version,
        groups: &Groups,
        positions: Vec<DVec3>,
    ) -> Result<(TetMesh, OtherCells), ReadError> {
        self.assembly.check_refused(path)?;
        match version {
            Version::V22 => {
                self.forget_repeated_cells();
                self.check_groups_22(path, groups, &positions)?;
                let tags = self.assembly.triangle_tags.iter_mut().chain(&mut self.assembly.quadrilateral_tags);
                tags.for_each(|tag| *tag = group_tag(tag.unsigned_abs()));
            }
            Version::V41 => self.groups_of_faces_41(path, groups)?,
        }
        let used = groups.in_order(&self.assembly.used_tags().into_iter().map(i32::unsigned_abs).collect::<Vec<_>>());
        let used: Vec<i32> = used.into_iter().map(group_tag).collect();
        self.assembly.finish_in_order(path, positions, &used, |tag| groups.name(tag.unsigned_abs()))
    }

    /// Version 4.1: turns the surface of each face into its group. Faces of surfaces that their group sees reversed are
    /// turned over, as Gmsh does when it saves version 2.2; those between partitions go.
    fn groups_of_faces_41(&mut self, path: &Path, groups: &Groups) -> Result<(), ReadError> {
        let mut known: HashMap<i32, Owner> = HashMap::new();
        for surface in self.assembly.used_tags() {
            let group = groups.of_surface(surface).map_err(|(first, second)| ReadError::TwoFamilies {
                path: path.into(),
                what: format!("surface {surface}"),
                first: groups.name(first),
                second: groups.name(second),
            })?;
            known.insert(surface, (group, groups.is_interface(surface)));
        }
        let mut lonely = Lonely::default();
        let Assembly { triangles, triangle_tags, others, quadrilateral_tags, .. } = &mut self.assembly;
        let n_faces = triangles.len() + others.quadrilaterals.len();
        resolve(triangles, triangle_tags, &known, &mut lonely);
        resolve(&mut others.quadrilaterals, quadrilateral_tags, &known, &mut lonely);
        lonely.check(path, n_faces)
    }

    /// Version 2.2: the group of each face is its own tag. A face in two groups is there twice.
    fn check_groups_22(&self, path: &Path, groups: &Groups, positions: &[DVec3]) -> Result<(), ReadError> {
        let Assembly { triangles, triangle_tags, others, quadrilateral_tags, .. } = &self.assembly;
        let mut lonely = Lonely::default();
        let two = |what: &str, vertex: u32, first, second| ReadError::TwoFamilies {
            path: path.into(),
            what: format!("the {what} at {}", positions[vertex as usize]),
            first: groups.name(first),
            second: groups.name(second),
        };
        let at = |vertex: u32| format!("the first at {}", positions[vertex as usize]);
        check_doubles(triangles, triangle_tags, |vertex| lonely.add(|| at(vertex)))
            .map_err(|(vertex, first, second)| two("triangle", vertex, first, second))?;
        check_doubles(&others.quadrilaterals, quadrilateral_tags, |vertex| lonely.add(|| at(vertex)))
            .map_err(|(vertex, first, second)| two("quadrilateral", vertex, first, second))?;
        lonely.check(path, triangles.len() + others.quadrilaterals.len())
    }

    /// Gmsh saves a cell of version 2.2 once for each 3-D group that it is in: keeps the first.
    fn forget_repeated_cells(&mut self) {
        if self.cell_owners.len() < 2 {
            return;
        }
        let Assembly { tets, others, .. } = &mut self.assembly;
        keep_first(tets);
        keep_first(&mut others.pyramids);
        keep_first(&mut others.prisms);
        keep_first(&mut others.hexahedra);
    }
}

fn keep_first<const N: usize>(cells: &mut Vec<[u32; N]>) {
    let mut seen = HashSet::with_capacity(cells.len());
    cells.retain(|cell| seen.insert(*cell));
}

/// The size of a physical tag as the tag of a face.
fn group_tag(group: u32) -> i32 {
    // Only the size 2^31 does not fit, and comes back as itself.
    group as i32
}

/// The group of a surface, whether it sees the surface reversed, and whether the surface lies between partitions.
type Owner = (Option<(u32, bool)>, bool);

/// Turns the surface of each face into its group; `known` has every surface.
fn resolve<const N: usize>(
    faces: &mut Vec<[u32; N]>,
    surfaces: &mut Vec<i32>,
    known: &HashMap<i32, Owner>,
    lonely: &mut Lonely,
) {
    let mut kept = Vec::with_capacity(faces.len());
    let mut tags = Vec::with_capacity(faces.len());
    for (&(mut face), &surface) in faces.iter().zip(surfaces.iter()) {
        match known[&surface] {
            (_, true) => {}
            (None, _) => lonely.add(|| format!("the first on surface {surface}")),
            (Some((group, reversed)), _) => {
                if reversed {
                    face[1..].reverse();
                }
                kept.push(face);
                tags.push(group_tag(group));
            }
        }
    }
    (*faces, *surfaces) = (kept, tags);
}

/// Calls `lonely` with a vertex of each face without a group. The error is a face in two groups: a vertex of it, and
/// both.
fn check_doubles<const N: usize>(
    faces: &[[u32; N]],
    tags: &[i32],
    mut lonely: impl FnMut(u32),
) -> Result<(), (u32, u32, u32)> {
    let mut seen = HashMap::with_capacity(faces.len());
    for (face, &tag) in faces.iter().zip(tags) {
        if tag == 0 {
            lonely(face[0]);
        }
        let mut key = *face;
        key.sort_unstable();
        let group = tag.unsigned_abs();
        if let Some(first) = seen.insert(key, group).filter(|&first| first != group) {
            return Err((face[0], first, group));
        }
    }
    Ok(())
}

/// Counts faces without a group.
#[derive(Default)]
struct Lonely {
    count: usize,
    detail: String,
}

impl Lonely {
    fn add(&mut self, detail: impl Fn() -> String) {
        if self.count == 0 {
            self.detail = detail();
        }
        self.count += 1;
    }

    fn check(self, path: &Path, n_triangles: usize) -> Result<(), ReadError> {
        let Self { count, detail } = self;
        if count == 0 {
            Ok(())
        } else {
            Err(ReadError::WithoutFamily { path: path.into(), count, n_triangles, detail })
        }
    }
}
