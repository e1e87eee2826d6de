//! Displaced surfaces: the first byte selects the format.
#![no_main]

const NAMES: [&str; 4] = ["surfaces/s.vtp", "surfaces/s.vtu", "surfaces/s.stl", "surfaces/s.msh"];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::choose(&NAMES, bytes, idmesh_fuzz::input));
