//! The pipeline: one file a stage, run in this order.
//!
//! | stage | moves | held | paper |
//! |---|---|---|---|
//! | [`wing`] | wing vertices, by their profiles; the junction onto its surface | - | 3.1 |
//! | [`trailing_edge`] | the rest of the trailing edge's boundary curve, then its inside | what the wing moved | 3.2 |
//! | [`wingtip`] | the tip's inside, pulled back by conservative springs | its boundary | 3.3 |
//! | [`carenage`] | carenage vertices, sliding on the original surface | its boundary | 3.4 |
//! | [`planes`] | vertices of plane families, in their plane | their boundary | - |
//! | [`crate::volume`] | everything else; plane families slide on | the other surfaces | 3.4, last paragraph |
//!
//! [`crate::volume::sliding`] says where surface vertices may go afterwards, in local optimisation.
//!
//! A stage is set up once per mesh and run once per design on a [`crate::mesh::Displacement`]. A
//! vertex on several families belongs to the first of them in the order fixed, prescribed, wing,
//! trailing edge, wingtip, carenage, plane; the plane families it touches still limit it.

pub mod carenage;
pub mod planes;
pub mod surface_network;
pub mod trailing_edge;
pub mod wing;
pub mod wingtip;

pub use wing::WingProfiles;
