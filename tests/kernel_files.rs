//! The kernels' files: shaders and twins belong together, are valid, and are laid out alike.

use std::collections::BTreeSet;
use std::fs;
use std::mem::offset_of;
use std::path::Path;

use idmesh::kernels::row::Entry;
use idmesh::kernels::{
    DOUBLE_KERNELS, KERNELS, Kernel, NUMBER_TYPES, PARTS, accelerate, accelerate_double, add_correction, coarse_cycle,
    convergence, defect, figures, first_sweep, hand_over, raise_worst_beta, relax_sweep, residual_double, rest_load,
    restrict_sweep, smooth_vertices, squares, transfer, turn,
};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module, TypeInner};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The kernels of both tables.
fn kernels() -> impl Iterator<Item = &'static Kernel> {
    KERNELS.iter().chain(&DOUBLE_KERNELS)
}

fn stems(folder: &str, extension: &str) -> BTreeSet<String> {
    let files = fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path());
    let files = files.filter(|path| path.extension().is_some_and(|found| found == extension));
    files.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect()
}

fn parse(source: &str, name: &str) -> Module {
    naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{name}: {}", error.emit_to_string(source)))
}

#[test]
fn every_kernel_has_its_files_and_its_row() {
    let table: BTreeSet<String> = kernels().map(|kernel| kernel.name).chain(PARTS).map(str::to_owned).collect();
    let number_types = NUMBER_TYPES.map(str::to_owned);
    let files: BTreeSet<String> = table.iter().cloned().chain(number_types).collect();
    assert_eq!(stems("kernels", "wgsl"), files, "kernels/*.wgsl against the table");
    let mut twins = stems("src/kernels", "rs");
    // The table itself and the number types, of which kernels have one each.
    assert!(twins.remove("mod") && twins.remove("real"));
    assert_eq!(twins, table, "src/kernels/*.rs against the table");
    let readme = fs::read_to_string(root().join("kernels/README.md")).unwrap();
    for name in &files {
        assert!(readme.contains(&format!("| `{name}.wgsl`")), "kernels/README.md has no row for {name}");
    }
    for kernel in kernels() {
        let file = |stem: &str| fs::read_to_string(root().join(format!("kernels/{stem}.wgsl"))).unwrap();
        let parts: String = kernel.parts.iter().map(|stem| file(stem)).collect();
        assert_eq!(kernel.source, parts.clone() + &file(kernel.name), "{}", kernel.name);
        assert!(parse(&parts, kernel.name).entry_points.is_empty(), "a part of {} has an entry", kernel.name);
    }
}

#[test]
fn every_kernel_validates_within_webgpu_limits() {
    for kernel in kernels() {
        let module = parse(kernel.source, kernel.name);
        let is_double = DOUBLE_KERNELS.iter().any(|double| double.name == kernel.name);
        let capabilities = if is_double { Capabilities::FLOAT64 } else { Capabilities::empty() };
        if let Err(error) = Validator::new(ValidationFlags::all(), capabilities).validate(&module) {
            panic!("{}: {}", kernel.name, error.emit_to_string(kernel.source));
        }
        let is_storage = |space| matches!(space, AddressSpace::Storage { .. });
        let n_storage = module.global_variables.iter().filter(|(_, variable)| is_storage(variable.space)).count();
        assert!(n_storage <= 8, "{} binds {n_storage} storage buffers", kernel.name);
        let [entry] = &module.entry_points[..] else { panic!("{} has not one entry point", kernel.name) };
        assert_eq!(entry.name, kernel.name);
        assert!(entry.workgroup_size.iter().product::<u32>() <= 256, "{}", kernel.name);
    }
}

/// Under Direct3D naga puts the number of workgroups where the entry itself reads it. A function
/// that is handed the struct of builtins would read the group's own number in its place, and no
/// other platform would show it.
#[test]
fn no_function_but_the_entry_reads_builtins() {
    for kernel in kernels() {
        let module = parse(kernel.source, kernel.name);
        for (_, function) in module.functions.iter() {
            for argument in &function.arguments {
                let TypeInner::Struct { members, .. } = &module.types[argument.ty].inner else { continue };
                let builtin = members.iter().find(|member| member.binding.is_some());
                assert!(builtin.is_none(), "{}: {:?} is handed {builtin:?}", kernel.name, function.name);
            }
        }
    }
}

/// Names, offsets and size of a struct in a kernel.
fn layout(kernel: &str, of: &str) -> (Vec<(String, u32)>, u32) {
    let kernel = kernels().find(|found| found.name == kernel).unwrap();
    let module = parse(kernel.source, kernel.name);
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(of)).unwrap().1;
    let TypeInner::Struct { members, span } = &found.inner else { panic!("{of} is no struct") };
    (members.iter().map(|member| (member.name.clone().unwrap(), member.offset)).collect(), *span)
}

macro_rules! assert_layout {
    ($kernel:literal, $struct:literal, $rust:ty, $($member:ident),*) => {
        let (members, span) = layout($kernel, $struct);
        let expected = vec![$((stringify!($member).to_owned(), offset_of!($rust, $member) as u32)),*];
        assert_eq!(members, expected, "{} {}", $kernel, $struct);
        assert_eq!(span as usize, size_of::<$rust>(), "{} {}", $kernel, $struct);
    };
}

#[test]
fn structs_are_laid_out_as_in_wgsl() {
    assert_layout!("relax_sweep", "Params", relax_sweep::Params, first_row, n_rows, relaxation, momentum);
    assert_layout!("relax_sweep", "Entry", Entry, column, stiffness);
    assert_layout!("convergence", "Params", convergence::Params, first_row, n_rows);
    assert_layout!("convergence", "Entry", Entry, column, stiffness);
    assert_layout!("defect", "Params", defect::Params, first_row, n_rows);
    assert_layout!("transfer", "Params", transfer::Params, first_row, n_rows, keep, padding);
    let weight = (vec![("column".to_owned(), 0), ("weight".to_owned(), 4)], 8);
    assert_eq!(layout("transfer", "Weight"), weight, "weights are stored as entries");
    assert_layout!("accelerate", "Params", accelerate::Params, n_vertices, relaxation, momentum, first_partial);
    assert_layout!("first_sweep", "Params", first_sweep::Params, first_row, n_rows, relaxation, padding);
    assert_layout!("restrict_sweep", "Params", restrict_sweep::Params, first_row, n_rows, relaxation, padding);
    assert_eq!(layout("restrict_sweep", "Weight"), weight, "weights are stored as entries");
    assert_layout!("coarse_cycle", "Params", coarse_cycle::Params, n_steps, n_rows);
    assert_layout!("coarse_cycle", "Step", coarse_cycle::Step, kind, first_row, n_rows, half, relaxation, momentum);
    let entry = (vec![("column".to_owned(), 0), ("value".to_owned(), 4)], 8);
    assert_eq!(layout("coarse_cycle", "Entry"), entry, "entries as of the other kernels");
    assert_layout!("hand_over", "Params", hand_over::Params, first_row, n_rows, is_zero, padding);
    assert_layout!("hand_over", "Entry", Entry, column, stiffness);
    assert_layout!(
        "accelerate_double",
        "Params",
        accelerate_double::Params,
        first_row,
        n_rows,
        first_partial,
        padding,
        relaxation,
        momentum
    );
    assert_layout!("turn", "Params", turn::Params, n_places, padding, unit);
    assert_layout!("rest_load", "Params", rest_load::Params, first_row, n_rows, is_listed, padding, scale);
    assert_layout!("residual_double", "Params", residual_double::Params, first_row, n_rows, is_listed, has_rest);
    assert_layout!("add_correction", "Params", add_correction::Params, n_vertices, padding);
    assert_layout!("squares", "Params", squares::Params, n_vertices, padding);
    assert_layout!("figures", "Params", figures::Params, n_lists, length, first, padding);
    assert_layout!(
        "smooth_vertices",
        "Params",
        smooth_vertices::Params,
        first,
        n_vertices,
        power,
        size,
        delta_squared,
        tolerance
    );
    assert_layout!("raise_worst_beta", "Params", raise_worst_beta::Params, first, n_vertices, six_goal, gain);
}

#[test]
fn the_block_of_the_twin_is_the_workgroup() {
    let reduce = ["convergence", "accelerate", "accelerate_double", "add_correction", "squares", "figures"];
    for kernel in kernels().filter(|kernel| reduce.contains(&kernel.name)) {
        assert_eq!(parse(kernel.source, kernel.name).entry_points[0].workgroup_size, [convergence::BLOCK as u32, 1, 1]);
    }
}
