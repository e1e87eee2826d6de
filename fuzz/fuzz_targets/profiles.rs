//! Profiles: the first byte selects the format.
#![no_main]

const NAMES: [&str; 8] = [
    "section.csv",
    "selig.dat",
    "lednicer.txt",
    "zones.tec",
    "segments.plt",
    "section.json",
    "diamonds.vtp",
    "diamonds.vtk",
];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::choose(&NAMES, bytes, idmesh_fuzz::input));
