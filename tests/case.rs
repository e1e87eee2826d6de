//! The case file: what a good one means, and that every mistake is reported at its line with what
//! was expected.

#[path = "case/placements.rs"]
mod placements;
#[path = "case/slips.rs"]
mod slips;

use std::path::{Path, PathBuf};

use glam::DVec3;
use idmesh::case::{Case, CaseError, Position};
use idmesh::families::TipStart;
use idmesh::families::{Junction, RigidMotion, Role};
use idmesh::profile::files::SpanAxis;
use idmesh::relaxation::Method;
use idmesh::smoothing::QualityTarget;

const GOOD: &str = r#"mesh = "wing-body.msh"

[profiles.wing]
new = "new.csv"
old = ["a.csv", "b.csv"]

[family.wing]
role = "wing"
[family.trailing_edge]
role = "trailing-edge"
[family.wingtip]
role = "wingtip"
coefficient = 0.25
start = "original"
[family.carenage]
role = "carenage"
[family.symmetry]
role = "plane"
[family.farfield]
role = "fixed"
[family.flap]
role = "prescribed"
displacement = "flap.csv"

[volume]
springs = "murayama"

[quality]
target = "off"

[solver]
method = "chebyshev"
tolerance = 1e-6
max_sweeps = 500

[output]
mesh = ["out/moved.msh", "moved.vtu"]
histogram = "beta.svg"
report = "out/report.html"
"#;

fn parse(text: &str) -> Result<Case, CaseError> {
    Case::parse(text, Path::new("cases/a.toml"))
}

/// The message of the error that `text` gives, without its location, and the location.
fn mistake(text: &str) -> (Position, String) {
    match parse(text).unwrap_err() {
        CaseError::Invalid { position, message, path } => {
            assert_eq!(path, Path::new("cases/a.toml"));
            (position, message)
        }
        other => panic!("not a mistake in the file: {other}"),
    }
}

/// Replaces `from`, which must be in the good case, and checks where and what is reported.
#[track_caller]
fn assert_mistake(from: &str, to: &str, line: usize, column: usize, message: &str) {
    assert!(GOOD.contains(from), "{from} is not in the good case");
    let (position, found) = mistake(&GOOD.replacen(from, to, 1));
    assert_eq!(found, message);
    assert_eq!((position.line, position.column), (line, column), "{found}");
}

#[test]
fn good_case_is_read_whole() {
    let case = parse(GOOD).unwrap();
    let here = Path::new("cases");
    assert_eq!(case.mesh, here.join("wing-body.msh"));
    assert_eq!(case.profiles["wing"].new, [here.join("new.csv")]);
    assert_eq!(case.profiles["wing"].old, Some(vec![here.join("a.csv"), here.join("b.csv")]));
    let role = |name: &str| case.families[name].role.clone();
    assert_eq!(case.families.len(), 7);
    assert_eq!(role("wing"), Role::Wing);
    assert_eq!(role("trailing_edge"), Role::TrailingEdge);
    assert_eq!(role("wingtip"), Role::Wingtip { coefficient: 0.25, start: TipStart::Original });
    assert_eq!(role("carenage"), Role::Carenage);
    assert_eq!(role("symmetry"), Role::Plane { flat: None, partner: None });
    assert_eq!(role("farfield"), Role::Fixed);
    assert_eq!(role("flap"), Role::Prescribed);
    assert_eq!(case.families["flap"].displacement, Some(here.join("flap.csv")));
    assert_eq!(case.settings.springs.name, "murayama");
    assert_eq!(
        (case.settings.method, case.settings.stopping.tolerance, case.settings.stopping.max_sweeps),
        (Method::Chebyshev, 1e-6, 500)
    );
    assert_eq!(case.output.mesh, [here.join("out/moved.msh"), here.join("moved.vtu")]);
    assert_eq!(case.output.histogram, Some(here.join("beta.svg")));
    assert_eq!(case.output.report, Some(here.join("out/report.html")));
}

#[test]
fn defaults() {
    let case = parse("mesh = \"wing.msh.gz\"\n[family.tip]\nrole = \"wingtip\"").unwrap();
    assert_eq!(case.families["tip"].role, Role::Wingtip { coefficient: 0.5, start: TipStart::Affine });
    let part = |more: &str| parse(&format!("mesh = \"a.msh\"\n[family.p]\nrole = \"attached\"\n{more}")).unwrap();
    for (more, junction) in
        [("", Junction::Glued), ("junction = \"glued\"", Junction::Glued), ("junction = \"slide\"", Junction::Slide)]
    {
        let role = Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction };
        assert_eq!(part(more).families["p"].role, role);
        let body = parse(&format!("mesh = \"a.msh\"\n[family.p]\nrole = \"rigid\"\n{more}")).unwrap();
        assert_eq!(body.families["p"].role, Role::Rigid { motion: RigidMotion::Root, junction });
    }
    assert_eq!(case.settings.springs.name, "rotation-aware-wall");
    assert_eq!(case.settings.quality, Some(QualityTarget::Original));
    assert_eq!(
        (case.settings.method, case.settings.stopping.tolerance, case.settings.stopping.max_sweeps),
        (Method::Auto, 1e-4, 200_000)
    );
    assert_eq!(case.output.mesh, [Path::new("cases/moved.msh.gz")]);
    assert_eq!(case.output.histogram, None);
    assert_eq!(case.output.report, None);
    let moved = |mesh: &str| parse(&format!("mesh = \"{mesh}\"")).unwrap().output.mesh;
    assert_eq!(moved("v1.2/wing.su2"), [Path::new("cases/moved.su2")]);
    assert_eq!(moved("wing.v22.msh"), [Path::new("cases/moved.msh")]);
    // An extension of several parts selects the format.
    assert_eq!(moved("wing.lb8.ugrid"), [Path::new("cases/moved.lb8.ugrid")]);
    assert_eq!(moved("a.b/wing.LR4.ugrid.gz"), [Path::new("cases/moved.LR4.ugrid.gz")]);
    assert_eq!(moved("lb8.ugrid"), [Path::new("cases/moved.ugrid")]);
}

#[test]
fn absolute_paths_stay() {
    assert_eq!(parse("mesh = \"/data/wing.msh\"").unwrap().mesh, Path::new("/data/wing.msh"));
}

#[test]
fn coefficient_ends_belong_to_the_range() {
    for (text, value) in [("0", 0.0), ("1", 1.0), ("1.0", 1.0)] {
        let case = parse(&GOOD.replace("0.25", text)).unwrap();
        assert_eq!(case.families["wingtip"].role, Role::Wingtip { coefficient: value, start: TipStart::Original });
    }
}

#[test]
fn errors_name_file_line_and_column() {
    let error = parse(&GOOD.replace("tolerance", "tolerence")).unwrap_err();
    assert_eq!(error.to_string(), "cases/a.toml:33:1: unknown key `tolerence` in [solver]; did you mean `tolerance`?");
}

#[test]
fn unknown_keys() {
    let top = "unknown key `meshes` at the top; did you mean `mesh`?";
    assert_mistake("mesh = ", "meshes = ", 1, 1, top);
    let far = "unknown key `colour` in [solver], expected `method`, `tolerance` or `max_sweeps`";
    assert_mistake("method = ", "colour = ", 32, 1, far);
    assert_mistake(
        "role = \"plane\"",
        "rol = \"plane\"",
        18,
        1,
        "unknown key `rol` in [family.symmetry]; did you mean `role`?",
    );
    assert_mistake("[volume]", "[volumes]", 25, 2, "unknown key `volumes` at the top; did you mean `volume`?");
}

#[test]
fn syntax_errors_have_a_line() {
    let (position, message) = mistake(&GOOD.replace("tolerance = 1e-6", "tolerance = "));
    assert_eq!(position.line, 33, "{message}");
    let (position, message) = mistake(&GOOD.replace("[quality]", "[quality"));
    assert_eq!(position.line, 28, "{message}");
    let (position, message) = mistake(&GOOD.replace("[family.farfield]", "[family.wing]"));
    assert_eq!(position.line, 19, "{message}");
    assert!(message.contains("duplicate"), "{message}");
    assert!(!message.contains('\n'), "{message:?}");
}

#[test]
fn columns_count_characters() {
    let (position, _) = mistake("\"é\" = 1\nmesh = \"m\"");
    assert_eq!((position.line, position.column), (1, 1));
    let (position, _) = mistake("mesh = \"m\"\nfamily = { é\u{e9} = 1 }");
    assert_eq!(position.line, 2);
}

#[test]
fn missing_keys() {
    let mesh = "missing key `mesh`, expected the mesh to move, such as mesh = \"wing-body.msh\"";
    assert_mistake("mesh = \"wing-body.msh\"", "", 1, 1, mesh);
    let role = "missing key `role` in [family.symmetry], expected one of `wing`, `trailing-edge`, `wingtip`, `attached`, \
                `rigid`, `carenage`, `plane`, `fixed`, `prescribed` or `interior`";
    assert_mistake("role = \"plane\"", "", 17, 9, role);
    let new = "missing key `new` in [profiles.wing], expected a profile file, a list of them, or a pattern such as \
               \"new/*.dat\"";
    assert_mistake("new = \"new.csv\"", "", 3, 11, new);
    let displacement = "missing key `displacement` in [family.flap], expected a CSV file with rows x,y,z,dx,dy,dz";
    assert_mistake("displacement = \"flap.csv\"", "", 21, 9, displacement);
}

#[test]
fn wrong_types() {
    assert_mistake("\"wing-body.msh\"", "3", 1, 8, "`mesh` is a number, expected a string");
    assert_mistake("\"wing-body.msh\"", "\"\"", 1, 8, "`mesh` is empty, expected a name");
    assert_mistake("1e-6", "\"1e-6\"", 33, 13, "`solver.tolerance` is a string, expected a number");
    assert_mistake(
        "\"new.csv\"",
        "true",
        4,
        7,
        "`profiles.wing.new` is true or false, expected a string or a list of strings",
    );
    assert_mistake("\"new.csv\"", "[]", 4, 7, "`profiles.wing.new` is an empty list, expected at least one file");
    assert_mistake("\"b.csv\"", "7", 5, 17, "`profiles.wing.old` is a number, expected a string");
    assert_mistake("500", "0", 34, 14, "`solver.max_sweeps` is 0, expected a whole number from 1 on");
    assert_mistake("500", "5.5", 34, 14, "`solver.max_sweeps` is a number, expected a whole number from 1 on");
    let (position, message) = mistake("mesh = \"m\"\nfamily = 3");
    assert_eq!((position.line, message.as_str()), (2, "`family` is a number, expected a table"));
    let (position, message) = mistake("mesh = \"m\"\n[family]\nwing = \"wing\"");
    assert_eq!((position.line, message.as_str()), (3, "`family.wing` is a string, expected a table"));
}

#[test]
fn unknown_names() {
    let role = "`family.trailing_edge.role` is \"trailing_edge\", expected `wing`, `trailing-edge`, `wingtip`, `attached`, \
                `rigid`, `carenage`, `plane`, `fixed`, `prescribed` or `interior`; did you mean `trailing-edge`?";
    assert_mistake("\"trailing-edge\"", "\"trailing_edge\"", 10, 8, role);
    assert_mistake(
        "start = \"original\"",
        "start = \"here\"",
        14,
        9,
        "`family.wingtip.start` is \"here\", expected `affine`, `rigid` or `original`",
    );
    let springs = "`volume.springs` is \"murayamma\", expected `longitudinal`, `torsional`, \
                   `torsional-wall`, `murayama`, `rotation-aware` or `rotation-aware-wall`; did you mean `murayama`?";
    assert_mistake("\"murayama\"", "\"murayamma\"", 26, 11, springs);
    let method = "`solver.method` is \"cg\", expected `auto`, `jacobi`, `chebyshev` or `multigrid`";
    assert_mistake("\"chebyshev\"", "\"cg\"", 32, 10, method);
}

#[test]
fn numbers_out_of_range() {
    for text in ["-0.1", "1.5", "nan", "inf"] {
        let (position, message) = mistake(&GOOD.replace("0.25", text));
        assert_eq!((position.line, position.column), (13, 15));
        let shown: f64 = text.parse().unwrap();
        assert_eq!(message, format!("`coefficient` is {shown}, expected 0 (rigid) to 1 (freely deformable)"));
    }
    for text in ["0", "-1e-4", "nan", "inf"] {
        let (position, message) = mistake(&GOOD.replace("1e-6", text));
        assert_eq!(position.line, 33);
        assert!(message.ends_with("expected a number above 0, such as 1e-4"), "{message}");
    }
}

#[test]
fn quality_has_three_targets() {
    let target = |word: &str| parse(&GOOD.replace("\"off\"", word)).unwrap().settings.quality;
    assert_eq!(target("\"off\""), None);
    assert_eq!(target("\"original\""), Some(QualityTarget::Original));
    assert_eq!(target("\"improve\""), Some(QualityTarget::Improve));
    let message = "`quality.target` is \"best\", expected `original`, `improve` or `off`";
    assert_mistake("\"off\"", "\"best\"", 29, 10, message);
}

#[test]
fn every_method_has_a_name() {
    let method =
        |name: &str| parse(&format!("mesh = \"wing.msh\"\n[solver]\nmethod = \"{name}\"")).unwrap().settings.method;
    for method_of_name in [Method::Auto, Method::Jacobi, Method::Chebyshev, Method::Multigrid] {
        assert_eq!(method(method_of_name.name()), method_of_name);
    }
}

#[test]
fn keys_must_fit_the_role() {
    let fit = |key: &str, role: &str, owner: &str| {
        format!("`{key}` does not fit role \"{role}\", expected only in a family whose role is \"{owner}\"")
    };
    assert_mistake(
        "role = \"plane\"",
        "role = \"plane\"\ncoefficient = 0.5",
        19,
        1,
        &fit("coefficient", "plane", "wingtip\" or \"attached"),
    );
    assert_mistake(
        "role = \"fixed\"",
        "role = \"fixed\"\nstart = \"rigid\"",
        21,
        1,
        &fit("start", "fixed", "wingtip\" or \"attached"),
    );
    assert_mistake(
        "role = \"wing\"\n",
        "role = \"wing\"\ndisplacement = \"d.csv\"\n",
        9,
        1,
        &fit("displacement", "wing", "prescribed"),
    );
    assert_mistake(
        "role = \"wing\"\n",
        "role = \"wing\"\njunction = \"slide\"\n",
        9,
        1,
        &fit("junction", "wing", "attached\" or \"rigid"),
    );
}

/// Fails if `MOST_FLAT` is 0.001 or 1.
#[test]
fn planes_may_be_not_quite_flat() {
    let with = |text: &str| GOOD.replace("role = \"plane\"", &format!("role = \"plane\"\n{text}"));
    assert_eq!(
        parse(&with("flat = 1e-3")).unwrap().families["symmetry"].role,
        Role::Plane { flat: Some(1e-3), partner: None }
    );
    assert_eq!(
        parse(&with("flat = 0.1")).unwrap().families["symmetry"].role,
        Role::Plane { flat: Some(0.1), partner: None }
    );
    for bad in ["0.0", "-0.001", "0.11", "nan"] {
        let (position, message) = mistake(&with(&format!("flat = {bad}")));
        assert_eq!((position.line, position.column), (19, 8));
        assert!(message.contains("expected a fraction of the family's size, above 0 and up to 0.1"), "{message}");
    }
    let fit = "`flat` does not fit role \"fixed\", expected only in a family whose role is \"plane\"";
    assert_mistake("role = \"fixed\"", "role = \"fixed\"\nflat = 1e-3", 21, 1, fit);
}

/// English and French names of a role are one role, under which errors name it.
#[test]
fn a_fuselage_is_a_carenage() {
    for name in ["carenage", "fuselage", "fairing"] {
        let text = GOOD.replace("role = \"fixed\"", &format!("role = \"{name}\""));
        let case = parse(&text).unwrap();
        assert_eq!(case.families["farfield"].role, Role::Carenage, "{name}");
        let fit = "`flat` does not fit role \"carenage\", expected only in a family whose role is \"plane\"";
        let flat = format!("role = \"{name}\"\nflat = 1e-3");
        assert_mistake("role = \"fixed\"", &flat, 21, 1, fit);
    }
}

/// `symmetry` stands on line 17; two more planes follow at the end.
#[test]
fn planes_have_partners() {
    let with = |symmetry: &str, left: &str, right: &str| {
        let planes =
            format!("[family.left]\nrole = \"plane\"\n{left}\n[family.right]\nrole = \"plane\"\n{right}\n[output]");
        GOOD.replace("role = \"plane\"", &format!("role = \"plane\"\n{symmetry}")).replace("[output]", &planes)
    };
    let partner = |case: &Case, name: &str| match &case.families[name].role {
        Role::Plane { partner, .. } => partner.clone(),
        _ => None,
    };
    let named = "partner = \"right\"";
    let case = parse(&with("", named, "")).unwrap();
    assert_eq!((partner(&case, "left").as_deref(), partner(&case, "right")), (Some("right"), None));
    let case = parse(&with("", named, "partner = \"left\"")).unwrap();
    assert_eq!(partner(&case, "right").as_deref(), Some("left"));
    for (symmetry, left, right, line, expected) in [
        ("partner = \"symmetry\"", "", "", 19, "`symmetry` is given as its own partner, expected another family"),
        ("partner = \"wing\"", "", "", 19, "`partner` is \"wing\", whose role is \"wing\", expected another family"),
        ("partner = \"rihgt\"", "", "", 19, "there is no table [family.rihgt]; did you mean `right`?"),
        ("partner = 3", "", "", 19, "`family.symmetry.partner` is a number, expected a string"),
        (named, named, "", 19, "but `left` is given the partner `right` (line "),
        ("", named, "partner = \"symmetry\"", 0, "but `right` is given the partner `symmetry` (line "),
        ("partner = \"left\"", named, "", 19, "but `left` is given the partner `right` (line "),
    ] {
        let (position, message) = mistake(&with(symmetry, left, right));
        assert!(message.contains(expected), "{message}");
        assert!(line == 0 || position.line == line, "{position:?}: {message}");
    }
    let fit = "`partner` does not fit role \"fixed\", expected only in a family whose role is \"plane\"";
    assert_mistake("role = \"fixed\"", "role = \"fixed\"\npartner = \"wing\"", 21, 1, fit);
}

#[test]
fn profiles_and_wings_belong_together() {
    let absent = "profiles are given for family `wings`, but there is no table [family.wings]; did you mean `wing`?";
    assert_mistake("[profiles.wing]", "[profiles.wings]", 3, 11, absent);
    let other =
        "profiles are given for family `symmetry`, whose role is \"plane\", expected a family whose role is \"wing\"";
    assert_mistake("[profiles.wing]", "[profiles.symmetry]", 3, 11, other);
    let lonely = "family `symmetry` is a wing, but there is no table [profiles.symmetry], expected one with its new profiles, or \
         one of several families that names it: families = [\"symmetry\", ...]";
    assert_mistake("role = \"plane\"", "role = \"wing\"", 17, 9, lonely);
}

#[test]
fn outputs_are_checked() {
    let input = "the output \"wing-body.msh\" is the input mesh, expected another name";
    assert_mistake("\"out/moved.msh\"", "\"wing-body.msh\"", 37, 9, input);
    assert_mistake("\"out/moved.msh\"", "\"moved.vtu\"", 37, 22, "the output \"moved.vtu\" is listed twice");
    let svg = "`output.histogram` is \"beta.png\", expected a name ending in .svg";
    assert_mistake("\"beta.svg\"", "\"beta.png\"", 38, 13, svg);
    let html = "`output.report` is \"beta.json\", expected a name ending in .html";
    assert_mistake("\"out/report.html\"", "\"beta.json\"", 39, 10, html);
}

#[test]
fn families_must_agree_with_the_mesh() {
    let case = parse(GOOD).unwrap();
    let names = |list: &[&str]| list.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    let all = ["wing", "trailing_edge", "wingtip", "carenage", "symmetry", "farfield", "flap"];
    case.for_families(&names(&all)).unwrap();

    let mesh = names(&["wing", "trailing_edge", "wingtip", "carenage", "symetry", "farfield", "flap", "pylon"]);
    let error = case.for_families(&mesh).unwrap_err();
    assert!(matches!(error, CaseError::Families { .. }));
    assert_eq!(
        error.to_string(),
        "cases/a.toml: the families of the case and of the mesh differ: no [family] table for `symetry`, `pylon`; \
         no family in the mesh for the table of `symmetry` (line 17; did you mean `symetry`?); the mesh has `wing`, \
         `trailing_edge`, `wingtip`, `carenage`, `symetry`, `farfield`, `flap`, `pylon`; the case has `carenage`, \
         `farfield`, `flap`, `symmetry`, `trailing_edge`, `wing`, `wingtip`"
    );
    let error = case.for_families(&[]).unwrap_err().to_string();
    assert!(error.contains("the mesh has none"), "{error}");
}

#[test]
fn patterns_expand_sorted() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("new")).unwrap();
    for name in ["b.dat", "a.dat", "c.txt", "a1.dat"] {
        std::fs::write(folder.path().join("new").join(name), "").unwrap();
    }
    let path = folder.path().join("case.toml");
    let files = |text: &str| {
        Case::parse(&GOOD.replace("\"new.csv\"", text), &path).map(|case| case.profiles["wing"].new.clone())
    };
    let in_new =
        |names: &[&str]| names.iter().map(|name| folder.path().join("new").join(name)).collect::<Vec<PathBuf>>();
    assert_eq!(files("\"new/*.dat\"").unwrap(), in_new(&["a.dat", "a1.dat", "b.dat"]));
    assert_eq!(files("[\"new/c.txt\", \"new/?.dat\"]").unwrap(), in_new(&["c.txt", "a.dat", "b.dat"]));
    let none = files("\"new/*.csv\"").unwrap_err().to_string();
    assert!(none.contains(":4:7: pattern \"new/*.csv\" matches no file in"), "{none}");
    let folder_pattern = files("\"n*/a.dat\"").unwrap_err().to_string();
    assert!(folder_pattern.ends_with("`*` and `?` are understood in the file name only"), "{folder_pattern}");
    let no_folder = files("\"old/*.dat\"").unwrap_err().to_string();
    assert!(no_folder.contains(":4:7: pattern \"old/*.dat\": cannot list"), "{no_folder}");
}

#[test]
fn files_that_are_no_text_or_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("case.toml");
    assert!(matches!(Case::read(&path), Err(CaseError::Unreadable { .. })));
    std::fs::write(&path, b"mesh = \"m\"\n\xff\n").unwrap();
    let error = Case::read(&path).unwrap_err().to_string();
    assert!(error.ends_with("case.toml:2:1: not a text file, expected TOML in UTF-8"), "{error}");
}
