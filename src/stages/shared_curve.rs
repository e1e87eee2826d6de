//! Curves that two wings with different profiles share, such as those of a wing and of its winglet.
//!
//! Each of the two wings has its own displacement for the vertices of the curve, because each is
//! interpolated from its own profiles. The first wing of the list places them
//! ([`super::wing::WingProfiles`]). The second wing moves by the difference more at the curve. A
//! spring network spreads this difference over a strip of the second wing, a quarter of the chord
//! wide, that ends before the wing's first section. So no row of triangles takes all of it, and
//! both wings keep their profiles.
//!
//! Profiles in one table for both wings need no such strip. The paper has one wing only.

use std::collections::BTreeMap;

use glam::DVec3;
use serde::Serialize;

use super::strip::{Strip, mean};
use super::surface_network::SurfaceNetwork;
use crate::backend::BackendError;
use crate::relaxation::{Convergence, Stopping};

/// A curve of two wings with different profiles. Lengths are in the mesh's unit.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SharedCurve {
    /// The wing that places the vertices of the curve.
    pub owner: String,
    /// Number of the vertices.
    pub vertices: usize,
    /// Largest distance between the places of a vertex by the profiles of the two wings.
    pub max_difference: f64,
    /// Largest such distance as a share of the chord: the length of the second wing's old profile
    /// that is nearest to the curve.
    pub of_chord: f64,
    /// Original position of the vertex with the largest share.
    pub at: [f64; 3],
}

/// The vertices of a wing that earlier wings place.
pub(super) struct SharedVertices {
    /// The wing that places each vertex `[n_vertices of the wing]`. Empty if it is this one for
    /// all.
    owner: Vec<Option<usize>>,
    /// Place, original position and chord of each vertex of another wing.
    shared: Vec<(usize, DVec3, f64)>,
    network: Option<SurfaceNetwork>,
}

impl SharedVertices {
    /// Sets up the strips beside the curves.
    ///
    /// - `owner` `[n_vertices of the wing]`: the number of the earlier wing that places the vertex
    ///
    /// # Errors
    /// The backend failed.
    pub fn new(wing: &Strip, owner: Vec<Option<usize>>) -> Result<Self, BackendError> {
        let line: Vec<usize> = (0..owner.len()).filter(|&place| owner[place].is_some()).collect();
        if line.is_empty() {
            return Ok(Self { owner: Vec::new(), shared: Vec::new(), network: None });
        }
        let chord_at =
            |places: &[usize]| wing.interpolation.chord_near(mean(places.iter().map(|&place| wing.positions[place])));
        // The curve may lie in the plane of a section. The row beside it lies on the strip's side.
        let network = wing.beside(
            &line,
            |_| false,
            |piece| {
                let beside = if piece.next.is_empty() { &piece.places } else { &piece.next };
                (chord_at(&piece.places), mean(beside.iter().map(|&place| wing.positions[place])))
            },
        )?;
        let mut shared = Vec::with_capacity(line.len());
        for piece in wing.pieces(&line, &wing.edges()) {
            let chord = chord_at(&piece.places);
            let at = |place: usize| wing.set_up.mesh.vertices[wing.vertices[place] as usize];
            shared.extend(piece.places.into_iter().map(|place| (place, at(place), chord)));
        }
        Ok(Self { owner, shared, network })
    }

    /// The earlier wing that places the vertex at a place of the wing.
    pub fn owner(&self, place: usize) -> Option<usize> {
        self.owner.get(place).copied().flatten()
    }

    /// What the profiles of two wings make of their common vertices, by the number of the earlier
    /// wing. The name of the owner is left empty.
    ///
    /// - `vertex`: the mesh's vertex at a place
    /// - `own` `[n_vertices of the wing]`: displacements by the wing's own profiles
    /// - `displacement` `[n_vertices]`: by the profiles of the wings that place the vertices
    pub fn curves(
        &self,
        vertex: impl Fn(usize) -> u32,
        own: &[DVec3],
        displacement: &[DVec3],
    ) -> BTreeMap<usize, SharedCurve> {
        let mut curves: BTreeMap<usize, SharedCurve> = BTreeMap::new();
        for &(place, at, chord) in &self.shared {
            let Some(owner) = self.owner(place) else { continue };
            let curve = curves.entry(owner).or_default();
            let difference = displacement[vertex(place) as usize].distance(own[place]);
            curve.vertices += 1;
            curve.max_difference = curve.max_difference.max(difference);
            if difference / chord > curve.of_chord || curve.vertices == 1 {
                (curve.of_chord, curve.at) = (difference / chord, at.to_array());
            }
        }
        curves
    }

    /// Spreads the differences over the strips.
    ///
    /// - `vertices`: the mesh's vertex at each place
    /// - `own` `[n_vertices of the wing]`: displacements by the wing's own profiles
    /// - `displacement` `[n_vertices]`: of the mesh; changed beside the curves
    ///
    /// # Errors
    /// The backend failed.
    pub fn spread(
        &mut self,
        vertices: &[u32],
        own: &[DVec3],
        displacement: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let Some(network) = &mut self.network else { return Ok(Convergence::nothing_to_do()) };
        let mut difference = vec![DVec3::ZERO; displacement.len()];
        for &(place, ..) in &self.shared {
            let vertex = vertices[place] as usize;
            difference[vertex] = displacement[vertex] - own[place];
        }
        if difference.iter().all(|difference| *difference == DVec3::ZERO) {
            return Ok(Convergence::nothing_to_do());
        }
        let convergence = network.relax(&mut difference, stopping)?;
        for (vertex, _) in network.moving() {
            displacement[vertex as usize] += difference[vertex as usize];
        }
        Ok(convergence)
    }

    /// Change of what [`Self::spread`] makes.
    ///
    /// - `own` `[n_vertices of the wing]`: change of the displacements by the wing's own profiles
    /// - `change` `[n_vertices]`: of the mesh; changed beside the curves
    /// - others: as for [`Self::spread`]
    ///
    /// # Errors
    /// The backend failed.
    pub fn forward(
        &mut self,
        vertices: &[u32],
        own: &[DVec3],
        change: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let Some(network) = &mut self.network else { return Ok(Convergence::nothing_to_do()) };
        let mut difference = vec![DVec3::ZERO; change.len()];
        for &(place, ..) in &self.shared {
            let vertex = vertices[place] as usize;
            difference[vertex] = change[vertex] - own[place];
        }
        let convergence = network.forward(&mut difference, stopping)?;
        for (vertex, _) in network.moving() {
            change[vertex as usize] += difference[vertex as usize];
        }
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `by_own` `[n_vertices of the wing]`: derivative by the displacements by the wing's own
    ///   profiles, to which this adds
    /// - `gradient` `[n_vertices]`: of the mesh, by the displacement after the spread on entry and
    ///   before it on exit
    ///
    /// # Errors
    /// The backend failed.
    pub fn reverse(
        &mut self,
        vertices: &[u32],
        by_own: &mut [DVec3],
        gradient: &mut [DVec3],
        stopping: &Stopping,
    ) -> Result<Convergence, BackendError> {
        let Some(network) = &mut self.network else { return Ok(Convergence::nothing_to_do()) };
        let mut by_difference = vec![DVec3::ZERO; gradient.len()];
        for (vertex, _) in network.moving() {
            by_difference[vertex as usize] = gradient[vertex as usize];
        }
        let convergence = network.reverse(&mut by_difference, stopping)?;
        for &(place, ..) in &self.shared {
            let by = by_difference[vertices[place] as usize];
            gradient[vertices[place] as usize] += by;
            by_own[place] -= by;
        }
        Ok(convergence)
    }
}
