//! [`Checksums`]: the files of a report, by which a later run knows whether its results still hold.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// SHA-256 sums by file, in hexadecimal digits. A file that cannot be read twice, such as a pipe,
/// has none.
pub type Sums = BTreeMap<String, Option<String>>;

/// Checksums of the files that a report belongs to, by the names that the user gave them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checksums {
    /// The case file.
    pub case: Sums,
    /// The mesh: one file, or the files of a folder, and files beside the mesh.
    pub mesh: Sums,
    /// Other files that the case names: profiles and displacements.
    pub inputs: Sums,
    /// The files of the design. Empty for the design of the case itself.
    pub design: Sums,
    /// The files that were written.
    pub outputs: Sums,
}
