//! The kernels: WGSL in `kernels/`, and here the CPU twin of each under the same stem.
//!
//! A twin is one generic function that computes what one or many invocations of its kernel compute, with the same
//! formula and the same order of operations: as `run::<f32>` it is the kernel, as `run::<f64>` the reference. The CPU
//! backend that users run is made of these same functions.
//!
//! Only `+ - * / sqrt` are used: they are rounded correctly everywhere, so a kernel and its twin agree to the bit
//! wherever the compiler does not contract `a * b + c`.

pub mod accelerate;
pub mod constraint;
pub mod convergence;
pub mod defect;
pub mod edge_stiffness;
pub mod raise_worst_beta;
mod real;
pub mod relax_sweep;
pub mod row;
pub mod smooth_vertices;
pub mod star;
pub mod transfer;

pub use real::Real;

/// A compute shader.
#[derive(Clone, Copy, Debug)]
pub struct Kernel {
    /// Stem of its file, name of its entry point and of its twin.
    pub name: &'static str,
    /// Stems of the files that stand before its own in `source`.
    pub parts: &'static [&'static str],
    /// The whole shader in WGSL. Bindings, access and workgroup size are read from it.
    pub source: &'static str,
}

/// Every kernel, one file each.
pub const KERNELS: [Kernel; 8] =
    [EDGE_STIFFNESS, RELAX_SWEEP, CONVERGENCE, DEFECT, TRANSFER, ACCELERATE, SMOOTH_VERTICES, CLIMB_VERTICES];

/// Stems of the files several kernels share.
pub const PARTS: [&str; 3] = ["constraint", "row", "star"];

/// See [`edge_stiffness`].
pub const EDGE_STIFFNESS: Kernel =
    Kernel { name: "edge_stiffness", parts: &[], source: include_str!("../../kernels/edge_stiffness.wgsl") };

/// See [`relax_sweep`].
pub const RELAX_SWEEP: Kernel = Kernel {
    name: "relax_sweep",
    parts: &["constraint", "row"],
    source: concat!(
        include_str!("../../kernels/constraint.wgsl"),
        include_str!("../../kernels/row.wgsl"),
        include_str!("../../kernels/relax_sweep.wgsl")
    ),
};

/// See [`convergence`].
pub const CONVERGENCE: Kernel = Kernel {
    name: "convergence",
    parts: &["constraint", "row"],
    source: concat!(
        include_str!("../../kernels/constraint.wgsl"),
        include_str!("../../kernels/row.wgsl"),
        include_str!("../../kernels/convergence.wgsl")
    ),
};

/// See [`defect`].
pub const DEFECT: Kernel = Kernel {
    name: "defect",
    parts: &["constraint", "row"],
    source: concat!(
        include_str!("../../kernels/constraint.wgsl"),
        include_str!("../../kernels/row.wgsl"),
        include_str!("../../kernels/defect.wgsl")
    ),
};

/// See [`transfer`].
pub const TRANSFER: Kernel = Kernel {
    name: "transfer",
    parts: &["constraint"],
    source: concat!(include_str!("../../kernels/constraint.wgsl"), include_str!("../../kernels/transfer.wgsl")),
};

/// See [`accelerate`].
pub const ACCELERATE: Kernel = Kernel {
    name: "accelerate",
    parts: &["constraint"],
    source: concat!(include_str!("../../kernels/constraint.wgsl"), include_str!("../../kernels/accelerate.wgsl")),
};

/// See [`smooth_vertices`].
pub const SMOOTH_VERTICES: Kernel = Kernel {
    name: "smooth_vertices",
    parts: &["constraint", "star"],
    source: concat!(
        include_str!("../../kernels/constraint.wgsl"),
        include_str!("../../kernels/star.wgsl"),
        include_str!("../../kernels/smooth_vertices.wgsl")
    ),
};

/// See [`raise_worst_beta`].
pub const CLIMB_VERTICES: Kernel = Kernel {
    name: "raise_worst_beta",
    parts: &["constraint", "star"],
    source: concat!(
        include_str!("../../kernels/constraint.wgsl"),
        include_str!("../../kernels/star.wgsl"),
        include_str!("../../kernels/raise_worst_beta.wgsl")
    ),
};
