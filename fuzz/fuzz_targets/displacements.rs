//! Prescribed displacements.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::input("flap.csv", bytes));
