//! Meshes of AFLR3: the first byte selects the variant.
#![no_main]

const VARIANTS: [&str; 7] = ["ugrid", "b8.ugrid", "lb4.ugrid", "b8l.ugrid", "lb8l.ugrid", "r8.ugrid", "lr4.ugrid"];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| idmesh_fuzz::choose(&VARIANTS, bytes, |variant, rest| {
    idmesh_fuzz::mesh(&format!("a.{variant}"), rest);
}));
