//! What the command line says of itself: completions and manual pages know every subcommand and
//! option that `--help` shows.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::fixture::*;

const SHELLS: [&str; 5] = ["bash", "elvish", "fish", "powershell", "zsh"];

/// The subcommands that `idmesh --help` lists, but for `help` itself.
fn subcommands(fixture: &Fixture) -> Vec<String> {
    let help = stdout(&fixture.idmesh(&["--help"]));
    let lines = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names: Vec<_> = lines.map(|line| line.split_whitespace().next().unwrap().to_owned()).collect();
    assert!(names.contains(&"run".to_owned()) && names.contains(&"batch".to_owned()), "{help}");
    names.into_iter().filter(|name| name != "help").collect()
}

/// The long options that `idmesh SUBCOMMAND --help` lists, without their dashes.
fn options(fixture: &Fixture, subcommand: &str) -> Vec<String> {
    let help = stdout(&fixture.idmesh(&[subcommand, "--help"]));
    // "  -q, --quiet" or "      --out <DIR>"
    let option = |line: &str| {
        let line = line.trim_start();
        let line = if line.as_bytes().get(2) == Some(&b',') { line[3..].trim_start() } else { line };
        let name: String = line.strip_prefix("--")?.chars().take_while(|c| c.is_alphanumeric() || *c == '-').collect();
        Some(name)
    };
    let names: Vec<_> = help.lines().filter_map(option).collect();
    assert!(names.contains(&"quiet".to_owned()) && names.contains(&"help".to_owned()), "{help}");
    names
}

/// Shells write options as `--out`, `-l out` or `'--out'`.
#[test]
fn completions_know_every_subcommand_and_option() {
    let fixture = Fixture::new();
    let scripts = SHELLS.map(|shell| {
        let output = fixture.idmesh(&["completions", shell]);
        assert_good(&output);
        assert_eq!(stderr(&output), "", "{shell}");
        stdout(&output)
    });
    let has = |script: &str, word: &str| {
        script.split(|c: char| !(c.is_alphanumeric() || "-_".contains(c))).any(|found| found == word)
    };
    for subcommand in subcommands(&fixture) {
        for (shell, script) in SHELLS.iter().zip(&scripts) {
            assert!(has(script, &subcommand), "{shell} does not know {subcommand}");
            for option in options(&fixture, &subcommand) {
                let found = has(script, &format!("--{option}")) || *shell == "fish" && has(script, &option);
                assert!(found, "{shell} does not know {subcommand} --{option}");
            }
        }
    }
}

/// What bash offers after some words, the last of which is begun.
#[cfg(unix)]
fn offered(fixture: &Fixture, words: &[&str]) -> Vec<String> {
    let program = r#"source script.bash
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1))
_idmesh idmesh "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\n' "${COMPREPLY[@]}""#;
    let output = Command::new("bash")
        .args(["--norc", "-c", program, "bash"])
        .args(words)
        .current_dir(fixture.folder.path())
        .output()
        .unwrap();
    stdout(&output).lines().map(str::to_owned).collect()
}

#[cfg(unix)]
#[test]
fn bash_completes_subcommands_options_values_and_files() {
    let fixture = Fixture::new();
    fixture.write("script.bash", &stdout(&fixture.idmesh(&["completions", "bash"])));
    // The oldest bash with the options that completion needs is 4; that of macOS is 3.
    let version = Command::new("bash").args(["-c", "echo ${BASH_VERSINFO[0]}"]).output().unwrap();
    if stdout(&version).trim().parse::<u32>().unwrap() < 4 {
        eprintln!("SKIPPED: bash is older than 4");
        return;
    }
    for subcommand in subcommands(&fixture) {
        let offered = offered(&fixture, &["idmesh", &subcommand, "--"]);
        for option in options(&fixture, &subcommand) {
            assert!(offered.contains(&format!("--{option}")), "{subcommand}: --{option} is not in {offered:?}");
        }
    }
    assert_eq!(offered(&fixture, &["idmesh", "ba"]), ["batch"]);
    assert_eq!(offered(&fixture, &["idmesh", "run", "--ba"]), ["--backend"]);
    assert_eq!(offered(&fixture, &["idmesh", "run", "--backend", ""]), ["auto", "gpu", "cpu"]);
    assert_eq!(offered(&fixture, &["idmesh", "run", "--json", "case"]), ["case.toml"]);
}

#[test]
fn an_unknown_shell_is_wrong_usage() {
    let fixture = Fixture::new();
    fixture.refuses_command(&["completions", "cmd"], 2, &["cmd"]);
    let errors = stderr(&fixture.idmesh(&["completions", "cmd"]));
    assert!(SHELLS.iter().all(|shell| errors.contains(shell)), "{errors}");
}

#[test]
fn every_subcommand_has_a_manual_page() {
    let fixture = Fixture::new();
    assert_good(&fixture.idmesh(&["man", "--out", "share/man1"]));
    let page = |name: &str| fixture.read(&format!("share/man1/{name}.1")).replace("\\-", "-");
    let subcommands = subcommands(&fixture);
    let mut expected: Vec<_> = subcommands.iter().map(|name| format!("idmesh-{name}.1")).collect();
    expected.push("idmesh.1".to_owned());
    expected.sort();
    assert_eq!(names(&fixture.path("share/man1")), expected);

    let main = page("idmesh");
    assert_eq!(stdout(&fixture.idmesh(&["man"])).replace("\\-", "-"), main);
    // What `--help` says of exit codes is in the manual, line by line.
    let help = stdout(&fixture.idmesh(&["--help"]));
    for line in help.lines().skip_while(|line| *line != "Exit codes:") {
        assert!(main.lines().any(|other| other == line), "\"{line}\" is not in {main}");
    }
    for subcommand in subcommands {
        assert!(main.contains(&format!("idmesh-{subcommand}(1)")), "{main}");
        let page = page(&format!("idmesh-{subcommand}"));
        assert!(page.contains(&format!("\n.TH idmesh-{subcommand} 1 ")), "{page}");
        for option in options(&fixture, &subcommand) {
            assert!(page.contains(&format!("--{option}")), "no --{option} in {page}");
        }
    }
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn manual_pages_need_a_folder_that_can_be_had() {
    let fixture = Fixture::new();
    fixture.refuses_command(&["man", "--out", "case.toml"], 3, &["case.toml"]);
    fs::create_dir(fixture.path("pages")).unwrap();
    fs::create_dir(fixture.path("pages/idmesh-run.1")).unwrap();
    fixture.refuses_command(&["man", "--out", "pages"], 3, &["idmesh-run.1"]);
    assert_eq!(names(&fixture.path("pages")), ["idmesh-run.1"], "half of the pages were written");
}
