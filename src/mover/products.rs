//! Products with the derivative of an outcome: [`Mover::forward`] and [`Mover::reverse`].
//!
//! An outcome keeps what its products need. So the products of an earlier outcome can be asked for
//! after later updates, and no product changes a later update.

use std::{collections::BTreeMap, sync::Arc};

use glam::DVec3;

use super::{Derivative, Design, Mover, NotDifferentiable, Outcome, ProductError};
use crate::{
    families::{Families, Junction, PlacedBy, Role},
    mesh::{Displacement, FamilyId, TetMesh},
    profile::Profile,
    relaxation::{Convergence, Stopping},
    stage::{Kept, NoProduct, SetUp},
    stages::{STAGES, StageRow, Stages, Wings},
};

/// Largest tolerance of a product, relative to its argument. With the tolerance of an update, 1e-4,
/// forward and reverse products would differ by 1e-5. The four digits more take half as many cycles
/// again.
const TOLERANCE: f64 = 1e-8;

/// The derivative of a number by a design. It has the shape of the design.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Gradient {
    /// By the displacements of each prescribed family `[n_vertices of the family]`, by the family's
    /// name, in the order of [`Mover::family_vertices`]. Zero at vertices that a fixed family
    /// holds. A vertex of several prescribed families counts for the last of them alone.
    pub prescribed: BTreeMap<String, Vec<DVec3>>,
    /// By the points of the new profiles of each wing, by the wing's name: one list for each
    /// profile, in the order of the design's profiles and of their points. Where a profile repeats
    /// a point, as a closed one does at its end, the first of the two counts alone.
    pub profiles: BTreeMap<String, Vec<Vec<DVec3>>>,
}

impl Outcome {
    /// Whether [`Mover::forward`] and [`Mover::reverse`] have an exact derivative of this outcome.
    ///
    /// # Errors
    /// The reason why not. With [`NotDifferentiable::Steps`] and [`NotDifferentiable::Optimised`]
    /// there still is the [frozen](Derivative::Frozen) derivative.
    pub fn differentiable(&self) -> Result<(), NotDifferentiable> {
        self.differentiable.kept(Derivative::Exact).map(|_| ())
    }

    /// Bytes that the outcome keeps for its products.
    #[doc(hidden)]
    pub fn bytes_for_products(&self) -> usize {
        self.differentiable.kept(Derivative::Frozen).map_or(0, |kept| kept.bytes())
    }
}

impl Mover {
    /// Change of the vertices `[n_vertices]` if the design changes in this direction: the
    /// derivative of [`Moved::vertices`](super::Moved::vertices) by the design, times the
    /// direction. The order is the order of the mesh that was given, and the unit is the unit of
    /// the direction.
    ///
    /// The derivative is the equilibrium's, to a relative tolerance of 1e-8, or the update's if it
    /// is smaller. Neither the order of updates and products nor [`Mover::start_from`] changes a
    /// product.
    ///
    /// - `outcome`: of an earlier update of this mover
    /// - `direction`: changes of the displacements of prescribed families, and of the points of new
    ///   profiles: [`Profile::points`](crate::profile::Profile::points) has the change of each
    ///   point of the outcome's profile with this number. Families and profiles that are left out
    ///   do not change. Of a vertex of several prescribed families the last family's counts
    ///
    /// # Errors
    /// See [`ProductError`].
    pub fn forward(
        &mut self,
        outcome: &Outcome,
        direction: &Design,
        derivative: Derivative,
    ) -> Result<Vec<DVec3>, ProductError> {
        let kept = self.kept(outcome, derivative)?;
        self.check_direction(direction, &kept)?;
        let mut change = vec![DVec3::ZERO; self.ordered.vertices.len()];
        for family in self.families.families_of(PlacedBy::Prescribed) {
            let given = direction.prescribed.get(&self.mesh.families[family.index()]);
            for (row, &vertex) in self.family_vertices[family.index()].iter().enumerate() {
                let place = self.order.place(vertex) as usize;
                if self.families.placed_by[place] == PlacedBy::Prescribed {
                    change[place] = given.map_or(DVec3::ZERO, |given| given[row]);
                }
            }
        }
        self.run_products(STAGES.iter(), |row, stages, set_up, stopping| {
            if row.placed_by == PlacedBy::Wing {
                stages.wings.interpolate_forward(set_up.families, &kept, &direction.profiles, &mut change)?;
            }
            let convergence = match row.products {
                Some(products) => products(stages).forward(set_up, &kept, &mut change, stopping)?,
                None => Convergence::nothing_to_do(),
            };
            even(row, set_up, &mut change);
            Ok(convergence)
        })?;
        Ok(self.order.of_vertices(&change))
    }

    /// The derivative of a number by the design, from its derivative by the vertices: the transpose
    /// of [`Mover::forward`].
    ///
    /// - `outcome`: of an earlier update of this mover
    /// - `seed` `[n_vertices]`: derivative of the number by
    ///   [`Moved::vertices`](super::Moved::vertices), in any unit and in the order of the mesh that
    ///   was given
    ///
    /// # Errors
    /// See [`ProductError`].
    pub fn reverse(
        &mut self,
        outcome: &Outcome,
        seed: &[DVec3],
        derivative: Derivative,
    ) -> Result<Gradient, ProductError> {
        let kept = self.kept(outcome, derivative)?;
        let expected = self.mesh.vertices.len();
        if seed.len() != expected {
            return Err(ProductError::Seed { expected, found: seed.len() });
        }
        check_finite(seed, || "the seed".to_owned())?;
        let mut gradient = self.order.to_vertices(seed);
        let mut profiles = BTreeMap::new();
        self.run_products(STAGES.iter().rev(), |row, stages, set_up, stopping| {
            if row.placed_by < PlacedBy::Volume {
                set_up.families.partners.even_reverse(set_up.families, &mut gradient);
            }
            let convergence = match row.products {
                Some(products) => products(stages).reverse(set_up, &kept, &mut gradient, stopping)?,
                None => Convergence::nothing_to_do(),
            };
            if row.placed_by == PlacedBy::Wing {
                profiles = stages.wings.interpolate_reverse(set_up.families, &mut gradient);
            }
            Ok(convergence)
        })?;
        let mut prescribed = BTreeMap::new();
        let families: Vec<FamilyId> = self.families.families_of(PlacedBy::Prescribed).collect();
        for family in families.into_iter().rev() {
            let take = |&vertex: &u32| {
                let place = self.order.place(vertex) as usize;
                let taken = std::mem::take(&mut gradient[place]);
                if self.families.placed_by[place] == PlacedBy::Prescribed { taken } else { DVec3::ZERO }
            };
            let of_family = self.family_vertices[family.index()].iter().map(take).collect();
            prescribed.insert(self.mesh.families[family.index()].clone(), of_family);
        }
        Ok(Gradient { prescribed, profiles })
    }

    /// What products of the outcome need.
    fn kept(&self, outcome: &Outcome, derivative: Derivative) -> Result<Arc<Kept>, ProductError> {
        if !Arc::ptr_eq(&outcome.mesh, &self.mesh) {
            return Err(ProductError::OtherMover);
        }
        Ok(Arc::clone(outcome.differentiable.kept(derivative)?))
    }

    fn check_direction(&self, direction: &Design, kept: &Kept) -> Result<(), ProductError> {
        for (name, given) in &direction.profiles {
            let Some(own) = kept.profiles.get(name) else {
                return Err(ProductError::UnknownWing {
                    name: name.clone(),
                    known: kept.profiles.keys().cloned().collect(),
                });
            };
            for (i, Profile { number, points }) in given.iter().enumerate() {
                let (wing, profile) = (name.clone(), *number);
                let is_double = given[..i].iter().any(|other| other.number == *number);
                let Some(own) = own.iter().find(|own| own.number == *number && !is_double) else {
                    return Err(ProductError::Profile {
                        wing,
                        profile,
                        known: own.iter().map(|own| own.number).collect(),
                    });
                };
                if points.len() != own.points.len() {
                    let (expected, found) = (own.points.len(), points.len());
                    return Err(ProductError::Points { wing, profile, expected, found });
                }
                check_finite(points, || format!("profile {number} of `{name}`"))?;
            }
        }
        let of_role = self.families.families_of(PlacedBy::Prescribed);
        let known: Vec<String> = of_role.map(|family| self.mesh.families[family.index()].clone()).collect();
        for (name, given) in &direction.prescribed {
            let Some(vertices) = self.family_vertices(name).filter(|_| known.contains(name)) else {
                return Err(ProductError::Unknown { name: name.clone(), known });
            };
            if given.len() != vertices.len() {
                let (family, expected, found) = (name.clone(), vertices.len(), given.len());
                return Err(ProductError::Direction { family, expected, found });
            }
            check_finite(given, || format!("family `{name}`"))?;
        }
        Ok(())
    }

    /// Runs the products of the stages in an order.
    ///
    /// # Errors
    /// A product is not there or did not converge, or the backend failed.
    fn run_products(
        &mut self,
        order: impl Iterator<Item = &'static StageRow>,
        mut product: impl FnMut(&StageRow, &mut Stages, &SetUp, &Stopping) -> Result<Convergence, NoProduct>,
    ) -> Result<(), ProductError> {
        let Self { ordered: mesh, cells, surface, families, backend, method, stopping, stages, .. } = self;
        let backend = backend.as_ref();
        let set_up = SetUp { mesh, cells, surface, families, backend, method: *method, stopping: *stopping };
        let stopping = Stopping { tolerance: stopping.tolerance.min(TOLERANCE), ..*stopping };
        let mut convergence = Convergence::nothing_to_do();
        for row in order {
            let given = |vertex: u32| (self.order.vertex(vertex), mesh.vertices[vertex as usize]);
            let of_stage = product(row, stages, &set_up, &stopping).map_err(|why| match why {
                NoProduct::Backend(error) => error.into(),
                NoProduct::Rotation { vertex } => {
                    let (vertex, position) = given(vertex);
                    ProductError::from(NotDifferentiable::Rotation { vertex, position })
                }
                NoProduct::Carenage { vertex } => {
                    let (vertex, position) = given(vertex);
                    ProductError::from(NotDifferentiable::Carenage { vertex, position })
                }
                NoProduct::Vertex { vertex, why } => {
                    let (vertex, position) = given(vertex);
                    NotDifferentiable::Vertex { vertex, position, why }.into()
                }
                NoProduct::Match { wing, profile, why } => NotDifferentiable::Match { wing, profile, why }.into(),
            })?;
            convergence = convergence.and(of_stage);
        }
        let Convergence { converged, sweeps, error, .. } = convergence;
        if converged { Ok(()) } else { Err(ProductError::NotConverged { sweeps, error }) }
    }
}

/// Gives partners the mean of their vectors, as after each stage of an update but the volume.
fn even(row: &StageRow, set_up: &SetUp, vectors: &mut Displacement) {
    if row.placed_by < PlacedBy::Volume {
        set_up.families.partners.even(set_up.families, vectors);
    }
}

fn check_finite(vectors: &[DVec3], of: impl Fn() -> String) -> Result<(), ProductError> {
    match vectors.iter().enumerate().find(|(_, vector)| !vector.is_finite()) {
        Some((row, &value)) => Err(ProductError::NotFinite { of: of(), row, value }),
        None => Ok(()),
    }
}

/// Why a profile of the last design has no derivative, if one has none.
pub(super) fn not_matched(wings: &Wings) -> Option<NotDifferentiable> {
    let (wing, (profile, why)) = wings.why_not()?;
    Some(NotDifferentiable::Match { wing: wing.to_owned(), profile, why })
}

/// Why a profile of the last design has the derivative of one side alone, if one has.
pub(super) fn kinked(wings: &Wings) -> Option<NotDifferentiable> {
    let (wing, (profile, why)) = wings.kink()?;
    Some(NotDifferentiable::Kink { wing: wing.to_owned(), profile, why })
}

/// The first family that moves in a way that has no products yet.
pub(super) fn without_products(mesh: &TetMesh, families: &Families) -> Option<NotDifferentiable> {
    let name = |family: FamilyId| mesh.families[family.index()].clone();
    let slides =
        |family: &FamilyId| matches!(families.roles[family.index()], Role::Rigid { junction: Junction::Slide, .. });
    if let Some(family) = families.families_of(PlacedBy::Rigid).find(slides) {
        return Some(NotDifferentiable::Junction { family: name(family) });
    }
    let mut stages = STAGES.iter().filter(|row| row.products.is_none());
    let family = stages.find_map(|row| families.families_of(row.placed_by).next())?;
    Some(NotDifferentiable::Role { family: name(family), role: families.roles[family.index()].name() })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::backend::{CpuBackend, Precision};
    use crate::families::{RigidMotion, TipStart};
    use crate::formats;
    use crate::mover::place_given;
    use crate::profile::csv;
    use crate::stage::{Products, Stage};

    /// Half an aircraft with a pylon that slides on its wing, and a nacelle.
    fn with_pylon() -> (Mover, Vec<Profile>) {
        let file = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/hybrid").join(name);
        let mesh = formats::read_mixed(&file("nacelle.msh.gz")).unwrap();
        let path = file("nacelle_old.csv");
        let old = csv::parse(&[(&path, &std::fs::read_to_string(&path).unwrap())]).unwrap();
        let roles = [
            ("pylon", Role::Attached { coefficient: 0.5, start: TipStart::Rigid, junction: Junction::Slide }),
            ("nacelle", Role::Rigid { motion: RigidMotion::Root, junction: Junction::Glued }),
            ("wing", Role::Wing),
            ("trailing_edge", Role::TrailingEdge),
            ("wingtip", Role::Wingtip { coefficient: 0.5, start: TipStart::Affine }),
            ("carenage", Role::Carenage),
            ("symmetry", Role::PLANE),
            ("farfield", Role::Fixed),
        ];
        let builder = Mover::builder(mesh.mesh).other_cells(mesh.others).old_profiles("wing", old.clone());
        let builder = roles.into_iter().fold(builder, |builder, (family, role)| builder.role(family, role));
        let stopping = Stopping { tolerance: 1e-14, ..Stopping::default() };
        (builder.stopping(stopping).build(Arc::new(CpuBackend::new(Precision::F64)) as Arc<_>).unwrap(), old)
    }

    fn with<R>(mover: &mut Mover, what: impl FnOnce(&SetUp, &mut Stages) -> R) -> R {
        let Mover { ordered: mesh, cells, surface, families, backend, method, stopping, stages, .. } = mover;
        let backend = backend.as_ref();
        what(&SetUp { mesh, cells, surface, families, backend, method: *method, stopping: *stopping }, stages)
    }

    /// The displacement before the stage of attached families.
    fn before(mover: &mut Mover, new: Vec<Profile>) -> Displacement {
        let design = Design::of_wing("wing", new);
        let Mover { ordered, order, families, stages, family_vertices, .. } = &mut *mover;
        let placed = place_given(ordered, order, family_vertices, families, &mut stages.wings, &design);
        let mut displacement = placed.unwrap().0;
        with(mover, |set_up, stages| {
            for row in STAGES.iter().filter(|row| row.placed_by < PlacedBy::Attached) {
                (row.of)(stages).run(set_up, &mut displacement, &|_| {}).unwrap();
            }
        });
        displacement
    }

    fn after(mover: &mut Mover, mut displacement: Displacement) -> Displacement {
        let end = with(mover, |set_up, stages| stages.attached.run(set_up, &mut displacement, &|_| {}).unwrap());
        assert!(end.converged);
        displacement
    }

    fn noise(k: usize) -> DVec3 {
        let t = k as f64;
        DVec3::new((1.3 * t + 0.2).sin(), (2.9 * t).cos(), (0.7 * t * t + 1.1).sin())
    }

    fn dot(a: &[DVec3], b: &[DVec3]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum()
    }

    /// The products of the stage alone, where a pylon slides: its curve, the strip beside it, and
    /// the inside of the pylon, by random displacements of all earlier stages. The chord grows, so
    /// that the curve lies in the hole under the pylon; or it shrinks, so that it lies on the wing
    /// around; or all is at rest, where every vertex lies on a kink.
    ///
    /// Fails if the motion of the root is that after the slide, if the rulings do not turn with it,
    /// or if any part of the change of a foot is left out.
    #[test]
    fn products_where_a_pylon_slides_are_exact() {
        let (mut mover, old) = with_pylon();
        for (what, growth, allowed) in [("grows", 0.1, 1e-6), ("shrinks", -0.06, 1e-6), ("rests", 0.0, 0.05)] {
            let turn = glam::DQuat::from_rotation_y(growth);
            let bump = |at: DVec3| growth * 0.2 * (2.0 * at.x).sin();
            let map = |at: DVec3| turn * DVec3::new(at.x * (1.0 + growth), at.y, at.z + bump(at));
            let points = |profile: &Profile| profile.points.iter().map(|&at| map(at)).collect();
            let new = old.iter().map(|profile| Profile { number: profile.number, points: points(profile) });
            let start = before(&mut mover, new.collect());
            let end = after(&mut mover, start.clone());
            let mut kept = Kept { surfaces: end.clone(), ..Kept::default() };
            mover.stages.attached.keep(&mut kept);
            assert_eq!(kept.before_slides().len(), start.len());
            let placed = mover.families.placed_by.clone();
            let pylon = mover.surface.vertices_of(mover.ordered.family("pylon").unwrap()).to_vec();
            let all: Vec<usize> = (0..start.len()).collect();
            let is_wing = |vertex: &usize| placed[*vertex] == PlacedBy::Wing;
            let on_pylon = |vertex: &usize| pylon.binary_search(&(*vertex as u32)).is_ok();
            let select = |is: &dyn Fn(&usize) -> bool| all.iter().copied().filter(is).collect::<Vec<usize>>();
            let curve = select(&|vertex| is_wing(vertex) && on_pylon(vertex));
            let strip = select(&|vertex| is_wing(vertex) && !on_pylon(vertex));
            let inside = select(&|vertex| placed[*vertex] == PlacedBy::Attached);
            let slid = |of: &[usize]| of.iter().filter(|&&vertex| start[vertex] != end[vertex]).count();
            let expected = if growth == 0.0 { 0 } else { curve.len() };
            assert!(slid(&curve) == expected && (growth == 0.0 || slid(&strip) > 20), "{what}: {}", slid(&strip));
            let changed = |by: &dyn Fn(usize) -> DVec3| -> Displacement {
                all.iter().map(|&v| if placed[v] < PlacedBy::Attached { by(v) } else { DVec3::ZERO }).collect()
            };
            let vertices = mover.ordered.vertices.clone();
            let smooth = |v: usize| {
                let at = vertices[v];
                DVec3::new((2.0 * at.y).sin() + at.z, 0.3 * at.x, (3.0 * at.x).cos() * at.y)
            };
            let stopping = Stopping { tolerance: 1e-14, ..Stopping::default() };
            for (direction, h) in [(changed(&smooth), 1e-6), (changed(&noise), 1e-7)] {
                let ends = [h, -h].map(|h| {
                    let moved = start.iter().zip(&direction).map(|(at, by)| *at + *by * h).collect();
                    after(&mut mover, moved)
                });
                let mut change = direction.clone();
                with(&mut mover, |set_up, stages| {
                    assert!(stages.attached.forward(set_up, &kept, &mut change, &stopping).unwrap().converged);
                });
                for (group, of) in [("curve", &curve), ("strip", &strip), ("inside", &inside)] {
                    let found: Vec<DVec3> = of.iter().map(|&v| change[v]).collect();
                    let off = of.iter().map(|&v| (ends[0][v] - ends[1][v]) / (2.0 * h) - change[v]);
                    let off: Vec<DVec3> = off.collect();
                    let off = (dot(&off, &off) / dot(&found, &found)).sqrt();
                    assert!(off <= allowed, "{what}, {group}, by {h:e}: {off:e}");
                    let seed: Displacement = (0..all.len())
                        .map(|v| if of.binary_search(&v).is_ok() { noise(v + 1_000_000) } else { DVec3::ZERO })
                        .collect();
                    let mut gradient = seed.clone();
                    with(&mut mover, |set_up, stages| {
                        stages.attached.reverse(set_up, &kept, &mut gradient, &stopping).unwrap();
                    });
                    assert!(inside.iter().all(|&v| gradient[v] == DVec3::ZERO));
                    let (one, other) = (dot(&seed, &change), dot(&gradient, &direction));
                    let norms = (dot(&seed, &seed) * dot(&found, &found)).sqrt();
                    assert!((one - other).abs() <= 1e-12 * norms, "{what}, {group}: {one} {other} to {norms}");
                }
            }
        }
    }
}
