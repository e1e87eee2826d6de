//! idmesh moves an aircraft's CFD mesh of tets, or a hybrid mesh with pyramids, prisms and
//! hexahedra, when its wing profiles change.
//!
//! Every vertex and every cell is kept, and only coordinates change. A [`mover::Mover`] is set up
//! once per mesh and moves the mesh to many designs. `ARCHITECTURE.md` is the map of the code.
//!
//! # A guided tour
//!
//! | step | call |
//! |---|---|
//! | read a case file, its mesh and its profiles | [`case::Case::load`] |
//! | or read a mesh alone, as a [`mesh::TetMesh`] with families | [`formats::read`] |
//! | or with its other cells, for [`mover::MoverBuilder::other_cells`] | [`formats::read_mixed`] |
//! | give each family a role, and each wing its old profiles | [`families::Role`], [`profile::Profile`] |
//! | set up a mover, which makes everything that depends on the mesh alone | [`case::LoadedCase::mover`], [`mover::Mover::builder`] |
//! | move the undeformed mesh to one design after another | [`mover::Mover::update`] |
//! | get the moved vertices, if the result may be used | [`mover::Outcome::valid`] |
//! | get products with the derivative of the moved mesh by the design | [`mover::Mover::forward`], [`mover::Mover::reverse`] |
//! | write the moved mesh | [`case::LoadedCase::write`], [`formats::MeshFile::write`] |
//! | do everything that `idmesh run` does with a design | [`session::Session`] |
//!
//! Bad input and a failed device are errors. A relaxation that did not converge and tets that stay
//! inverted are results. [`mover::Outcome::valid`] returns an error for such results.
//!
//! ```
//! use idmesh::{backend, case::Case};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let case = Case::load("examples/wing-body/case.toml")?;
//! let mut mover = case.mover(backend::select(backend::Selection::Cpu)?)?;
//! let outcome = mover.update(&case.design)?;
//! let moved = outcome.valid()?;
//! assert_eq!(moved.vertices().len(), case.file.mesh.vertices.len());
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]

pub mod backend;
pub mod case;
#[doc(hidden)]
pub mod cli;
#[doc(hidden)]
pub mod constraint;
pub mod families;
pub mod formats;
#[doc(hidden)]
pub mod geometry;
#[doc(hidden)]
pub mod kernels;
#[doc(hidden)]
pub mod memory;
pub mod mesh;
pub mod mover;
pub mod profile;
#[doc(hidden)]
pub mod projection;
pub mod quality;
#[doc(hidden)]
pub mod relaxation;
pub mod report;
pub mod session;
#[doc(hidden)]
pub mod smoothing;
#[doc(hidden)]
pub mod solver_measures;
#[doc(hidden)]
pub mod springs;
#[doc(hidden)]
pub mod stage;
#[doc(hidden)]
pub mod stages;
mod text;
#[doc(hidden)]
pub mod volume;

pub use glam::DVec3;

/// Compiles the code in the book and in the README.
#[cfg(doctest)]
#[doc = include_str!("../docs/src/library.md")]
#[doc = include_str!("../docs/src/derivatives.md")]
#[doc = include_str!("../README.md")]
struct Book;
