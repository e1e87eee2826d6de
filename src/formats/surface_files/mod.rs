//! New files of the surfaces of a mesh, to look at or to hand on. They are no mesh files: nothing
//! reads a mesh from them.
//!
//! | extension | file | families | quadrilaterals |
//! |---|---|---|---|
//! | `.vtp` | VTK's poly data, in XML | numbers and names | stay |
//! | `.stl` | STL, as text | a solid each | divided |
//! | `.glb` | glTF 2.0, binary, with the motion as a morph target | a node each | divided |

mod glb;
mod stl;
mod vtp;

use std::io;
use std::path::Path;

use glam::DVec3;

use super::atomic::FileSet;
use super::out::{Out, in_blocks};
use crate::mesh::{FamilyId, HybridMesh, halves};

/// The surfaces of a mesh. Lengths are in the mesh's unit.
#[derive(Clone, Copy)]
pub struct SurfaceFile<'a> {
    /// The mesh, undeformed.
    pub mesh: HybridMesh<'a>,
    /// The positions of the vertices `[n_vertices]`.
    pub vertices: &'a [DVec3],
    /// The ways of the vertices from their undeformed places `[n_vertices]`. `None` for a mesh that
    /// was not moved.
    pub displacement: Option<&'a [DVec3]>,
}

type Create = fn(&mut Out, &SurfaceFile) -> io::Result<()>;

/// Extensions with the writers of their files.
const WRITERS: [(&str, Create); 3] = [("vtp", vtp::create), ("stl", stl::create), ("glb", glb::create)];

/// The extensions of files of surfaces, for messages.
pub const SURFACE_EXTENSIONS: &str = ".vtp, .stl or .glb";

fn writer(path: &Path) -> Option<Create> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    WRITERS.iter().find(|(known, _)| *known == extension).map(|(_, writer)| *writer)
}

/// Whether a path names a file of surfaces that can be written.
pub fn is_surface_file(path: &Path) -> bool {
    writer(path).is_some()
}

impl SurfaceFile<'_> {
    /// Adds the file to a set.
    ///
    /// # Errors
    /// The extension belongs to no such file, the file cannot be written, or a position is too
    /// large for a file in single precision.
    pub fn add_to(&self, files: &mut FileSet, path: &Path) -> io::Result<()> {
        let unknown = || io::Error::other(format!("expected a name ending in {SURFACE_EXTENSIONS}"));
        let create = writer(path).ok_or_else(unknown)?;
        let mut bytes = Vec::new();
        in_blocks(&mut bytes, |out| create(out, self))?;
        files.add(path, move |out| out.write_all(&bytes))
    }

    /// The faces of each family that has some, in the order of the mesh.
    fn families(&self) -> Vec<(FamilyId, &str, Vec<&[u32]>)> {
        let names = &self.mesh.mesh.families;
        let mut faces: Vec<Vec<&[u32]>> = vec![Vec::new(); names.len()];
        for face in 0..self.mesh.n_faces() as u32 {
            if let Some(family) = self.mesh.family_of(face) {
                faces[family.index()].push(self.mesh.face_vertices(face));
            }
        }
        let all = names.iter().zip(faces).enumerate();
        let named = all.map(|(index, (name, faces))| (FamilyId(index as u16), name.as_str(), faces));
        named.filter(|(_, _, faces)| !faces.is_empty()).collect()
    }

    /// The triangles of faces. A quadrilateral is divided as everywhere in idmesh.
    fn triangles(&self, faces: &[&[u32]]) -> Vec<[u32; 3]> {
        let triangles = |face: &&[u32]| match **face {
            [a, b, c] => [Some([a, b, c]), None],
            [a, b, c, d] => {
                let [one, other] = halves([a, b, c, d], self.mesh.vertices());
                [Some(one), (other != one).then_some(other)]
            }
            _ => [None, None],
        };
        faces.iter().flat_map(triangles).flatten().collect()
    }
}

/// The vertices of faces, each once and ascending, and the number among them of each vertex of the
/// mesh.
struct Used {
    vertices: Vec<u32>,
    numbers: Vec<u32>,
}

impl Used {
    /// - `n_vertices`: of the mesh
    fn new<'f>(faces: impl Iterator<Item = &'f [u32]>, n_vertices: usize) -> Self {
        let mut numbers = vec![0; n_vertices];
        faces.flatten().for_each(|&vertex| numbers[vertex as usize] = 1);
        let vertices: Vec<u32> = (0..n_vertices as u32).filter(|&vertex| numbers[vertex as usize] == 1).collect();
        for (number, &vertex) in (0..).zip(&vertices) {
            numbers[vertex as usize] = number;
        }
        Self { vertices, numbers }
    }

    fn number(&self, vertex: u32) -> u32 {
        self.numbers[vertex as usize]
    }

    fn pick(&self, of: &[DVec3]) -> Vec<DVec3> {
        self.vertices.iter().map(|&vertex| of[vertex as usize]).collect()
    }
}
