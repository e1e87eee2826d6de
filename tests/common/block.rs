//! A block of cells for a wing in a box of cells, whose sides are families for whatever a test
//! wants of them.

use glam::DVec3;
use idmesh::families::Role;
use idmesh::mesh::TetMesh;
use idmesh::mover::{Design, Mover, MoverBuilder};
use idmesh::profile::{Plane, Profile, cut};
use idmesh::relaxation::Method;
use idmesh::smoothing::QualityTarget;

use super::aircraft::cpu;
use super::carved::{carve, on};

const CELLS: [usize; 3] = [12, 8, 10];
pub const CELL: f64 = 0.25;

/// A block of 3 x 2 cells for a wing, from the plane y = 0 on, `span` cells long, in a box of which
/// each side across y and z is a family of its own.
pub fn block(span: f64, place: impl Fn(DVec3) -> DVec3) -> TetMesh {
    let is_wing = |at: DVec3| at.x > 4.0 && at.x < 7.0 && at.y < span && at.z > 4.0 && at.z < 6.0;
    let family = |triangle| match triangle {
        _ if on(triangle, 1, 0.0) => "symmetry",
        _ if on(triangle, 2, 0.0) => "floor",
        _ if on(triangle, 1, 8.0) => "side",
        _ if on(triangle, 2, 10.0) => "ceiling",
        _ if [(0, 0.0), (0, 12.0)].into_iter().any(|(axis, value)| on(triangle, axis, value)) => "farfield",
        _ => "wing",
    };
    carve(CELLS, &["wing", "symmetry", "side", "floor", "ceiling", "farfield"], is_wing, family, |at| place(at * CELL))
}

/// Sections of the wing in planes y = const before it was placed.
pub fn sections(at: &[f64]) -> Vec<Profile> {
    let mesh = block(8.0, |at| at);
    let family = mesh.family("wing").unwrap();
    let own = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &of)| of == family);
    let triangles: Vec<[u32; 3]> = own.map(|(&triangle, _)| triangle).collect();
    let plane = |(number, &y): (usize, &f64)| (number as i64, Plane { point: DVec3::Y * y, normal: DVec3::Y });
    let section = |(number, plane)| Profile { number, points: cut::cut(&mesh.vertices, &triangles, &plane).unwrap() };
    at.iter().enumerate().map(plane).map(section).collect()
}

pub fn mapped(profiles: &[Profile], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let points = |profile: &Profile| profile.points.iter().map(|&point| map(point)).collect();
    profiles.iter().map(|profile| Profile { number: profile.number, points: points(profile) }).collect()
}

pub fn builder(mesh: TetMesh, old: Vec<Profile>, role: impl Fn(&str) -> Role) -> MoverBuilder {
    let names = mesh.families.clone();
    let mut builder = Mover::builder(mesh).method(Method::Chebyshev);
    for name in &names {
        builder = builder.role(name, role(name));
    }
    if role("wing") == Role::Wing { builder.old_profiles("wing", old) } else { builder }
}

pub fn set_up(mesh: TetMesh, old: Vec<Profile>, role: impl Fn(&str) -> Role, quality: Option<QualityTarget>) -> Mover {
    builder(mesh, old, role).quality(quality).build(cpu()).unwrap()
}

pub fn design(new: Vec<Profile>) -> Design {
    Design::of_wing("wing", new)
}
