//! Folders of OpenFOAM: the first byte selects the file of a golden folder that the rest replaces.
#![no_main]

const FILES: [&str; 5] = ["points", "faces", "owner", "neighbour", "boundary"];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::choose(&FILES, bytes, idmesh_fuzz::polymesh));
