//! What a fuzzer's input must do: be read or refused. If it is read, it must be written back as it
//! was, and moved, written and read again it must be the same mesh.
//!
//! The demands are those of the package's own test with random damage, `tests/formats`.

#[path = "../../tests/formats/damage.rs"]
#[allow(dead_code, unused_imports, reason = "fuzzers damage files themselves")]
mod damage;

#[path = "../../tests/formats/damage_inputs.rs"]
#[allow(dead_code, reason = "fuzzers have seeds of their own")]
mod damage_inputs;

/// A mesh file; its name selects the format. A file of a golden OpenFOAM mesh has the folder of the
/// others before its name, such as `foam.ascii/owner`.
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
