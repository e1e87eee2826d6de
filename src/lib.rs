//! idmesh moves an aircraft's tetrahedral CFD mesh when its wing profiles change.
//!
//! Every vertex and every tet is kept; only coordinates change. See `ARCHITECTURE.md` for the map
//! of the code and [`mover::Mover`] for the one door to it.
//!
//! # A guided tour
//!
//! | step | by |
//! |---|---|
//! | a case file, its mesh and its profiles are read | [`case::Case::load`] |
//! | or a mesh alone, as a [`mesh::TetMesh`] with families | [`formats::read`] |
//! | each family has a role, each wing old profiles | [`families::Role`], [`profile::Profile`] |
//! | what depends on the mesh alone is made | [`case::LoadedCase::mover`], [`mover::Mover::builder`] |
//! | the undeformed mesh is moved to one design after another | [`mover::Mover::update`] |
//! | the moved vertices are handed out, if the result is good | [`mover::Outcome::valid`] |
//! | the moved mesh is written | [`case::LoadedCase::write`], [`formats::MeshFile::write`] |
//! | everything that a command does with a design is done | [`session::Session`] |
//!
//! Bad input and a failed device are errors. A relaxation that did not converge and tets that stay
//! inverted are results: [`mover::Outcome::valid`] refuses both.
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
pub mod springs;
#[doc(hidden)]
pub mod stage;
#[doc(hidden)]
pub mod stages;
mod text;
#[doc(hidden)]
pub mod volume;

/// Compiles the code in the book and in the README.
#[cfg(doctest)]
#[doc = include_str!("../docs/src/library.md")]
#[doc = include_str!("../README.md")]
struct Book;
