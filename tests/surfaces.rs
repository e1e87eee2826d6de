//! Surfaces that belong together: families that share vertices.

mod common;

use std::collections::BTreeMap;

use common::aircraft::{SMALL, mover, settings, vertices_of};
use glam::DVec3;
use idmesh::mesh::FamilyId;
use idmesh::mover::{Design, MoveError, Mover};
use idmesh::stages::Role;

/// The wing and its tip, moved as these say.
fn prescribed(wing: impl Fn(DVec3) -> DVec3, tip: impl Fn(DVec3) -> DVec3) -> (Mover, Design) {
    let mesh = SMALL.mesh();
    let mut settings = settings(&mesh, Vec::new());
    let [wing_family, tip_family] = ["wing", "wingtip"].map(|name| mesh.family(name).unwrap());
    settings.old_profiles.clear();
    settings.roles[wing_family.index()] = Role::Prescribed;
    settings.roles[tip_family.index()] = Role::Prescribed;
    let mover = mover(mesh, settings).unwrap();
    let displacement = |family: FamilyId, by: &dyn Fn(DVec3) -> DVec3| -> Vec<DVec3> {
        let vertices = mover.family_vertices(family).iter();
        vertices.map(|&vertex| by(mover.mesh().vertices[vertex as usize])).collect()
    };
    let prescribed =
        BTreeMap::from([(wing_family, displacement(wing_family, &wing)), (tip_family, displacement(tip_family, &tip))]);
    (mover, Design { prescribed, ..Design::default() })
}

#[test]
fn prescribed_families_that_agree_are_moved() {
    let bend = |at: DVec3| 0.01 * at.y * at.y * DVec3::Z;
    let (mut mover, design) = prescribed(bend, |at| bend(at) * (1.0 + 5e-7));
    mover.update(&design, &|_| {}).unwrap();
}

#[test]
fn prescribed_families_that_disagree_are_an_error() {
    let bend = |at: DVec3| 0.01 * at.y * at.y * DVec3::Z;
    let (mut mover, design) = prescribed(bend, |at| bend(at) + 1e-6 * DVec3::X);
    let shared: Vec<usize> = vertices_of(mover.mesh(), "wingtip");
    let wing = vertices_of(mover.mesh(), "wing");
    match mover.update(&design, &|_| {}).unwrap_err() {
        MoveError::Disagree { family, other, vertex, position, difference } => {
            let both = [&*family, &*other];
            assert!(both == ["wing", "wingtip"] || both == ["wingtip", "wing"], "{both:?}");
            assert!(shared.contains(&(vertex as usize)) && wing.contains(&(vertex as usize)));
            assert_eq!(position, mover.mesh().vertices[vertex as usize]);
            common::assert_close(difference, 1e-6, 1e-12);
        }
        error => panic!("{error}"),
    }
}
