//! Half aircraft with parts that hang from the wing: their meshes, profiles and movers.

use idmesh::families::{Junction, RigidMotion, Role};
use idmesh::mesh::TetMesh;
use idmesh::mover::{Mover, MoverBuilder};
use idmesh::profile::{Profile, csv};

use super::aircraft::{file, role};

pub fn mesh(name: &str) -> TetMesh {
    idmesh::formats::read(&file(&format!("tests/data/aircraft/{name}.msh.gz"))).unwrap().mesh
}

pub fn profiles(mesh: &str, set: &str) -> Vec<Profile> {
    let path = file(&format!("tests/data/aircraft/{mesh}/{set}.csv"));
    csv::parse(&[(&path, &std::fs::read_to_string(&path).unwrap())]).unwrap()
}

pub fn rigid(motion: RigidMotion) -> Role {
    Role::Rigid { motion, junction: Junction::Glued }
}

/// The usual roles, and others for the parts, with default settings.
pub fn builder(mesh: TetMesh, old: Vec<Profile>, parts: &[(&str, Role)]) -> MoverBuilder {
    let usual: Vec<_> = mesh.families.iter().filter_map(|name| Some((name.clone(), role(name)?))).collect();
    let builder = Mover::builder(mesh).old_profiles("wing", old);
    let builder = usual.into_iter().fold(builder, |builder, (family, role)| builder.role(&family, role));
    parts.iter().fold(builder, |builder, (family, role)| builder.role(family, role.clone()))
}
