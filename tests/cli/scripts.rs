//! The scripts of `examples` run: jobs of arrays, and loops with a flow solver, whose place a
//! script of a few lines takes.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

use crate::fixture::*;
use crate::wing_box::{FAMILIES, WingBox};

fn script(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name)
}

/// Runs a script of `examples` in the folder of a fixture, with idmesh in the path.
fn run(fixture: &Fixture, name: &str, arguments: &[&str], variables: &[(&str, &str)]) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_idmesh")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("sh");
    command.arg(script(name)).args(arguments).current_dir(fixture.folder.path());
    command.env("PATH", path).env("NODEVICE_SELECT", "1").env("BACKEND", "cpu");
    without_gpu(&mut command).envs(variables.iter().copied()).output().unwrap()
}

/// The reports of all jobs, joined.
fn joined(fixture: &Fixture, number: usize) -> Vec<String> {
    let files: Vec<String> = fixture.files().into_iter().filter(|name| name.starts_with("reports.")).collect();
    assert_eq!(files.len(), number, "{files:?}");
    let files: Vec<&str> = files.iter().map(String::as_str).collect();
    let output = fixture.idmesh(&[&["report"], &files[..], &["--join", "all.jsonl"]].concat());
    assert_good(&output);
    assert!(!stderr(&output).contains("warning"), "{}", stderr(&output));
    let line = |line: &str| serde_json::from_str::<Value>(line).unwrap()["design"].as_str().unwrap().to_owned();
    fixture.read("all.jsonl").lines().map(line).collect()
}

#[test]
fn scripts_of_arrays_do_each_design_once() {
    type Variables = fn(&str) -> Vec<(&'static str, String)>;
    let slurm: Variables = |number| {
        let array = [("ID", number), ("MIN", "1"), ("MAX", "3"), ("STEP", "1"), ("COUNT", "3")];
        let names = [
            "SLURM_ARRAY_TASK_ID",
            "SLURM_ARRAY_TASK_MIN",
            "SLURM_ARRAY_TASK_MAX",
            "SLURM_ARRAY_TASK_STEP",
            "SLURM_ARRAY_TASK_COUNT",
        ];
        let script =
            [("SLURM_JOB_ID", "77"), ("SLURM_PROCID", "0"), ("SLURM_NTASKS", "1"), ("SLURM_CPUS_PER_TASK", "1")];
        let array = names.into_iter().zip(array).map(|(name, (_, value))| (name, value.to_owned()));
        array.chain(script.map(|(name, value)| (name, value.to_owned()))).collect()
    };
    let aws: Variables = |number| {
        let index = number.parse::<u32>().unwrap() - 1;
        vec![
            ("AWS_BATCH_JOB_ARRAY_INDEX", index.to_string()),
            ("AWS_BATCH_JOB_ARRAY_SIZE", "3".to_owned()),
            ("WORK", ".".to_owned()),
        ]
    };
    let pbs: Variables = |number| vec![("PBS_ARRAY_INDEX", number.to_owned()), ("NCPUS", "1".to_owned())];
    for (name, variables, jobs) in
        [("slurm.sh", slurm, 3), ("slurm-claims.sh", slurm, 3), ("aws-batch.sh", aws, 3), ("pbs.sh", pbs, 10)]
    {
        let fixture = Fixture::with_designs(4);
        for number in 1..=jobs {
            let variables = variables(&number.to_string());
            let variables: Vec<(&str, &str)> = variables.iter().map(|(name, value)| (*name, value.as_str())).collect();
            let output = run(&fixture, &format!("arrays/{name}"), &[], &variables);
            assert_eq!(output.status.code(), Some(0), "{name} {number}: {}", stderr(&output));
        }
        let files: Vec<String> = fixture.files().into_iter().filter(|name| name.starts_with("reports.")).collect();
        // A job without a design writes no reports.
        assert_eq!(joined(&fixture, files.len()), ["0", "1", "2", "3"], "{name}");
        assert_eq!(fs::read_dir(fixture.path("moved")).unwrap().count(), 4, "{name}");
    }
}

/// A flow solver of a few lines: it keeps the mesh that it was given.
fn solver(fixture: &Fixture, text: &str) -> String {
    let path = fixture.path("solver");
    fs::write(&path, format!("#!/bin/sh\nset -eu\n{text}\n")).unwrap();
    fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
    path.display().to_string()
}

/// The vertices of the box's families that the loops move, by their numbers, and where they lie.
fn wing() -> BTreeMap<usize, [f64; 3]> {
    let mesh = WingBox::new();
    let vertices = mesh.family_vertices(0);
    vertices.into_iter().map(|vertex| (vertex, mesh.vertices[vertex])).collect()
}

fn case(mesh: &str, displacement: &str, output: &str) -> String {
    let fixed = FAMILIES.iter().filter(|name| !["wing", "symmetry"].contains(name));
    // The strips beside the wing follow it.
    let roles = [("trailing_edge", "trailing-edge"), ("wingtip", "wingtip"), ("farfield", "fixed")];
    let fixed = fixed
        .map(|name| format!("[family.{name}]\nrole = \"{}\"\n", roles.iter().find(|role| role.0 == *name).unwrap().1));
    format!(
        "mesh = \"{mesh}\"\n[family.wing]\nrole = \"prescribed\"\ndisplacement = \"{displacement}\"\n\
         [family.symmetry]\nrole = \"plane\"\n{}[output]\nmesh = \"{output}\"\n",
        fixed.collect::<String>()
    )
}

/// The wing of a moved mesh is bent by this much, and the mesh is the one the solver was given.
#[track_caller]
fn is_bent(path: &Path, bend: f64) {
    let moved = idmesh::formats::read(path).unwrap().mesh;
    for (vertex, [x, y, z]) in wing() {
        let expected = [x, y, z + bend * y * y];
        let found = moved.vertices[vertex].to_array();
        assert!((0..3).all(|axis| (found[axis] - expected[axis]).abs() < 1e-12), "{found:?}, expected {expected:?}");
    }
}

/// Each design is moved from the undeformed mesh to its own positions, and the solver gets it.
#[test]
fn the_loop_with_su2_moves_each_design() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["convert", "box.msh", "mesh.su2"]));
    fixture.write("case.toml", &case("mesh.su2", "surface_positions.dat", "mesh_out.su2"));
    let rows = wing().into_iter().map(|(vertex, [x, y, z])| format!("{vertex}\t{x}\t{y}\t{z}\n"));
    fixture.write("surface_original.dat", &rows.collect::<String>());
    fixture.write("config.cfg", "MESH_FILENAME= mesh_out.su2\n");
    let keeps = "mesh=$(sed -n 's/MESH_FILENAME= //p' \"$1\")\ncp \"$mesh\" \"kept.$(ls | grep -c '^kept' || true).su2\"\necho 1 > history.csv";
    let solver = solver(&fixture, keeps);
    let output = run(&fixture, "loops/su2.sh", &["2"], &[("SU2_CFD", &solver)]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(stdout(&output), "design 1: bend 0.025\ndesign 2: bend 0.05\n");
    is_bent(&fixture.path("kept.0.su2"), 0.025);
    is_bent(&fixture.path("kept.1.su2"), 0.05);
    assert!(fixture.path("history.2.csv").exists() && fixture.path("report.2.json").exists());
    // A solver that fails, and a case that is wrong, stop the loop.
    let fails = run(&fixture, "loops/su2.sh", &["2"], &[("SU2_CFD", "false")]);
    assert_eq!(fails.status.code(), Some(1));
    fixture.write("case.toml", "");
    assert_eq!(run(&fixture, "loops/su2.sh", &["2"], &[("SU2_CFD", &solver)]).status.code(), Some(3));
}

#[test]
fn the_loop_with_openfoam_rewrites_the_points() {
    let fixture = Fixture::new();
    fs::create_dir_all(fixture.path("constant/polyMesh")).unwrap();
    assert_good(&fixture.idmesh(&["convert", "box.msh", "constant/polyMesh"]));
    fixture.write("case.toml", &case("base/polyMesh", "surface.csv", "constant/polyMesh/points"));
    // OpenFOAM numbers vertices as the file did.
    let rows = wing().into_values().map(|[x, y, z]| format!("{x},{y},{z}\n"));
    fixture.write("surface_original.csv", &("x,y,z\n".to_owned() + &rows.collect::<String>()));
    let others = || {
        let names = ["faces", "owner", "neighbour", "boundary"];
        names.map(|name| fs::read(fixture.path(&format!("constant/polyMesh/{name}"))).unwrap())
    };
    let before = others();
    let keeps = "n=$(ls | grep -c '^kept' || true); mkdir \"kept.$n\"; cp -R constant/polyMesh \"kept.$n/\"; echo 0.5";
    let solver = solver(&fixture, keeps);
    for round in 0..2 {
        let output = run(&fixture, "loops/openfoam.sh", &["2"], &[("SOLVER", &solver)]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        for (number, bend) in [(2 * round, 0.025), (2 * round + 1, 0.05)] {
            is_bent(&fixture.path(&format!("kept.{number}/polyMesh")), bend);
        }
    }
    assert!(others() == before, "more than the points was rewritten");
    assert_eq!(fixture.read("objective.2"), "0.5\n");
}
