//! With and without a GPU.

use crate::fixture::*;
use crate::schema::assert_report;

#[test]
fn no_gpu_is_an_error_only_where_one_is_asked_for() {
    let fixture = Fixture::new();
    let run = |backend: &str| {
        let mut command = command(fixture.folder.path(), &["run", "case.toml", "--backend", backend]);
        without_gpu(&mut command).output().unwrap()
    };
    let before = fixture.files();
    let output = run("gpu");
    assert_eq!(output.status.code(), Some(6), "{}", stderr(&output));
    assert!(stderr(&output).contains("error: no usable GPU"), "{}", stderr(&output));
    assert_eq!(fixture.files(), before);
    let output = run("auto");
    assert_good(&output);
    assert!(stderr(&output).contains("computing on the CPU"), "{}", stderr(&output));

    let mut adapters = command(fixture.folder.path(), &["adapters"]);
    let output = without_gpu(&mut adapters).output().unwrap();
    assert_good(&output);
    assert_eq!(stdout(&output), "no adapters; auto computes on the CPU\n");
}

/// A good run with `-q` says nothing, whatever the environment has for Mesa and Wayland.
///
/// Fails with Mesa's drivers and their layer if `XDG_RUNTIME_DIR` is left as it is: libwayland then
/// prints an error, twice.
#[test]
fn a_good_run_says_nothing_on_standard_error() {
    if gpu_tests_are_off() {
        return;
    }
    let fixture = Fixture::new();
    for folder in [None, Some(""), Some("no/absolute/path"), Some("/tmp")] {
        let quiet = |arguments: &[&str]| {
            let mut command = command(fixture.folder.path(), arguments);
            command.env_remove("NODEVICE_SELECT").env_remove("XDG_RUNTIME_DIR");
            if let Some(folder) = folder {
                command.env("XDG_RUNTIME_DIR", folder);
            }
            let output = command.output().unwrap();
            assert_good(&output);
            assert_eq!(stderr(&output), "", "{arguments:?}, {folder:?}");
            stdout(&output)
        };
        quiet(&["run", "case.toml", "--backend", "auto", "-q"]);
        // There is a Vulkan driver, so its layers have spoken if they would.
        assert!(quiet(&["adapters"]).contains("arrays up to"));
    }
}

/// A GPU takes one design after another, so it does not take them for designs in one solve.
#[test]
fn designs_together_are_refused_on_a_gpu() {
    if gpu_tests_are_off() {
        return;
    }
    let fixture = Fixture::with_designs(2);
    let batch = |together: &str| {
        let arguments = ["batch", "case.toml", "--backend", "gpu", "--designs", "designs", "--together", together];
        fixture.idmesh(&arguments)
    };
    let output = batch("2");
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(stderr(&output).contains("--together 2: several designs in one solve need the CPU"), "{}", stderr(&output));
    assert!(!fixture.path("0.msh").exists());
    assert_good(&batch("1"));
}

pub fn gpu_tests_are_off() -> bool {
    let off = !cfg!(feature = "gpu") || std::env::var("IDMESH_TEST_GPU").is_ok_and(|value| value == "off");
    if off {
        eprintln!("skipped: no GPU tests are wanted (IDMESH_TEST_GPU=off, or built without the gpu feature)");
    }
    off
}

#[test]
fn cpu_and_gpu_agree() {
    if gpu_tests_are_off() {
        return;
    }
    let fixture = Fixture::new();
    let arguments = ["compare", "case.toml", "--tolerance", "1e-3", "--json", "-", "--report", "page.html"];
    let output = every_network(&fixture, &arguments);
    assert_good(&output);
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(found["within_tolerance"], true);
    assert!(found["seconds"]["gpu"].as_f64().unwrap() > 0.0);
    // In single precision the two are never the same: a difference of zero would mean that one was
    // compared with itself.
    assert!(found["max_difference"].as_f64().unwrap() > 0.0);
    // The page names the same vertex first, and has the stages of both.
    let page = fixture.read("page.html");
    assert!(page.contains(&format!("data-cell=\"0\" tabindex=\"0\"><td>{}</td>", found["worst_vertex"])));
    assert!(
        page.contains("within tolerance") && page.contains("CPU against GPU") && page.contains("<td>corrected</td>")
    );
    let output = fixture.idmesh(&["adapters"]);
    assert!(stdout(&output).contains("arrays up to"), "{}", stdout(&output));
}

/// `idmesh` with a GPU that relaxes networks of every size.
fn every_network(fixture: &Fixture, arguments: &[&str]) -> std::process::Output {
    command(fixture.folder.path(), arguments).env("IDMESH_GPU_VERTICES", "0").output().unwrap()
}

/// The networks of a small mesh are the CPU's, whatever the backend, and the report says so.
#[test]
fn small_networks_are_left_to_the_cpu() {
    if gpu_tests_are_off() {
        return;
    }
    let fixture = Fixture::new();
    let output = fixture.idmesh(&["compare", "case.toml", "--json", "-"]);
    assert_good(&output);
    assert!(stderr(&output).contains("the GPU had nothing to do"), "{}", stderr(&output));
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(found["max_difference"], 0.0);
    let run = ["run", "case.toml", "--backend", "gpu", "--json", "-", "-q"];
    let report = |output: &std::process::Output| -> serde_json::Value {
        assert_good(output);
        serde_json::from_str(&stdout(output)).unwrap()
    };
    let small = report(&fixture.idmesh(&run));
    assert_eq!(small["device_work"]["dispatches"], 0);
    assert!(["f64", "f32"].contains(&small["backend"]["arithmetic"].as_str().unwrap()));
    let every = report(&every_network(&fixture, &run));
    assert!(every["device_work"]["dispatches"].as_u64().unwrap() > 0, "{}", every["device_work"]);
    let wrong = command(fixture.folder.path(), &run).env("IDMESH_GPU_VERTICES", "many").output().unwrap();
    assert_eq!(wrong.status.code(), Some(6));
    assert!(stderr(&wrong).contains("IDMESH_GPU_VERTICES is `many`, expected a number"), "{}", stderr(&wrong));
}

/// Times of kernels are in the report where they are asked for, and change no other byte and no
/// other command. Stages follow one another, so their seconds are not more than the update's.
#[test]
fn kernels_are_timed_only_where_that_is_asked_for() {
    if gpu_tests_are_off() {
        return;
    }
    let fixture = Fixture::new();
    let run = ["run", "case.toml", "--backend", "gpu", "--json", "report.json", "-q"];
    let with = |times: Option<&str>| {
        let mut command = command(fixture.folder.path(), &run);
        command.env("IDMESH_GPU_VERTICES", "0").env_remove("IDMESH_GPU_TIMES");
        if let Some(times) = times {
            command.env("IDMESH_GPU_TIMES", times);
        }
        command.output().unwrap()
    };
    let report = |times| -> serde_json::Value {
        assert_good(&with(times));
        let report = serde_json::from_str(&fixture.read("report.json")).unwrap();
        assert_report(&report);
        report
    };
    let figures = |report: &serde_json::Value, key: &str| -> Vec<f64> {
        report["stage_seconds"].as_array().unwrap().iter().filter_map(|stage| stage[key].as_f64()).collect()
    };
    let plain = report(None);
    let mesh = std::fs::read(fixture.path("moved.msh")).unwrap();
    assert!(figures(&plain, "kernels").is_empty() && plain["device_work"]["reads"].as_u64().unwrap() > 0);
    let timed = report(Some("1"));
    assert_eq!(std::fs::read(fixture.path("moved.msh")).unwrap(), mesh);
    assert_eq!(timed["device_work"], plain["device_work"]);
    let names: Vec<_> =
        timed["stage_seconds"].as_array().unwrap().iter().map(|stage| stage["stage"].as_str().unwrap()).collect();
    assert_eq!(names, ["wing", "trailing edge", "rigid", "attached", "carenage", "planes", "volume", "checks"]);
    let [seconds, waiting, kernels] = ["seconds", "waiting", "kernels"].map(|key| figures(&timed, key));
    assert!(seconds.iter().sum::<f64>() <= timed["seconds"]["update"].as_f64().unwrap(), "{timed}");
    assert!(waiting.iter().zip(&seconds).all(|(waiting, seconds)| waiting <= seconds), "{timed}");
    assert!(waiting[6] > 0.0, "{timed}");
    // An adapter without time stamps has no times. Mesa's software adapter has them, and runs its
    // kernels at no other time than between a submission and its answer.
    if kernels.is_empty() {
        assert!(!stdout(&fixture.idmesh(&["adapters"])).contains("llvmpipe"));
    } else {
        assert!(kernels.len() == seconds.len() && kernels[6] > 0.0 && kernels[7] == 0.0, "{timed}");
        assert!(kernels.iter().zip(&seconds).all(|(kernels, seconds)| *kernels <= 1.01 * seconds), "{timed}");
    }
    let wrong = with(Some("yes"));
    assert_eq!(wrong.status.code(), Some(6));
    assert!(stderr(&wrong).contains("IDMESH_GPU_TIMES is `yes`, expected `0` or `1`"), "{}", stderr(&wrong));
}

/// Products of both backends agree to 1e-6 of their norms where updates are solved to 1e-8, and on
/// each backend one product is the transpose of the other. A tolerance below the difference
/// refuses.
#[test]
fn products_of_cpu_and_gpu_agree() {
    let fixture = Fixture::new();
    fixture.case("tolerance = 1e-4", "tolerance = 1e-8");
    fixture.refuses_command(&["compare", "box.msh", "box.msh", "--derivatives"], 3, &["two meshes have none"]);
    if gpu_tests_are_off() {
        return;
    }
    let arguments = ["compare", "case.toml", "--derivatives", "--json", "-", "--tolerance"];
    let output = every_network(&fixture, &[&arguments[..], &["1e-6"]].concat());
    assert_good(&output);
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let figure = |name: &str| found["derivatives"][name].as_f64().unwrap();
    let (forward, reverse) = (figure("forward"), figure("reverse"));
    // A difference of zero would mean that one was compared with itself.
    assert!(0.0 < forward && forward < 1e-6 && 0.0 < reverse && reverse < 1e-6, "{found}");
    assert!(figure("transposed") < 1e-7, "{found}");
    let below = format!("{:e}", 0.5 * forward.min(reverse));
    let refused = every_network(&fixture, &[&arguments[..], &[below.as_str()]].concat());
    assert_eq!(refused.status.code(), Some(1), "{}", stderr(&refused));
}
