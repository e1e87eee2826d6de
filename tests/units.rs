//! The unit of length does not matter. A mesh with everything that belongs to it, scaled by a
//! factor, moves to the scaled result, from 1e-30 to 1e30.
//!
//! A power of two is exact in floating point, so there every bit must agree, on every backend.
//! Other factors round the input, and the moved vertices must agree to 1e-12 of the mesh's size.

mod common;

use std::sync::Arc;

use common::aircraft::{Anyway, ROUND, SMALL, WING_BODY, cpu, file, role, triangles_of, vertices_of};
use common::block::{block, sections};
use common::faults::size;
use common::{assert_close, compare};
use glam::{DQuat, DVec3};
use idmesh::backend::Backend;
use idmesh::families::Role;
use idmesh::mesh::{MeshError, SIZES, TetMesh, check_size, refine};
use idmesh::mover::{Design, FamilyReport, MoveError, Mover, Outcome, Settings};
use idmesh::profile::{Plane, Profile, cut};
use idmesh::relaxation::Method;
use idmesh::smoothing::QualityTarget;
use idmesh::springs::Springs;

/// A mesh with everything that has a length.
struct Setting {
    mesh: TetMesh,
    roles: Vec<(String, Role)>,
    /// Old profiles, new profiles and mirror plane of the family `wing`.
    wing: Option<(Vec<Profile>, Vec<Profile>, Option<Plane>)>,
    /// Displacements of prescribed families.
    prescribed: Vec<(String, Vec<DVec3>)>,
    settings: Settings,
}

impl Setting {
    fn new(mesh: TetMesh, of: impl Fn(&str) -> Role, settings: Settings) -> Self {
        let roles = mesh.families.iter().map(|name| (name.clone(), of(name))).collect();
        Self { mesh, roles, wing: None, prescribed: Vec::new(), settings }
    }

    fn with_wing(self, old: Vec<Profile>, new: Vec<Profile>) -> Self {
        Self { wing: Some((old, new, None)), ..self }
    }

    /// Builds the mover in another unit and moves the mesh.
    fn outcome(&self, factor: f64, backend: &Arc<dyn Backend>) -> Outcome {
        let points = |points: &[DVec3]| points.iter().map(|&point| factor * point).collect::<Vec<_>>();
        let profiles = |profiles: &[Profile]| -> Vec<Profile> {
            profiles.iter().map(|p| Profile { number: p.number, points: points(&p.points) }).collect()
        };
        let mesh = TetMesh { vertices: points(&self.mesh.vertices), ..self.mesh.clone() };
        let mut builder = Mover::builder(mesh).settings(self.settings);
        for (family, role) in &self.roles {
            builder = builder.role(family, role.clone());
        }
        let mut design = Design::default();
        if let Some((old, new, mirror)) = &self.wing {
            let mirror = mirror.map(|plane| Plane { point: factor * plane.point, ..plane });
            builder = builder.wing("wing", &["wing"], profiles(old), mirror);
            design = design.with_profiles("wing", profiles(new));
        }
        for (family, displacement) in &self.prescribed {
            design = design.with_prescribed(family, points(displacement));
        }
        builder.build(Arc::clone(backend)).unwrap().update(&design).unwrap()
    }
}

fn settings(method: Method, quality: Option<QualityTarget>) -> Settings {
    let mut settings = Settings::default();
    (settings.method, settings.quality) = (method, quality);
    settings
}

/// Half an aircraft, with all stages from the wing to the volume.
fn aircraft(old: &str, new: &str, settings: Settings) -> Setting {
    let role = |name: &str| role(name).unwrap();
    Setting::new(SMALL.mesh(), role, settings).with_wing(SMALL.profiles(old), SMALL.profiles(new))
}

/// Four old profiles cut from the mesh, bent up, and local optimisation with vertices that slide.
fn cut_from_the_mesh() -> Setting {
    let setting = aircraft("old_2", "big_2", settings(Method::Chebyshev, Some(QualityTarget::Improve)));
    let mesh = &setting.mesh;
    let wing: Vec<_> = triangles_of(mesh, "wing").into_iter().map(|t| t.map(|vertex| vertex as u32)).collect();
    let [root, tip] = [0, 1].map(|profile| SMALL.profiles("old_2")[profile].points[0].y);
    let plane = |k: i64| (k, Plane { point: (root + (tip - root) * k as f64 / 3.0) * DVec3::Y, normal: DVec3::Y });
    let old = cut::cut_at_planes(&mesh.vertices, &wing, &(0..4).map(plane).collect::<Vec<_>>()).unwrap();
    let bent = |profile: &Profile| {
        let points = profile.points.iter().map(|p| DVec3::new(p.x, p.y, 1.2 * p.z + 0.1 * (p.y - root).powi(2)));
        Profile { number: profile.number, points: points.collect() }
    };
    let new = old.iter().map(bent).collect();
    setting.with_wing(old, new)
}

/// A rounded wingtip and a curved fuselage, multigrid, and local optimisation.
fn rounded() -> Setting {
    let role = |name: &str| role(name).unwrap();
    let settings = settings(Method::Auto, Some(QualityTarget::Improve));
    Setting::new(ROUND.mesh(), role, settings).with_wing(ROUND.profiles("old_2"), ROUND.profiles("planform_2"))
}

/// A wing high on a round fuselage, where the root slides on its steep side.
fn high_wing() -> Setting {
    let mesh = idmesh::formats::read(&file("tests/data/high-wing.msh.gz")).unwrap().mesh;
    let wing: Vec<_> = triangles_of(&mesh, "wing").into_iter().map(|t| t.map(|vertex| vertex as u32)).collect();
    let at = |y: f64| Plane { point: DVec3::Y * y, normal: DVec3::Y };
    let old = cut::cut_at_planes(&mesh.vertices, &wing, &[(0, at(1.0)), (1, at(3.5))]).unwrap();
    let thicker = |profile: &Profile| {
        let middle = profile.points.iter().map(|p| p.z).sum::<f64>() / profile.points.len() as f64;
        let points = profile.points.iter().map(|p| DVec3::new(p.x, p.y, middle + 0.05 + 1.2 * (p.z - middle)));
        Profile { number: profile.number, points: points.collect() }
    };
    let new = old.iter().map(thicker).collect();
    let settings = settings(Method::Chebyshev, Some(QualityTarget::Original));
    Setting::new(mesh, |name| role(name).unwrap(), settings).with_wing(old, new)
}

fn turned(old: &[Profile], angles: [f64; 2]) -> Vec<Profile> {
    let middle = DVec3::new(1.375, 0.0, 1.25);
    let one = |(profile, angle): (&Profile, f64)| {
        let turn = DQuat::from_rotation_y(angle);
        let points = profile.points.iter().map(|&point| middle + turn * (point - middle) + 0.05 * DVec3::Z);
        Profile { number: profile.number, points: points.collect() }
    };
    old.iter().zip(angles).map(one).collect()
}

/// A wing from one periodic plane to the other, turned so far that the mesh follows in steps.
fn periodic() -> Setting {
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "symmetry" => Role::Plane { flat: None, partner: Some("side".to_owned()) },
        "floor" => Role::Plane { flat: None, partner: Some("ceiling".to_owned()) },
        "side" | "ceiling" => Role::PLANE,
        _ => Role::Fixed,
    };
    let old = sections(&[0.3, 1.55]);
    let new = turned(&old, [1.0, 1.2]);
    let settings = settings(Method::Chebyshev, Some(QualityTarget::Original));
    Setting::new(block(8.0, |at| at), role, settings).with_wing(old, new)
}

/// A wing whose other half is the mirror image.
fn mirrored() -> Setting {
    let role = |name: &str| match name {
        "wing" => Role::Wing,
        "farfield" => Role::Fixed,
        _ => Role::PLANE,
    };
    let old = sections(&[0.3, 0.9]);
    let new = turned(&old, [0.1, 0.2]);
    let mut setting = Setting::new(block(8.0, |at| at), role, settings(Method::Jacobi, None)).with_wing(old, new);
    setting.wing.as_mut().unwrap().2 = Some(Plane { point: DVec3::Y, normal: DVec3::Y });
    setting
}

/// A family moved as prescribed, a plane with noise, and a fixed family that holds vertices back.
fn prescribed() -> Setting {
    let noisy = |at: DVec3| if at.z == 2.5 { at + 1e-4 * (7.0 * at.x + 5.0 * at.y).sin() * DVec3::Z } else { at };
    let mesh = block(6.0, noisy);
    let role = |name: &str| match name {
        "wing" => Role::Prescribed,
        "ceiling" => Role::Plane { flat: Some(1e-3), partner: None },
        "floor" => Role::PLANE,
        _ => Role::Fixed,
    };
    let by = |at: DVec3| DVec3::new(0.01 * at.z, 0.0, 0.005 + 0.04 * at.y * at.y);
    let displacement = vertices_of(&mesh, "wing").into_iter().map(|vertex| by(mesh.vertices[vertex])).collect();
    let mut setting = Setting::new(mesh, role, settings(Method::Chebyshev, Some(QualityTarget::Original)));
    setting.prescribed.push(("wing".to_owned(), displacement));
    setting
}

/// All measures of an outcome that have no unit.
fn without_unit(outcome: &Outcome) -> String {
    let Outcome { converged, inverted, folds, folded, path, smoothed, solver, unconverged, .. } = outcome;
    let missed: Vec<_> = outcome.profiles.iter().map(|(name, report)| (name, report.max_miss_of_vertices)).collect();
    let verdict = outcome.check().map_err(|refused| format!("{:?}", refused.why));
    let (warnings, held) = (outcome.warnings.len(), outcome.held_back.len());
    let stages = outcome.stages.iter().map(|s| (s.name, s.beta_min, s.beta_max, s.beta_mean, s.inverted));
    format!(
        "{converged} {inverted} {folds:?} {folded:?} {path:?} {smoothed:?} {solver:?} {unconverged:?} {missed:?} \
         {verdict:?} {warnings} {held} {:?} {:?} {:?}",
        stages.collect::<Vec<_>>(),
        outcome.self_intersecting,
        outcome.nearest_to_refusal.as_ref().map(|(wing, closeness)| (wing, closeness.share)),
    )
}

/// The lengths in the reports of families and profiles.
fn lengths(outcome: &Outcome) -> Vec<f64> {
    let of_family = |report: &FamilyReport| {
        let held = report.held_back.map(|held| held.max_distance);
        [report.max_distance_to_original_surface, report.max_distance_to_plane, report.max_distance_of_partners, held]
    };
    let of_profiles = outcome.profiles.values().filter_map(|report| report.max_distance_to_new_profiles);
    outcome.families.values().flat_map(of_family).flatten().chain(of_profiles).collect()
}

#[track_caller]
fn assert_same_bits(name: &str, setting: &Setting, backend: &Arc<dyn Backend>) {
    let expected = setting.outcome(1.0, backend);
    assert!(expected.displacement().iter().any(|by| by.length() > 1e-3), "{name}: nothing moves");
    for power in [-100, 100] {
        let factor = 2f64.powi(power);
        let found = setting.outcome(factor, backend);
        let back: Vec<DVec3> = found.vertices().iter().map(|&at| at / factor).collect();
        if let Err(mismatch) = compare(expected.vertices(), &back, 0.0) {
            panic!("{name}, 2^{power}: {mismatch:?}");
        }
        assert_eq!(without_unit(&found), without_unit(&expected), "{name}, 2^{power}");
        assert_eq!((&found.beta, &found.original_beta), (&expected.beta, &expected.original_beta), "{name}, 2^{power}");
        let back: Vec<f64> = lengths(&found).into_iter().map(|length| length / factor).collect();
        assert_eq!(back, lengths(&expected), "{name}, 2^{power}");
    }
}

/// Every stage, and every setting that changes how lengths are used.
///
/// Fails if a point counts as on the surface within 1e-15 of a length of 1, in
/// `TargetSurface::along`.
#[test]
fn a_power_of_two_changes_no_bit() {
    let steps = periodic().outcome(1.0, &cpu());
    assert!(steps.path.steps > 1 && !steps.families["side"].max_distance_of_partners.unwrap().is_nan(), "no steps");
    assert_eq!(prescribed().outcome(1.0, &cpu()).held_back.len(), 1, "nothing is held back");
    for (name, setting) in [
        ("aircraft", aircraft("old_2", "big_2", settings(Method::Multigrid, None))),
        ("cut from the mesh", cut_from_the_mesh()),
        ("high wing", high_wing()),
        ("periodic", periodic()),
        ("mirrored", mirrored()),
        ("prescribed", prescribed()),
    ] {
        assert_same_bits(name, &setting, &cpu());
    }
}

#[test]
fn a_power_of_two_changes_no_bit_of_a_large_aircraft() {
    assert_same_bits("rounded", &rounded(), &cpu());
}

/// All springs but `murayama`, whose published sum depends on the unit.
#[test]
fn a_power_of_two_changes_no_bit_with_any_springs() {
    for springs in ["longitudinal", "torsional", "torsional-wall", "rotation-aware", "rotation-aware-wall"] {
        let springs = Springs::named(springs).unwrap();
        let mut settings = settings(Method::Chebyshev, None);
        settings.springs = springs;
        assert_same_bits(springs.name, &aircraft("old_2", "planform_2", settings), &cpu());
    }
}

#[cfg(feature = "gpu")]
#[test]
fn a_power_of_two_changes_no_bit_on_the_gpu() {
    let every_network = idmesh::backend::gpu::Bounds { least_vertices: Some(0), ..Default::default() };
    let Some(gpu) = common::adapter::gpu(every_network) else { return };
    let gpu: Arc<dyn Backend> = Arc::new(gpu);
    for (name, setting) in [
        ("aircraft", aircraft("old_2", "big_2", settings(Method::Multigrid, None))),
        ("cut from the mesh", cut_from_the_mesh()),
        ("periodic", periodic()),
        ("prescribed", prescribed()),
    ] {
        assert_same_bits(name, &setting, &gpu);
    }
}

/// Sweeps in f64, and f32 cycles of multigrid.
#[test]
fn other_factors_change_a_result_by_rounding() {
    for (name, setting) in [
        ("aircraft", aircraft("old_2", "planform_2", settings(Method::Chebyshev, None))),
        ("multigrid", aircraft("old_2", "big_2", settings(Method::Multigrid, None))),
        ("cut from the mesh", cut_from_the_mesh()),
        ("mirrored", mirrored()),
        ("prescribed", prescribed()),
    ] {
        assert_same_in_other_units(name, &setting);
    }
}

/// Meshes that multigrid relaxes by default. On all levels of the hierarchy no decision depends on
/// rounding.
///
/// Fails if `ROUNDING` in the aggregation is 0.
#[test]
fn other_factors_change_a_large_aircraft_by_rounding() {
    let role = |name: &str| role(name).unwrap();
    let wing_body = Setting::new(WING_BODY.mesh(), role, Settings::default())
        .with_wing(WING_BODY.profiles("old_5"), WING_BODY.profiles("big_5"));
    assert_eq!(wing_body.outcome(1.0, &cpu()).solver.method, "multigrid");
    assert_same_in_other_units("wing-body", &wing_body);
    assert_same_in_other_units("rounded", &rounded());
}

#[track_caller]
fn assert_same_in_other_units(name: &str, setting: &Setting) {
    let expected = setting.outcome(1.0, &cpu());
    for factor in [1e-30, 1e-9, 25.4, 9.4607e15, 1e30] {
        let found = setting.outcome(factor, &cpu());
        let back: Vec<DVec3> = found.vertices().iter().map(|&at| at / factor).collect();
        if let Err(mismatch) = compare(expected.vertices(), &back, 1e-12 * size(&setting.mesh)) {
            panic!("{name}, {factor:e}: {mismatch:?}");
        }
        for (found, expected) in found.stages.iter().zip(&expected.stages) {
            assert_eq!(found.inverted, expected.inverted, "{name}, {factor:e}");
            assert_close(found.beta_min, expected.beta_min, 1e-11);
            assert_close(found.beta_mean, expected.beta_mean, 1e-12);
        }
        let path = |outcome: &Outcome| (outcome.path.steps, outcome.path.given_up, outcome.path.reached);
        let judged = |outcome: &Outcome| (outcome.is_valid(), outcome.converged, path(outcome), outcome.warnings.len());
        assert_eq!(judged(&found), judged(&expected), "{name}, {factor:e}");
    }
}

// ---- beyond the range ----

/// Where products of lengths would be zero or infinite, the size is named and nothing is moved.
#[test]
fn sizes_out_of_range_are_refused() {
    let mesh = |factor: f64| {
        let mesh = SMALL.mesh();
        TetMesh { vertices: mesh.vertices.iter().map(|&at| factor * at).collect(), ..mesh }
    };
    // The largest extent of the mesh is 16.
    for factor in [1e-300, 1e-200, 1e-100, 6e-52, 7e48, 1e100, 1e200, 1e307] {
        let mut builder = Mover::builder(mesh(factor));
        for family in mesh(1.0).families {
            builder = builder.role(&family, Role::Fixed);
        }
        match builder.build(cpu()) {
            Err(MoveError::Mesh(MeshError::Size { size })) => assert_close(size / factor, 16.0, 1e-9),
            Err(other) => panic!("{factor:e}: {other}"),
            Ok(_) => panic!("{factor:e} is moved"),
        }
        assert!(matches!(refine(&mesh(factor)), Err(MeshError::Size { .. })), "{factor:e}");
    }
    for factor in [7e-52, 6e48] {
        assert!(refine(&mesh(factor)).unwrap().tets[..] == refine(&mesh(1.0)).unwrap().tets[..], "{factor:e}");
    }
}

/// A place far away is no size, and faults that have their own message keep it.
#[test]
fn only_sizes_are_judged() {
    let at = |x: f64, dx: f64| [DVec3::splat(x), DVec3::splat(x) + dx * DVec3::Y];
    assert!(check_size(at(1e60, 0.0)).is_ok() && check_size(at(1e49, 1e48)).is_ok());
    assert!(check_size(at(0.0, *SIZES.start())).is_ok() && check_size(at(0.0, *SIZES.end())).is_ok());
    assert!(check_size(at(0.0, 0.99 * SIZES.start())).is_err() && check_size(at(0.0, 1.01 * SIZES.end())).is_err());
    assert!(check_size([DVec3::splat(-1.7e308), DVec3::splat(1.7e308)]).is_err());
    assert!(check_size([DVec3::ZERO, DVec3::NAN]).is_ok() && check_size([DVec3::ZERO, DVec3::INFINITY]).is_ok());
    assert!(check_size([]).is_ok());
}
