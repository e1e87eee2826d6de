//! The wing is what its sections say, or the run refuses: NACA wings of chord 1 meshed by gmsh,
//! judged by the airfoil's formula.

use std::fs;
use std::path::Path;
use std::process::Output;

use glam::DVec3;
use idmesh::formats;
use idmesh::mesh::TetMesh;
use idmesh::profile::{Plane, cut};
use tempfile::TempDir;

use super::fixture::{assert_good, command, stderr};

/// A mesh with its families' roles, and profiles by name.
struct Wing {
    folder: TempDir,
    mesh: &'static str,
}

impl Wing {
    fn new(mesh: &'static str) -> Self {
        Self { folder: tempfile::tempdir().unwrap(), mesh }
    }

    fn mesh(&self) -> TetMesh {
        formats::read(&data(self.mesh)).unwrap().mesh
    }

    fn sections(&self, name: &str, sections: &[Vec<DVec3>]) {
        let mut text = "profile,x,y,z\n".to_owned();
        for (number, points) in sections.iter().enumerate() {
            points.iter().for_each(|p| text += &format!("{number},{:e},{:e},{:e}\n", p.x, p.y, p.z));
        }
        fs::write(self.folder.path().join(name), text).unwrap();
    }

    /// Runs with these tables of profiles.
    fn run(&self, profiles: &str) -> Output {
        let families = self.mesh().families;
        let role = |name: &String| match name.as_str() {
            "symmetry" => "plane",
            "farfield" => "fixed",
            "trailing_edge" => "trailing-edge",
            "wingtip" => "wingtip",
            _ => "wing",
        };
        let families = families.iter().map(|name| format!("[family.{name}]\nrole = \"{}\"\n", role(name)));
        let case = format!(
            "mesh = '{}'\n{profiles}\n{}[output]\nmesh = \"moved.su2\"\n",
            data(self.mesh).display(),
            families.collect::<String>()
        );
        fs::write(self.folder.path().join("case.toml"), case).unwrap();
        command(self.folder.path(), &["run", "case.toml", "--backend", "cpu", "--json", "report.json"])
            .output()
            .unwrap()
    }

    #[track_caller]
    fn refuses(&self, profiles: &str, words: &[&str]) {
        let moved = self.folder.path().join("moved.su2");
        if moved.exists() {
            fs::remove_file(&moved).unwrap();
        }
        let output = self.run(profiles);
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        for word in words {
            assert!(stderr(&output).contains(word), "\"{word}\" is not in: {}", stderr(&output));
        }
        assert!(!moved.exists());
    }

    /// Where the wing's vertices were, and where they are.
    fn moved(&self) -> Vec<(DVec3, DVec3)> {
        let before = self.mesh();
        let after = formats::read(&self.folder.path().join("moved.su2")).unwrap().mesh;
        let is_wing =
            |family: usize| before.families[family].starts_with("wing") && before.families[family] != "wingtip";
        let all = before.triangles.iter().zip(&before.triangle_family);
        let mut vertices: Vec<u32> =
            all.filter(|(_, family)| is_wing(family.index())).flat_map(|(triangle, _)| *triangle).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.iter().map(|&v| (before.vertices[v as usize], after.vertices[v as usize])).collect()
    }
}

fn data(mesh: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/shape").join(mesh)
}

/// Half the thickness of a NACA 00xx of thickness 0.12 (Abbott and von Doenhoff), closed or with a
/// base.
fn half_thickness(x: f64, base: f64) -> f64 {
    let open =
        |x: f64| 0.6 * (0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4));
    open(x) + x * (base / 2.0 - if base == 0.0 { open(1.0) } else { 0.0 })
}

/// The airfoil in a plane y = const: from the lower side of the trailing edge round the leading
/// edge to the upper side.
fn airfoil(y: f64, base: f64, map: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
    let n = 160;
    let point = |i: i32| {
        let x = 0.5 * (1.0 - (std::f64::consts::PI * f64::from(i) / f64::from(n)).cos());
        map(DVec3::new(x, y, f64::from(i.signum()) * half_thickness(x, base)))
    };
    (-n..=n).map(point).collect()
}

fn same(at: DVec3) -> DVec3 {
    at
}

/// A section that is thicker by this factor.
fn thicker(y: f64, factor: f64) -> Vec<DVec3> {
    airfoil(y, 0.0, |at| DVec3::new(at.x, at.y, factor * at.z))
}

/// Wings of chord 1 that gmsh meshed from the airfoil's formula, with the leading edge on the y
/// axis, are measured so. An airfoil file placed by the printed values moves nothing.
#[test]
fn cut_prints_where_an_airfoil_goes() {
    for (mesh, base) in [("dent.msh.gz", 0.0), ("blunt6.msh.gz", 0.02)] {
        let wing = Wing::new(mesh);
        let path = data(mesh);
        let cut = |more: &[&str]| {
            let arguments =
                [&["cut", path.to_str().unwrap(), "--family", "wing", "--at", "y=0.5,y=1.5", "--out", "old.csv"], more];
            let output = command(wing.folder.path(), &arguments.concat()).output().unwrap();
            assert_good(&output);
            String::from_utf8(output.stdout).unwrap()
        };
        let sections: serde_json::Value = serde_json::from_str(&cut(&["--json", "-"])).unwrap();
        let table = cut(&[]);
        let mut placements = String::new();
        for (number, y) in [0.5, 1.5].into_iter().enumerate() {
            let section = &sections["sections"][number];
            let near = |key: &str, expected: f64, tolerance: f64| {
                let found = section[key].as_f64().unwrap();
                assert!((found - expected).abs() <= tolerance, "{mesh}: {key} is {found}, not {expected}");
            };
            near("number", number as f64, 0.0);
            near("at", y, 0.0);
            near("chord", 1.0, 2e-3);
            near("twist", 0.0, 0.1);
            near("thickness", 0.12, 2e-3 + 0.4 * base);
            near("trailing_edge", base, 1e-3);
            assert_eq!(section["plane"], "y");
            let position: Vec<f64> =
                section["position"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
            assert!(DVec3::from_slice(&position).distance(DVec3::new(0.0, y, 0.0)) < 2e-3, "{position:?}");
            let line = table.lines().nth(number + 1).unwrap();
            let cells: Vec<&str> = line.split_whitespace().collect();
            assert_eq!(cells[1], format!("y={y}"), "{line}");
            let [x, y, z, chord, twist] = [2, 3, 4, 5, 6].map(|cell| cells[cell]);
            placements += &format!(
                "[[profiles.wing.placement.\"naca.dat\"]]\nposition = [{x}, {y}, {z}]\nchord = {chord}\ntwist = {twist}\n"
            );
        }
        let points = airfoil(0.0, base, same);
        let run = |thicker: f64| {
            let rows: String = points.iter().map(|point| format!("{} {}\n", point.x, thicker * point.z)).collect();
            fs::write(wing.folder.path().join("naca.dat"), format!("NACA 0012\n{rows}")).unwrap();
            assert_good(&wing.run(&format!("[profiles.wing]\nnew = \"naca.dat\"\n{placements}")));
            wing.moved()
        };
        let worst = run(1.0).iter().map(|(from, to)| from.distance(*to)).fold(0.0, f64::max);
        assert!(worst < 5e-3, "{mesh}: {worst:e}");
        // A thicker airfoil moves the wing at both places.
        let thicker = run(1.2);
        for y in [0.5, 1.5] {
            let beside = thicker.iter().filter(|(from, _)| (from.y - y).abs() < 0.2);
            let most = beside.map(|(from, to)| from.distance(*to)).fold(0.0, f64::max);
            assert!((most - 0.012).abs() < 4e-3, "{mesh} {y}: {most}");
        }
    }
}

const NEW: &str = "[profiles.wing]\nnew = \"new.csv\"\n";

/// Flat cuts through the facets lie 0.8 % of the chord below the airfoil; the vertices stand on it.
///
/// Fails if, of `carry`, `FLAT` is 1e-3 or `LOST` 0.005, or, of `matching`, `STRAIGHT_TURNS` 0,
/// `STRAIGHT` 1e-5 or `CROWDED` 1.
#[test]
fn a_wings_own_airfoil_moves_nothing() {
    for (mesh, base) in [("dent.msh.gz", 0.0), ("blunt6.msh.gz", 0.02)] {
        for planes in [[0.5, 1.5], [0.41, 1.6]] {
            let wing = Wing::new(mesh);
            wing.sections("new.csv", &planes.map(|y| airfoil(y, base, same)));
            assert_good(&wing.run(NEW));
            let mut ways: Vec<f64> = wing.moved().iter().map(|(from, to)| from.distance(*to)).collect();
            ways.sort_by(f64::total_cmp);
            let (median, worst) = (ways[ways.len() / 2], ways[ways.len() - 1]);
            assert!(worst < 3e-3 && median < 2e-4, "{mesh} {planes:?}: {worst:e} {median:e}");
        }
    }
}

/// A flat slice of another program, turned and given as the new sections: the turn reaches every
/// vertex.
#[test]
fn a_flat_slice_given_alone_is_compared_with_the_flat_cut() {
    let wing = Wing::new("dent.msh.gz");
    let mesh = wing.mesh();
    let family = mesh.family("wing").unwrap();
    let own = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &of)| of == family);
    let triangles: Vec<[u32; 3]> = own.map(|(&triangle, _)| triangle).collect();
    let (sin, cos) = 0.05f64.sin_cos();
    let turned =
        |at: DVec3| DVec3::new(0.25 + (at.x - 0.25) * cos + at.z * sin, at.y, at.z * cos - (at.x - 0.25) * sin);
    let section = |y: f64| {
        let plane = Plane { point: DVec3::Y * y, normal: DVec3::Y };
        cut::cut(&mesh.vertices, &triangles, &plane).unwrap().into_iter().map(turned).collect::<Vec<_>>()
    };
    wing.sections("new.csv", &[section(0.5), section(1.5)]);
    assert_good(&wing.run(NEW));
    let worst = wing.moved().iter().map(|&(from, to)| turned(from).distance(to)).fold(0.0, f64::max);
    assert!(worst < 1e-10, "{worst:e}");
    let report = fs::read_to_string(wing.folder.path().join("report.json")).unwrap();
    assert!(report.contains("\"compared_with_flat_cuts\": true"), "{report}");
}

/// Thickness over the original one, of the vertices between two stations along the span.
fn thickness(wing: &Wing, from: f64, to: f64) -> Vec<f64> {
    let there = |(at, _): &(DVec3, DVec3)| (from..=to).contains(&at.y) && at.z.abs() > 0.03;
    wing.moved().into_iter().filter(there).map(|(from, to)| to.z / from.z).collect()
}

#[track_caller]
fn assert_thickness(wing: &Wing, from: f64, to: f64, low: f64, high: f64) {
    let found = thickness(wing, from, to);
    assert!(found.len() > 3);
    assert!(found.iter().all(|t| (low..=high).contains(t)), "{from}..{to}: {found:?}");
}

/// One section of several is 30 % thicker. The trend is the straight line of least squares, and
/// what the outermost section differs from it is held: with three sections nothing is left at the
/// ends, with five 0.03 / 2 of the thickness.
///
/// Fails if `OVERSHOOT` is 1, and if `STEPS` of `locate` is 8.
#[test]
fn a_change_inside_stays_inside() {
    let wing = Wing::new("half4.su2.gz");
    let table = "[profiles.wing]\nnew = \"new.csv\"\nold = \"old.csv\"\n";
    let three = [0.5, 1.0, 1.5];
    wing.sections("old.csv", &three.map(|y| thicker(y, 1.0)));
    wing.sections("new.csv", &three.map(|y| thicker(y, if y == 1.0 { 1.3 } else { 1.0 })));
    assert_good(&wing.run(table));
    assert_thickness(&wing, 0.0, 0.5, 0.999, 1.001);
    assert_thickness(&wing, 1.5, 2.0, 0.999, 1.001);
    assert_thickness(&wing, 0.98, 1.02, 1.28, 1.301);

    let five = [0.2, 0.6, 1.0, 1.4, 1.8];
    wing.sections("old.csv", &five.map(|y| thicker(y, 1.0)));
    wing.sections("new.csv", &five.map(|y| thicker(y, if y == 0.6 { 1.3 } else { 1.0 })));
    assert_good(&wing.run(table));
    // The line's slope is -0.03 a section: 0.015 more half a section further out, at the root, and
    // as much less at the tip.
    assert_thickness(&wing, 0.0, 0.0, 1.0, 1.02);
    assert_thickness(&wing, 2.0, 2.0, 0.98, 1.0);
    // Beside the section the change overshoots by a tenth at most.
    assert_thickness(&wing, 1.0, 1.8, 0.97, 1.001);
    // A parabola through three sections of which the last one changes overshoots by an eighth of
    // 0.3.
    let last = [0.2, 1.0, 1.8];
    wing.sections("old.csv", &last.map(|y| thicker(y, 1.0)));
    wing.sections("new.csv", &last.map(|y| thicker(y, if y == 1.8 { 1.3 } else { 1.0 })));
    assert_good(&wing.run(table));
    assert_thickness(&wing, 0.2, 1.0, 0.9695, 1.001);
}

/// A twist linear over the sections goes on to the ends.
#[test]
fn a_linear_twist_stays_linear() {
    let wing = Wing::new("half4.su2.gz");
    let twisted = |at: DVec3| {
        let (sin, cos) = (0.1 * at.y).sin_cos();
        DVec3::new(0.25 + (at.x - 0.25) * cos + at.z * sin, at.y, at.z * cos - (at.x - 0.25) * sin)
    };
    let five = [0.2, 0.6, 1.0, 1.4, 1.8];
    wing.sections("old.csv", &five.map(|y| thicker(y, 1.0)));
    wing.sections("new.csv", &five.map(|y| airfoil(y, 0.0, twisted)));
    assert_good(&wing.run("[profiles.wing]\nnew = \"new.csv\"\nold = \"old.csv\"\n"));
    // 2 % of the largest displacement, 0.15 at the trailing edge's tip.
    let worst = wing.moved().iter().map(|&(from, to)| twisted(from).distance(to)).fold(0.0, f64::max);
    assert!(worst < 3e-3, "{worst:e}");
}

/// A full-span wing in one family, from y = -2 to 2, with sections on its right half.
///
/// Fails if `REACH` of the wing is 5, `SLACK` 0, or `ON_MIRROR` 1e-3.
#[test]
fn the_other_half_is_a_mirror_image_where_the_case_says_so() {
    let wing = Wing::new("full6.msh.gz");
    wing.sections("old.csv", &[0.5, 1.5].map(|y| thicker(y, 1.0)));
    wing.sections(
        "new.csv",
        &[0.5, 1.5].map(|y| airfoil(y, 0.0, |at| DVec3::new(at.x, at.y, 1.2 * at.z + 0.05 * at.y))),
    );
    let table = "[profiles.wing]\nnew = \"new.csv\"\nold = \"old.csv\"\n";
    wing.refuses(table, &["reaches 2.50 of the span that its profiles cover beyond the first", "mirror = \"y\""]);
    assert_good(&wing.run(&format!("{table}mirror = \"y\"\n")));
    for (from, to) in wing.moved() {
        let expected = DVec3::new(from.x, from.y, 1.2 * from.z + 0.05 * from.y.abs());
        assert!(to.distance(expected) < 1e-10, "{from}: {to} {expected}");
    }
    wing.refuses(&format!("{table}mirror = \"y=1.0\"\n"), &["across the mirror plane"]);
    // Mirrored at this plane the other half stands some percent of the chord above its place.
    let tilted = "mirror = { point = [0, 0, 0], normal = [0, 1, 0.05] }\n";
    wing.refuses(&format!("{table}{tilted}"), &["off the profile's mirror image"]);
}

/// One wing in an upper and a lower family, whose tables name the same files, or that one table
/// names.
#[test]
fn families_of_one_wing_move_as_one() {
    let wing = Wing::new("split6.msh.gz");
    wing.sections("new.csv", &[0.5, 1.5].map(|y| thicker(y, 1.1)));
    assert_good(&wing.run("[profiles.wing_upper]\nnew = \"new.csv\"\n[profiles.wing_lower]\nnew = \"new.csv\"\n"));
    let two = wing.moved();
    for (from, to) in &two {
        assert!((to.z - 1.1 * from.z).abs() < 2e-3 && (to.x - from.x).abs() < 2e-3, "{from} {to}");
    }
    assert_good(&wing.run("[profiles.any]\nfamilies = [\"wing_*\"]\nnew = \"new.csv\"\n"));
    assert!(wing.moved() == two);
    wing.refuses("[profiles.wing_upper]\nnew = \"new.csv\"\n", &["family `wing_lower` is a wing"]);
    let doubled =
        "[profiles.any]\nfamilies = [\"wing_*\"]\nnew = \"new.csv\"\n[profiles.wing_upper]\nnew = \"old.csv\"\n";
    wing.sections("old.csv", &[0.5, 1.5].map(|y| thicker(y, 1.0)));
    wing.refuses(doubled, &["family `wing_upper` is in [profiles.any] and in [profiles.wing_upper]"]);
}

/// Sections that cannot be meant are refused before anything moves, with what is wrong.
///
/// Fails if `SLACK` of the wing is 0.2.
#[test]
fn sections_that_are_not_the_wings_are_refused() {
    let wing = Wing::new("half4.su2.gz");
    let both = "[profiles.wing]\nnew = \"new.csv\"\nold = \"old.csv\"\n";
    let planes = [0.5, 1.5];
    let good = planes.map(|y| thicker(y, 1.0));
    let of = |map: &dyn Fn(DVec3) -> DVec3| planes.map(|y| airfoil(y, 0.0, map));

    wing.sections("old.csv", &good);
    wing.sections("new.csv", &of(&|at| at + 0.25 * DVec3::X));
    assert_good(&wing.run(both));
    // The wing ends at 2: beyond the last section it reaches 0.58 of what the sections cover.
    wing.sections("old.csv", &[0.5, 1.45].map(|y| thicker(y, 1.0)));
    wing.refuses(both, &["of the span that its profiles cover", "0.58 beyond the last"]);
    wing.sections("old.csv", &of(&|at| at + 0.25 * DVec3::X));
    wing.refuses(both, &["profile 0", "24.8 % of the chord"]);
    wing.sections("old.csv", &of(&|at| at / 1000.0));
    wing.sections("new.csv", &of(&|at| at / 1000.0));
    wing.refuses(both, &["times smaller than the wing", "another unit of length"]);

    wing.sections("old.csv", &good);
    wing.sections("new.csv", &of(&|at| DVec3::new(1000.0 * at.x, at.y, 1000.0 * at.z)));
    wing.refuses(both, &["1000 times larger than the old one: another unit of length?"]);
    wing.sections("new.csv", &of(&|at| at + 20.0 * DVec3::Z));
    wing.refuses(both, &["lies 20.0000 away from the old one"]);
    wing.sections("new.csv", &[good[1].clone(), good[0].clone()]);
    wing.refuses(both, &["the other way round along the span"]);
    let mut sorted = good.clone();
    sorted.iter_mut().for_each(|points| points.sort_by(|a, b| a.x.total_cmp(&b.x)));
    wing.sections("new.csv", &sorted);
    wing.refuses(both, &["not in order along the curve"]);
    wing.sections("new.csv", &good.clone().map(|points| points[160..].to_vec()));
    wing.refuses(both, &["short of the trailing edge"]);

    let twice = good.clone().map(|points| points.iter().chain(&points[1..]).copied().collect());
    wing.sections("new.csv", &twice);
    wing.refuses(both, &["not in order along the curve"]);
    wing.sections("new.csv", &of(&|at| DVec3::new(at.x, at.z, at.y)));
    wing.refuses(both, &["stands across the old one's"]);
    let few = "profile,x,y,z\n0,1,0.5,0\n0,0,0.5,0\n1,1,1.5,0\n1,0,1.5,0\n";
    fs::write(wing.folder.path().join("new.csv"), few).unwrap();
    wing.refuses(both, &["2 different points"]);
    // Outboard of the tip stands the section of another wing: the loft to it leaves this one.
    wing.sections("old.csv", &[good[0].clone(), airfoil(2.2, 0.0, |at| at + 0.3 * DVec3::X)]);
    wing.sections("new.csv", &[good[0].clone(), thicker(2.2, 1.0)]);
    wing.refuses(both, &["profile 1", "of the chord, expected the section of this wing"]);
    wing.sections("old.csv", &[good[0].clone(), thicker(2.2, 1.0)]);
    let output = wing.run(both);
    assert_good(&output);
    assert!(
        stderr(&output).contains("the planes of the profiles [1] cross no edge of the wing"),
        "{}",
        stderr(&output)
    );

    let blunt = Wing::new("blunt6.msh.gz");
    blunt.sections("new.csv", &good);
    blunt.refuses(NEW, &["a blunt trailing edge cannot become sharp"]);
}
