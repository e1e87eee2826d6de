//! idmesh moves an aircraft's tetrahedral CFD mesh when its wing profiles change.
//!
//! Every vertex and every tet is kept; only coordinates change. See `ARCHITECTURE.md` for the map
//! of the code and [`mover::Mover`] for the one door to it.
//!
//! # A guided tour
//!
//! A mesh is a [`mesh::TetMesh`] whose boundary triangles belong to named families;
//! [`formats::read`] makes one from a file and [`formats::MeshFile::write`] puts the moved vertices
//! back into that file. Each family has a [`families::Role`]: a wing follows its profiles, a
//! carenage slides on its original surface, a far field stays. Old and new [`profile::Profile`]s
//! come from files ([`profile::files`]) or are cut from the wing ([`profile::cut`]).
//!
//! [`mover::Mover::new`] does what depends on the mesh alone. [`mover::Mover::update`] then moves
//! the undeformed mesh to one [`mover::Design`] after another, stage by stage ([`stages`]). The
//! wing's displacement is interpolated from its profiles; everything else is a spring network
//! ([`relaxation::Network`]), relaxed on a [`backend::Backend`]: the CPU in f64, or a GPU in f32
//! with residuals in f64. Where that leaves bad or inverted tets, local optimisation
//! ([`smoothing`]) repairs them, if [`mover::Settings::quality`] asks for it. The
//! [`mover::Outcome`] holds the vertices and what the report says of them: the quality of the tets
//! at four stages ([`quality`]), how true the surfaces stayed to their shapes, how the volume
//! converged, and what local optimisation did.
//!
//! Bad input and a failed device are errors. A relaxation that did not converge and tets that stay
//! inverted are results: look at [`mover::Outcome::converged`] and [`mover::Outcome::is_valid`]
//! before using the vertices.
//!
//! ```
//! use std::{collections::BTreeMap, fs, path::Path};
//!
//! use idmesh::{
//!     backend::{self, Selection},
//!     families::{Role, TipStart},
//!     formats::{self, Fields},
//!     mover::{Design, Mover, Settings},
//!     profile::csv,
//!     relaxation::{Stopping, Method},
//!     springs::Springs,
//!     stages::WingProfiles,
//! };
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let folder = Path::new("examples/wing-body");
//! let file = formats::read(&folder.join("wing-body.msh.gz"))?;
//! let wing = file.mesh.family("wing").ok_or("the mesh has no wing")?;
//! let profiles = |name: &str| -> Result<_, Box<dyn std::error::Error>> {
//!     let path = folder.join(name);
//!     Ok(csv::parse(&[(&path, &fs::read_to_string(&path)?)])?)
//! };
//!
//! // Once per mesh.
//! let role = |family: &String| match family.as_str() {
//!     "wing" => Role::Wing,
//!     "trailing_edge" => Role::TrailingEdge,
//!     "wingtip" => Role::Wingtip { coefficient: 0.5, start: TipStart::Affine },
//!     "carenage" => Role::Carenage,
//!     "symmetry" => Role::PLANE,
//!     _ => Role::Fixed,
//! };
//! let settings = Settings {
//!     roles: file.mesh.families.iter().map(role).collect(),
//!     wings: vec![WingProfiles::new("wing", wing, profiles("old.csv")?)],
//!     springs: <&Springs>::default(),
//!     method: Method::Chebyshev,
//!     stopping: Stopping::default(),
//!     quality: Some(idmesh::smoothing::QualityTarget::Original),
//!     max_steps: idmesh::volume::MAX_STEPS,
//! };
//! let backend = backend::select(Selection::Cpu)?;
//! let mut mover = Mover::new(file.mesh.clone(), settings, backend.into(), &|_| {})?;
//!
//! // Once per design.
//! let design = Design { profiles: BTreeMap::from([("wing".to_owned(), profiles("new.csv")?)]), ..Design::default() };
//! let outcome = mover.update(&design, &|stage| eprintln!("{stage}"))?;
//! assert!(outcome.converged);
//! assert!(outcome.is_valid());
//!
//! let moved = std::env::temp_dir().join(format!("idmesh-{}.vtu", std::process::id()));
//! let fields = Fields { displacement: Some(&outcome.displacement), beta: Some(&outcome.beta) };
//! file.write(&moved, &outcome.vertices, &fields)?;
//! # fs::remove_file(moved)?;
//! # Ok(())
//! # }
//! ```

pub mod backend;
pub mod case;
#[doc(hidden)]
pub mod cli;
pub mod families;
pub mod formats;
#[doc(hidden)]
pub mod geometry;
pub mod kernels;
pub mod mesh;
pub mod mover;
pub mod profile;
pub mod projection;
pub mod quality;
pub mod relaxation;
pub mod report;
pub mod smoothing;
pub mod springs;
pub mod stage;
pub mod stages;
mod text;
pub mod volume;

/// Compiles the code in the book.
#[cfg(doctest)]
#[doc = include_str!("../docs/src/library.md")]
struct Book;
