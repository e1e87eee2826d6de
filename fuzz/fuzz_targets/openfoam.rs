//! Meshes of OpenFOAM: the first byte selects the file of a golden mesh that the rest replaces.
#![no_main]

const FILES: [&str; 10] = [
    "foam.ascii/points",
    "foam.ascii/faces",
    "foam.ascii/owner",
    "foam.ascii/neighbour",
    "foam.ascii/boundary",
    "foam.binary/points",
    "foam.binary/faces",
    "foam.binary/owner",
    "foam.binary/neighbour",
    "foam.binary/boundary",
];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::choose(&FILES, bytes, idmesh_fuzz::mesh));
