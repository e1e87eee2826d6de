//! Files with the names of a mesh's families.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::mesh("names.mapbc", bytes));
