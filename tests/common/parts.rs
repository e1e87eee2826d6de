//! Half aircraft with parts that hang from the wing: their meshes, profiles and movers.

use glam::DVec3;
use idmesh::families::{Junction, RigidMotion, Role};
use idmesh::mesh::{FamilyId, TetMesh};
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

/// A mesh whose family is two: the triangles behind a point along its direction from the origin
/// are those of `FAMILY_rear`.
pub fn halved(mut mesh: TetMesh, family: &str, at: DVec3) -> TetMesh {
    let (whole, rear) = (mesh.family(family).unwrap(), FamilyId(mesh.families.len() as u16));
    mesh.families.push(format!("{family}_rear"));
    for (triangle, of) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let middle = triangle.iter().map(|&vertex| mesh.vertices[vertex as usize]).sum::<DVec3>() / 3.0;
        if *of == whole && (middle - at).dot(at) > 0.0 {
            *of = rear;
        }
    }
    mesh
}

/// The usual roles, and others for the parts, with default settings.
pub fn builder(mesh: TetMesh, old: Vec<Profile>, parts: &[(&str, Role)]) -> MoverBuilder {
    builder_of_wing(mesh, (old, &["wing"]), parts)
}

/// The same with a wing of several families.
pub fn builder_of_wing(
    mesh: TetMesh,
    (old, families): (Vec<Profile>, &[&str]),
    parts: &[(&str, Role)],
) -> MoverBuilder {
    let usual: Vec<_> = mesh.families.iter().filter_map(|name| Some((name.clone(), role(name)?))).collect();
    let builder = Mover::builder(mesh).wing("wing", families, old, None);
    let builder = usual.into_iter().fold(builder, |builder, (family, role)| builder.role(&family, role));
    parts.iter().fold(builder, |builder, (family, role)| builder.role(family, role.clone()))
}
