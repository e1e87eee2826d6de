//! Meshes of Medit: the first byte selects text or binary.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::choose(&["a.mesh", "a.meshb"], bytes, idmesh_fuzz::mesh));
