//! The `$Elements` section as cells and faces, and the mesh made of them.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::path::Path;

use glam::DVec3;

use super::Version;
use super::families::Groups;
use super::ungrouped::Ungrouped;
use super::vertices::Vertices;
use crate::formats::error::ReadError;
use crate::formats::mesh_builder::{CellKind, Kind, MeshBuilder};
use crate::formats::scanner::Scanner;
use crate::mesh::{OtherCells, TetMesh};

/// An element type of Gmsh.
pub(super) struct ElementType {
    kind: Kind,
    /// Number of vertices of an element.
    pub n_vertices: usize,
}

const fn refused(name: &'static str, n_vertices: usize) -> ElementType {
    ElementType { kind: Kind::Refuse(name), n_vertices }
}

const fn passed_over(name: &'static str, n_vertices: usize) -> ElementType {
    ElementType { kind: Kind::PassOver(name), n_vertices }
}

const fn mesh(shape: CellKind) -> ElementType {
    ElementType { kind: Kind::Mesh(shape), n_vertices: shape.n_vertices() }
}

/// The element types from number 1 on. Later types have third or higher order.
const TYPES: [ElementType; 19] = [
    passed_over("lines", 2),
    mesh(CellKind::Triangle),
    mesh(CellKind::Quadrilateral),
    mesh(CellKind::Tet),
    mesh(CellKind::Hexahedron),
    mesh(CellKind::Prism),
    mesh(CellKind::Pyramid),
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

/// The elements of a file, in its order. The tag of a face is its surface entity (4.1) or its
/// signed physical tag (2.2).
#[derive(Default)]
pub(super) struct Elements {
    mesh_builder: MeshBuilder,
    /// Volume entities (4.1) or physical tags (2.2) of the cells.
    cell_owners: BTreeSet<i32>,
    last_owner: Option<i32>,
}

impl Elements {
    /// Reserves memory for `count` elements. The count was checked against the size of the file.
    pub fn begin(&mut self, of: &ElementType, count: usize) {
        if let Kind::Mesh(shape) = of.kind {
            self.mesh_builder.reserve(shape, count);
        }
    }

    /// Reads the vertices of one element. `node` reads a tag.
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
                    Kind::Refuse(_) => self.mesh_builder.refuse(name, 1),
                    _ => self.mesh_builder.pass_over(name, 1),
                }
                return Ok(());
            }
        };
        if !shape.is_face() && self.last_owner != Some(owner) {
            self.last_owner = Some(owner);
            self.cell_owners.insert(owner);
        }
        self.mesh_builder.push(shape, owner, || {
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

    /// Cells and faces without their groups, each once: version 2.2 has one for each group.
    pub fn without_groups(mut self) -> MeshBuilder {
        keep_first(&mut self.mesh_builder.triangles);
        self.mesh_builder
    }

    /// The parts of the file that do not belong to the mesh, in words.
    fn passed_over(&self) -> Vec<String> {
        let mut words = self.mesh_builder.passed_over();
        if self.cell_owners.len() > 1 {
            words.push(format!("the division of the cells into {} volumes", self.cell_owners.len()));
        }
        words
    }

    /// Makes the mesh. Also returns the parts of the file that do not belong to the mesh, in words.
    pub fn into_mesh(
        mut self,
        path: &Path,
        version: Version,
        groups: &Groups,
        positions: Vec<DVec3>,
    ) -> Result<(TetMesh, OtherCells, Vec<String>), ReadError> {
        self.mesh_builder.check_refused(path)?;
        let mut beside = self.passed_over();
        let n_faces = self.mesh_builder.triangles.len() + self.mesh_builder.others.quadrilaterals.len();
        let ungrouped = match version {
            Version::V22 => {
                self.forget_repeated_cells();
                self.groups_of_faces_22(path, groups, &positions)?
            }
            Version::V41 => self.groups_of_faces_41(path, groups)?,
        };
        let at = |vertex: u32| positions[vertex as usize].to_string();
        beside.extend(ungrouped.check(path, &self.mesh_builder, n_faces, at)?);
        let used =
            groups.in_order(&self.mesh_builder.used_tags().into_iter().map(i32::unsigned_abs).collect::<Vec<_>>());
        let used: Vec<i32> = used.into_iter().map(group_tag).collect();
        let (mesh, others) =
            self.mesh_builder.finish_in_order(path, positions, &used, |tag| groups.given_name(tag.unsigned_abs()))?;
        Ok((mesh, others, beside))
    }

    /// Version 4.1: replaces the surface of each face by its group. If the group sees the surface
    /// reversed, the face is turned over, as Gmsh does when it saves version 2.2. Faces between
    /// partitions are removed. Faces without a group are removed and returned.
    fn groups_of_faces_41(&mut self, path: &Path, groups: &Groups) -> Result<Ungrouped, ReadError> {
        let mut known: HashMap<i32, GroupOfSurface> = HashMap::new();
        for surface in self.mesh_builder.used_tags() {
            let group = groups.of_surface(surface).map_err(|(first, second)| ReadError::TwoFamilies {
                path: path.into(),
                what: format!("surface {surface}"),
                first: groups.name(first),
                second: groups.name(second),
            })?;
            known.insert(surface, (group, groups.is_interface(surface)));
        }
        let mut ungrouped = Ungrouped::default();
        let MeshBuilder { triangles, triangle_tags, others, quadrilateral_tags, .. } = &mut self.mesh_builder;
        resolve(triangles, triangle_tags, &known, &mut ungrouped);
        resolve(&mut others.quadrilaterals, quadrilateral_tags, &known, &mut ungrouped);
        Ok(ungrouped)
    }

    /// Version 2.2: the group of each face is its own tag. A face in two groups occurs twice. Faces
    /// without a group are removed and returned.
    fn groups_of_faces_22(
        &mut self,
        path: &Path,
        groups: &Groups,
        positions: &[DVec3],
    ) -> Result<Ungrouped, ReadError> {
        let mut ungrouped = Ungrouped::default();
        let MeshBuilder { triangles, triangle_tags, others, quadrilateral_tags, .. } = &mut self.mesh_builder;
        let two = |what: &str, vertex: u32, first, second| ReadError::TwoFamilies {
            path: path.into(),
            what: format!("the {what} at {}", positions[vertex as usize]),
            first: groups.name(first),
            second: groups.name(second),
        };
        keep_grouped(triangles, triangle_tags, &mut ungrouped)
            .map_err(|(vertex, first, second)| two("triangle", vertex, first, second))?;
        keep_grouped(&mut others.quadrilaterals, quadrilateral_tags, &mut ungrouped)
            .map_err(|(vertex, first, second)| two("quadrilateral", vertex, first, second))?;
        Ok(ungrouped)
    }

    /// Removes repeated cells. Gmsh saves a cell of version 2.2 once for each of its 3-D groups.
    fn forget_repeated_cells(&mut self) {
        if self.cell_owners.len() < 2 {
            return;
        }
        let MeshBuilder { tets, others, .. } = &mut self.mesh_builder;
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

/// The absolute value of a physical tag as the tag of a face.
fn group_tag(group: u32) -> i32 {
    // Only the value 2^31 overflows, and it converts back to itself.
    group as i32
}

/// The group of a surface, whether the group sees the surface reversed, and whether the surface
/// lies between partitions.
type GroupOfSurface = (Option<(u32, bool)>, bool);

/// Replaces the surface of each face by its group. `known` holds every surface.
fn resolve<const N: usize>(
    faces: &mut Vec<[u32; N]>,
    surfaces: &mut Vec<i32>,
    known: &HashMap<i32, GroupOfSurface>,
    ungrouped: &mut Ungrouped,
) {
    let mut kept = Vec::with_capacity(faces.len());
    let mut tags = Vec::with_capacity(faces.len());
    for (&(mut face), &surface) in faces.iter().zip(surfaces.iter()) {
        match known[&surface] {
            (_, true) => {}
            (None, _) => ungrouped.add(&face, Some(surface)),
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

/// Replaces the signed group of each face by its absolute value, and removes faces without a group.
///
/// # Errors
/// A face is in two groups: a vertex of the face, and both groups.
fn keep_grouped<const N: usize>(
    faces: &mut Vec<[u32; N]>,
    tags: &mut Vec<i32>,
    ungrouped: &mut Ungrouped,
) -> Result<(), (u32, u32, u32)> {
    let mut seen = HashMap::with_capacity(faces.len());
    for (face, tag) in faces.iter().zip(tags.iter_mut()) {
        let group = tag.unsigned_abs();
        *tag = group_tag(group);
        if group == 0 {
            ungrouped.add(face, None);
            continue;
        }
        let mut key = *face;
        key.sort_unstable();
        if let Some(first) = seen.insert(key, group).filter(|&first| first != group) {
            return Err((face[0], first, group));
        }
    }
    let mut of_face = tags.iter();
    faces.retain(|_| of_face.next() != Some(&0));
    tags.retain(|&tag| tag != 0);
    Ok(())
}
