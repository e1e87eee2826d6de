//! Meshes in Gmsh.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::mesh("a.msh", bytes));
