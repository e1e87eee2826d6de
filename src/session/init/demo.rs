//! A case to try idmesh with: a small half aircraft, whose mesh is in the program, with a wing that
//! becomes thicker and bends up.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::{Proposal, Wanted, free, make};
use crate::case::LoadError;
use crate::families::guess::Sections;
use crate::formats::read_bytes;
use crate::profile::Profile;
use crate::session::SessionError;

/// The mesh of `tests/data/small.msh.gz`, see the table there: half an aircraft of 5141 tets.
const MESH: &[u8] = include_bytes!("wing-body.msh.gz");

/// The name of the mesh's file.
const NAME: &str = "wing-body.msh.gz";

/// The design makes sections thicker by this share.
const THICKER: f64 = 0.1;

/// The design raises the last section by this share of the span, and the others by the square of
/// their place along the span.
const RAISED: f64 = 0.08;

fn wanted<'a>(folder: &'a Path, mesh: &'a Path, replaces: bool) -> Wanted<'a> {
    Wanted { mesh, target: Some(folder), wing: &[], planes: 5, replaces }
}

/// Checks that a folder holds neither the mesh nor the case of an earlier demonstration.
///
/// # Errors
/// [`SessionError::Exists`]
pub fn check_demo_is_free(folder: &Path, replaces: bool) -> Result<(), SessionError> {
    let mesh = folder.join(NAME);
    let paths: [PathBuf; 2] = [mesh.clone(), folder.join("case.toml")];
    free(&wanted(folder, &mesh, replaces), paths.iter())
}

/// The case in a folder, with its mesh.
///
/// - `replaces`: whether files that are there may be replaced
///
/// # Errors
/// As for [`super::propose`].
pub fn propose_demo(
    folder: &Path,
    replaces: bool,
    progress: impl Fn(&str) + Clone + Send + 'static,
) -> Result<Proposal, SessionError> {
    let mesh = folder.join(NAME);
    let file = read_bytes(&mesh, MESH.to_vec()).map_err(LoadError::from)?;
    let wanted = wanted(folder, &mesh, replaces);
    let about = "Its wing becomes thicker and bends up. Change a file in `new`, and run";
    let mut proposal = make(&file, &wanted, about, &bent_up, progress)?;
    proposal.files.insert(0, (mesh.clone(), MESH.to_vec()));
    free(&wanted, proposal.files.iter().map(|(path, _)| path))?;
    Ok(proposal)
}

/// The new sections.
fn bent_up(sections: &Sections) -> Vec<Profile> {
    let [from, to] = sections.span;
    let raised = sections.profiles.iter().zip(&sections.planes).zip(&sections.poses);
    let profile = |((profile, plane), pose): ((&Profile, &crate::profile::Plane), &crate::profile::Pose)| {
        let share = (plane.point.dot(sections.normal) - from) / (to - from);
        let [first, last] = [profile.points[0], profile.points[profile.points.len() - 1]];
        let chord = (0.5 * (first + last) - pose.leading_edge).normalize_or(DVec3::X);
        let across = sections.normal.cross(chord).normalize_or(DVec3::Z);
        let up = DVec3::Z * (RAISED * (to - from) * share * share);
        let place = |at: &DVec3| *at + across * (THICKER * (*at - pose.leading_edge).dot(across)) + up;
        Profile { number: profile.number, points: profile.points.iter().map(place).collect() }
    };
    raised.map(profile).collect()
}
