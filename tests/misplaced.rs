//! Roles that cannot be meant are warned of, and roles that can be are not.

mod common;

use common::aircraft::*;
use common::carved::{carve, on};
use glam::DVec3;
use idmesh::families::{Misplaced, Role, TipStart};
use idmesh::mesh::{FamilyId, TetMesh};
use idmesh::mover::{Design, MoverBuilder, Outcome, Warning};
use idmesh::profile::Profile;

const TIP: Role = Role::Wingtip { coefficient: 0.5, start: TipStart::Affine };

/// The warnings of roles in a design that moves the wing.
fn warnings(builder: MoverBuilder, new: Vec<Profile>) -> Vec<Warning> {
    of_roles(builder.build(cpu()).unwrap().update(&Design::of_wing("wing", new)).unwrap())
}

fn of_roles(outcome: Outcome) -> Vec<Warning> {
    let is_of_role = |warning: &Warning| matches!(warning, Warning::Misplaced { .. } | Warning::LooseTip { .. });
    outcome.warnings.into_iter().filter(is_of_role).collect()
}

/// The warnings for the mesh `small`, on which some families have other roles.
fn of_small(roles: &[(&str, Role)]) -> Vec<Warning> {
    of_mesh(SMALL.mesh(), roles)
}

fn of_mesh(mesh: TetMesh, roles: &[(&str, Role)]) -> Vec<Warning> {
    let builder = builder(mesh, SMALL.profiles("old_2"));
    warnings(
        roles.iter().fold(builder, |builder, (family, role)| builder.role(family, role.clone())),
        SMALL.profiles("big_2"),
    )
}

fn misplaced(family: &str, role: &'static str, misplaced: Misplaced) -> Warning {
    Warning::Misplaced { family: family.to_owned(), role, misplaced }
}

fn loose(family: &str) -> Warning {
    Warning::LooseTip { families: vec![family.to_owned()] }
}

/// Gives the triangles of a family with their centres before `x` to a new family.
fn split(mesh: &mut TetMesh, family: &str, x: f64, name: &str) {
    let (whole, part) = (mesh.family(family).unwrap(), FamilyId(mesh.families.len() as u16));
    for (triangle, family) in mesh.triangles.iter().zip(&mut mesh.triangle_family) {
        let centre = triangle.iter().map(|&vertex| mesh.vertices[vertex as usize].x).sum::<f64>() / 3.0;
        if *family == whole && centre < x {
            *family = part;
        }
    }
    assert!(mesh.triangle_family.iter().filter(|&&family| family == part).count() > 10);
    mesh.families.push(name.to_owned());
}

#[test]
fn the_usual_roles_are_not_warned_of() {
    assert_eq!(of_small(&[]), []);
    for aircraft in [WING_BODY, ROUND] {
        assert_eq!(warnings(aircraft.builder(aircraft.profiles("old_2")), aircraft.profiles("small_2")), []);
    }
}

#[test]
fn families_that_nothing_moves_are_warned_of() {
    assert_eq!(of_small(&[("farfield", TIP)]), [loose("farfield")]);
    for (name, role) in [("carenage", Role::Carenage), ("trailing-edge", Role::TrailingEdge)] {
        let told = of_small(&[("farfield", role)]);
        assert_eq!(told, [misplaced("farfield", name, Misplaced::Untouched)]);
        assert!(told[0].to_string().contains("`farfield` has the role") && told[0].to_string().contains(name));
    }
}

/// A fuselage in pieces: the nose touches the wing through the rest, if the rest follows too.
#[test]
fn families_that_touch_through_others_are_not_warned_of() {
    let mut mesh = SMALL.mesh();
    split(&mut mesh, "carenage", -1.0, "nose");
    let nose = ("nose", Role::Carenage);
    assert_eq!(of_mesh(mesh.clone(), std::slice::from_ref(&nose)), []);
    let told = of_mesh(mesh, &[nose, ("carenage", Role::Fixed)]);
    assert_eq!(told, [misplaced("nose", "carenage", Misplaced::Untouched)]);
}

/// A tip whose only neighbour stays has nothing to follow, whatever places the neighbour.
#[test]
fn tips_at_fixed_families_are_warned_of() {
    let mut mesh = SMALL.mesh();
    split(&mut mesh, "carenage", -1.0, "nose");
    assert_eq!(of_mesh(mesh, &[("nose", TIP), ("carenage", Role::Fixed)]), [loose("nose")]);
}

#[test]
fn flat_families_are_no_carenages() {
    let told = of_small(&[("symmetry", Role::Carenage)]);
    assert_eq!(told, [misplaced("symmetry", "carenage", Misplaced::Flat)]);
    assert!(told[0].to_string().ends_with("is `plane` its role?"), "{}", told[0]);
}

/// The symmetry plane reaches its own side of the mesh's box, and its edges reach four others.
#[test]
fn far_families_that_follow_a_wing_are_warned_of() {
    assert_eq!(of_small(&[("symmetry", TIP)]), [misplaced("symmetry", "wingtip", Misplaced::Far(5))]);
    let told = of_small(&[("symmetry", Role::TrailingEdge)]);
    assert_eq!(told, [misplaced("symmetry", "trailing-edge", Misplaced::Far(5))]);
    assert!(told[0].to_string().contains("reaches 5 of the six sides"), "{}", told[0]);
}

const CELLS: [usize; 3] = [12, 8, 10];
const CELL: f64 = 0.25;

/// A wing from wall to wall, whose trailing edge is a family of its own. The sides of the box are
/// `symmetry` at z = 0, and `walls`.
///
/// - `low`: the cell with which the wing begins in z; at 0 the symmetry plane cuts it
fn in_tunnel(low: f64) -> TetMesh {
    let is_wing = |at: DVec3| at.cmpgt(DVec3::new(4.0, 0.0, low)).all() && at.x < 7.0 && at.z < 6.0;
    let family = |triangle| match triangle {
        _ if on(triangle, 2, 0.0) => "symmetry",
        _ if (0..3).any(|axis| on(triangle, axis, 0.0) || on(triangle, axis, CELLS[axis] as f64)) => "walls",
        _ if on(triangle, 0, 7.0) => "trailing_edge",
        _ => "wing",
    };
    carve(CELLS, &["wing", "trailing_edge", "symmetry", "walls"], is_wing, family, |at| at * CELL)
}

/// The warnings if the wing in a tunnel moves as a whole.
fn of_tunnel(low: f64, walls: Role) -> Vec<Warning> {
    let moving = builder(in_tunnel(low), Vec::new()).role("wing", Role::Prescribed).role("walls", walls);
    let mut mover = moving.build(cpu()).unwrap();
    let displacement = vec![DVec3::X * 0.03; mover.family_vertices("wing").unwrap().len()];
    of_roles(mover.update(&Design::of_prescribed("wing", displacement)).unwrap())
}

/// The walls of a tunnel touch the wing, so they would move with it if they were its tip.
#[test]
fn walls_that_touch_the_wing_are_no_tip() {
    assert_eq!(of_tunnel(4.0, TIP), [misplaced("walls", "wingtip", Misplaced::Far(6))]);
}

/// The trailing edge reaches both walls, and the symmetry plane that cuts the wing along its span.
#[test]
fn a_trailing_edge_may_reach_three_sides() {
    let mesh = in_tunnel(0.0);
    let edge = vertices_of(&mesh, "trailing_edge");
    let reaches = |axis: usize, value: f64| edge.iter().any(|&vertex| mesh.vertices[vertex][axis] == value);
    assert!(reaches(1, 0.0) && reaches(1, 2.0) && reaches(2, 0.0));
    assert_eq!(of_tunnel(0.0, Role::Fixed), []);
    assert_eq!(of_tunnel(4.0, Role::Fixed), []);
}
