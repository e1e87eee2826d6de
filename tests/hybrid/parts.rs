//! Pylon and nacelle with layers of prisms.

use super::*;
use idmesh::families::{Junction, RigidMotion, TipStart};

/// Half an aircraft with pylon and nacelle, three layers on all walls: 19 374 tets, 10 227 prisms.
fn with_nacelle(junction: Junction) -> (MeshFile, MoverBuilder) {
    let file = formats::read_mixed(&file("tests/data/hybrid/nacelle.msh.gz")).unwrap();
    let pylon = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction };
    let builder = builder_with(&file.mesh, &file.others, profiles("nacelle_old"));
    let builder = builder
        .role("pylon", pylon)
        .role("nacelle", Role::Rigid { motion: RigidMotion::Root, junction: Junction::Glued });
    assert!(
        file.mesh.families.iter().all(|name| role(name).is_some() || ["pylon", "nacelle", "fluid"].contains(&&**name))
    );
    (file, builder)
}

/// The wing twists and its chord grows by 12 % at the tip. The nacelle stays one body to rounding,
/// layers keep their thickness on all walls, and no cell becomes bad, with the junction glued and
/// sliding.
///
/// Fails if the springs are the longitudinal ones, or if a body's motion is a thousandth too large.
#[test]
fn a_nacelle_with_layers_goes_with_its_wing() {
    for junction in [Junction::Glued, Junction::Slide] {
        let (MeshFile { mesh, others, .. }, builder) = with_nacelle(junction);
        let hybrid = HybridMesh { mesh: &mesh, others: &others };
        let mut mover = builder.build(cpu()).unwrap();
        let outcome = mover.update(&Design::of_wing("wing", profiles("nacelle_planform"))).unwrap();
        let moved = outcome.valid().unwrap().vertices();
        let (before, after) = (jacobians(hybrid, &mesh.vertices), jacobians(hybrid, moved));
        for (kind, least) in before {
            assert!(after[kind] > 0.95 * least, "{junction:?}: {kind} {} of {least}", after[kind]);
        }
        let ratios = layers(hybrid, &["wing", "carenage", "wingtip", "trailing_edge", "pylon", "nacelle"], moved);
        assert!(ratios.len() > 3000);
        let (low, high) = range(&ratios);
        assert!(low > 0.99 && high < 1.01, "{junction:?}: {low} {high}");
        for kind in outcome.kinds.as_ref().unwrap() {
            assert!(kind.inverted == 0 && kind.shape_min.unwrap() > 0.7, "{junction:?}: {kind:?}");
        }
        // A body keeps all distances: those from three vertices tell.
        let body: Vec<usize> =
            mover.family_vertices("nacelle").unwrap().iter().map(|&vertex| vertex as usize).collect();
        for from in [body[0], body[body.len() / 2], body[body.len() - 1]] {
            for &vertex in &body {
                let change = moved[from].distance(moved[vertex]) - mesh.vertices[from].distance(mesh.vertices[vertex]);
                assert!(change.abs() < 1e-12, "{junction:?}: {change:e}");
            }
        }
    }
}
