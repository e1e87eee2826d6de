//! Lists of a batch's designs.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::input("designs.txt", bytes));
