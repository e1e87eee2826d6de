//! The command line. Each subcommand has a file of its own.
//!
//! A command writes data to standard output, and everything else to standard error, through
//! `console::Console`. A command that fails returns a `failure::Failure`. [`main`] prints this
//! failure once and returns its exit code. No module below this one prints.

mod adapters;
mod batch;
mod check;
mod compare;
mod completions;
mod console;
mod convert;
mod cut;
mod demo;
mod estimate;
mod failure;
mod gradient;
mod init;
mod json;
mod lines;
mod man;
mod quality;
mod queue;
mod refine;
mod report;
mod run;
mod schema;
mod threads;
mod workers;

use std::ffi::OsString;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

use clap::{ArgAction, CommandFactory, Parser, Subcommand, ValueEnum};

use crate::backend::{self, Backend, Selection};
use crate::case::{Case, LoadError, LoadedCase, has_extension};
use crate::formats::{MeshFile, has_format};
use crate::memory::set_most;
use crate::mesh::{mostly_left_handed, partly_inside};
use crate::text::{shell_word, shown};
use console::{Console, STDOUT_IS_CLOSED};
use failure::{Exit, Failure};

const EXIT_CODES: &str = "\
Exit codes:
  0  good
  1  compare: out of tolerance; batch: a design failed
  2  wrong usage
  3  bad input, or an output that cannot be written: no mesh was written
  4  not converged: the mesh is written, unless a vertex has no finite
     position
  5  the moved mesh may not be used: inverted cells remain, the surface
     passes through itself, vertices left the surface they slide on or
     are held back, periodic planes no longer match, or the wing misses
     its new profiles. The mesh is written as NAME.invalid.EXT, the cells
     in question as NAME.inverted.vtu
  6  no usable GPU, or the GPU failed
  7  gradient: the result has no derivative, because it took several steps,
     local optimisation moved vertices, or for another reason that is told";

/// Moves an aircraft's CFD mesh of tets or mixed cells when its wing profiles change, without
/// remeshing.
#[derive(Debug, Parser)]
#[command(name = "idmesh", version, after_help = EXIT_CODES)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
    /// Say nothing but errors and data.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    quiet: bool,
    /// Say more: every step with its time.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
    /// Take at most this much memory, such as 500M or 8G; a packed file may unpack to as much.
    #[arg(long, global = true, value_name = "SIZE", value_parser = size)]
    max_memory: Option<u64>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Move a small mesh that is in the program, to see what idmesh does.
    Demo(demo::Arguments),
    /// Make a first case of a mesh.
    Init(init::Arguments),
    /// Move a mesh to one design.
    Run(run::Arguments),
    /// Check a case without moving the mesh.
    Check(check::Arguments),
    /// Move a mesh to many designs, set up once.
    Batch(batch::Arguments),
    /// Join the reports of several jobs, each design once, or make a page of them.
    Report(report::Arguments),
    /// Compare CPU and GPU on a case, or two meshes vertex by vertex.
    Compare(compare::Arguments),
    /// Turn the derivative of a number by the vertices into that by the design.
    Gradient(gradient::Arguments),
    /// Measure a mesh.
    Quality(quality::Arguments),
    /// Cut profiles from a wing's surface.
    Cut(cut::Arguments),
    /// Write a mesh in another format, with its families.
    Convert(convert::Arguments),
    /// Cut every cell into eight, a pyramid into ten; families are kept.
    Refine(refine::Arguments),
    /// List the GPUs and say which one would be taken.
    Adapters(adapters::Arguments),
    /// Print a script by which a shell completes the command line.
    Completions(completions::Arguments),
    /// Print the JSON Schema of cases or of reports.
    Schema(schema::Arguments),
    /// Print the manual page, or write those of all subcommands.
    Man(man::Arguments),
}

/// Where to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum BackendChoice {
    /// A hardware GPU if there is one, else the CPU.
    Auto,
    /// A GPU, or an error.
    Gpu,
    /// The CPU, in double precision.
    Cpu,
}

impl From<BackendChoice> for Selection {
    fn from(choice: BackendChoice) -> Self {
        match choice {
            BackendChoice::Auto => Selection::Auto,
            BackendChoice::Gpu => Selection::Gpu,
            BackendChoice::Cpu => Selection::Cpu,
        }
    }
}

/// The target of a command's JSON.
#[derive(Clone, Debug, PartialEq, Eq)]
enum JsonTarget {
    /// Standard output, written `-`.
    StandardOutput,
    /// A file.
    File(PathBuf),
}

impl From<PathBuf> for JsonTarget {
    fn from(path: PathBuf) -> Self {
        if path.as_os_str() == "-" { Self::StandardOutput } else { Self::File(path) }
    }
}

fn json_target(text: &str) -> Result<JsonTarget, std::convert::Infallible> {
    Ok(PathBuf::from(text).into())
}

/// The file of a page.
fn page_target(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match has_extension(&path, "html") {
        true => Ok(path),
        false => Err("expected a name ending in .html".to_owned()),
    }
}

/// A number of bytes, such as `8G`.
fn size(text: &str) -> Result<u64, String> {
    let text = text.trim();
    let digits = text.trim_end_matches(|letter: char| letter.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_ascii_uppercase().as_str() {
        "" | "B" => 1.0,
        "K" | "KB" => 1e3,
        "M" | "MB" => 1e6,
        "G" | "GB" => 1e9,
        "T" | "TB" => 1e12,
        "KIB" => 1024.0,
        "MIB" => f64::powi(1024.0, 2),
        "GIB" => f64::powi(1024.0, 3),
        "TIB" => f64::powi(1024.0, 4),
        _ => f64::NAN,
    };
    match digits.parse::<f64>().map(|number| number * unit) {
        Ok(bytes) if (1.0..1e18).contains(&bytes) => Ok(bytes as u64),
        _ => Err("expected a number of bytes, such as 500M or 8G".to_owned()),
    }
}

/// Selects a backend. If `auto` falls back to the CPU, a note says so.
fn choose_backend(choice: BackendChoice, console: &Console) -> Result<Box<dyn Backend>, Failure> {
    console.step("starting the backend");
    let backend = backend::select(choice.into())?;
    if choice == BackendChoice::Auto && backend.info().kind == "cpu" {
        console.note("no hardware GPU found: computing on the CPU");
    }
    Ok(backend)
}

/// Prints the warnings of a mesh file.
fn warn_of_file(path: &Path, file: &MeshFile, console: &Console) {
    for warning in file.warnings() {
        console.warn(format_args!("{}: {warning}", path.display()));
    }
}

/// Warns of families that lie partly inside the volume, and of cells of which most are left-handed.
/// A run would refuse both.
fn warn_of_mesh(path: &Path, file: &MeshFile, console: &Console) {
    for error in partly_inside(file.cells()).into_iter().chain(mostly_left_handed(file.cells())) {
        console.warn(format_args!("{}: {error}; a run refuses this mesh", path.display()));
    }
}

/// Prints the warnings of a mesh file, and notes that all cells of a shape are left-handed in it.
fn tell_of_file(path: &Path, file: &MeshFile, console: &Console) {
    warn_of_file(path, file, console);
    if !file.left_handed.is_empty() {
        console.note(format_args!(
            "{}: all {} are left-handed (negative volume): idmesh turns them over; a file of the same format keeps them as \
             they are",
            path.display(),
            file.left_handed.join(" and all ")
        ));
    }
}

/// Reads a case and all files that it names.
fn load(path: &Path, console: &Console) -> Result<LoadedCase, Failure> {
    load_files(read_case(path, console)?, console)
}

/// Reads a case file alone.
fn read_case(path: &Path, console: &Console) -> Result<Case, Failure> {
    console.step("reading the case");
    if has_format(path) && path.exists() {
        let mesh = shell_word(path.display());
        let mut failure = Failure::bad_input(format!("{} is a mesh, expected a case file (TOML)", path.display()));
        failure.hint = Some(format!(
            "a case names the mesh, the new profiles and the role of each family; `idmesh quality {mesh}` lists the families"
        ));
        return Err(failure);
    }
    Ok(Case::read(path).map_err(LoadError::from)?)
}

/// Reads the files that a case names.
fn load_files(case: Case, console: &Console) -> Result<LoadedCase, Failure> {
    let case = case.with_files(&|step| console.step(step))?;
    tell_of_file(&case.case.mesh, &case.file, console);
    for (wing, old) in case.old_profiles() {
        let new = case.design.profiles.get(wing).map_or(0, Vec::len);
        console.detail(format_args!("{wing}: {new} new profiles, {} old ones", old.len()));
    }
    Ok(case)
}

/// The whole command line, from which completions and manual pages are made.
fn command_line() -> clap::Command {
    Arguments::command()
}

/// Parses arguments, the program's name first. The error quotes arguments in such a way that no
/// terminal obeys them and none begins a line of its own.
fn parse(arguments: &[OsString]) -> Result<Arguments, clap::Error> {
    Arguments::try_parse_from(arguments).map_err(|error| {
        let escaped: Vec<String> = arguments.iter().map(|argument| shown(argument.display()).to_string()).collect();
        if arguments.iter().zip(&escaped).all(|(argument, escaped)| argument == escaped.as_str()) {
            return error;
        }
        // The same mistake in escaped arguments has the same message, with escapes.
        match Arguments::try_parse_from(&escaped) {
            Err(of_escaped) if of_escaped.kind() == error.kind() => of_escaped,
            _ => command_line().error(error.kind(), "an argument with control characters, or not in UTF-8"),
        }
    })
}

/// Prints help, or a mistake in the arguments. Help that cannot be printed is a failure, unless its
/// reader has closed the pipe.
fn tell(error: &clap::Error) -> ExitCode {
    if !error.use_stderr()
        && let Err(failure) = Console::new(false, 0).check_stdout()
    {
        Console::new(false, 0).fail(&failure);
        return ExitCode::from(failure.exit as u8);
    }
    match error.print().and_then(|()| std::io::stdout().flush()) {
        Err(why) if !error.use_stderr() && why.kind() != std::io::ErrorKind::BrokenPipe => {
            Console::new(false, 0).fail(&Failure::bad_input(format!("cannot write to standard output: {why}")));
            ExitCode::from(Exit::BadInput as u8)
        }
        _ => ExitCode::from(error.exit_code() as u8),
    }
}

/// Parses the command line, runs the command and reports its failure.
///
/// - `stdout_is_closed`: whether the process was started without a standard output
pub fn main(stdout_is_closed: bool) -> ExitCode {
    STDOUT_IS_CLOSED.store(stdout_is_closed, Relaxed);
    let arguments: Vec<OsString> = std::env::args_os().collect();
    let arguments = match parse(&arguments) {
        Ok(arguments) => arguments,
        Err(error) => return tell(&error),
    };
    arguments.max_memory.into_iter().for_each(set_most);
    let console = Console::new(arguments.quiet, arguments.verbose);
    let command = Arc::new(arguments.command);
    let result = {
        let (command, console) = (command.clone(), console.clone());
        threads::run(move || run_command(&command, &console))
    };
    // In case of a failure the command has not begun.
    let result = result.map_err(|failure| remove_earlier(&command, failure));
    console.finish();
    match result.and_then(|result| result) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            console.fail(&failure);
            ExitCode::from(failure.exit as u8)
        }
    }
}

/// Removes the results of an earlier run that would pass for those of a command that cannot begin.
fn remove_earlier(command: &Command, failure: Failure) -> Failure {
    match command {
        Command::Run(arguments) => run::remove_earlier(arguments, failure),
        Command::Batch(arguments) => batch::remove_earlier(arguments, failure),
        _ => failure,
    }
}

fn run_command(command: &Command, console: &Console) -> Result<(), Failure> {
    match command {
        Command::Demo(arguments) => demo::run(arguments, console),
        Command::Init(arguments) => init::run(arguments, console),
        Command::Run(arguments) => run::run(arguments, console),
        Command::Check(arguments) => check::run(arguments, console),
        Command::Batch(arguments) => batch::run(arguments, console),
        Command::Report(arguments) => report::run(arguments, console),
        Command::Compare(arguments) => compare::run(arguments, console),
        Command::Gradient(arguments) => gradient::run(arguments, console),
        Command::Quality(arguments) => quality::run(arguments, console),
        Command::Cut(arguments) => cut::run(arguments, console),
        Command::Convert(arguments) => convert::run(arguments, console),
        Command::Refine(arguments) => refine::run(arguments, console),
        Command::Adapters(arguments) => adapters::run(arguments, console),
        Command::Completions(arguments) => completions::run(arguments, console),
        Command::Schema(arguments) => schema::run(arguments, console),
        Command::Man(arguments) => man::run(arguments, console),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The message for these arguments, without colours.
    fn refused(arguments: &[&str]) -> String {
        let arguments: Vec<OsString> =
            std::iter::once("idmesh").chain(arguments.iter().copied()).map(Into::into).collect();
        parse(&arguments).unwrap_err().render().to_string()
    }

    #[test]
    fn messages_on_arguments_have_no_control_characters() {
        for arguments in [
            &["r\x1b[31mun"][..],
            &["run", "case.toml", "--\x1b[2J"],
            &["run", "case.toml", "--backend", "cpu\nerror: all is well"],
            &["cut", "a.msh", "--family", "w", "--out", "o.csv", "--at", "y=\u{202e}1\x07"],
            &["quality", "a.msh", "\u{9b}31m"],
        ] {
            let message = refused(arguments);
            let is_plain = |letter: char| letter == '\n' || shown(letter).to_string() == letter.to_string();
            assert!(message.chars().all(is_plain), "{message:?}");
            assert_eq!(message.matches("error: ").count() - message.matches("\\nerror: ").count(), 1, "{message}");
            assert!(message.contains('\\'), "{message}");
        }
    }

    /// Without such characters the message is clap's own, and help is no error of its own.
    #[test]
    fn other_messages_stay() {
        let plain = Arguments::try_parse_from(["idmesh", "rum"]).unwrap_err();
        assert_eq!(refused(&["rum"]), plain.render().to_string());
        assert!(refused(&["--help"]).contains("Usage: idmesh"));
    }
}
