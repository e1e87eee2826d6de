//! The stages that move surfaces, one file each, and the table [`STAGES`] of all stages in the
//! order in which they run.
//!
//! | stage | moves | held | paper |
//! |---|---|---|---|
//! | [`wing`] | wing vertices, by their profiles; then junction vertices, back onto their surface | - | 3.1 |
//! | [`trailing_edge`] | the rest of the trailing edge's boundary curve, then the inside | vertices of the wing | 3.2 |
//! | [`rigid`] | rigid bodies, with the root of their assembly | - | - |
//! | [`attached`] | junctions that slide, with a strip of the wing or body beside them; then the inside of wingtips and attached families, with conservative springs | their roots, and rigid bodies | 3.3 |
//! | [`carenage`] | carenage vertices, on their original surface | the carenage's boundary | 3.4 |
//! | [`planes`] | vertices of plane families, in their planes | the planes' boundary | - |
//! | [`crate::volume`] | all other vertices, and again those of plane families | the other surfaces | 3.4, last paragraph |
//!
//! In local optimisation surface vertices may move once more; see [`crate::volume::sliding`].
//!
//! A stage is set up once per mesh and run once per design ([`Stage`]). [`Stages`] holds the stages
//! of a mesh. A vertex on several families belongs to the first of these families in the order
//! fixed, prescribed, wing, trailing edge, rigid, attached (with wingtip), carenage, plane
//! ([`PlacedBy`]). The carenages and planes at the vertex limit its place all the same.

pub mod attached;
pub mod carenage;
mod junction;
pub mod planes;
pub mod rigid;
mod rulings;
pub mod shared_curve;
mod strip;
mod surface_equilibrium;
pub mod surface_network;
pub mod trailing_edge;
pub mod wing;

pub use shared_curve::SharedCurve;
pub use wing::{MISSED_SURFACE, MissedSurface, WingProfiles, Wings};

use junction::MadeByJunctions;
use wing::MadeByWings;

use attached::AttachedFamilies;
use carenage::Carenages;
use planes::Planes;
use rigid::Rigids;
use trailing_edge::TrailingEdges;

use crate::families::{PlacedBy, SetupError};
use crate::stage::{Products, SetUp, Stage};
use crate::volume::{EdgeGraph, VolumeSettings, VolumeStage};

/// All stages of a mesh.
pub struct Stages {
    /// Moves the wings.
    pub wings: Wings,
    /// Moves the trailing edges.
    pub trailing_edges: TrailingEdges,
    /// Moves the rigid bodies.
    pub rigids: Rigids,
    /// Moves the wingtips and the attached families.
    pub attached: AttachedFamilies,
    /// Moves the carenages.
    pub carenages: Carenages,
    /// Moves the plane families.
    pub planes: Planes,
    /// Moves all other vertices.
    pub volume: VolumeStage,
}

impl Stages {
    /// Sets up every stage. The volume and the surfaces are set up in parallel.
    ///
    /// - `wings`: each wing with its old profiles
    /// - `edge_graph`: the edges of the mesh's tets
    /// - `lowest`: smallest beta of the undeformed mesh
    /// - `observer`: gets the name of each step of the set-up
    ///
    /// # Errors
    /// Roles or old profiles do not fit the mesh, or the backend failed.
    pub fn new(
        set_up: &SetUp,
        wings: &[WingProfiles],
        edge_graph: EdgeGraph,
        volume: VolumeSettings,
        lowest: f64,
        observer: &dyn Fn(&str),
    ) -> Result<Self, SetupError> {
        observer("profiles");
        let wings = Wings::new(set_up, wings)?;
        observer("springs");
        let shaped = wings.beside_sections();
        let of_surfaces = || {
            let trailing_edges = TrailingEdges::new(set_up)?;
            let attached = AttachedFamilies::new(set_up, &shaped)?;
            let carenages = Carenages::new(set_up)?;
            Ok::<_, SetupError>((trailing_edges, attached, carenages, Planes::new(set_up)?))
        };
        let (of_surfaces, volume) =
            rayon::join(of_surfaces, || VolumeStage::new(set_up, edge_graph, volume, lowest, &shaped));
        let (trailing_edges, mut attached, carenages, planes) = of_surfaces?;
        let (rigids, mut volume) = (Rigids::default(), volume?);
        volume.let_slide(attached.take_on_bodies());
        Ok(Self { wings, trailing_edges, rigids, attached, carenages, planes, volume })
    }
}

/// What the stages of the surfaces keep of their last design, for reports and products.
#[derive(Default)]
pub struct MadeBySurfaces {
    wings: MadeByWings,
    rigids: Rigids,
    junctions: MadeByJunctions,
}

impl Stages {
    /// Exchanges what the stages of the surfaces keep of their last design with what they kept of
    /// another one. So several designs can be in work at once.
    pub fn exchange(&mut self, made: &mut MadeBySurfaces) {
        self.wings.exchange(&mut made.wings);
        std::mem::swap(&mut self.rigids, &mut made.rigids);
        self.attached.exchange(&mut made.junctions);
    }
}

/// A row of [`STAGES`].
pub struct StageRow {
    /// The name of the stage in messages and results.
    pub name: &'static str,
    /// The vertices that the stage places.
    pub placed_by: PlacedBy,
    /// The stage in [`Stages`].
    pub of: fn(&mut Stages) -> &mut dyn Stage,
    /// The products of the stage in [`Stages`]; `None` for a stage that has none yet.
    pub products: Option<fn(&mut Stages) -> &mut dyn Products>,
}

/// All stages in the order in which they run.
pub const STAGES: &[StageRow] = &[
    StageRow {
        name: "wing",
        placed_by: PlacedBy::Wing,
        of: |stages| &mut stages.wings,
        products: Some(|stages| &mut stages.wings),
    },
    StageRow {
        name: "trailing edge",
        placed_by: PlacedBy::TrailingEdge,
        of: |stages| &mut stages.trailing_edges,
        products: Some(|stages| &mut stages.trailing_edges),
    },
    StageRow {
        name: "rigid",
        placed_by: PlacedBy::Rigid,
        of: |stages| &mut stages.rigids,
        products: Some(|stages| &mut stages.rigids),
    },
    StageRow {
        name: "attached",
        placed_by: PlacedBy::Attached,
        of: |stages| &mut stages.attached,
        products: Some(|stages| &mut stages.attached),
    },
    StageRow {
        name: "carenage",
        placed_by: PlacedBy::Carenage,
        of: |stages| &mut stages.carenages,
        products: Some(|stages| &mut stages.carenages),
    },
    StageRow {
        name: "planes",
        placed_by: PlacedBy::Plane,
        of: |stages| &mut stages.planes,
        products: Some(|stages| &mut stages.planes),
    },
    StageRow {
        name: "volume",
        placed_by: PlacedBy::Volume,
        of: |stages| &mut stages.volume,
        products: Some(|stages| &mut stages.volume),
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::ROLES;

    /// A vertex belongs to the first stage of its families. So the stages run in the order of
    /// [`PlacedBy`], and the table holds the stage of every role.
    #[test]
    fn every_role_that_moves_has_its_stage_in_order() {
        let mut placed: Vec<PlacedBy> = ROLES.iter().map(|row| row.placed_by).collect();
        placed.retain(|placed| !matches!(placed, PlacedBy::Fixed | PlacedBy::Prescribed));
        placed.push(PlacedBy::Volume);
        placed.sort_unstable();
        placed.dedup();
        assert_eq!(STAGES.iter().map(|row| row.placed_by).collect::<Vec<_>>(), placed);
    }
}
