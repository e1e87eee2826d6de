//! A process held to so many bytes says what is lacking, instead of being ended by the system.

use std::fs;
use std::io::Write;
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

/// Runs the case on one thread with so many megabytes of addresses.
fn run_within(fixture: &Fixture, megabytes: usize) -> Output {
    let mut command = within(fixture, &["run", "case.toml", "--backend", "cpu"], 1000 * megabytes);
    command.env("RAYON_NUM_THREADS", "1").output().unwrap()
}

/// Threads take memory from one place, where addresses are limited: twenty of them need their
/// stacks and little more. With 64 MiB of addresses for each, the run would find none left.
///
/// Fails if `share_limited_addresses` does nothing.
#[test]
fn threads_set_no_addresses_aside() {
    let fixture = turned_wing();
    let mut run = within(&fixture, &["run", "case.toml", "--backend", "cpu"], 350_000);
    assert_good(&run.env("RAYON_NUM_THREADS", "20").output().unwrap());
}

/// A command with so many kilobytes of addresses.
fn within(fixture: &Fixture, arguments: &[&str], kilobytes: usize) -> Command {
    let run = command(fixture.folder.path(), arguments);
    let mut shell = Command::new("sh");
    shell.current_dir(fixture.folder.path()).arg("-c").arg(format!("ulimit -v {kilobytes}; exec \"$@\""));
    shell.arg("sh").arg(run.get_program()).args(run.get_args());
    shell
}

/// Whatever the limit, the result is good, or the memory is said not to suffice, and no result of
/// an earlier run is left. The limits are so close together that some are met anywhere: in threads,
/// in a reader, in the set-up, in an update.
#[test]
fn no_limit_of_addresses_ends_a_command_without_a_word() {
    let fixture = Fixture::new();
    let before = fixture.files();
    let mut counts = [0, 0];
    // With fewer addresses the system cannot start the program. A run takes some 20 MB more.
    let starts = |&kilobytes: &usize| within(&fixture, &["--version"], kilobytes).output().unwrap().status.success();
    let least = (16_000..200_000).step_by(1_000).find(starts).unwrap();
    for kilobytes in (least..least + 36_000).step_by(1_500).chain((60_000..260_000).step_by(8_643)) {
        for (threads, arguments) in [
            ("2", &["run", "case.toml", "--backend", "cpu"][..]),
            ("1", &["run", "case.toml", "--backend", "cpu"]),
            ("2", &["quality", "box.msh"]),
        ] {
            if arguments[0] == "run" {
                fixture.write("moved.msh", "an earlier result");
            }
            let output = within(&fixture, arguments, kilobytes).env("RAYON_NUM_THREADS", threads).output().unwrap();
            let errors = stderr(&output);
            match output.status.code() {
                Some(0) => counts[0] += 1,
                Some(3) => {
                    counts[1] += 1;
                    assert!(errors.contains("error: ") && errors.contains("memory"), "{kilobytes}: {errors}");
                    // Where the memory ends while a file is written, the next job removes it.
                    let files = fixture.files();
                    let left: Vec<&String> = files.iter().filter(|name| !name.starts_with(".idmesh-")).collect();
                    assert_eq!(left, before.iter().collect::<Vec<_>>(), "files were left behind");
                }
                code => panic!("{kilobytes}: {code:?}, {:?}: {errors}", output.status),
            }
            let _ = fs::remove_file(fixture.path("moved.msh"));
        }
    }
    assert!(counts.iter().all(|&count| count > 2), "{counts:?}");
}

/// A gzipped mesh with so many bytes of comments before it.
fn padded(fixture: &Fixture, bytes: usize) {
    assert_good(&fixture.idmesh(&["convert", "box.msh", "box.su2"]));
    let plain = "% nothing here\n".repeat(bytes / 15) + &fixture.read("box.su2");
    let file = fs::File::create(fixture.path("padded.su2.gz")).unwrap();
    let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::best());
    encoder.write_all(plain.as_bytes()).unwrap();
    encoder.finish().unwrap();
}

/// `--max-memory` lets a packed file unpack to more, and refuses what needs more.
#[test]
fn the_user_sets_the_limit() {
    let fixture = Fixture::new();
    padded(&fixture, 80 << 20);
    let words = ["padded.su2.gz: the gzipped file unpacks to more than ", "--max-memory"];
    fixture.refuses_command(&["quality", "padded.su2.gz"], 3, &words);
    let plain = fixture.idmesh(&["quality", "box.su2"]);
    let allowed = fixture.idmesh(&["quality", "padded.su2.gz", "--max-memory", "1G"]);
    assert_good(&allowed);
    assert_eq!(stdout(&allowed), stdout(&plain));
    let words = ["GB of memory, but ", " GB are available"];
    fixture.refuses_command(&["--max-memory", "1M", "run", "case.toml", "--backend", "cpu"], 3, &words);
    for size in ["", "0", "-1", "many", "1X", "nan", "1e30", "G"] {
        let output = fixture.idmesh(&["quality", "box.su2", &format!("--max-memory={size}")]);
        assert_eq!(output.status.code(), Some(2), "{size}");
        assert!(stderr(&output).contains("such as 500M or 8G") || size.is_empty(), "{}", stderr(&output));
    }
}

/// The number before a word of a message.
fn gigabytes(text: &str, after: &str) -> f64 {
    let (_, rest) = text.split_once(after).unwrap_or_else(|| panic!("no `{after}` in {text}"));
    rest.split_whitespace().next().unwrap().parse().unwrap()
}

/// Every unit of `--max-memory`: the process may take so much, less what it has. 500 threads need
/// more, at least 2 MiB each.
///
/// Fails if a unit is another number, if the memory in use does not count, and if the stacks of
/// threads do not.
#[test]
fn the_limit_has_units() {
    let fixture = Fixture::new();
    for (limit, bytes) in [
        ("900000000", 0.9),
        ("900000000B", 0.9),
        ("900000K", 0.9),
        ("900000kib", 0.921_6),
        ("900M", 0.9),
        ("900MiB", 0.943_718_4),
        ("1G", 1.0),
        ("0.9gb", 0.9),
        ("1GiB", 1.073_741_824),
        ("0.001T", 1.0),
        ("0.0009TiB", 0.989_560_464),
    ] {
        let mut command = command(fixture.folder.path(), &["--max-memory", limit, "quality", "box.msh"]);
        let output = command.env("RAYON_NUM_THREADS", "500").output().unwrap();
        let errors = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{limit}: {errors}");
        let [needed, available] = ["takes about ", " but "].map(|before| gigabytes(&errors, before));
        assert!((1.06..1.5).contains(&needed), "{limit}: {errors}");
        assert!(available < bytes - 1e-3 && available > bytes - 0.05, "{limit}: {errors}");
    }
}

/// A plain file of 80 MB takes as much to be read. The gzipped one may unpack to so much, but what
/// is unpacked already counts.
///
/// Fails if the check of `formats::read`, of `formats::gzip` or of `cli::refine` is left out.
#[test]
fn files_are_refused_that_the_limit_does_not_hold() {
    let fixture = Fixture::new();
    padded(&fixture, 80 << 20);
    fs::write(fixture.path("padded.su2"), "% nothing here\n".repeat((80 << 20) / 15) + &fixture.read("box.su2"))
        .unwrap();
    let refused = |file: &str| {
        let mut command = command(fixture.folder.path(), &["--max-memory", "60M", "quality", file]);
        let output = command.env("RAYON_NUM_THREADS", "1").output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        stderr(&output)
    };
    let message = refused("padded.su2");
    assert!(message.contains("error: padded.su2: this takes about "), "{message}");
    assert!((0.06..0.09).contains(&gigabytes(&message, "takes about ")), "{message}");
    // The gzipped one is refused before it is whole.
    let message = refused("padded.su2.gz");
    assert!(
        message.contains("unpacks to more than 60000000 bytes") || message.contains("this takes about "),
        "{message}"
    );
    for limit in ["1G", "300M"] {
        assert_good(&fixture.idmesh(&["--max-memory", limit, "quality", "padded.su2.gz"]));
        assert_good(&fixture.idmesh(&["--max-memory", limit, "refine", MESH, "fine.b8.ugrid"]));
    }
    // 818 728 tets.
    let refused = fixture.idmesh(&["--max-memory", "60M", "refine", MESH, "fine.b8.ugrid"]);
    let needed = gigabytes(&stderr(&refused), "takes about ");
    assert!((0.03..0.07).contains(&needed), "{}", stderr(&refused));
}

/// An array of 32 MiB that the limit would just hold, if the process took nothing else. It is
/// refused before it is unpacked.
///
/// Fails if `Allowance::take` does not check the memory.
#[test]
fn packed_arrays_are_refused_that_the_limit_does_not_hold() {
    let fixture = Fixture::new();
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    encoder.write_all(&vec![0; 32 << 20]).unwrap();
    let packed = encoder.finish().unwrap();
    let header: Vec<u8> = [1, 32 << 20, 0, packed.len() as u64].into_iter().flat_map(u64::to_le_bytes).collect();
    let text = "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
                compressor=\"vtkZLibDataCompressor\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\">\
                <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1\
                </DataArray></Points>\
                <Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"appended\" offset=\"0\"/>\
                <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
                <DataArray type=\"Int64\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece>\
                </UnstructuredGrid><AppendedData encoding=\"raw\">_";
    let bytes = [text.as_bytes(), &header, &packed, b"</AppendedData></VTKFile>"].concat();
    fs::write(fixture.path("array.vtu"), bytes).unwrap();
    for (limit, words) in [("36M", "array.vtu: this takes about 0.034 GB of memory"), ("1G", "no boundary triangles")] {
        let mut command = command(fixture.folder.path(), &["--max-memory", limit, "quality", "array.vtu"]);
        let output = command.env("RAYON_NUM_THREADS", "1").output().unwrap();
        assert!(stderr(&output).contains(words) && output.status.code() == Some(3), "{}", stderr(&output));
    }
}

/// The bomb is refused with a tenth of the memory to which it unpacks.
#[test]
fn a_bomb_is_refused_at_small_memory() {
    let fixture = Fixture::new();
    padded(&fixture, 400 << 20);
    let output =
        within(&fixture, &["quality", "padded.su2.gz"], 120_000).env("RAYON_NUM_THREADS", "1").output().unwrap();
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("the gzipped file unpacks to more than "), "{}", stderr(&output));
}

/// Between too little for the set-up and enough for all there is a limit that only the steps do not
/// fit into.
///
/// Fails if the bytes for each tet are half as many or twice as many.
#[test]
fn lack_of_memory_is_told() {
    let fixture = turned_wing();
    let mut before = fixture.files();
    // Measured were up to 530 bytes for each tet, and 345 to 363 for the steps.
    let expected = [("102341 tets: this takes", 0.05..0.08), ("102341 tets, moved in steps", 0.035..0.045)];
    let mut told = [false; 2];
    for megabytes in (70..).step_by(10) {
        let output = run_within(&fixture, megabytes);
        let errors = stderr(&output);
        if output.status.success() {
            break;
        }
        for (told, (message, gigabytes_needed)) in told.iter_mut().zip(&expected) {
            if errors.contains(message) {
                assert!(gigabytes_needed.contains(&gigabytes(&errors, "takes about ")), "{errors}");
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

/// Of thousands of sections only the points are kept, not the smooth curves, which take 65
/// kilobytes for each section and each of its forms. With the curves this case needs 300 MB of
/// addresses.
///
/// Fails if `KeptSection` keeps its `OldSection`.
#[test]
fn many_profiles_take_little_memory() {
    let fixture = Fixture::new();
    let at = |number: i64| 0.3 + 0.9 * number as f64 / 1499.0;
    fixture.write("new.csv", &profiles(&(0..1500).map(|number| (number, at(number), 0.05)).collect::<Vec<_>>()));
    assert_good(&run_within(&fixture, 130));
    assert!(fixture.files().contains(&"moved.msh".to_owned()));
}

/// Fails if the trees of all reports are kept.
#[test]
fn many_reports_take_little_more_than_their_texts() {
    let fixture = Fixture::new();
    let point = |at: u32| format!("[{at}.5,0.25]");
    let curve = (0..2000).map(point).collect::<Vec<_>>().join(",");
    let line = |design: u32| {
        let outline = format!("{{\"profile\":1,\"change\":0.1,\"old\":[{curve}],\"new\":[{curve}]}}");
        format!("{{\"design\":\"d{design}\",\"exit\":0,\"valid\":true,\"outlines\":{{\"wing\":[{outline}]}}}}\n")
    };
    fixture.write("reports.jsonl", &(0..600).map(line).collect::<String>());
    let megabytes = fs::metadata(fixture.path("reports.jsonl")).unwrap().len() / 1_000_000;
    assert!(megabytes > 25, "{megabytes}");
    for target in [["-o", "page.html"], ["--join", "joined.jsonl"]] {
        let arguments = [&["report", "reports.jsonl"], &target[..]].concat();
        // The trees of all lines take more than ten times as much as their texts.
        assert_good(&within(&fixture, &arguments, 3000 * megabytes as usize + 100_000).output().unwrap());
        assert_good(&fixture.idmesh(&[&arguments[..], &["--max-memory", &format!("{}M", 2 * megabytes)]].concat()));
        fs::remove_file(fixture.path(target[1])).unwrap();
        let words = ["cannot read reports.jsonl: this takes about ", " GB are available"];
        let limit = format!("{megabytes}M");
        fixture.refuses_command(&[&arguments[..], &["--max-memory", &limit]].concat(), 3, &words);
    }
}

/// More threads than can be useful are refused: a run with thousands seems to hang.
///
/// Fails if `MOST` of the threads is 1 000 000.
#[test]
fn too_many_threads_are_refused() {
    let fixture = Fixture::new();
    for n_threads in [100_000, 10_000_000] {
        let mut command = command(fixture.folder.path(), &["quality", "box.msh"]);
        let output = command.env("RAYON_NUM_THREADS", n_threads.to_string()).output().unwrap();
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        let words = format!("error: {n_threads} threads cannot be started: at most ");
        assert!(stderr(&output).starts_with(&words), "{}", stderr(&output));
    }
}

/// The memory must suffice for all designs that are in work at once. A mover of this mesh takes
/// 530 bytes for each of 5136 tets, 230 000 for each of two profiles, and 14 000 for each family.
///
/// Fails if the memory of one mover is checked.
#[test]
fn designs_at_once_need_the_memory_of_all() {
    let fixture = Fixture::with_designs(64);
    let batch = |jobs: &str, out: &str| {
        let words = ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", out, "-q"];
        let words = [&words[..], &["--max-memory", "150M", "--jobs", jobs]].concat();
        command(fixture.folder.path(), &words).env("RAYON_NUM_THREADS", "2").output().unwrap()
    };
    let refused = batch("64", "many");
    assert_eq!(refused.status.code(), Some(3), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("this takes about 0.20"), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("hint: take fewer than 64 designs at once (--jobs)"), "{}", stderr(&refused));
    assert!(!fixture.path("many").exists());
    assert_good(&batch("2", "few"));
    assert_eq!(fs::read_dir(fixture.path("few")).unwrap().count(), 64);
}

/// What a mover asks for. Of each case one part is most: profiles, their points, the curves of 68
/// sections at a time, the points of these curves, and families.
///
/// Fails if any constant of `mover::needs` is half or twice as large, but the one of corner tets.
#[test]
fn every_part_of_a_mover_is_asked_for() {
    let ring = |number: usize, n: usize| {
        let at = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        let y = 0.3 + 0.9e-4 * number as f64;
        let row = |i: usize| format!("{number},{},{y},{}\n", at(i).cos(), 0.1 * at(i).sin());
        (0..=n).map(row).collect::<String>()
    };
    for (n_profiles, n_points, splits, megabytes) in [
        (9000, 8, false, 61.0..72.0),
        (200, 1000, false, 105.0..129.0),
        (68, 8, false, 16.5..20.5),
        (2, 50_000, false, 107.0..131.0),
        (2, 8, true, 14.5..18.0),
    ] {
        let fixture = Fixture::new();
        let mut case = CASE.replacen("new = \"new.csv\"", "new = \"new.csv\"\nold = \"new.csv\"", 1);
        if splits {
            assert_good(&fixture.idmesh(&["convert", "box.msh", "box.su2"]));
            fixture.write("box.su2", &split(&fixture.read("box.su2")));
            case = case.replacen("box.msh", "box.su2", 1).replacen("[family.farfield]", "[family.\"part*\"]", 1);
        }
        fixture.write("case.toml", &case);
        let text: String = (0..n_profiles).map(|number| ring(number, n_points)).collect();
        fixture.write("new.csv", &format!("profile,x,y,z\n{text}"));
        // The least limit that holds what was read, or a little more.
        let mut limits = ["25M", "32M", "40M", "50M", "64M"].into_iter().map(|limit| {
            let arguments = ["run", "case.toml", "--backend", "cpu", "--max-memory", limit];
            let mut run = command(fixture.folder.path(), &arguments);
            stderr(&run.env("RAYON_NUM_THREADS", "1").output().unwrap())
        });
        let told = limits.find(|errors| errors.contains(" tets: this takes about "));
        let errors = told.unwrap_or_else(|| panic!("{n_profiles} profiles of {n_points} points"));
        let needed = 1000.0 * gigabytes(&errors, "takes about ");
        assert!(megabytes.contains(&needed), "{n_profiles} x {n_points}, split: {splits}: {errors}");
    }
}

/// A mesh of SU2 in which each triangle of the farfield, 892 of them, is a family of its own.
fn split(su2: &str) -> String {
    let (before, of_family) = su2.split_once("MARKER_TAG= farfield\n").unwrap();
    let (count, rest) = of_family.split_once('\n').unwrap();
    let n: usize = count.trim_start_matches("MARKER_ELEMS=").trim().parse().unwrap();
    assert_eq!(n, 892);
    let mut lines = rest.lines();
    let parts = lines.by_ref().take(n).enumerate();
    let parts: String = parts.map(|(at, line)| format!("MARKER_TAG= part{at}\nMARKER_ELEMS= 1\n{line}\n")).collect();
    let rest: String = lines.map(|line| format!("{line}\n")).collect();
    format!("{}{parts}{rest}", before.replacen("NMARK= 5", &format!("NMARK= {}", 4 + n), 1))
}
