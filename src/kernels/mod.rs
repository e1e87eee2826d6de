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
pub mod place;
pub mod raise_worst_beta;
mod real;
pub mod relax_sweep;
pub mod row;
pub mod smooth_vertices;
pub mod star;
pub mod transfer;
mod vector;

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

/// The text of a file of `kernels/`.
macro_rules! wgsl {
    ($stem:ident) => {
        include_str!(concat!("../../kernels/", stringify!($stem), ".wgsl"))
    };
}

/// The table: a row names a kernel's file, entry point and twin, and the parts that stand before it in the shader. A row whose
/// file or twin is missing does not compile.
macro_rules! kernels {
    ($($name:ident: $($part:ident),*;)*) => {
        $(
            // Names the twin, so that the compiler misses it.
            #[allow(unused_imports)]
            use $name::run as _;
        )*

        /// Every kernel, one file each.
        pub const KERNELS: [Kernel; [$(stringify!($name)),*].len()] = [$(Kernel {
            name: stringify!($name),
            parts: &[$(stringify!($part)),*],
            source: concat!($(wgsl!($part),)* wgsl!($name)),
        }),*];

        /// Something of each kernel, such as what a device makes of it.
        #[derive(Clone, Copy, Debug)]
        pub struct OfKernels<P> {
            $(
                #[allow(missing_docs)]
                pub $name: P,
            )*
        }

        impl<P> OfKernels<P> {
            /// Makes it of one kernel after another.
            ///
            /// # Errors
            /// The first that `make` gives.
            pub fn new<E>(mut make: impl FnMut(&Kernel) -> Result<P, E>) -> Result<Self, E> {
                let [$($name),*] = &KERNELS;
                Ok(Self { $($name: make($name)?),* })
            }
        }
    };
}

kernels! {
    edge_stiffness: place, vector;
    relax_sweep: place, constraint, row;
    convergence: place, constraint, row;
    defect: place, constraint, row;
    transfer: place, constraint;
    accelerate: place, constraint;
    smooth_vertices: place, constraint, vector, star;
    raise_worst_beta: place, constraint, vector, star;
}

/// Stems of the files several kernels share.
pub const PARTS: [&str; 5] = ["place", "constraint", "vector", "row", "star"];
