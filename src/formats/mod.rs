//! Mesh files: reads a mesh, and writes it back with its vertices moved.
//!
//! A file is written back as its own bytes with only the coordinates replaced. So sections that
//! idmesh does not know survive, and a mesh that did not move gives the same file. In another
//! format mesh and families go into a new file.
//!
//! To add a format: write its file here with a `FORMAT`, add that to [`FORMATS`] in `table.rs`.
//!
//! Files import from each other in one direction: the table from the formats, these from
//! `format.rs` and the tools they share.

mod aflr3;
mod allowance;
mod atomic;
#[cfg(feature = "cgns")]
mod cgns;
mod disk;
mod document;
mod error;
mod format;
mod gmsh;
mod gzip;
mod handedness;
mod input;
mod lines;
mod linked;
mod mapbc;
mod medit;
mod mesh_builder;
mod names_lock;
mod new_file;
mod number;
mod openfoam;
mod out;
mod placed;
mod read;
mod read_surface;
mod real_path;
mod scanner;
mod stl;
mod su2;
mod sums;
mod surface;
mod surface_files;
mod table;
mod temporary;
mod vtk;
mod write;

pub(crate) use atomic::check as check_writable;
pub use atomic::{FileSet, write_atomically};
pub(crate) use disk::{Sync, folder_to_disk, to_disk};
pub use error::{Location, ReadError, WriteError};
pub use format::Format;
pub(crate) use input::{open_file, read_file, read_lines, read_named};
pub(crate) use names_lock::{NamesLock, patiently};
pub use new_file::{Cells, Fields};
pub use placed::{PlaceError, Placed};
pub use read::{MeshFile, mesh_path, read, read_bytes, read_mixed};
pub use read_surface::{is_surface, read_surface, surface_of};
pub(crate) use real_path::{is_at, is_same, is_special, real_path};
pub use sums::sha256_of;
pub(crate) use sums::sha256_of_text;
pub use surface::{PointField, Surface};
pub use surface_files::{SURFACE_EXTENSIONS, SurfaceFile, is_surface_file};
pub use table::FORMATS;
pub(crate) use table::{extension, has_format};
pub(crate) use temporary::{Claim, host, temporary as temporary_file};
pub use vtk::{Polylines, read_polylines, vtu_bytes, write_vtu};
pub(crate) use write::twin;
