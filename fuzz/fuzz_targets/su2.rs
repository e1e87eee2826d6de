//! Meshes in SU2.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::mesh("a.su2", bytes));
