//! Every command in a block of shell runs, or is listed here with the reason why not.

use std::collections::BTreeSet;
use std::path::Path;

use super::{Block, Page, page, pages, workplace};
use crate::fixture::{assert_good, command, stderr, stdout};
use crate::gpu::gpu_tests_are_off;

/// Beginnings of commands that do not run here.
const NOT_RUN: [(&str, &str); 7] = [
    ("tests/run", "it runs this test"),
    ("cargo install --path .", "it builds in release for minutes; `cargo build` of this test builds the same program"),
    ("pip install .", "it builds in release for minutes; the tests of the Python package build the same package"),
    ("sh examples/openfoam/restart.sh", "it needs OpenFOAM and minutes; tests/cli/openfoam.rs runs it, shorter"),
    ("cargo install cargo-fuzz", "it needs a registry"),
    ("cargo +nightly fuzz", "it needs a nightly toolchain"),
    (
        "mkdir -p fuzz/corpus/vtu && cp tests/data/mixed/*.vtu",
        "it belongs to the fuzz target; the files are looked for",
    ),
];

/// One command of a page, as one line.
struct Line {
    text: String,
    exit: i32,
}

fn commands(block: &Block) -> Vec<Line> {
    let whole = block.lines.join("\n").replace("\\\n", " ");
    let lines = whole.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'));
    let command = |line: &str| match line.split_once(" # ") {
        None => Line { text: line.to_owned(), exit: 0 },
        Some((text, remark)) => {
            let code = remark.trim().strip_prefix("exit code ").unwrap_or_else(|| panic!("`{line}`: which exit code?"));
            let code = code.split(':').next().unwrap();
            Line { text: text.trim().to_owned(), exit: code.parse().unwrap() }
        }
    };
    lines.map(command).collect()
}

/// The idmesh command in a line: as it stands, through cargo, or in a job of a cluster, whose first
/// task it is.
fn of_idmesh(line: &str) -> Option<String> {
    if let Some(arguments) = line.strip_prefix("cargo run --release -- ") {
        return Some(arguments.to_owned());
    }
    if line.starts_with("sbatch ") {
        let job = line.split_once("--wrap='").unwrap().1.strip_suffix('\'').unwrap();
        let (settings, arguments) = job.split_once(" idmesh ").unwrap();
        assert_eq!(settings, "RAYON_NUM_THREADS=8");
        return Some(arguments.replace("$SLURM_ARRAY_TASK_ID", "1"));
    }
    line.strip_prefix("idmesh ").map(str::to_owned)
}

#[test]
fn every_command_runs() {
    let mut not_run = BTreeSet::new();
    let mut n_run = 0;
    for page in pages() {
        // Commands of one page may build on those before them.
        let folder = workplace();
        for block in page.blocks("sh") {
            for line in commands(&block) {
                let place = format!("{}:{}: `{}`", page.name(), block.line, line.text);
                match of_idmesh(&line.text) {
                    Some(arguments) => n_run += usize::from(run(folder.path(), &arguments, line.exit, &place)),
                    None => {
                        let listed = NOT_RUN.iter().find(|(beginning, _)| line.text.starts_with(beginning));
                        let (beginning, _) = listed.unwrap_or_else(|| panic!("{place} is neither run nor listed"));
                        not_run.insert(*beginning);
                    }
                }
            }
        }
    }
    assert!(n_run >= 10, "only {n_run} commands ran");
    for (beginning, reason) in NOT_RUN {
        assert!(not_run.contains(beginning), "no page has `{beginning}`, which is not run because {reason}");
    }
}

/// Runs a command, and looks for the files it was to write; false if it needs a GPU and these tests
/// are off.
fn run(folder: &Path, arguments: &str, exit: i32, place: &str) -> bool {
    assert!(!arguments.contains(['\'', '"', '$', '|', '>', '*', '&', ';']), "{place} needs a shell");
    let words: Vec<&str> = arguments.split_whitespace().collect();
    let on_gpu = words[0] == "compare" && words[1].ends_with(".toml");
    if on_gpu && gpu_tests_are_off() {
        return false;
    }
    let output = command(folder, &words).output().unwrap();
    assert_eq!(output.status.code(), Some(exit), "{place}: {}", stderr(&output));
    for pair in words.windows(2) {
        if ["--out", "--json", "--histogram", "--report", "--output"].contains(&pair[0]) && pair[1] != "-" {
            assert!(folder.join(pair[1]).exists(), "{place} wrote no {}", pair[1]);
        }
    }
    true
}

#[test]
fn a_remark_gives_the_exit_code() {
    let block =
        Block { language: "sh", line: 1, lines: vec!["idmesh a \\", "  b  # exit code 1: why", "", "# words", "c"] };
    let lines: Vec<_> = commands(&block).into_iter().map(|line| (line.text, line.exit)).collect();
    assert_eq!(lines, [("idmesh a    b".to_owned(), 1), ("c".to_owned(), 0)]);
}

fn help(arguments: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let output = command(folder.path(), &[arguments, &["--help"]].concat()).output().unwrap();
    assert_good(&output);
    stdout(&output)
}

/// The subcommands that `idmesh --help` lists.
fn subcommands() -> Vec<String> {
    let help = help(&[]);
    let list = help.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let first =
        |line: &str| line.strip_prefix("  ")?.split(' ').next().filter(|word| !word.is_empty()).map(str::to_owned);
    list.lines().filter_map(first).filter(|name| name != "help").collect()
}

#[test]
fn every_subcommand_has_its_section_and_its_row() {
    let page = page("docs/src/commands.md");
    let names = subcommands();
    assert!(names.len() >= 8, "{names:?}");
    for name in names {
        assert!(page.text.contains(&format!("\n## {name}\n")), "{} has no section `{name}`", page.name());
        assert!(page.text.contains(&format!("\n| [`{name}`](#{name}) |")), "{} has no row `{name}`", page.name());
    }
}

/// In code between words too: `idmesh cut --planes N` names a command that is there, with an option
/// it has.
#[test]
fn commands_and_options_in_the_text_are_known() {
    let names = subcommands();
    let options_of = |name: &str| -> BTreeSet<String> {
        let is_option = |character: char| character.is_ascii_alphanumeric() || character == '-';
        help(&[name]).split(|character| !is_option(character)).map(str::to_owned).collect()
    };
    let every: BTreeSet<String> = names.iter().flat_map(|name| options_of(name)).collect();
    // Of cargo.
    let others = ["--no-default-features"];
    let mut n_options = 0;
    for page in pages() {
        for (number, span) in page.spans() {
            let words: Vec<&str> = span.split_whitespace().collect();
            let known = match words.as_slice() {
                ["idmesh", name, ..] if !name.starts_with('-') => {
                    assert!(names.iter().any(|known| known == name), "{}:{number}: `{span}`", page.name());
                    options_of(name)
                }
                [first, ..] if first.starts_with("--") => every.clone(),
                _ => continue,
            };
            for option in words.iter().filter(|word| word.starts_with("--") && !others.contains(word)) {
                assert!(known.contains(*option), "{}:{number}: `{option}` of `{span}` is unknown", page.name());
                n_options += 1;
            }
        }
    }
    assert!(n_options > 10, "{n_options}");
}

/// The first column of the table of exit codes is that of `idmesh --help`.
#[test]
fn exit_codes_are_those_of_the_help() {
    let Page { text, .. } = page("docs/src/commands.md");
    let table = text.split("| exit code | meaning |").nth(1).unwrap().split("\n\n").next().unwrap().to_owned();
    let in_page: Vec<u8> = table.lines().filter_map(|line| line.split('|').nth(1)?.trim().parse().ok()).collect();
    let help = help(&[]);
    let list = help.split("Exit codes:\n").nth(1).unwrap();
    let in_help: Vec<u8> = list.lines().filter_map(|line| line.split_whitespace().next()?.parse().ok()).collect();
    assert!(in_help.len() > 5);
    assert_eq!(in_page, in_help);
}
