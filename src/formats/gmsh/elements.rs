//! The `$Elements` section as tets and triangles, and the mesh that they make.

use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::Path;

use super::Version;
use super::families::Groups;
use super::vertices::Vertices;
use crate::formats::error::ReadError;
use crate::formats::scanner::Scanner;
use crate::mesh::{FamilyId, TetMesh};

/// What becomes of the elements of a type.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Use {
    Tet,
    Triangle,
    /// Points and lines: not part of the mesh.
    PassOver,
    /// Counted, so that the message can say what there is.
    Refuse,
}

/// An element type of Gmsh.
pub(super) struct Kind {
    name: &'static str,
    /// How many vertices an element has.
    pub n_vertices: usize,
    usage: Use,
}

const fn kind(name: &'static str, n_vertices: usize, usage: Use) -> Kind {
    Kind { name, n_vertices, usage }
}

/// The element types from number 1 on; later ones are of third order and more.
const KINDS: [Kind; 19] = [
    kind("lines", 2, Use::PassOver),
    kind("triangles", 3, Use::Triangle),
    kind("quadrangles", 4, Use::Refuse),
    kind("tets", 4, Use::Tet),
    kind("hexahedra", 8, Use::Refuse),
    kind("prisms", 6, Use::Refuse),
    kind("pyramids", 5, Use::Refuse),
    kind("second-order lines", 3, Use::PassOver),
    kind("second-order triangles", 6, Use::Refuse),
    kind("second-order quadrangles", 9, Use::Refuse),
    kind("second-order tets", 10, Use::Refuse),
    kind("second-order hexahedra", 27, Use::Refuse),
    kind("second-order prisms", 18, Use::Refuse),
    kind("second-order pyramids", 14, Use::Refuse),
    kind("points", 1, Use::PassOver),
    kind("second-order quadrangles", 8, Use::Refuse),
    kind("second-order hexahedra", 20, Use::Refuse),
    kind("second-order prisms", 15, Use::Refuse),
    kind("second-order pyramids", 13, Use::Refuse),
];

impl Kind {
    /// Reads the number of an element type.
    pub fn read(scanner: &mut Scanner) -> Result<&'static Kind, ReadError> {
        let number = scanner.unsigned_int("an element type")?;
        KINDS.get((number as usize).wrapping_sub(1)).ok_or_else(|| {
            scanner.malformed("an element type that idmesh reads (2: triangle, 4: tet)", format!("type {number}"))
        })
    }
}

/// The elements of a file, in its order.
#[derive(Default)]
pub(super) struct Elements {
    tets: Vec<[u32; 4]>,
    triangles: Vec<[u32; 3]>,
    /// Where each triangle belongs `[n_triangles]`: its surface entity (4.1) or signed physical tag (2.2).
    owners: Vec<i32>,
    /// Where the first tet belongs, and whether another tet belongs elsewhere.
    tet_owner: Option<i32>,
    several_tet_owners: bool,
    refused: BTreeMap<&'static str, usize>,
}

impl Elements {
    /// Makes room for `count` elements, a count that was checked against the size of the file.
    pub fn begin(&mut self, kind: &Kind, count: usize) {
        match kind.usage {
            Use::Tet => self.tets.reserve(count),
            Use::Triangle => self.triangles.reserve(count),
            Use::PassOver | Use::Refuse => {}
        }
    }

    /// Reads the vertices of one element with `node`, which reads a tag.
    #[inline]
    pub fn read<'a>(
        &mut self,
        scanner: &mut Scanner<'a>,
        kind: &Kind,
        vertices: &Vertices,
        element: u64,
        owner: i32,
        node: impl Fn(&mut Scanner<'a>) -> Result<u64, ReadError>,
    ) -> Result<(), ReadError> {
        let mut vertex = |entity| {
            let tag = node(scanner)?;
            vertices.find(tag).ok_or_else(|| ReadError::UnknownVertex {
                place: scanner.place(scanner.last),
                entity,
                element,
                vertex: tag,
                defined: vertices.described(),
            })
        };
        match kind.usage {
            Use::Tet => {
                self.tets.push([vertex("tet")?, vertex("tet")?, vertex("tet")?, vertex("tet")?]);
                self.several_tet_owners |= *self.tet_owner.get_or_insert(owner) != owner;
            }
            Use::Triangle => {
                self.triangles.push([vertex("triangle")?, vertex("triangle")?, vertex("triangle")?]);
                self.owners.push(owner);
            }
            Use::PassOver => {
                for _ in 0..kind.n_vertices {
                    node(scanner)?;
                }
            }
            Use::Refuse => {
                for _ in 0..kind.n_vertices {
                    node(scanner)?;
                }
                *self.refused.entry(kind.name).or_default() += 1;
            }
        }
        Ok(())
    }

    /// Joins the parts to a mesh, and gives the offsets of the vertices' coordinates.
    pub fn into_mesh(
        mut self,
        path: &Path,
        version: Version,
        groups: &Groups,
        vertices: Vertices,
    ) -> Result<(TetMesh, Vec<usize>), ReadError> {
        if !self.refused.is_empty() {
            let found: Vec<_> = self.refused.iter().map(|(name, count)| format!("{count} {name}")).collect();
            return Err(ReadError::Elements { path: path.into(), found: found.join(", ") });
        }
        let of_triangle = match version {
            Version::V22 => {
                self.forget_repeated_tets();
                self.groups_of_triangles_22(path, groups, &vertices)?
            }
            Version::V41 => self.groups_of_triangles_41(path, groups)?,
        };
        let missing = |what, hint| ReadError::Missing { path: path.into(), what, hint };
        if self.tets.is_empty() {
            return Err(missing("tets", "mesh the volume, and put it into a physical group so that Gmsh saves it"));
        }
        if self.triangles.is_empty() {
            return Err(missing("boundary triangles", "put every boundary surface into a physical group"));
        }
        let (triangle_family, families) = number_families(path, groups, &of_triangle)?;
        let Self { tets, triangles, .. } = self;
        Ok((TetMesh { vertices: vertices.positions, tets, triangles, triangle_family, families }, vertices.slots))
    }

    /// Version 4.1: the group of each triangle `[n_triangles]`, through its surface. Triangles of surfaces that their
    /// group sees reversed are turned over, as Gmsh does when it saves version 2.2; those between partitions go.
    fn groups_of_triangles_41(&mut self, path: &Path, groups: &Groups) -> Result<Vec<u32>, ReadError> {
        let owners = std::mem::take(&mut self.owners);
        let mut known = HashMap::new();
        for &surface in &owners {
            if let Entry::Vacant(entry) = known.entry(surface) {
                let group = groups.of_surface(surface).map_err(|(first, second)| ReadError::TwoFamilies {
                    path: path.into(),
                    what: format!("surface {surface}"),
                    first: groups.name(first),
                    second: groups.name(second),
                })?;
                entry.insert((group, groups.is_interface(surface)));
            }
        }
        let mut of_triangle = Vec::with_capacity(owners.len());
        let mut kept = Vec::with_capacity(owners.len());
        let mut lonely = Lonely::default();
        for (&[a, b, c], &surface) in self.triangles.iter().zip(&owners) {
            match known[&surface] {
                (_, true) => {}
                (None, _) => lonely.add(|| format!("the first on surface {surface}")),
                (Some((group, reversed)), _) => {
                    kept.push(if reversed { [a, c, b] } else { [a, b, c] });
                    of_triangle.push(group);
                }
            }
        }
        lonely.check(path, owners.len())?;
        self.triangles = kept;
        Ok(of_triangle)
    }

    /// Version 2.2: the group of each triangle `[n_triangles]`, its own tag. A triangle in two groups is there twice.
    fn groups_of_triangles_22(&self, path: &Path, groups: &Groups, vertices: &Vertices) -> Result<Vec<u32>, ReadError> {
        let mut lonely = Lonely::default();
        let mut seen = HashMap::with_capacity(self.triangles.len());
        for (triangle, &tag) in self.triangles.iter().zip(&self.owners) {
            let corner = || vertices.positions[triangle[0] as usize];
            if tag == 0 {
                lonely.add(|| format!("the first at {}", corner()));
            }
            let mut key = *triangle;
            key.sort_unstable();
            let group = tag.unsigned_abs();
            if let Some(first) = seen.insert(key, group).filter(|&first| first != group) {
                return Err(ReadError::TwoFamilies {
                    path: path.into(),
                    what: format!("the triangle at {}", corner()),
                    first: groups.name(first),
                    second: groups.name(group),
                });
            }
        }
        lonely.check(path, self.triangles.len())?;
        Ok(self.owners.iter().map(|tag| tag.unsigned_abs()).collect())
    }

    /// Gmsh saves a tet of version 2.2 once for each 3-D group that it is in: keeps the first.
    fn forget_repeated_tets(&mut self) {
        if !self.several_tet_owners {
            return;
        }
        let mut seen = HashSet::with_capacity(self.tets.len());
        self.tets.retain(|tet| seen.insert(*tet));
    }
}

/// Counts triangles without a group.
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

/// Turns groups into families: the groups that have triangles, in the order of the file. Groups that share a name are
/// one family.
fn number_families(
    path: &Path,
    groups: &Groups,
    of_triangle: &[u32],
) -> Result<(Vec<FamilyId>, Vec<String>), ReadError> {
    let mut seen = HashSet::new();
    let used: Vec<u32> = of_triangle.iter().copied().filter(|group| seen.insert(*group)).collect();
    let limit = usize::from(u16::MAX);
    if used.len() > limit {
        return Err(ReadError::TooMany { path: path.into(), what: "families", count: used.len(), limit });
    }
    let mut families: Vec<String> = Vec::new();
    let mut of_name = HashMap::new();
    let mut of_group = HashMap::new();
    for group in groups.in_order(&used) {
        let name = groups.name(group);
        let family = *of_name.entry(name).or_insert_with_key(|name| {
            families.push(name.clone());
            FamilyId((families.len() - 1) as u16)
        });
        of_group.insert(group, family);
    }
    Ok((of_triangle.iter().map(|group| of_group[group]).collect(), families))
}
