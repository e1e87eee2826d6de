//! Files of VTK and ParaView: XML unstructured grids (`.vtu`) and legacy unstructured grids
//! (`.vtk`).

mod base64;
mod cells;
mod compression;
mod create;
mod header;
pub(super) mod legacy;
mod names;
mod own_points;
mod payload;
mod points;
mod polylines;
mod surface;
mod types;
pub(super) mod vtu;
mod xml;

pub(super) use create::{Array, array, create_xml, number as family_number, vectors};
pub use create::{vtu_bytes, write_vtu};
pub(super) use names::{list_names, listed_names, parse_names};
pub use polylines::{Polylines, read_polylines};
pub(super) use surface::{read_grid, read_poly_data};
pub(super) use types::{vtk_kind, vtk_number};
