//! The surfaces on which junctions slide: those of the wings, and those of rigid bodies.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::{behind, families_at, refused};
use crate::families::{Families, Junction, PlacedBy, RigidMotion, Role, SetupError, TipStart};
use crate::geometry::{corners, triangle_normal, unit_normal};
use crate::mesh::FamilyId;
use crate::stage::SetUp;

/// Width of the strip of a wing beside a curve, as a fraction of the curve's extent (about a
/// chord).
const STRIP: f64 = 0.5;

/// The same of a body.
const STRIP_OF_BODY: f64 = 1.0;

/// Cosine of the largest angle, 72 degrees, between the body at a curve and elsewhere on the
/// surface on which the curve slides.
const FACING: f64 = 0.3;

/// Cosine of the least angle, 60 degrees, between two triangles at whose edge this surface ends.
const SMOOTH: f64 = 0.5;

/// What a curve of a part lies on.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum On {
    /// The wings.
    Wings,
    /// The rigid families of an assembly, by its number, that slide and have this motion.
    Body(usize, RigidMotion),
}

impl On {
    pub fn placed_by(self) -> PlacedBy {
        match self {
            Self::Wings => PlacedBy::Wing,
            Self::Body(..) => PlacedBy::Rigid,
        }
    }

    /// The assembly to which a body belongs.
    pub fn assembly(self) -> Option<usize> {
        match self {
            Self::Wings => None,
            Self::Body(assembly, _) => Some(assembly),
        }
    }

    /// Whether a family is part of this surface.
    pub fn has(self, families: &Families, family: FamilyId) -> bool {
        match (self, &families.roles[family.index()]) {
            (Self::Wings, role) => *role == Role::Wing,
            (Self::Body(assembly, own), Role::Rigid { motion, junction: Junction::Slide }) => {
                own == *motion && families.assemblies[assembly].families.contains(&family)
            }
            _ => false,
        }
    }

    /// Width of the strip beside a curve, as a fraction of the curve's extent.
    pub fn strip(self) -> f64 {
        match self {
            Self::Wings => STRIP,
            Self::Body(..) => STRIP_OF_BODY,
        }
    }

    /// Of a family of the part and one of the surface, the one whose table lets the curve slide.
    pub fn reported(self, [of_part, of_surface]: [FamilyId; 2]) -> FamilyId {
        match self {
            Self::Wings => of_part,
            Self::Body(..) => of_surface,
        }
    }

    pub fn is_met_by_none(self) -> &'static str {
        match self {
            Self::Wings => "neither it nor what it hangs together with meets a wing",
            Self::Body(..) => "no attached family meets it",
        }
    }
}

/// What slides in an assembly.
pub(super) struct Sliding {
    /// The attached families.
    pub part: Vec<FamilyId>,
    /// What they slide on, the wings first, each with a family whose table says so.
    pub on: Vec<(FamilyId, On)>,
}

/// What slides in an assembly. `None` if all its junctions are glued.
///
/// # Errors
/// [`SetupError::Junction`]: some slide, and others cannot
pub(super) fn sliding(set_up: &SetUp, assembly: usize) -> Result<Option<Sliding>, SetupError> {
    let members = &set_up.families.assemblies[assembly].families;
    let role = |family: FamilyId| &set_up.families.roles[family.index()];
    let slides = |family: &&FamilyId| matches!(role(**family), Role::Attached { junction: Junction::Slide, .. });
    let first_on_wing = members.iter().find(slides).copied();
    let mut on: Vec<(FamilyId, On)> = first_on_wing.map(|family| (family, On::Wings)).into_iter().collect();
    for &family in members {
        if let Role::Rigid { motion, junction: Junction::Slide } = *role(family)
            && !on.iter().any(|(_, other)| *other == On::Body(assembly, motion))
        {
            on.push((family, On::Body(assembly, motion)));
        }
    }
    let Some(&(first, _)) = on.first() else { return Ok(None) };
    let attached = |family: &&FamilyId| role(**family).placed_by() == PlacedBy::Attached;
    let part: Vec<FamilyId> = members.iter().filter(attached).copied().collect();
    for &family in &part {
        let name = &set_up.mesh.families[family.index()];
        let why = match role(family) {
            Role::Wingtip { .. } => format!("it hangs together with `{name}`, which is a wingtip"),
            Role::Attached { junction: Junction::Glued, .. } if first_on_wing.is_some() => {
                format!("it hangs together with `{name}`, whose junction is glued")
            }
            Role::Attached { start, .. } if *start != TipStart::Rigid => format!("the start of `{name}` is not rigid"),
            _ => continue,
        };
        return Err(refused(set_up, first, why));
    }
    Ok(Some(Sliding { part, on }))
}

/// The surface behind a half-edge of a part, on which the part slides. `None` if it does not: on a
/// wing or a body where the curve is glued, and on families that later stages place.
///
/// # Errors
/// [`SetupError::Junction`]: the part slides on wings, and another family that earlier stages place
/// lies there
pub(super) fn lies_on(
    set_up: &SetUp,
    assembly: usize,
    on_wings: bool,
    half_edge: u32,
) -> Result<Option<On>, SetupError> {
    let [family, other] = families_at(set_up, half_edge);
    match &set_up.families.roles[other.index()] {
        Role::Wing if on_wings => Ok(Some(On::Wings)),
        &Role::Rigid { motion, junction: Junction::Slide } => Ok(Some(On::Body(assembly, motion))),
        role if !on_wings || role.placed_by() >= PlacedBy::Rigid => Ok(None),
        role => {
            let why = format!("it meets `{}`, whose role is {}", behind(set_up, half_edge), role.name());
            Err(refused(set_up, family, why))
        }
    }
}

/// The triangles of a body that hang together with its curves, and face as the body does at them.
/// The others are no graph over the plane of the curve's hole: the duct of a nacelle faces as its
/// outside does on the other side of its axis.
///
/// - `vertices` `[n_vertices]`: of the mesh
/// - `curves`: the vertices of each curve
pub(super) fn facing<'a>(
    vertices: &[DVec3],
    triangles: Vec<[u32; 3]>,
    curves: impl Iterator<Item = &'a [u32]>,
) -> Vec<[u32; 3]> {
    let normals: Vec<DVec3> = triangles.iter().map(|&t| unit_normal(corners(vertices, t))).collect();
    let edges = |[a, b, c]: [u32; 3]| [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]);
    let mut beside: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (index, &triangle) in triangles.iter().enumerate() {
        edges(triangle).into_iter().for_each(|edge| beside.entry(edge).or_default().push(index));
    }
    let mut kept = vec![false; triangles.len()];
    for curve in curves {
        let on_curve: HashSet<u32> = curve.iter().copied().collect();
        let at_curve = |index: &usize| triangles[*index].iter().any(|vertex| on_curve.contains(vertex));
        let mut front: Vec<usize> = (0..triangles.len()).filter(at_curve).collect();
        let up: DVec3 = front.iter().map(|&index| triangle_normal(corners(vertices, triangles[index]))).sum();
        let up = up.normalize_or_zero();
        let mut seen = vec![false; triangles.len()];
        while let Some(index) = front.pop() {
            if normals[index].dot(up) < FACING || std::mem::replace(&mut seen[index], true) {
                continue;
            }
            kept[index] = true;
            let smooth = |other: &&usize| normals[index].dot(normals[**other]) > SMOOTH;
            front.extend(edges(triangles[index]).iter().flat_map(|edge| &beside[edge]).filter(smooth));
        }
    }
    triangles.into_iter().zip(kept).filter_map(|(triangle, kept)| kept.then_some(triangle)).collect()
}
