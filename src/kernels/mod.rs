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
pub mod accelerate_double;
pub mod add_correction;
pub mod block;
pub mod coarse_cycle;
pub mod constraint;
pub mod convergence;
pub mod defect;
pub mod figures;
pub mod first_sweep;
pub mod hand_over;
pub mod place;
pub mod raise_worst_beta;
mod real;
pub mod relax_sweep;
pub mod residual_double;
pub mod rest_load;
pub mod restrict_sweep;
pub mod row;
pub mod smooth_vertices;
pub mod squares;
pub mod star;
pub mod transfer;
pub mod turn;
pub(crate) mod vector;

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
    (
        $(#[$about_table:meta])* $table:ident, $(#[$about:meta])* $of_kernels:ident:
        $($name:ident: $($part:ident),*;)*
    ) => {
        $(
            // Names the twin: a missing one is a compiler error.
            #[allow(unused_imports)]
            use $name::run as _;
        )*

        $(#[$about_table])*
        pub const $table: [Kernel; [$(stringify!($name)),*].len()] = [$(Kernel {
            name: stringify!($name),
            parts: &[$(stringify!($part)),*],
            source: concat!($(wgsl!($part),)* wgsl!($name)),
        }),*];

        $(#[$about])*
        #[derive(Clone, Copy, Debug)]
        pub struct $of_kernels<P> {
            $(
                #[allow(missing_docs)]
                pub $name: P,
            )*
        }

        impl<P> $of_kernels<P> {
            /// Makes the value of each kernel, one after another.
            ///
            /// # Errors
            /// The first error of `make`.
            pub fn new<E>(mut make: impl FnMut(&Kernel) -> Result<P, E>) -> Result<Self, E> {
                let [$($name),*] = &$table;
                Ok(Self { $($name: make($name)?),* })
            }
        }
    };
}

kernels! {
    /// The kernels in f32, which every adapter runs. Each has its own file.
    KERNELS,
    /// One value per kernel, for example its pipeline on a device.
    OfKernels:
    relax_sweep: place, single, constraint, row;
    first_sweep: place, single, constraint;
    convergence: place, single, constraint, row;
    defect: place, single, constraint, row;
    transfer: place, single, constraint;
    restrict_sweep: place, single, constraint;
    coarse_cycle: place, single, constraint;
    accelerate: place, single, constraint;
    smooth_vertices: place, single, constraint, vector, star;
    raise_worst_beta: place, single, constraint, vector, star;
}

kernels! {
    /// The kernels with numbers in f64, for adapters that have them. Each has its own file.
    DOUBLE_KERNELS,
    /// One value per kernel with numbers in f64.
    OfDoubleKernels:
    hand_over: place, double, constraint;
    accelerate_double: place, double, constraint, block;
    turn: place;
    rest_load: place;
    residual_double: place, double, constraint;
    add_correction: place, double, constraint, block;
    squares: place, block;
    figures: place, block;
}

/// Names of the files that several kernels share.
pub const PARTS: [&str; 6] = ["place", "constraint", "vector", "row", "star", "block"];

/// Names of the shared files that say in which number type a kernel computes.
pub const NUMBER_TYPES: [&str; 2] = ["single", "double"];
