//! The text of a first case, with the reason of each guess in its comments.

use std::fmt;
use std::path::Path;

use crate::families::Role;
use crate::families::guess::{Guess, GuessedWing};
use crate::profile::Plane;
use crate::text::figures::Shortest;
use crate::text::{shell_word, shown};

/// What to look at where the shape of no section tells its leading edge.
const IN_DOUBT: &str =
    "LOOK: no section's shape tells its leading from its trailing edge. The leading edge is taken at the
# smaller x. If the flow comes from the other side, an airfoil that is placed so lies backwards.";

/// What to do where the leading edge is at the greater x.
const UPSIDE_DOWN: &str =
    "LOOK: the leading edge is at the greater x, and the twist turns an airfoil by half a turn, with its upper
# side below. Change the sign of each y in the airfoil's file: its upper side is then above.";

/// A case file.
pub(super) struct Case<'a> {
    /// What the new sections are, in a line that ends before a command.
    pub about: &'a str,
    /// The file of the schema of cases, beside the case.
    pub schema: &'a str,
    /// The path of the mesh from the case.
    pub mesh: &'a str,
    pub families: &'a [(String, Guess)],
    pub wings: &'a [(String, GuessedWing)],
    /// For each wing the file with its old profiles, and the files with the new ones, from the
    /// case.
    pub files: &'a [(String, Vec<String>)],
    /// The name of the moved mesh.
    pub output: &'a str,
    /// The path of the case.
    pub case: &'a Path,
}

/// A name with letters that every file system takes.
pub(super) fn slug(name: &str) -> String {
    let plain = |letter: char| if letter.is_ascii_alphanumeric() || "-_".contains(letter) { letter } else { '_' };
    let slug: String = name.chars().map(plain).take(60).collect();
    if slug.is_empty() { "wing".to_owned() } else { slug }
}

/// A text of TOML in one line, in which a terminal obeys nothing.
fn quoted(text: &str) -> String {
    let mut quoted = "\"".to_owned();
    for letter in text.chars() {
        match letter {
            '"' | '\\' => quoted.extend(['\\', letter]),
            _ if shown(letter).to_string() != letter.to_string() => quoted += &format!("\\U{:08X}", u32::from(letter)),
            _ => quoted.push(letter),
        }
    }
    quoted + "\""
}

/// A key of TOML.
fn key(name: &str) -> String {
    let is_bare = |letter: char| letter.is_ascii_alphanumeric() || "-_".contains(letter);
    if !name.is_empty() && name.chars().all(is_bare) { name.to_owned() } else { quoted(name) }
}

/// The plane of a section in words.
fn place_of(plane: &Plane) -> String {
    let normal = plane.normal.to_array();
    match normal.iter().position(|part| part.abs() == 1.0) {
        Some(axis) => format!("{} = {}", ["x", "y", "z"][axis], length(plane.point.dot(plane.normal) * normal[axis])),
        None => {
            let [x, y, z] = normal.map(|part| Shortest(format!("{part:.4}").parse().unwrap_or(part)));
            format!("across [{x}, {y}, {z}]")
        }
    }
}

/// A length with so many digits that a placement is right to 1e-8 of the mesh's size.
fn length(x: f64) -> Shortest {
    Shortest(format!("{x:.8e}").parse().unwrap_or(x))
}

impl fmt::Display for Case<'_> {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let case = shell_word(self.case.display());
        writeln!(out, "#:schema ./{}\n", self.schema)?;
        writeln!(
            out,
            "# A case for {}, made by `idmesh init`. Roles are guesses; each has its reason.",
            shown(self.mesh)
        )?;
        writeln!(out, "# {}", self.about)?;
        writeln!(out, "#\n#     idmesh run {case}\n#\n# Paths are relative to this file.\n")?;
        writeln!(out, "mesh = {}", quoted(self.mesh))?;
        for ((name, wing), (old, new)) in self.wings.iter().zip(self.files) {
            self.wing(out, name, wing, old, new)?;
        }
        writeln!(out, "\n# One table for each family of the mesh: what it does when the wing changes.")?;
        for (name, guess) in self.families {
            writeln!(out, "\n# {}: {}", guess.certainty.name(), shown(&guess.reason))?;
            writeln!(out, "[family.{}]\nrole = {}", key(name), quoted(guess.role.name()))?;
            match &guess.role {
                Role::Wingtip { coefficient, .. } => {
                    writeln!(out, "coefficient = {coefficient:?}   # 0 rigid ... 1 freely deformable")?;
                }
                Role::Attached { .. } => {
                    writeln!(
                        out,
                        "# junction = \"slide\"   # keeps its shape where the chord changes: its curve on the wing slides"
                    )?;
                }
                Role::Plane { flat: Some(flat), .. } => {
                    writeln!(
                        out,
                        "flat = {flat:e}   # its vertices lie so far off their plane, as a share of its size"
                    )?;
                }
                _ => {}
            }
        }
        writeln!(
            out,
            "\n[quality]\ntarget = \"original\"   # repairs what springs leave bad; \"improve\" goes past it, \"off\""
        )?;
        writeln!(out, "\n[output]\nmesh = {}", quoted(self.output))?;
        writeln!(out, "report = \"report.html\"   # open it in a browser")
    }
}

impl Case<'_> {
    fn wing(&self, out: &mut fmt::Formatter, name: &str, wing: &GuessedWing, old: &str, new: &[String]) -> fmt::Result {
        let sections = &wing.sections;
        writeln!(
            out,
            "\n# The sections of {}: a new one takes the place of the old one with the same number.",
            shown(name)
        )?;
        writeln!(out, "[profiles.{}]", key(name))?;
        let names: Vec<&str> = wing.families.iter().map(|family| self.families[family.index()].0.as_str()).collect();
        if names != [name] {
            let list: Vec<String> = names.iter().map(|name| quoted(name)).collect();
            writeln!(out, "families = [{}]", list.join(", "))?;
        }
        writeln!(out, "new = [")?;
        for ((file, plane), pose) in new.iter().zip(&sections.planes).zip(&sections.poses) {
            let place = place_of(plane);
            let [x, y, z] = pose.leading_edge.to_array().map(length);
            let twist = pose.twist.map_or(String::new(), |(_, twist)| format!(", twist {twist:.4}"));
            writeln!(
                out,
                "    {},   # {place}: chord {}, {:.2} % thick{twist}, leading edge [{x}, {y}, {z}]",
                quoted(file),
                length(pose.chord),
                100.0 * pose.thickness,
            )?;
        }
        writeln!(out, "]\nold = {}", quoted(old))?;
        if let Some(mirror) = &wing.mirror {
            let axis = ["x", "y", "z"][mirror.normal.abs().max_position()];
            let plane = match mirror.point.dot(mirror.normal) {
                0.0 => axis.to_owned(),
                at => format!("{axis}={}", length(at)),
            };
            writeln!(
                out,
                "mirror = {}   # the other half moves as the mirror image of these sections",
                quoted(&plane)
            )?;
        }
        let Some((pose, plane)) = sections.poses.first().zip(sections.planes.first()) else { return Ok(()) };
        let axis = ["x", "y", "z"][plane.normal.abs().max_position()];
        let [x, y, z] = pose.leading_edge.to_array().map(length);
        writeln!(
            out,
            "\n# An airfoil with a chord of 1 can stand for a section: put its file into `new` in place of that"
        )?;
        writeln!(out, "# section's, and say where it stands. For the first section:")?;
        let advice =
            [(sections.in_doubt, IN_DOUBT), (pose.twist.is_some_and(|(_, twist)| twist.abs() > 90.0), UPSIDE_DOWN)];
        for (_, advice) in advice.into_iter().filter(|(holds, _)| *holds) {
            writeln!(out, "#\n# {advice}")?;
        }
        writeln!(out, "#")?;
        writeln!(out, "# [profiles.{}.placement.\"new/airfoil.dat\"]", key(name))?;
        writeln!(out, "# chord = {}\n# position = [{x}, {y}, {z}]", length(pose.chord))?;
        if let Some((_, twist)) = pose.twist {
            writeln!(out, "# twist = {twist:.6}\n# plane = \"{axis}\"")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_in_files_and_tables() {
        for (name, file) in [
            ("wing", "wing"),
            ("left wing", "left_wing"),
            ("../x", "___x"),
            ("a\"b\\\n\u{7f}\u{202e}\u{e0001}\u{1f6e9}", "a_b______"),
            ("", "wing"),
            ("7", "7"),
        ] {
            assert_eq!(slug(name), file);
            // The key is read back as the name, whatever its form.
            let text = format!("[family.{}]\nrole = 1\n", key(name));
            let read: toml::Table = text.parse().unwrap_or_else(|error| panic!("{text}: {error}"));
            assert!(read["family"].as_table().unwrap().contains_key(name), "{text}");
            assert!(text.lines().count() == 2 && text.chars().all(|letter| letter == '\n' || !letter.is_control()));
        }
    }
}
