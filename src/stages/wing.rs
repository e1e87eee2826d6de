//! Stage wing (paper 3.1): the wing's vertices follow their profiles, and the junction goes back onto its surface.
//!
//! The displacement comes from [`crate::profile`]. It takes the wing's root off the fuselage (or off the symmetry plane
//! it ends in). Each junction vertex therefore slides along the moved wing's own span-wise direction until it meets the
//! fuselage's original surface, which leaves the wing's shape alone, and the wing beside the junction follows: the slide
//! is spread over a strip of the wing by a spring network. The paper shows the imperfection (its Fig. 3) and corrects the
//! fuselage only.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{Families, Motion, Owner, SetUp, SetupError, Wanted, patch::Patch};
use crate::{
    backend::{BackendError, Constraint},
    mesh::{FamilyId, TetMesh, edges::triangle_edges},
    profile::{Profile, ProfileError, WingLoft},
    relaxation::{Accuracy, Convergence},
};

/// Width of the strip that follows a junction, as a fraction of the junction's extent (about a chord).
const STRIP: f64 = 0.25;

/// All wings of a mesh.
pub struct Wings {
    wings: Vec<Wing>,
}

struct Wing {
    family: FamilyId,
    vertices: Vec<u32>,
    loft: WingLoft,
    /// Vertices that must end on a carenage or plane, as places in `vertices`.
    junction: Vec<usize>,
    strip: Option<Patch>,
}

impl Wings {
    /// Finds each wing vertex's place among the old profiles.
    ///
    /// # Errors
    /// A wing without old profiles or with unusable ones; the backend failed.
    pub fn new(set_up: &SetUp, old_profiles: &BTreeMap<FamilyId, Vec<Profile>>) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        let wings = families.placed_by(Owner::Wing).map(|family| {
            let name = || mesh.families[family.index()].clone();
            let old = old_profiles.get(&family).ok_or_else(|| SetupError::NoProfiles { family: name() })?;
            let vertices = surface.vertices_of(family).to_vec();
            let positions: Vec<DVec3> = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
            let normals = surface.normals_of(family, &mesh.vertices);
            let place = |vertex: u32| vertices.binary_search(&vertex).expect("an edge's ends are vertices") as u32;
            let edges: Vec<[u32; 2]> =
                triangle_edges(surface.corners_of(family)).into_iter().map(|edge| edge.map(place)).collect();
            let loft = WingLoft::new(old, &positions, &normals, &edges)
                .map_err(|error| SetupError::Profiles { family: name(), error })?;
            let junction: Vec<usize> = (0..vertices.len())
                .filter(|&place| {
                    families.owner[vertices[place] as usize] == Owner::Wing
                        && families.shapes_at(vertices[place]).next().is_some()
                })
                .collect();
            let strip = strip(set_up, family, &vertices, &junction)?;
            Ok(Wing { family, vertices, loft, junction, strip })
        });
        Ok(Self { wings: wings.collect::<Result<_, SetupError>>()? })
    }

    /// Writes the displacement that the profiles give into `motion`, and for vertices that others place into `wanted`.
    ///
    /// # Errors
    /// A wing's new profiles are missing or do not pair with the old ones.
    pub fn interpolate(
        &self,
        families: &Families,
        new_profiles: &BTreeMap<FamilyId, Vec<Profile>>,
        motion: &mut Motion,
        wanted: &mut Vec<Wanted>,
    ) -> Result<Vec<Vec<DVec3>>, (FamilyId, ProfileError)> {
        let no_profiles = Vec::new();
        self.wings
            .iter()
            .map(|wing| {
                let new = new_profiles.get(&wing.family).unwrap_or(&no_profiles);
                let moved = wing.loft.displacements(new).map_err(|error| (wing.family, error))?;
                for (&vertex, displacement) in wing.vertices.iter().zip(&moved.displacement) {
                    if families.owner[vertex as usize] == Owner::Wing {
                        motion[vertex as usize] = *displacement;
                    } else {
                        wanted.push(Wanted { family: wing.family, vertex, displacement: *displacement });
                    }
                }
                Ok(moved.generator)
            })
            .collect()
    }

    /// Slides the junctions back onto their surfaces; `generators` as [`Self::interpolate`] returned them.
    ///
    /// # Errors
    /// The backend failed.
    pub fn join(
        &mut self,
        mesh: &TetMesh,
        families: &Families,
        generators: &[Vec<DVec3>],
        motion: &mut Motion,
        accuracy: &Accuracy,
    ) -> Result<Convergence, BackendError> {
        let mut convergence = Convergence::nothing_to_do();
        for (wing, generators) in self.wings.iter_mut().zip(generators) {
            let Some(strip) = &mut wing.strip else { continue };
            let mut slide = vec![DVec3::ZERO; mesh.vertices.len()];
            for &place in &wing.junction {
                let vertex = wing.vertices[place];
                let displacement = motion[vertex as usize];
                if displacement != DVec3::ZERO {
                    let start = mesh.vertices[vertex as usize] + displacement;
                    slide[vertex as usize] = families.settle_along(vertex, start, Some(generators[place])) - start;
                }
            }
            families.partners.even_slide(&wing.vertices, motion, &mut slide);
            convergence = convergence.and(strip.relax(&mut slide, accuracy)?);
            for &vertex in &wing.vertices {
                motion[vertex as usize] += slide[vertex as usize];
            }
        }
        Ok(convergence)
    }
}

fn strip(
    set_up: &SetUp,
    family: FamilyId,
    vertices: &[u32],
    junction: &[usize],
) -> Result<Option<Patch>, BackendError> {
    let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
    if junction.is_empty() {
        return Ok(None);
    }
    let points: Vec<DVec3> = junction.iter().map(|&place| mesh.vertices[vertices[place] as usize]).collect();
    let centre = points.iter().sum::<DVec3>() / points.len() as f64;
    let width = STRIP * 2.0 * points.iter().map(|point| point.distance(centre)).fold(0.0, f64::max);
    let on_junction: std::collections::HashSet<u32> = junction.iter().map(|&place| vertices[place]).collect();
    let beside = |vertex: u32| {
        let at = mesh.vertices[vertex as usize];
        points.iter().any(|point| point.distance_squared(at) < width * width)
    };
    let edges = triangle_edges(surface.corners_of(family));
    let constraint = |vertex: u32| {
        let free = families.owner[vertex as usize] == Owner::Wing && !on_junction.contains(&vertex) && beside(vertex);
        if free { Constraint::Free } else { Constraint::Held }
    };
    Patch::new(&mesh.vertices, &edges, constraint, backend, method).map(Some)
}
