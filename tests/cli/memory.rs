//! A process held to so many bytes says what is lacking, instead of being ended by the system.

use std::process::{Command, Output};

use idmesh::formats;

use crate::fixture::*;

const MESH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/pitch-wing.msh.gz");

/// A wing in a cube of 102 341 tets, turned by 175 degrees: too far for one jump.
fn turned_wing() -> Fixture {
    let fixture = Fixture::new();
    let mesh = formats::read(MESH.as_ref()).unwrap().mesh;
    let wing = mesh.family("wing").unwrap();
    let triangles = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|(_, family)| **family == wing);
    let mut vertices: Vec<u32> = triangles.flat_map(|(triangle, _)| *triangle).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let (sin, cos) = 175.0_f64.to_radians().sin_cos();
    let row = |vertex: u32| {
        let at = mesh.vertices[vertex as usize];
        let (x, z) = (at.x * cos + at.z * sin, at.z * cos - at.x * sin);
        format!("{},{},{},{},0,{}\n", at.x, at.y, at.z, x - at.x, z - at.z)
    };
    fixture.write("wing.csv", &vertices.into_iter().map(row).collect::<String>());
    let families =
        "[family.wing]\nrole = \"prescribed\"\ndisplacement = \"wing.csv\"\n[family.farfield]\nrole = \"fixed\"\n";
    fixture.write("case.toml", &format!("mesh = '{MESH}'\n{families}[output]\nmesh = \"moved.msh\"\n"));
    fixture
}

/// Runs the case with so many megabytes of addresses. Threads set none aside for themselves, or the
/// limit would be met anywhere.
fn run_within(fixture: &Fixture, megabytes: usize) -> Output {
    let run = command(fixture.folder.path(), &["run", "case.toml", "--backend", "cpu"]);
    let mut shell = Command::new("sh");
    shell.current_dir(fixture.folder.path()).arg("-c").arg(format!("ulimit -v {}; exec \"$@\"", 1000 * megabytes));
    shell
        .arg("sh")
        .arg(run.get_program())
        .args(run.get_args())
        .env("RAYON_NUM_THREADS", "1")
        .env("MALLOC_ARENA_MAX", "1")
        .output()
        .unwrap()
}

/// Between too little for the set-up and enough for all there is a limit that only the steps do not
/// fit into.
#[test]
fn lack_of_memory_is_told() {
    let fixture = turned_wing();
    let mut before = fixture.files();
    let mut told = [false; 2];
    for megabytes in (70..).step_by(10) {
        let output = run_within(&fixture, megabytes);
        let errors = stderr(&output);
        if output.status.success() {
            break;
        }
        for (told, message) in told.iter_mut().zip(["102341 tets: this takes", "102341 tets, moved in steps"]) {
            if errors.contains(message) {
                assert_eq!(output.status.code(), Some(3), "{errors}");
                assert!(errors.contains("GB of memory, but ") && errors.contains(" GB are available"), "{errors}");
                assert_eq!(fixture.files(), before, "files were left behind");
                *told = true;
            }
        }
        assert!(megabytes < 1000, "{errors}");
    }
    before.push("moved.msh".to_owned());
    before.sort();
    assert_eq!(fixture.files(), before);
    assert_eq!(told, [true; 2]);
}
