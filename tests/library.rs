//! Checks that the library refuses the same as the command line: unknown names, results that may
//! not be used, and good names for bad results.

mod common;

use common::aircraft::{SMALL, builder, cpu};
use glam::DVec3;
use idmesh::case::{Case, LoadedCase};
use idmesh::families::Role;
use idmesh::formats::FileSet;
use idmesh::mover::{Design, Mover, MoverBuilder, Outcome, Stopping, Why};
use idmesh::session::{Job, Outputs, Session};
use tempfile::TempDir;

fn refused(builder: MoverBuilder) -> String {
    builder.build(cpu()).err().unwrap().to_string()
}

#[test]
fn every_family_needs_a_role() {
    let error = refused(Mover::builder(SMALL.mesh()).role("wing", Role::Fixed).role("farfield", Role::Fixed));
    assert_eq!(
        error,
        "no role is given for `trailing_edge`, `wingtip`, `carenage`, `symmetry`, expected one for each family of the mesh"
    );
}

#[test]
fn names_that_the_mesh_has_not_are_refused() {
    let error = refused(SMALL.builder(SMALL.profiles("old_2")).role("wing_tip", Role::Carenage));
    assert!(error.starts_with("the mesh has no family `wing_tip`; did you mean `wingtip`?"), "{error}");
    let error = refused(builder(SMALL.mesh(), Vec::new()).old_profiles("wings", SMALL.profiles("old_2")));
    assert!(error.starts_with("the mesh has no family `wings`; did you mean `wing`?"), "{error}");
    let error = refused(builder(SMALL.mesh(), Vec::new()).wing("all", &[], SMALL.profiles("old_2"), None));
    assert!(error.starts_with("the wing `all` has no families"), "{error}");
}

/// The ranges are those of the case file.
#[test]
fn numbers_that_mean_nothing_are_refused() {
    let builder = || SMALL.builder(SMALL.profiles("old_2"));
    for coefficient in [-1.0, 3.0, f64::NAN] {
        let tip = Role::Wingtip { coefficient, start: Default::default() };
        let error = refused(builder().role("wingtip", tip));
        assert!(error.starts_with("`coefficient` of family `wingtip` is"), "{error}");
    }
    for flat in [0.0, 0.2, f64::NAN] {
        let error = refused(builder().role("symmetry", Role::Plane { flat: Some(flat), partner: None }));
        assert!(error.starts_with("`flat` of family `symmetry` is"), "{error}");
    }
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = refused(builder().stopping(Stopping { tolerance, ..Stopping::default() }));
        assert!(error.starts_with("`tolerance` is"), "{error}");
    }
    assert!(refused(builder().max_steps(0)).starts_with("`max_steps` is 0"));
    assert!(refused(builder().stopping(Stopping { max_sweeps: 0, ..Stopping::default() })).starts_with("`max_sweeps`"));
}

/// A part of a design that the mover cannot do is an error and is not ignored.
#[test]
fn a_design_with_a_name_that_the_mover_has_not_is_refused() {
    let mut mover = SMALL.mover(2);
    let good = Design::of_wing("wing", SMALL.profiles("big_2"));
    let wing = good.clone().with_profiles("wingg", SMALL.profiles("big_2"));
    let error = mover.update(&wing).unwrap_err().to_string();
    assert!(error.starts_with("the design has profiles for `wingg`"), "{error}");
    assert!(error.contains("did you mean `wing`?"), "{error}");
    // A family of the mesh that is not prescribed.
    let error = mover.update(&good.with_prescribed("farfield", vec![DVec3::X; 3])).unwrap_err().to_string();
    assert!(error.starts_with("the design has a displacement for `farfield`"), "{error}");
}

/// Fails if `Outcome::valid` returns a mesh from relaxations that did not converge.
#[test]
fn what_did_not_converge_is_not_handed_out() {
    let stopping = Stopping { max_sweeps: 2, ..Stopping::default() };
    let mut mover = SMALL.builder(SMALL.profiles("old_2")).stopping(stopping).build(cpu()).unwrap();
    let outcome = mover.update(&Design::of_wing("wing", SMALL.profiles("small_2"))).unwrap();
    assert!(!outcome.converged);
    let refused = outcome.valid().unwrap_err();
    assert!(refused.why != Why::NotFinite, "{refused:?}");
    assert!(refused.message.contains("not converged: "), "{refused:?}");
    assert!(refused.hint.unwrap().contains("raise max_sweeps"));
    assert_eq!(outcome.even_if_invalid().vertices().len(), mover.mesh().vertices.len());
}

/// The example case in a folder of its own.
fn example() -> (TempDir, LoadedCase) {
    let here = common::aircraft::file("examples/wing-body");
    let folder = tempfile::tempdir().unwrap();
    for name in ["case.toml", "wing-body.msh.gz", "old.csv", "new.csv"] {
        std::fs::copy(here.join(name), folder.path().join(name)).unwrap();
    }
    let case = Case::load(folder.path().join("case.toml")).unwrap();
    (folder, case)
}

/// Moves the mesh to the design of the case, and replaces the displacement of one vertex after the
/// volume stage.
fn spoilt(case: &LoadedCase, to: DVec3) -> Outcome {
    let mut mover = case.mover(cpu()).unwrap();
    let inside = mover.mesh().tets[0][0] as usize;
    let mut amend = |stage: &str, displacement: &mut Vec<DVec3>| {
        if stage == "volume" {
            displacement[inside] = to;
        }
    };
    mover.update_amended(&case.design, &mut amend).unwrap()
}

fn names(folder: &TempDir) -> Vec<String> {
    let entries = std::fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| name.starts_with("moved"));
    names.sort();
    names
}

#[test]
fn a_bad_mesh_never_gets_the_good_name() {
    let (folder, case) = example();
    let outcome = spoilt(&case, DVec3::splat(3.0));
    assert!(outcome.inverted > 0);
    assert_eq!(outcome.valid().unwrap_err().why, Why::Invalid);
    std::fs::write(folder.path().join("moved.vtu"), "of another design").unwrap();
    let written = case.write(&outcome).unwrap();
    assert_eq!(written.len(), 5);
    assert!(folder.path().join("beta.svg").is_file());
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("case.toml: refused</title>") && page.contains("id=\"canvas\""));
    let message = format!("{} of 97694 tets are inverted", outcome.inverted);
    assert!(page.contains(&message) && page.contains("<td>final: the volume has moved</td>"), "{message}");
    assert_eq!(names(&folder), ["moved.invalid.msh.gz", "moved.invalid.vtu", "moved.inverted.vtu"]);
}

#[test]
fn a_mesh_without_finite_positions_is_not_written() {
    let (folder, case) = example();
    let outcome = spoilt(&case, DVec3::NAN);
    assert_eq!(outcome.valid().unwrap_err().why, Why::NotFinite);
    let error = case.write(&outcome).unwrap_err().to_string();
    assert_eq!(error, "not converged: 1 vertices have no finite position; no mesh was written");
    assert!(names(&folder).is_empty());
    // The page is written all the same, without a view.
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    let lost = outcome.even_if_invalid().vertices().iter().position(|at| !at.is_finite()).unwrap();
    for words in [
        "case.toml: not converged</title>",
        "not converged: 1 vertices have no finite position",
        &format!("<td>{lost}</td>"),
        "<h2>Convergence</h2>",
        "script-src 'none'",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("id=\"canvas\"") && !page.contains("NaN") && !page.contains("<script"));
}

/// The page of a good outcome that a program has moved and written: the figures of the report.
#[test]
fn a_program_writes_the_page_too() {
    let (folder, case) = example();
    let mut mover = case.mover(cpu()).unwrap();
    let outcome = mover.update(&case.design).unwrap();
    let written = case.write(&outcome).unwrap();
    assert!(written.contains(&folder.path().join("report.html")), "{written:?}");
    let page = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    assert!(page.contains("case.toml: valid</title>") && page.contains("old, asked and got"));
    assert!(page.contains(&format!("<td>{:.6}</td>", outcome.stages[3].beta_min)));
}

/// The error of a case names the file at fault.
#[test]
fn errors_point_into_files() {
    let (folder, _) = example();
    std::fs::write(folder.path().join("new.csv"), "profile,x,y,z\n1,0,zero,0\n").unwrap();
    let error = Case::load(folder.path().join("case.toml")).err().unwrap().to_string();
    assert!(error.contains("new.csv:2:"), "{error}");
}

/// An outcome whose fields were changed is judged as before.
#[test]
fn a_bad_result_cannot_be_made_good() {
    let (_folder, case) = example();
    let mut outcome = spoilt(&case, DVec3::splat(3.0));
    outcome.inverted = 0;
    outcome.self_intersecting.clear();
    outcome.off_surface.clear();
    outcome.missed.clear();
    outcome.converged = true;
    assert!(!outcome.is_valid() && outcome.valid().is_err());
}

/// Another run puts its mesh under the good name while this run computes an invalid one: the good
/// name is free in the end.
///
/// Fails if `Session::finish` removes earlier results before the update alone.
#[test]
fn a_mesh_of_another_run_does_not_stand_for_an_invalid_one() {
    let (folder, case) = example();
    let good = folder.path().join("moved.vtu");
    let of_another = good.clone();
    let progress = move |step: &str| {
        if step == "writing" {
            std::fs::write(&of_another, "of another run").unwrap();
        }
    };
    let mut session = Session::new(&case, cpu(), progress).unwrap();
    let mut design = case.design.clone();
    for profile in design.profiles.values_mut().flatten() {
        profile.points.iter_mut().for_each(|point| point.z *= -3.0);
    }
    let outputs = Outputs::of(&case.case, None);
    let job = Job {
        design: &design,
        name: None,
        started: std::time::Instant::now(),
        read_seconds: 0.0,
        outputs: &outputs,
        report: None,
        checksums: None,
        claim: None,
    };
    let finished = session.finish(job).unwrap();
    assert_eq!(finished.verdict.unwrap_err().why, Why::Invalid);
    assert!(!good.exists() && folder.path().join("moved.invalid.vtu").is_file());
}

/// A front end that forgets to check its outputs loses no input.
#[test]
fn no_input_is_overwritten() {
    let (folder, case) = example();
    let mut session = Session::new(&case, cpu(), |_| {}).unwrap();
    let mut outputs = Outputs::of(&case.case, None);
    outputs.meshes = vec![folder.path().join("wing-body.msh.gz")];
    let job = Job {
        design: &case.design,
        name: None,
        started: std::time::Instant::now(),
        read_seconds: 0.0,
        outputs: &outputs,
        report: None,
        checksums: None,
        claim: None,
    };
    let error = session.finish(job).err().unwrap().to_string();
    assert!(error.contains("would overwrite the input"), "{error}");
    let (outcome, _) = session.update(&case.design).unwrap();
    let mut files = FileSet::default();
    assert!(outputs.add_to(&mut files, &case, None, &outcome).is_err());
    drop(files);
    assert!(idmesh::formats::read(&outputs.meshes[0]).is_ok());
}
