//! Half aircraft with their profiles, and what must hold of them after any design.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use idmesh::backend::{Backend, CpuBackend, Precision};
use idmesh::families::{Role, TipStart};
use idmesh::mesh::TetMesh;
use idmesh::mover::{Design, Mover, MoverBuilder, Outcome};
use idmesh::profile::{Profile, csv};
use idmesh::relaxation::Method;

/// A mesh and the folder of its profiles.
#[derive(Clone, Copy, Debug)]
pub struct Aircraft {
    mesh: &'static str,
    profiles: &'static str,
    /// How far a section of the moved wing may lie from its new profile, in chords.
    pub section_tolerance: f64,
    /// How far the mesh's facets may lie inside a new profile, in chords: `h^2 / 8 r`, with `h` the
    /// longest edge of a section at the leading edge and `r = 1.1 t^2` the radius there of a
    /// four-digit NACA profile of thickness `t`.
    pub facet_tolerance: f64,
}

/// 5 141 tets; 16 edges from leading to trailing edge.
pub const SMALL: Aircraft = Aircraft {
    mesh: "tests/data/small.msh.gz",
    profiles: "tests/data/profiles",
    section_tolerance: 6e-3,
    facet_tolerance: 2.8e-2,
};
/// 97 694 tets, flat wingtip.
pub const WING_BODY: Aircraft = Aircraft {
    mesh: "examples/wing-body/wing-body.msh.gz",
    profiles: "tests/data/profiles/wing-body",
    section_tolerance: 2e-3,
    facet_tolerance: 3.2e-3,
};
/// 99 178 tets, rounded wingtip.
pub const ROUND: Aircraft = Aircraft {
    mesh: "tests/data/round.msh.gz",
    profiles: "tests/data/profiles/round",
    section_tolerance: 2e-3,
    facet_tolerance: 3.2e-3,
};

/// A file of the repository.
pub fn file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

impl Aircraft {
    pub fn mesh(&self) -> TetMesh {
        idmesh::formats::read(&file(self.mesh)).unwrap().mesh
    }

    /// The profiles `NAME.csv`.
    pub fn profiles(&self, name: &str) -> Vec<Profile> {
        let path = file(self.profiles).join(format!("{name}.csv"));
        let text = std::fs::read_to_string(&path).unwrap();
        csv::parse(&[(&path, &text)]).unwrap()
    }

    /// See [`builder`].
    pub fn builder(&self, old: Vec<Profile>) -> MoverBuilder {
        builder(self.mesh(), old)
    }

    /// A mover on the CPU with the old profiles that belong to as many planes.
    pub fn mover(&self, planes: usize) -> Mover {
        self.builder(self.profiles(&format!("old_{planes}"))).build(cpu()).unwrap()
    }
}

/// The usual role of a family.
pub fn role(name: &str) -> Option<Role> {
    Some(match name {
        "wing" => Role::Wing,
        "trailing_edge" => Role::TrailingEdge,
        "wingtip" => Role::Wingtip { coefficient: 0.5, start: TipStart::default() },
        "carenage" => Role::Carenage,
        "symmetry" => Role::PLANE,
        "farfield" => Role::Fixed,
        _ => return None,
    })
}

/// The usual roles, default springs and tolerance, and old profiles of the family `wing` unless
/// there are none.
pub fn builder(mesh: TetMesh, old: Vec<Profile>) -> MoverBuilder {
    let roles: Vec<_> = mesh.families.iter().filter_map(|name| Some((name.clone(), role(name)?))).collect();
    // Springs alone: local optimisation would hide what they do, and its thresholds amplify
    // rounding.
    let mut builder = Mover::builder(mesh).method(Method::Chebyshev).quality(None);
    for (name, role) in roles {
        builder = builder.role(&name, role);
    }
    if old.is_empty() { builder } else { builder.old_profiles("wing", old) }
}

pub fn cpu() -> Arc<dyn Backend> {
    Arc::new(CpuBackend::new(Precision::F64))
}

/// Moves to a design of the family `wing`.
pub fn update(mover: &mut Mover, new: Vec<Profile>) -> Outcome {
    mover.update(&Design::of_wing("wing", new)).unwrap()
}

/// The moved mesh of a result, good or not: tests look for themselves.
pub trait Anyway {
    fn vertices(&self) -> &[DVec3];
    fn displacement(&self) -> &[DVec3];
}

impl Anyway for Outcome {
    fn vertices(&self) -> &[DVec3] {
        self.even_if_invalid().vertices()
    }

    fn displacement(&self) -> &[DVec3] {
        self.even_if_invalid().displacement()
    }
}

/// The vertices of a family, found without the crate's topology.
pub fn vertices_of(mesh: &TetMesh, family: &str) -> Vec<usize> {
    let mut vertices: Vec<usize> = triangles_of(mesh, family).into_iter().flatten().collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// The triangles of a family.
pub fn triangles_of(mesh: &TetMesh, family: &str) -> Vec<[usize; 3]> {
    let family = mesh.family(family).unwrap_or_else(|| panic!("no family `{family}`"));
    let all = mesh.triangles.iter().zip(&mesh.triangle_family);
    all.filter(|&(_, &of)| of == family).map(|(triangle, _)| triangle.map(|vertex| vertex as usize)).collect()
}
