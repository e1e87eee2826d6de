//! The kernels: WGSL in `kernels/`, and here the CPU twin of each kernel, in a file of the same
//! name.
//!
//! A twin is one generic function. The function computes what one or many invocations of its kernel
//! compute, with the same formula and the same order of operations. `run::<f32>` computes in the
//! kernel's precision, `run::<f64>` is the reference. The CPU backend runs these same functions.
//!
//! Only `+ - * / sqrt` are used. Every machine rounds them correctly, so a kernel and its twin
//! agree to the bit wherever the compiler does not contract `a * b + c`.

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
    /// Name of its file without the extension, of its entry point and of its twin.
    pub name: &'static str,
    /// Names of the shared files that stand before its own file in `source`.
    pub parts: &'static [&'static str],
    /// The whole shader in WGSL. Bindings, access and workgroup size are read from this text.
    pub source: &'static str,
}

/// The text of a file in `kernels/`.
macro_rules! wgsl {
    ($stem:ident) => {
        include_str!(concat!("../../kernels/", stringify!($stem), ".wgsl"))
    };
}

/// Makes the table. A row names a kernel's file, entry point and twin, and the shared files before
/// it in the shader. A row whose file or twin is missing does not compile.
macro_rules! kernels {
    ($($name:ident: $($part:ident),*;)*) => {
        $(
            // Names the twin: a missing one is a compiler error.
            #[allow(unused_imports)]
            use $name::run as _;
        )*

        /// All kernels. Each has its own file.
        pub const KERNELS: [Kernel; [$(stringify!($name)),*].len()] = [$(Kernel {
            name: stringify!($name),
            parts: &[$(stringify!($part)),*],
            source: concat!($(wgsl!($part),)* wgsl!($name)),
        }),*];

        /// One value per kernel, for example its pipeline on a device.
        #[derive(Clone, Copy, Debug)]
        pub struct OfKernels<P> {
            $(
                #[allow(missing_docs)]
                pub $name: P,
            )*
        }

        impl<P> OfKernels<P> {
            /// Makes the value of each kernel, one after another.
            ///
            /// # Errors
            /// The first error of `make`.
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

/// Names of the files that several kernels share.
pub const PARTS: [&str; 5] = ["place", "constraint", "vector", "row", "star"];
