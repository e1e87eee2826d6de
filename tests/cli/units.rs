//! Meshes in very small and very large units, through files: what is written, and what is refused.

use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::formats::{self, Fields};

use crate::fixture::*;

/// Half of the box's extent along z.
const HALF: f64 = 1.25;

/// The usual case in another unit. All numbers of the profiles have an exponent.
fn scaled(factor: f64) -> Fixture {
    let fixture = Fixture::new();
    fixture.mesh(|mesh| mesh.vertices.iter_mut().flatten().for_each(|x| *x *= factor));
    let text = fixture.read("new.csv");
    let row = |row: &str| {
        let (number, position) = row.split_once(',').unwrap();
        let position = position.split(',').map(|x| format!("{:e}", factor * x.parse::<f64>().unwrap()));
        format!("{number},{}\n", position.collect::<Vec<_>>().join(","))
    };
    let rows: String = text.lines().skip(1).map(row).collect();
    fixture.write("new.csv", &format!("profile,x,y,z\n{rows}"));
    fixture
}

fn vertices(path: &Path) -> Vec<DVec3> {
    formats::read_mixed(path).unwrap().mesh.vertices
}

/// The moved vertices by way of a format, in the unit of the box.
fn moved(fixture: &Fixture, name: &str, factor: f64) -> Vec<DVec3> {
    let output = name.replace("in", "moved");
    assert_good(&fixture.idmesh(&["convert", "box.msh", name]));
    let case = CASE.replace("box.msh", name).replace("moved.msh", &output);
    fixture.write("case.toml", &case);
    let run = fixture.run();
    assert!(run.status.success(), "{name}: {}", stderr(&run));
    vertices(&fixture.path(&output)).into_iter().map(|at| at / factor).collect()
}

/// Formats in f64, as text and binary, hold lengths of every unit. They move to the same mesh, to
/// the bit for a power of two.
#[test]
fn files_hold_every_unit() {
    let names = ["in.msh", "in.su2", "in.mesh", "in.ugrid", "in.lb8.ugrid", "in.vtu", "in.vtk"];
    let expected: Vec<Vec<DVec3>> = names.iter().map(|name| moved(&scaled(1.0), name, 1.0)).collect();
    for (factor, tolerance) in [(2f64.powi(-100), 0.0), (2f64.powi(100), 0.0), (1e-30, 1e-12), (1e30, 1e-12)] {
        let fixture = scaled(factor);
        for (name, expected) in names.iter().zip(&expected) {
            let found = moved(&fixture, name, factor);
            let off = found.iter().zip(expected).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
            assert!(off <= tolerance, "{name}, {factor:e}: {off:e}");
        }
    }
}

/// The other commands in the smallest and the largest units.
#[test]
fn commands_work_in_every_unit() {
    let measures = |fixture: &Fixture| {
        let output = fixture.idmesh(&["quality", "box.msh"]);
        assert_good(&output);
        // Volumes have the unit, and their digits make the table wider.
        let text = stdout(&output);
        let lines = text.lines().filter(|line| !line.contains("volume min"));
        lines.map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect::<Vec<_>>()
    };
    let cut = |fixture: &Fixture| {
        assert_good(&fixture.idmesh(&["cut", "box.msh", "--family", "wing", "--planes", "3", "--out", "cut.csv"]));
        let text = fixture.read("cut.csv");
        let row = |row: &str| row.split(',').skip(1).map(|x| x.parse().unwrap()).collect::<Vec<f64>>();
        text.lines().skip(1).flat_map(row).collect::<Vec<f64>>()
    };
    let tets = |fixture: &Fixture| {
        assert_good(&fixture.idmesh(&["refine", "box.msh", "fine.msh"]));
        formats::read(&fixture.path("fine.msh")).unwrap().mesh.tets
    };
    let ordinary = scaled(1.0);
    for factor in [2f64.powi(-100), 2f64.powi(100)] {
        let fixture = scaled(factor);
        assert_eq!(measures(&fixture), measures(&ordinary), "{factor:e}");
        assert_eq!(cut(&fixture), cut(&ordinary).iter().map(|x| factor * x).collect::<Vec<_>>(), "{factor:e}");
        assert_eq!(tets(&fixture), tets(&ordinary), "{factor:e}");
        // A vertex moved by a thousandth of the diagonal is found, and its place is readable.
        assert_good(&fixture.idmesh(&["compare", "box.msh", "box.msh"]));
        std::fs::copy(fixture.path("box.msh"), fixture.path("other.msh")).unwrap();
        fixture.mesh(|mesh| mesh.vertices.iter_mut().flatten().for_each(|x| *x *= 1.001 * factor));
        let output = fixture.idmesh(&["compare", "box.msh", "other.msh"]);
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        let text = stdout(&output);
        assert!(text.contains("relative difference") && text.lines().all(|line| line.len() < 130), "{text}");
    }
}

#[test]
fn sizes_out_of_range_name_the_file_and_the_size() {
    for factor in [1e-300, 1e-60, 1e60, 1e200] {
        let fixture = scaled(factor);
        std::fs::copy(fixture.path("box.msh"), fixture.path("other.msh")).unwrap();
        let size = format!("box.msh: the mesh measures {:e} of its unit, expected 1e-50 to 1e50", 3.0 * factor);
        for command in [
            vec!["run", "case.toml", "--backend", "cpu"],
            vec!["quality", "box.msh"],
            vec!["cut", "box.msh", "--family", "wing", "--planes", "2", "--out", "cut.csv"],
            vec!["refine", "box.msh", "fine.msh"],
            vec!["compare", "box.msh", "other.msh"],
        ] {
            fixture.refuses_command(&command, 3, &[&size]);
        }
        // Nothing is computed, so nothing is lost.
        assert_good(&fixture.idmesh(&["convert", "box.msh", "box.su2"]));
        assert_eq!(vertices(&fixture.path("box.su2")), vertices(&fixture.path("box.msh")));
    }
}

/// Single precision holds 1e-38 at least. A smaller mesh is refused, and not written as zeros.
#[test]
fn single_precision_never_becomes_zero() {
    let fixture = scaled(1e-30);
    assert_good(&fixture.idmesh(&["convert", "box.msh", "box.lb4.ugrid"]));
    let pairs = vertices(&fixture.path("box.msh")).into_iter().zip(vertices(&fixture.path("box.lb4.ugrid")));
    let off = pairs.map(|(a, b)| a.distance(b)).fold(0.0, f64::max);
    assert!(off < 1e-6 * HALF * 1e-30, "{off:e}");
    for factor in [1e-40, 1e-60] {
        let words = [&*format!("{:e}", 3.0 * factor), "too little for the file's single precision"];
        scaled(factor).refuses_command(&["convert", "box.msh", "box.lb4.ugrid"], 3, &words);
    }
    scaled(1e40).refuses_command(&["convert", "box.msh", "box.lb4.ugrid"], 3, &["does not fit", "single precision"]);
}

/// The same for files that are written back: in order, and in arrays of points.
#[test]
fn single_precision_is_kept_where_it_suffices() {
    let data = |name: &str| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/mixed").join(name);
    for (name, output) in [("meshio.lb4.ugrid", "a.lb4.ugrid"), ("meshio.single.vtu", "a.vtu")] {
        let folder = tempfile::tempdir().unwrap();
        let file = formats::read_mixed(&data(name)).unwrap();
        let path = folder.path().join(output);
        let write = |factor: f64| {
            let vertices: Vec<DVec3> = file.mesh.vertices.iter().map(|&at| factor * at).collect();
            file.write(&path, &vertices, &Fields::default()).map(|()| vertices)
        };
        for written in [write(2f64.powi(-100)).unwrap(), write(2f64.powi(100)).unwrap()] {
            assert_eq!(written.len(), file.mesh.vertices.len());
        }
        assert_eq!(vertices(&path), write(2f64.powi(100)).unwrap(), "{name}");
        for factor in [1e-45, 1e-60] {
            let error = write(factor).unwrap_err().to_string();
            assert!(error.contains("too little for the file's single precision"), "{name}: {error}");
        }
        assert_eq!(vertices(&path), write(2f64.powi(100)).unwrap(), "{name}: the file before is lost");
    }
}

/// Messages show places on a mesh of any unit.
#[test]
fn places_in_messages_are_readable() {
    let fixture = scaled(1e-30);
    fixture.mesh(|mesh| {
        mesh.vertices.iter_mut().flatten().for_each(|x| *x *= 1e-30);
        mesh.tets[7].swap(0, 1);
    });
    let [x, ..] = vertices(&fixture.path("box.msh"))
        [formats::read(&fixture.path("box.msh")).unwrap().mesh.tets[7][0] as usize]
        .to_array();
    fixture.refuses(3, &["1 of ", &format!("near [{x:.6e}, ")]);
}
