//! What a fuzzer's input must do: be read or refused, and if read, be written back as it was.
//!
//! The demands are those of the package's own test with random damage, `tests/formats`.

use std::fs;
use std::path::Path;

use idmesh::formats;

#[path = "../../tests/formats/damage.rs"]
#[allow(dead_code, reason = "fuzzers damage files themselves")]
mod damage;

#[path = "../../tests/formats/damage_inputs.rs"]
#[allow(dead_code, reason = "fuzzers have seeds of their own")]
mod damage_inputs;

/// A mesh file; its name selects the format.
pub fn mesh(name: &str, bytes: &[u8]) {
    damage::survives(name, bytes);
}

/// A case, a list of designs, displacements or profiles, by the names of the seeds.
pub fn input(name: &str, bytes: &[u8]) {
    damage_inputs::survives(name, bytes);
}

/// The rest of the input, with what its first byte selects.
pub fn choose(from: &[&str], bytes: &[u8], read: impl Fn(&str, &[u8])) {
    if let Some((&first, rest)) = bytes.split_first() {
        read(from[first as usize % from.len()], rest);
    }
}

/// A golden folder of OpenFOAM in which one file is replaced.
pub fn polymesh(name: &str, bytes: &[u8]) {
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data/mixed/foam.ascii/constant/polyMesh");
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    for entry in fs::read_dir(golden).expect("the golden folder") {
        let path = entry.expect("a file of it").path();
        fs::copy(&path, folder.path().join(path.file_name().unwrap_or_default())).expect("a copy");
    }
    fs::write(folder.path().join(name), bytes).expect("a file in it");
    drop(formats::read_mixed(&folder.path().join("points")));
}
