//! Meshes in CGNS.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::mesh("a.cgns", bytes));
