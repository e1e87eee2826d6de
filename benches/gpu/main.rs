//! What a machine's GPU does with idmesh, in one command with a time limit: a table in Markdown.
//!
//! `gpu [--seconds S] [--millions M]`: at most S seconds (480) and meshes of at most M million tets
//! (100). Parts run one after another in processes of their own, each with a limit. A part that
//! fails, hangs or finds no time left is named, and the others run all the same. It needs its
//! folder as `benches/run_all carry` makes it, or Cargo, and no other file.
//!
//! | part | what it tells |
//! |---|---|
//! | `start` | the tests of the kernels at the start of the adapter |
//! | `parity` | moved meshes on the GPU against the CPU in f64 |
//! | `crossover` | the size from which on a network is relaxed faster on the GPU |
//! | `sizes` | what a mesh costs by its size, and sweeps as a share of copying |

#[path = "../common/mod.rs"]
mod common;

mod crossover;
mod machine;
mod parity;
mod sizes;
mod start;

use std::{
    io::{BufRead, BufReader, Write as _},
    process::{Command, ExitCode, Stdio},
    thread,
    time::{Duration, Instant},
};

use common::{Failure, cost::heap};
use idmesh::backend::gpu::{Bounds, Choice, GpuBackend};

/// Counts the bytes in use.
#[global_allocator]
static HEAP: heap::Counting = heap::Counting;

/// A part: its name, its share of the whole time, and what runs.
type Part = (&'static str, f64, fn(&Budget) -> Result<(), Failure>);

/// The parts in order. The last takes the time that is left.
const PARTS: [Part; 4] = [
    ("start", 0.1, start::run),
    ("parity", 0.3, parity::run),
    ("crossover", 0.2, crossover::run),
    ("sizes", 1.0, sizes::run),
];

/// Seconds without `--seconds`.
const SECONDS: f64 = 480.0;

/// Seconds that are left for the end of a process and the last lines.
const SPARE: f64 = 2.0;

/// Time and size of a run.
pub struct Budget {
    end: Instant,
    millions: f64,
}

impl Budget {
    /// Seconds that are left.
    pub fn left(&self) -> f64 {
        self.end.saturating_duration_since(Instant::now()).as_secs_f64()
    }

    /// Why a piece of work of so many seconds is not begun; nothing if it fits.
    pub fn refuses(&self, seconds: f64) -> Option<String> {
        let left = self.left();
        (seconds > left).then(|| format!("needs about {seconds:.0} s, {left:.0} s are left"))
    }
}

fn main() -> ExitCode {
    common::end(run())
}

fn run() -> Result<(), Failure> {
    let (mut seconds, mut millions, mut part) = (SECONDS, 100.0, None);
    let mut words = std::env::args().skip(1).filter(|word| word != "--bench");
    while let Some(word) = words.next() {
        let mut number = || -> Result<f64, Failure> {
            let text = words.next().unwrap_or_default();
            let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && number.is_finite());
            number.ok_or_else(|| format!("{word} needs a number above 0, not `{text}`").into())
        };
        match word.as_str() {
            "--seconds" => seconds = number()?,
            "--millions" => millions = number()?,
            "--part" => part = words.next(),
            _ => return Err(format!("`{word}` is neither --seconds nor --millions").into()),
        }
    }
    let budget = Budget { end: Instant::now() + Duration::from_secs_f64(seconds), millions };
    match part {
        None => all(&budget, seconds),
        Some(name) => {
            let (.., run) = PARTS.iter().find(|(of, ..)| *of == name).ok_or("there is no such part")?;
            run(&budget)
        }
    }
}

/// The GPU, whose kernels are timed.
///
/// # Errors
/// There is none.
pub fn gpu(bounds: Bounds) -> Result<GpuBackend, Failure> {
    Ok(GpuBackend::with_bounds(Choice::Any, Bounds { times: true, ..bounds })?)
}

/// Prints a row of a table in Markdown, at once.
pub fn print_cells(cells: &[String]) {
    println!("| {} |", cells.join(" | "));
    // Where nobody reads any more the part may as well go on.
    let _ = std::io::stdout().flush();
}

/// Prints the header of a table in Markdown, the first column to the left.
pub fn print_header(names: &[&str]) {
    print_cells(&common::row(names));
    let rule = |at: usize| if at == 0 { "---" } else { "---:" };
    print_cells(&(0..names.len()).map(|at| rule(at).to_owned()).collect::<Vec<_>>());
}

fn all(budget: &Budget, seconds: f64) -> Result<(), Failure> {
    machine::print();
    let mut failed = Vec::new();
    for (name, share, _) in PARTS {
        println!("\n## {name}\n");
        let limit = (share * seconds).min(budget.left() - SPARE);
        let end = if limit < 1.0 {
            Err("not run: no time is left".to_owned())
        } else {
            in_process(name, limit, budget.millions)
        };
        if let Err(why) = end {
            println!("\n**{name}: {why}**");
            failed.push(name);
        }
    }
    println!("\n{:.0} of {seconds:.0} s", seconds - budget.left());
    if failed.is_empty() { Ok(()) } else { Err(format!("not as it should be: {}", failed.join(", ")).into()) }
}

/// Runs a part in a process of its own, which is ended at its limit. Returns what is wrong with it.
fn in_process(name: &str, limit: f64, millions: f64) -> Result<(), String> {
    let program = std::env::current_exe().map_err(|error| format!("not run: {error}"))?;
    let end = Instant::now() + Duration::from_secs_f64(limit);
    let mut command = Command::new(program);
    command.args(["--part", name, "--seconds", &(limit - 0.5).to_string(), "--millions", &millions.to_string()]);
    // Mesa's layers speak on standard error otherwise.
    command.env("NODEVICE_SELECT", "1").stdout(Stdio::piped());
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        command.env("XDG_RUNTIME_DIR", std::env::temp_dir());
    }
    let mut process = command.spawn().map_err(|error| format!("not run: {error}"))?;
    let output = process.stdout.take();
    let told = thread::spawn(move || {
        let lines = output.into_iter().flat_map(|output| BufReader::new(output).lines());
        lines.map_while(Result::ok).for_each(|line| println!("{line}"));
    });
    let status = loop {
        match process.try_wait() {
            Ok(Some(status)) => break Ok(status),
            Ok(None) if Instant::now() < end => thread::sleep(Duration::from_millis(20)),
            Ok(None) => {
                let ended = process.kill().and_then(|()| process.wait());
                break Err(
                    ended.map_or_else(|error| error.to_string(), |_| format!("ended at its limit of {limit:.0} s"))
                );
            }
            Err(error) => break Err(error.to_string()),
        }
    };
    drop(told.join());
    match status? {
        status if status.success() => Ok(()),
        status => Err(format!("failed ({status}); its message is on standard error")),
    }
}
