//! Stage wing (paper 3.1): the wing's vertices follow their profiles, and the vertices of the
//! junction slide back onto the surface that they share with the wing.
//!
//! A wing is one or several families with one set of profiles, such as an upper and a lower side.
//! The families of a wing move as one surface.
//!
//! 1. [`Wings::interpolate`] displaces every wing vertex with its profiles ([`crate::profile`]).
//!    The displacement takes the wing's root off the fuselage, or off the symmetry plane in which
//!    the wing ends.
//! 2. [`Stage::run`] slides each junction vertex along the moved wing's span direction at the
//!    vertex, until it meets the fuselage's original surface. This slide does not change the wing's
//!    shape.
//! 3. A spring network spreads the slide over a strip of the wing beside the junction. The strip
//!    ends before the first section.
//!
//! Wings that share vertices move as [`super::shared_curve`] says.
//!
//! The paper shows the imperfection at the junction (Fig. 3) and corrects the fuselage only.
//!
//! With a mirror plane the profiles stand on one side of the plane. A vertex on the other side
//! gets the mirrored displacement of its mirror image.
//!
//! `products` has the derivative by the points of the new profiles.

mod products;

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::shared_curve::{SharedCurve, SharedVertices};
use products::WingProduct;

use super::strip::{self, Strip};
use super::surface_network::SurfaceNetwork;
use crate::families::Families;
use crate::families::PlacedBy;
use crate::families::Role;
use crate::families::SetupError;
use crate::mesh::Displacement;
use crate::mesh::corners::Face;
use crate::stage::{SetUp, Stage, StageError, Wanted};
use crate::{
    geometry::vertex_normals,
    mesh::{
        FamilyId, TetMesh,
        half_edge::{Surface, next},
    },
    profile::{
        Closeness, Missed, Plane, Profile, ProfileDisplacement, ProfileError, ProfileInterpolation, ProfileMatch,
        Remark, WingSurface,
        cut::{Gap, Junctions},
    },
    relaxation::Convergence,
};

/// Largest length of a wing beyond its outermost sections, as a fraction of the span between them.
const REACH: f64 = 0.5;
/// Allowance for the noise of a wing's ends, as a fraction of the same span. An end may lie in a
/// plane that is not quite flat.
const SLACK: f64 = 0.01;

/// A vertex stands in the mirror plane if it is nearer to the plane than this fraction of the
/// wing's extent.
const ON_MIRROR: f64 = 1e-9;

/// A wing and its old profiles. Of two wings that share vertices, the first of a list places them.
#[derive(Clone, Debug, PartialEq)]
pub struct WingProfiles {
    /// The name of the wing in designs and reports.
    pub name: String,
    /// The wing's families, at least one, all with the role
    /// [`Role::Wing`](crate::families::Role::Wing).
    pub families: Vec<FamilyId>,
    /// The old profiles, in the mesh's unit.
    pub old: Vec<Profile>,
    /// A plane with the old profiles on one side. The wing on the other side moves as their mirror
    /// image.
    pub mirror: Option<Plane>,
    /// How new profiles are matched with the old ones. With `None` each design decides.
    pub matched: Option<ProfileMatch>,
}

impl WingProfiles {
    /// A wing that is one family, without a mirror plane.
    pub fn new(name: &str, family: FamilyId, old: Vec<Profile>) -> Self {
        Self { name: name.to_owned(), families: vec![family], old, mirror: None, matched: None }
    }
}

/// A junction vertex misses its surface if the line along the span does not lead to it: then the
/// nearest point of the surface is farther from the line than this share of the chord.
pub const MISSED_SURFACE: f64 = 0.01;

/// Junction vertices of a wing whose lines along the span miss the surface that they share with the
/// wing, such as a wing that has sunk below its fuselage. They went to the nearest point, so the
/// section is not the asked one there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MissedSurface {
    /// The worst vertex.
    pub vertex: u32,
    /// Its distance from the line, as a share of the longest chord at the junction.
    pub of_chord: f64,
    /// Number of vertices beyond [`MISSED_SURFACE`].
    pub vertices: usize,
}

/// All wings of a mesh.
pub struct Wings {
    wings: Vec<Wing>,
    /// The displacement of each wing by its profiles in the last design. Empty before the first
    /// design.
    moved: Vec<ProfileDisplacement>,
    /// The curves that wings shared with earlier wings in the last design, with the wings' names.
    shared_curves: Vec<(String, SharedCurve)>,
    /// The wings whose junctions missed their surfaces in the last design, by name.
    missed_surfaces: BTreeMap<String, MissedSurface>,
    /// For each wing, the displacement of its junction's vertices before they slid in the last
    /// design, in the mesh's unit.
    before_slide: Vec<Vec<DVec3>>,
    /// The products of each wing in hand. Empty between products.
    products: Vec<WingProduct>,
}

/// What the wings keep of their last design.
#[derive(Default)]
pub struct MadeByWings {
    moved: Vec<ProfileDisplacement>,
    shared_curves: Vec<(String, SharedCurve)>,
    missed_surfaces: BTreeMap<String, MissedSurface>,
    before_slide: Vec<Vec<DVec3>>,
}

struct Wing {
    name: String,
    vertices: Vec<u32>,
    /// A family of the wing for each vertex `[n_vertices of the wing]`.
    family: Vec<FamilyId>,
    /// The vertices that earlier wings of the list place.
    shared: SharedVertices,
    interpolation: ProfileInterpolation,
    mirror: Option<Mirror>,
    /// Vertices that are also on a carenage or plane, as indices of `vertices`.
    junction: Vec<usize>,
    /// The longest chord at the junction, in the mesh's unit.
    junction_chord: f64,
    strip: Option<SurfaceNetwork>,
}

/// The mirror plane of a wing, and the side of the plane on which each vertex stands.
struct Mirror {
    plane: Plane,
    side: Vec<Side>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    OfSections,
    Beyond,
    InPlane,
}

impl Mirror {
    /// Finds the side of each vertex.
    ///
    /// - `sections`: the old profiles
    /// - `positions` `[n_vertices of the wing]`: in the mesh's unit
    ///
    /// # Errors
    /// [`ProfileError::BothSides`]: profiles stand on both sides of the plane.
    fn new(plane: Plane, sections: &[Profile], positions: &[DVec3]) -> Result<Self, ProfileError> {
        let size = 2.0 * positions.iter().map(|p| p.distance(positions[0])).fold(0.0, f64::max);
        let in_plane = ON_MIRROR * size;
        let heights = sections.iter().flat_map(|profile| &profile.points).map(|&point| plane.distance(point));
        let (low, high) = heights.fold((0.0, 0.0), |(low, high), h| (f64::min(low, h), f64::max(high, h)));
        if low < -in_plane && high > in_plane {
            return Err(ProfileError::BothSides { low, high });
        }
        let plane = if high > in_plane { plane } else { Plane { normal: -plane.normal, ..plane } };
        let side = |&position: &DVec3| match plane.distance(position) {
            height if height.abs() <= in_plane => Side::InPlane,
            height if height < 0.0 => Side::Beyond,
            _ => Side::OfSections,
        };
        Ok(Self { plane, side: positions.iter().map(side).collect() })
    }

    /// Mirrors a position to the sections' side, if the vertex stands beyond the plane.
    fn fold(&self, vertex: usize, at: DVec3) -> DVec3 {
        match self.side[vertex] {
            Side::Beyond => at - self.plane.normal * (2.0 * self.plane.distance(at)),
            _ => at,
        }
    }

    /// Mirrors a direction, if the vertex stands beyond the plane.
    fn reflect(&self, vertex: usize, along: DVec3) -> DVec3 {
        match self.side[vertex] {
            Side::Beyond => along - 2.0 * self.across(along),
            _ => along,
        }
    }

    /// Mirrors a displacement from the sections' side to the vertex's side. Vertices in the plane
    /// stay in the plane.
    fn unfold(&self, vertex: usize, displacement: DVec3) -> DVec3 {
        match self.side[vertex] {
            Side::InPlane => displacement - self.across(displacement),
            _ => self.reflect(vertex, displacement),
        }
    }

    fn across(&self, along: DVec3) -> DVec3 {
        self.plane.normal * along.dot(self.plane.normal)
    }
}

impl Wings {
    /// Finds the place of each wing vertex among the old profiles, and sets up the strips.
    ///
    /// # Errors
    /// - [`SetupError::NoProfiles`], [`SetupError::SeveralProfiles`]: a family with the role wing
    ///   has no old profiles, or two sets of old profiles
    /// - [`SetupError::NoWing`]: a family of a wing has another role
    /// - [`SetupError::Profiles`]: the old profiles cannot be used
    /// - [`SetupError::Reach`]: the wing reaches too far beyond its outermost sections
    /// - [`SetupError::Backend`]: the backend failed
    pub fn new(set_up: &SetUp, wings: &[WingProfiles]) -> Result<Self, SetupError> {
        let SetUp { mesh, families, .. } = *set_up;
        let name = |family: FamilyId| mesh.families[family.index()].clone();
        for family in families.families_of(PlacedBy::Wing) {
            match wings.iter().filter(|wing| wing.families.contains(&family)).count() {
                1 => {}
                0 => return Err(SetupError::NoProfiles { family: name(family) }),
                _ => return Err(SetupError::SeveralProfiles { family: name(family) }),
            }
        }
        // The wing that places each vertex.
        let mut owner: HashMap<u32, usize> = HashMap::new();
        let mut all: Vec<Wing> = Vec::new();
        for wing in wings {
            if let Some(&other) =
                wing.families.iter().find(|family| families.roles[family.index()].placed_by() != PlacedBy::Wing)
            {
                return Err(SetupError::NoWing { wing: wing.name.clone(), family: name(other) });
            }
            let made = Wing::new(set_up, wing, &owner)?;
            for &vertex in &made.vertices {
                owner.entry(vertex).or_insert(all.len());
            }
            all.push(made);
        }
        Ok(Self {
            wings: all,
            moved: Vec::new(),
            shared_curves: Vec::new(),
            missed_surfaces: BTreeMap::new(),
            before_slide: Vec::new(),
            products: Vec::new(),
        })
    }

    /// Writes the displacements by the profiles into `displacement`, in the mesh's unit.
    /// Displacements of vertices that other families place go into `wanted` instead. [`Stage::run`]
    /// goes on with the junctions.
    ///
    /// # Errors
    /// The new profiles of a wing are missing or do not pair with the old ones. The error holds the
    /// wing's name.
    pub fn interpolate(
        &mut self,
        families: &Families,
        new_profiles: &BTreeMap<String, Vec<Profile>>,
        displacement: &mut Displacement,
        wanted: &mut Vec<Wanted>,
    ) -> Result<(), (String, ProfileError)> {
        let no_profiles = Vec::new();
        self.moved = self
            .wings
            .iter()
            .map(|wing| {
                let new = new_profiles.get(&wing.name).unwrap_or(&no_profiles);
                let mut moved = wing.interpolation.displacements(new).map_err(|error| (wing.name.clone(), error))?;
                if let Some(mirror) = &wing.mirror {
                    let pairs = moved.displacement.iter_mut().zip(&mut moved.span_direction);
                    for (place, (displacement, span_direction)) in pairs.enumerate() {
                        *displacement = mirror.unfold(place, *displacement);
                        *span_direction = mirror.reflect(place, *span_direction);
                    }
                }
                for (place, (&vertex, by)) in wing.vertices.iter().zip(&moved.displacement).enumerate() {
                    if families.placed_by[vertex as usize] != PlacedBy::Wing {
                        wanted.push(Wanted { family: wing.family[place], vertex, displacement: *by });
                    } else if wing.shared.owner(place).is_none() {
                        displacement[vertex as usize] = *by;
                    }
                }
                Ok(moved)
            })
            .collect::<Result<_, _>>()?;
        let of_wing = |(wing, moved): (&Wing, &ProfileDisplacement)| {
            let at = |place: usize| wing.vertices[place];
            let curves = wing.shared.curves(at, &moved.displacement, displacement);
            let named = curves.into_iter().map(|(owner, curve)| {
                (wing.name.clone(), SharedCurve { owner: self.wings[owner].name.clone(), ..curve })
            });
            named.collect::<Vec<_>>()
        };
        self.shared_curves = self.wings.iter().zip(&self.moved).flat_map(of_wing).collect();
        Ok(())
    }

    /// Exchanges what the wings keep of their last design with what they kept of another one.
    pub fn exchange(&mut self, made: &mut MadeByWings) {
        let MadeByWings { moved, shared_curves, missed_surfaces, before_slide } = made;
        std::mem::swap(&mut self.moved, moved);
        std::mem::swap(&mut self.shared_curves, shared_curves);
        std::mem::swap(&mut self.missed_surfaces, missed_surfaces);
        std::mem::swap(&mut self.before_slide, before_slide);
    }

    /// The wings whose junctions missed their surfaces in the last design, by name.
    pub fn missed_surfaces(&self) -> &BTreeMap<String, MissedSurface> {
        &self.missed_surfaces
    }

    /// The curves that wings share with earlier wings of the list, with the name of the later wing
    /// and what the last design made of them.
    pub fn shared_curves(&self) -> impl Iterator<Item = (&str, &SharedCurve)> {
        self.shared_curves.iter().map(|(wing, curve)| (wing.as_str(), curve))
    }

    /// The wing with the profiles that came nearest to a refusal in the last design.
    pub fn nearest_to_refusal(&self) -> Option<(String, Closeness)> {
        let all = self
            .wings
            .iter()
            .zip(&self.moved)
            .map(|(wing, displacement)| (wing.name.clone(), displacement.closeness.clone()));
        all.max_by(|a, b| a.1.share.total_cmp(&b.1.share))
    }

    /// What was odd about the new profiles of the last design, each with the name of its wing.
    pub fn remarks(&self) -> impl Iterator<Item = (&str, &Remark)> {
        let all = self.wings.iter().zip(&self.moved);
        all.flat_map(|(wing, moved)| moved.remarks.iter().map(|remark| (wing.name.as_str(), remark)))
    }

    /// How each profile of a wing was matched in the last design, by its number.
    pub fn matches(&self, wing: &str) -> BTreeMap<i64, ProfileMatch> {
        let mut all = self.wings.iter().zip(&self.moved);
        all.find(|(of, _)| of.name == wing).map(|(_, moved)| moved.matches.clone()).unwrap_or_default()
    }

    /// The wings with new profiles that were compared with flat cuts in the last design.
    pub fn flat_cuts(&self) -> Vec<String> {
        let flat = self.wings.iter().zip(&self.moved).filter(|(_, displacement)| displacement.flat_cuts);
        flat.map(|(wing, _)| wing.name.clone()).collect()
    }

    /// The old profiles that pass through parts on their wing and are bridged there, each with the
    /// name of the wing.
    pub fn gaps(&self) -> impl Iterator<Item = (&str, &[(i64, Gap)])> {
        self.wings.iter().map(|wing| (wing.name.as_str(), wing.interpolation.gaps()))
    }

    /// The vertices beside the planes of the old profiles.
    pub fn beside_sections(&self) -> Vec<u32> {
        self.wings
            .iter()
            .flat_map(|wing| wing.interpolation.beside_sections().map(|place| wing.vertices[place]))
            .collect()
    }

    /// For each wing, the vertex that misses each new profile the most. [`Missed::vertex`] is a
    /// vertex of the mesh here.
    ///
    /// - `new_profiles`: of the last design
    /// - `vertices` `[n_vertices]`: moved positions, in the mesh's unit
    ///
    /// # Errors
    /// As for [`Wings::interpolate`].
    pub fn missed(
        &self,
        new_profiles: &BTreeMap<String, Vec<Profile>>,
        vertices: &[DVec3],
    ) -> Result<BTreeMap<String, Vec<Missed>>, (String, ProfileError)> {
        let of_wing = |(wing, displacement): (&Wing, &ProfileDisplacement)| {
            let new = new_profiles.get(&wing.name).map_or(&[][..], Vec::as_slice);
            let at = wing.vertices.iter().map(|&vertex| vertices[vertex as usize]);
            let missed = match &wing.mirror {
                None => wing.interpolation.missed(new, displacement, &at.collect::<Vec<_>>()),
                Some(mirror) => {
                    let mut displacement = displacement.clone();
                    let pairs = displacement.displacement.iter_mut().zip(&mut displacement.span_direction);
                    for (place, (displacement, span_direction)) in pairs.enumerate() {
                        *displacement = mirror.reflect(place, *displacement);
                        *span_direction = mirror.reflect(place, *span_direction);
                    }
                    let folded = at.enumerate().map(|(place, at)| mirror.fold(place, at));
                    wing.interpolation.missed(new, &displacement, &folded.collect::<Vec<_>>())
                }
            };
            let mut missed = missed.map_err(|error| (wing.name.clone(), error))?;
            missed.iter_mut().for_each(|missed| missed.vertex = wing.vertices[missed.vertex] as usize);
            Ok((wing.name.clone(), missed))
        };
        self.wings.iter().zip(&self.moved).map(of_wing).collect()
    }
}

impl Stage for Wings {
    /// Slides the junctions back onto their surfaces. [`Wings::interpolate`] must run before.
    fn run(
        &mut self,
        set_up: &SetUp,
        displacement: &mut Displacement,
        _: &dyn Fn(&str),
    ) -> Result<Convergence, StageError> {
        let SetUp { mesh, families, stopping, .. } = set_up;
        let mut convergence = Convergence::nothing_to_do();
        self.missed_surfaces.clear();
        self.before_slide.clear();
        for (wing, moved) in self.wings.iter_mut().zip(&self.moved) {
            let spread = wing.shared.spread(&wing.vertices, &moved.displacement, displacement, stopping)?;
            convergence = convergence.and(spread);
            let at_junction = wing.junction.iter().map(|&place| displacement[wing.vertices[place] as usize]);
            self.before_slide.push(at_junction.collect());
            let Some(strip) = &mut wing.strip else { continue };
            let mut slide = vec![DVec3::ZERO; mesh.vertices.len()];
            let mut missed: Option<MissedSurface> = None;
            for &place in &wing.junction {
                let vertex = wing.vertices[place];
                let displacement = displacement[vertex as usize];
                if displacement != DVec3::ZERO {
                    let at = mesh.vertices[vertex as usize];
                    let along = moved.span_direction[place].try_normalize();
                    // The order of these subtractions matters. In another order the rounding of the
                    // sum with the position would stay in the displacement.
                    let settled = families.settle_along(vertex, at + displacement, along) - at;
                    let by = settled - displacement;
                    slide[vertex as usize] = by;
                    if let Some(along) = along.filter(|_| families.shapes_at(vertex).count() == 1) {
                        let of_chord = (by - along * by.dot(along)).length() / wing.junction_chord;
                        let worst = missed.get_or_insert(MissedSurface { vertex, of_chord, vertices: 0 });
                        worst.vertices += usize::from(of_chord > MISSED_SURFACE);
                        if of_chord > worst.of_chord {
                            (worst.vertex, worst.of_chord) = (vertex, of_chord);
                        }
                    }
                }
            }
            let missed = missed.filter(|missed| missed.of_chord > MISSED_SURFACE);
            self.missed_surfaces.extend(missed.map(|missed| (wing.name.clone(), missed)));
            families.partners.even_slide(&wing.vertices, displacement, &mut slide);
            convergence = convergence.and(strip.relax(&mut slide, stopping)?);
            for &vertex in &wing.vertices {
                displacement[vertex as usize] += slide[vertex as usize];
            }
        }
        Ok(convergence)
    }
}

impl Wing {
    /// Sets up a wing.
    ///
    /// - `owner`: the number of the wing that places a vertex, for the vertices of earlier wings
    fn new(set_up: &SetUp, wing: &WingProfiles, owner: &HashMap<u32, usize>) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        let about = |error| SetupError::Profiles { family: wing.name.clone(), error };
        let mut vertices: Vec<u32> =
            wing.families.iter().flat_map(|&family| surface.vertices_of(family).iter().copied()).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |vertex: u32| vertices.binary_search(&vertex).expect("a triangle's corners are vertices") as u32;
        let corners = wing.families.iter().flat_map(|&family| surface.corners_of(family));
        let triangles: Vec<[u32; 3]> = corners.map(|corners| corners.map(place)).collect();
        let faces = wing.families.iter().flat_map(|&family| surface.faces_of(family));
        let mut faces: Vec<Face> = faces.map(|face| face.renumbered(place)).collect();
        let mut positions: Vec<DVec3> = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
        let mut normals = vertex_normals(&positions, &triangles);
        let mirror = wing.mirror.map(|plane| Mirror::new(plane, &wing.old, &positions)).transpose().map_err(about)?;
        let mut mirrored = Vec::new();
        if let Some(mirror) = &mirror {
            let has = |face: &Face, side| face.vertices().iter().any(|&corner| mirror.side[corner as usize] == side);
            (mirrored, faces) = faces.into_iter().partition(|face| has(face, Side::Beyond));
            // A face with corners on both sides belongs to neither half.
            mirrored.retain(|face| !has(face, Side::OfSections));
            for place in 0..vertices.len() {
                positions[place] = mirror.fold(place, positions[place]);
                normals[place] = mirror.reflect(place, normals[place]);
            }
        }
        let junctions = junctions(mesh, surface, &families.roles, &wing.families, place);
        let of_wing = WingSurface {
            positions: &positions,
            normals: &normals,
            faces: &faces,
            mirrored: &mirrored,
            junctions: Some(&junctions),
        };
        let interpolation = ProfileInterpolation::new(&wing.old, &of_wing).map_err(about)?.matched_by(wing.matched);
        if let Some(reach) = interpolation.reach().filter(|reach| reach.iter().any(|reach| *reach > REACH + SLACK)) {
            return Err(SetupError::Reach { wing: wing.name.clone(), reach, mirrored: mirror.is_some() });
        }
        let junction: Vec<usize> = (0..vertices.len())
            .filter(|&place| {
                families.placed_by[vertices[place] as usize] == PlacedBy::Wing
                    && families.shapes_at(vertices[place]).next().is_some()
            })
            .collect();
        let of_wing = Strip {
            set_up,
            families: &wing.families,
            vertices: &vertices,
            positions: &positions,
            interpolation: &interpolation,
        };
        if let Some(place) = strip::part_without_section(&of_wing, &triangles) {
            let family = wing.families.iter().find(|&&family| surface.vertices_of(family).contains(&vertices[place]));
            let family = family.map_or_else(String::new, |family| mesh.families[family.index()].clone());
            return Err(SetupError::Apart { wing: wing.name.clone(), family });
        }
        let placed = |vertex: &u32| (families.placed_by[*vertex as usize] == PlacedBy::Wing).then(|| owner.get(vertex));
        let owners: Vec<Option<usize>> = vertices.iter().map(|vertex| placed(vertex).flatten().copied()).collect();
        let shared = SharedVertices::new(&of_wing, owners)?;
        let strip = of_wing.beside_junction(&junction, |place| shared.owner(place).is_some())?;
        let family = |vertex: &u32| {
            let has = |family: &&FamilyId| surface.vertices_of(**family).binary_search(vertex).is_ok();
            *wing.families.iter().find(has).expect("the vertices are those of the families")
        };
        let family = vertices.iter().map(family).collect();
        let junction_chord = of_wing.longest_chord(&junction);
        let name = wing.name.clone();
        Ok(Self { name, vertices, family, shared, interpolation, mirror, junction, junction_chord, strip })
    }
}

/// Where a wing's surface ends on other families.
///
/// - `wing`: the wing's families
/// - `number`: the number of a vertex of the mesh in the result
pub(crate) fn junctions(
    mesh: &TetMesh,
    surface: &Surface,
    roles: &[Role],
    wing: &[FamilyId],
    number: impl Fn(u32) -> u32,
) -> Junctions {
    let half_edges = wing.iter().flat_map(|&family| surface.boundary_loops(family)).flatten();
    let beyond = half_edges.filter_map(|half_edge| {
        let family = surface.family_behind(half_edge);
        let ends = [half_edge, next(half_edge)].map(|half_edge| number(surface.origin(half_edge)));
        (!wing.contains(&family)).then_some((ends, family))
    });
    Junctions::new(beyond, &mesh.families, |family| roles[family.index()].is_bridged())
}
