//! Meshes in XML of VTK.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::mesh("a.vtu", bytes));
