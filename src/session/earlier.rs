//! [`EarlierResults`]: what an earlier run of a batch left, and how much of it still holds.
//!
//! A result is known by checksums: of the case, the mesh, the other inputs, the design and the
//! outputs. A result whose files have changed since is made again.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::checksums::{has_all_inputs, same_inputs, same_outputs, sums};
use super::{DesignFiles, Exit, Line, Outputs, ReportFile, SessionError};
use crate::report::Checksums;

/// The designs of a batch whose results an earlier run left.
#[derive(Debug, Default)]
pub struct EarlierResults {
    /// The lines of the designs that are done.
    done: BTreeMap<String, Line>,
}

impl EarlierResults {
    /// Finds the designs that are done: their lines and their outputs are there, and the checksums
    /// of inputs and outputs agree. A design that could not be moved is not done, because its fault
    /// may lie outside its files.
    ///
    /// - `designs`: the designs of this job
    /// - `case`: checksums of the case's files
    /// - `pattern`: the outputs of the case, to which a design gives its name
    ///
    /// # Errors
    /// The file cannot be read, or a line is no report of a design.
    pub fn find(
        file: &ReportFile,
        designs: &[DesignFiles],
        case: &Checksums,
        pattern: &Outputs,
    ) -> Result<Self, SessionError> {
        let mut lines: HashMap<String, Line> =
            file.lines()?.into_iter().map(|line| (line.design.clone(), line)).collect();
        let mut done = BTreeMap::new();
        for design in designs {
            let Some(line) = lines.remove(&design.name) else { continue };
            let Some(earlier) = line.checksums.as_ref().filter(|_| line.exit.is_some_and(has_result)) else { continue };
            let now = of_design(case, design);
            let outputs = pattern.named(&design.name)?;
            if has_all_inputs(&now)
                && same_inputs(earlier, &now)
                && same_outputs(&earlier.outputs, &outputs, line.valid)
            {
                done.insert(design.name.clone(), line);
            }
        }
        Ok(Self { done })
    }

    /// The line of a design that is done; `None` if it is to be done.
    pub fn line(&self, design: &DesignFiles) -> Option<&Line> {
        self.done.get(&design.name)
    }

    /// The number of designs that are done and failed.
    pub fn n_failed(&self) -> usize {
        self.done.values().filter(|line| line.exit != Some(0)).count()
    }

    /// Takes the lines out of a file that do not hold any more.
    ///
    /// | a line of | stays if |
    /// |---|---|
    /// | a design of this job | the design is done |
    /// | a design of another job of the same array | its inputs have not changed |
    /// | no design of the batch | `keeps_others` |
    ///
    /// - `designs`: the designs of this job
    /// - `all`: the designs of all jobs of the array
    /// - `case`: checksums of the case's files
    /// - `keeps_others`: whether the run goes on with an earlier one, or shares the file with a
    ///   running one
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn clear(
        &self,
        file: &ReportFile,
        designs: &[DesignFiles],
        all: &[DesignFiles],
        case: &Checksums,
        keeps_others: bool,
    ) -> Result<(), SessionError> {
        let own: HashSet<&str> = designs.iter().map(|design| design.name.as_str()).collect();
        let all: HashMap<&str, &DesignFiles> = all.iter().map(|design| (design.name.as_str(), design)).collect();
        file.keep(|line| match all.get(line.design.as_str()) {
            Some(_) if own.contains(line.design.as_str()) => self.done.contains_key(&line.design),
            Some(design) => {
                let now = of_design(case, design);
                line.checksums.as_ref().is_some_and(|earlier| same_inputs(earlier, &now))
            }
            None => keeps_others,
        })
    }
}

/// Whether a design with this exit code has files of a result.
pub(super) fn has_result(exit: u8) -> bool {
    [0, Exit::NotConverged as u8, Exit::Inverted as u8].contains(&exit)
}

/// The checksums of a case with those of a design.
pub fn of_design(case: &Checksums, design: &DesignFiles) -> Checksums {
    Checksums { design: sums(design.paths()), ..case.clone() }
}
