//! `idmesh init` makes a first case of a mesh.

use std::path::PathBuf;

use super::console::Console;
use super::estimate::SET_UP;
use super::failure::Failure;
use super::tell_of_file;
use crate::families::guess::Certainty;
use crate::formats;
use crate::report::aligned;
use crate::session::{InitProposal, InitWanted, check_free, propose};
use crate::text::{shell_word, shown};

/// Arguments of `idmesh init`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The roles of the families are guessed from their shapes, places and names. The
case runs as it is and moves nothing: change a file in its folder `new`.")]
pub(super) struct Arguments {
    /// The mesh file.
    mesh: PathBuf,
    /// The case file to write, ending in .toml, or a folder for case.toml. By default the folder
    /// MESH-case, here.
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// The families that are the wing, if the guess is wrong: wing_upper,wing_lower.
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    wing: Vec<String>,
    /// Cut each wing at this many planes.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..=999))]
    planes: u16,
    /// Replace files that are there.
    #[arg(long)]
    force: bool,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    console.check_stdout()?;
    let wanted = InitWanted {
        mesh: &arguments.mesh,
        target: arguments.output.as_deref(),
        wing: &arguments.wing,
        planes: arguments.planes.into(),
        replaces: arguments.force,
    };
    check_free(&wanted)?;
    console.estimate(SET_UP);
    console.step(&format!("reading {}", arguments.mesh.display()));
    let file = formats::read_mixed(&arguments.mesh)?;
    tell_of_file(&arguments.mesh, &file, console);
    let proposal = propose(&file, &wanted, console.progress())?;
    console.step("writing");
    proposal.write(|| console.data(&text(&proposal)))?;
    for (name, guess) in &proposal.families {
        if guess.certainty == Certainty::Doubtful {
            console.warn(format_args!("look at the role of `{name}` in {}", proposal.case.display()));
        }
    }
    for (name, wing) in &proposal.wings {
        let case = proposal.case.display();
        if wing.sections.in_doubt {
            console.warn(format_args!(
                "{case}: the shape of no section of `{name}` tells the leading from the trailing edge; the leading edge is \
                 taken at the smaller x"
            ));
        }
        let twists = wing.sections.poses.iter().filter_map(|pose| pose.twist);
        if twists.into_iter().any(|(_, twist)| twist.abs() > 90.0) {
            console.warn(format_args!(
                "{case}: sections of `{name}` have their leading edge downstream along x: an airfoil placed with their twist \
                 has its upper side below"
            ));
        }
    }
    let n_sections = proposal.paths().filter(|path| path.extension().is_some_and(|end| end == "csv")).count();
    console.note(format_args!("wrote {}, its schema and {n_sections} files with sections", proposal.case.display()));
    Ok(())
}

/// The guesses, and what to do next.
fn text(proposal: &InitProposal) -> String {
    let mut rows = vec![["family", "role", "guess"].map(str::to_owned).to_vec()];
    for (name, guess) in &proposal.families {
        rows.push(vec![name.clone(), guess.role.name().to_owned(), guess.certainty.name().to_owned()]);
    }
    let reasons = std::iter::once("reason".to_owned())
        .chain(proposal.families.iter().map(|(_, guess)| shown(&guess.reason).to_string()));
    let width = rows.iter().map(|row| row[2].chars().count()).max().unwrap_or_default();
    for row in &mut rows {
        row[2] = format!("{:width$}", row[2]);
    }
    let table = aligned(&rows);
    let mut text: String = table.lines().zip(reasons).map(|(line, reason)| format!("{line}  {reason}\n")).collect();
    for (name, wing) in &proposal.wings {
        text += &format!("\n{}: {} sections\n", shown(name), wing.sections.profiles.len());
    }
    let case = shell_word(proposal.case.display());
    let changed = proposal.paths().find(|path| path.parent().is_some_and(|folder| folder.ends_with("new")));
    let changed = changed.map_or(String::new(), |path| shown(path.display()).to_string());
    text += &format!(
        "\nnext:\n  idmesh run {case}   nothing moves yet\n  change {changed} or another file beside it, and run again\n"
    );
    text
}
