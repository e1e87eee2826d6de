//! What the designs of a batch replace in a case.

use std::path::Path;

use super::designs::DesignFiles;
use super::failure::Failure;
use super::job::{Job, about_profiles, prescribed, read_profiles};
use crate::mesh::FamilyId;
use crate::mover::Design;
use crate::profile::{self, Plane, Profile, files};

/// Profiles lie in the same plane within this fraction of their size, as the points of one do.
const PLANES: f64 = 1e-6;

/// What a design replaces in a case.
#[derive(Clone, Debug)]
pub(super) enum Varied {
    /// The new profiles of these wings.
    Profiles(Vec<String>),
    /// The displacement of a prescribed family.
    Displacement(FamilyId),
}

impl Varied {
    /// All sets of profiles, or, where there are none, the one displacement.
    ///
    /// # Errors
    /// There is none, or several displacements.
    pub(super) fn of(job: &Job) -> Result<Self, Failure> {
        let wings: Vec<String> = job.design.profiles.keys().cloned().collect();
        let prescribed: Vec<FamilyId> = job.design.prescribed.keys().copied().collect();
        match prescribed.as_slice() {
            _ if !wings.is_empty() => Ok(Self::Profiles(wings)),
            &[family] => Ok(Self::Displacement(family)),
            prescribed => Err(Failure::bad_input(format!(
                "{}: no table [profiles.NAME] and {} prescribed families, expected tables whose profiles the designs \
                 replace, or one prescribed family",
                job.case.path.display(),
                prescribed.len()
            ))),
        }
    }

    /// The extensions that designs have in a folder.
    pub(super) fn extensions(&self) -> &'static [&'static str] {
        match self {
            Self::Profiles(..) => files::EXTENSIONS,
            Self::Displacement(_) => &["csv"],
        }
    }

    /// The tables of a design that is of several files.
    pub(super) fn tables(&self) -> &[String] {
        match self {
            Self::Profiles(wings) => wings,
            Self::Displacement(_) => &[],
        }
    }

    /// The job's design with what files say in place of what it varies.
    ///
    /// # Errors
    /// A file is missing, cannot be read or is wrong, or its profiles lie in other planes than
    /// those cut from the mesh.
    pub(super) fn read(&self, job: &Job, design_files: &DesignFiles) -> Result<Design, Failure> {
        let mut design = job.design.clone();
        match self {
            Self::Displacement(family) => {
                let rows = prescribed(&job.file.mesh, *family, design_files.only()?)?.rows;
                design.prescribed.insert(*family, rows.into_iter().map(|row| row.displacement).collect());
            }
            Self::Profiles(wings) if wings.len() == 1 && design_files.is_single() => {
                design.profiles.insert(wings[0].clone(), profiles(job, &wings[0], design_files.only()?)?);
            }
            Self::Profiles(wings) => {
                for wing in wings {
                    design.profiles.insert(wing.clone(), profiles(job, wing, design_files.of_table(wing)?)?);
                }
            }
        }
        Ok(design)
    }
}

/// The new profiles of a wing from a design's file.
fn profiles(job: &Job, wing: &str, path: &Path) -> Result<Vec<Profile>, Failure> {
    let mut source = job.case.profiles[wing].clone();
    // An airfoil takes the place of the case's.
    if let [only] = source.new.as_slice()
        && let Some(placement) = source.placements.get(only).cloned()
    {
        source.placements.insert(path.to_path_buf(), placement);
    }
    let paths = [path.to_path_buf()];
    let new = read_profiles(&paths, &source)?;
    if source.old.is_none() {
        same_planes(&job.design.profiles[wing], &new).map_err(|failure| about_profiles(failure, wing, &paths))?;
    }
    Ok(new)
}

/// Refuses profiles in other planes than those at which the old ones were cut: their motion would
/// be another than in a run of their own, where the old ones are cut at their planes.
fn same_planes(cut: &[Profile], new: &[Profile]) -> Result<(), Failure> {
    let bad = |error: profile::ProfileError| Failure::bad_input(error.to_string());
    for profile in new {
        let Some(like) = cut.iter().find(|other| other.number == profile.number) else { continue };
        let plane = Plane::of_profile(like).map_err(bad)?;
        let size = profile.points.iter().map(|point| point.distance(profile.points[0])).fold(0.0, f64::max);
        let off = profile.points.iter().map(|&point| plane.distance(point).abs()).fold(0.0, f64::max);
        if off > PLANES * size {
            let message = format!(
                "profile {} is up to {off:.1e} away from the plane at which the case's new profiles let the old one be cut",
                profile.number
            );
            return Err(Failure::bad_input(message).with_hint("name the old profiles in the case: old = \"FILE\""));
        }
    }
    Ok(())
}
