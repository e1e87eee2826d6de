//! The roles of a mesh's families, and the constraints that follow for each vertex.

use std::collections::{BTreeMap, HashMap};

use glam::{DMat3, DVec3};
use thiserror::Error;

mod alike;
mod assemblies;
#[doc(hidden)]
pub mod guess;
mod misplaced;
mod partners;
mod roles;
#[doc(hidden)]
pub mod shape;
mod slide;

pub use assemblies::{Assembly, RootChange};
pub use misplaced::Misplaced;
pub use partners::{Partners, even};
pub use roles::{Junction, PlacedBy, ROLES, RigidMotion, Role, RoleOptions, RoleRow, TipStart};

use crate::{
    backend::BackendError,
    constraint::Constraint,
    mesh::{FamilyId, HybridMesh, TetMesh, csr::Csr, half_edge::Surface},
    profile::ProfileError,
    projection::continuation::ContinuationError,
    text::nearest::{did_you_mean, quoted},
};
use shape::{FamilyShape, ShapeAtVertex};

/// An error of a mesh and its roles.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SetupError {
    /// A plane family is not flat.
    #[error(
        "family `{family}` has the role plane, but its vertices lie up to {distance:e} off the plane fitted to them \
         (allowed: {allowed:e}){}",
        advice(*least, distance / allowed)
    )]
    NotPlane {
        /// Name of the family.
        family: String,
        /// Largest distance of a vertex from the fitted plane, in the mesh's unit.
        distance: f64,
        /// The allowed distance, in the mesh's unit.
        allowed: f64,
        /// The least `flat` that would accept the family.
        least: f64,
    },
    /// A carenage could not be continued across the hole under a wing.
    #[error("family `{family}`: {error}")]
    Continuation {
        /// Name of the family.
        family: String,
        /// The cause.
        error: ContinuationError,
    },
    /// A wing's old profiles do not fit its surface.
    #[error("profiles of family `{family}`: {error}")]
    Profiles {
        /// Name of the family.
        family: String,
        /// The cause.
        error: ProfileError,
    },
    /// A family belongs to two wings.
    #[error("family `{family}` belongs to two sets of profiles, expected one")]
    SeveralProfiles {
        /// Name of the family.
        family: String,
    },
    /// A family of a wing has another role.
    #[error("family `{family}` belongs to the profiles of `{wing}`, but has not the role wing")]
    NoWing {
        /// Name of the wing's family.
        wing: String,
        /// Name of the family.
        family: String,
    },
    /// A wing reaches far beyond its sections.
    #[error(
        "the wing of `{wing}` reaches {:.2} of the span that its profiles cover beyond the first of them and {:.2} beyond the \
         last, allowed is 0.5: nothing says how it moves there{}",
        reach[0],
        reach[1],
        if *mirrored { "" } else { "; give profiles nearer to its ends, or, if the other half is its mirror image, mirror = \"y\"" }
    )]
    Reach {
        /// Name of the wing's family.
        wing: String,
        /// Reach beyond the first and the last profile, as shares of the span between them.
        reach: [f64; 2],
        /// Whether it has a mirror plane.
        mirrored: bool,
    },
    /// A name that is none of the mesh's families.
    #[error("the mesh has no family `{name}`{}; it has {}", did_you_mean(name, known).unwrap_or_default(), quoted(known))]
    UnknownFamily {
        /// The name.
        name: String,
        /// The families of the mesh.
        known: Vec<String>,
    },
    /// Two wings have one name, or a wing has the name of a family of another wing.
    #[error("`{wing}` is the name of two wings, or of a wing and of another wing's family, expected different names")]
    WingNames {
        /// The name.
        wing: String,
    },
    /// A wing lists a family twice.
    #[error("the wing `{wing}` has the family `{family}` twice, expected each family once")]
    FamilyTwice {
        /// Name of the wing.
        wing: String,
        /// Name of the family.
        family: String,
    },
    /// A part of a wing of several families shares no vertex with the rest, and has no section.
    #[error(
        "family `{family}` shares no vertex with the other families of the wing `{wing}`, and no plane of its profiles crosses \
         it: nothing says how it moves; expected profiles there, or a table of its own"
    )]
    Apart {
        /// Name of the wing.
        wing: String,
        /// Name of the family.
        family: String,
    },
    /// A number of a role or a setting is out of its range.
    #[error("{what} is {value}, expected {expected}")]
    OutOfRange {
        /// The setting, and its family if it is a role's.
        what: String,
        /// The number.
        value: f64,
        /// The range.
        expected: &'static str,
    },
    /// Families without a role.
    #[error("no role is given for {}, expected one for each family of the mesh", quoted(families))]
    NoRole {
        /// The families.
        families: Vec<String>,
    },
    /// A family inside the volume has the role of a surface.
    #[error(
        "the faces of family `{family}` lie inside the volume, between two cells, but it has the role {role}, expected interior"
    )]
    Inside {
        /// Name of the family.
        family: String,
        /// Its role.
        role: &'static str,
    },
    /// A family on the boundary has the role interior.
    #[error(
        "family `{family}` has the role interior, but its faces lie on the boundary, expected the role of a surface"
    )]
    NotInside {
        /// Name of the family.
        family: String,
    },
    /// A wing of no family.
    #[error("the wing `{wing}` has no families, expected at least one")]
    NoFamilies {
        /// Name of the wing's family.
        wing: String,
    },
    /// A wing has no old profiles.
    #[error("family `{family}` has the role wing, but no old profiles")]
    NoProfiles {
        /// Name of the family.
        family: String,
    },
    /// Two plane families cannot be partners.
    #[error("`{family}` and `{partner}` shall be partners: {why}")]
    Partners {
        /// Name of the first family.
        family: String,
        /// Name of the second family.
        partner: String,
        /// The cause.
        why: String,
    },
    /// Wingtip and attached families that touch move as one, but their starts differ.
    #[error(
        "the families `{family}` and `{other}` are wingtips or attached and hang together, so they move as one, but their \
         `start` differs, expected the same for both"
    )]
    TipStarts {
        /// Name of the first family.
        family: String,
        /// Name of a family with another start.
        other: String,
    },
    /// An assembly hangs from nothing that is placed before it.
    #[error(
        "family `{family}` has the role {role}, but neither it nor a family that it hangs together with touches a wing, a \
         trailing edge, a carenage, or a prescribed or fixed family: nothing says how it moves{}",
        if *role == "rigid" { "; motion = \"none\" or a given motion needs no such family" } else { "" }
    )]
    NoRoot {
        /// Name of the family.
        family: String,
        /// Its role.
        role: &'static str,
    },
    /// The root of an assembly lies on a line, so it has no one rotation.
    #[error(
        "family `{family}` goes with the rotation of its root, but the root's {vertices} vertices lie on a line, so they \
         turn about it in no known way; expected start = \"affine\" or motion = \"translation\""
    )]
    ThinRoot {
        /// Name of the family.
        family: String,
        /// Number of the root's vertices.
        vertices: usize,
    },
    /// A given motion takes a rigid family off a plane that it touches.
    #[error(
        "the motion of family `{family}` leaves the plane with the normal ({:.4}, {:.4}, {:.4}) that it touches, expected a \
         turn about this normal and a shift in the plane",
        normal.x, normal.y, normal.z
    )]
    LeavesPlane {
        /// Name of the family.
        family: String,
        /// The plane's unit normal.
        normal: DVec3,
    },
    /// The junction of an attached family cannot slide, or none slides on a rigid one.
    #[error("the junction of family `{family}` cannot slide: {why}; junction = \"glued\" goes without")]
    Junction {
        /// Name of the family.
        family: String,
        /// The cause.
        why: String,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// Largest number of rounds of alternating projections.
const ROUNDS: usize = 100;

/// A larger `flat` is refused: such a family is no plane.
pub const MOST_FLAT: f64 = 0.1;

/// A family that lies farther off its plane than so many times the allowed distance may be no
/// plane, and no `flat` is advised that would make it one.
const NEARLY: f64 = 10.0;

fn advice(least: f64, times: f64) -> String {
    if least > MOST_FLAT {
        return ": it is no plane, expected another role".to_owned();
    }
    if times > NEARLY {
        return "; is `plane` its role? If it is a plane with noise, a key `flat` in its table allows it".to_owned();
    }
    format!("; with `flat = {least:e}` in its table every vertex keeps its own distance from that plane")
}

/// The roles of a mesh's families, and the constraints of its vertices.
pub struct Families {
    /// Role of each family `[n_families]`.
    pub roles: Vec<Role>,
    /// Shape of each carenage and plane family `[n_families]`.
    pub shapes: Vec<Option<FamilyShape>>,
    /// The stage that places each vertex `[n_vertices]`. Vertices at which an assembly rests on a
    /// carenage are fixed.
    pub placed_by: Vec<PlacedBy>,
    /// The carenage and plane families of each vertex: `n_vertices` rows.
    touches: Csr,
    /// For each plane family with `flat`, the signed distance of each vertex from the plane, in the
    /// mesh's unit.
    offsets: BTreeMap<FamilyId, HashMap<u32, f64>>,
    /// Vertices of periodic planes that move alike.
    pub partners: Partners,
    /// Families with roles that cannot be meant, ascending.
    pub misplaced: Vec<(FamilyId, Misplaced)>,
    /// Families that hang together from wings.
    pub assemblies: Vec<Assembly>,
}

/// Whether a vertex is on a face that the volume does not move `[n_vertices]`: a face of any family
/// but planes, in which vertices slide, and families inside the volume.
///
/// - `roles` `[n_families]`
pub fn held_by_roles(mesh: HybridMesh, roles: &[Role]) -> Vec<bool> {
    let mut is_held = vec![false; mesh.vertices().len()];
    for face in 0..mesh.n_faces() as u32 {
        let role = mesh.family_of(face).and_then(|family| roles.get(family.index()));
        if !matches!(role, Some(Role::Plane { .. } | Role::Interior)) {
            mesh.face_vertices(face).iter().for_each(|&vertex| is_held[vertex as usize] = true);
        }
    }
    is_held
}

impl Families {
    /// Derives the constraints of all vertices.
    ///
    /// - `roles` `[n_families]`
    ///
    /// # Errors
    /// A plane family is not flat, a hole cannot be closed, planes that shall be partners do not
    /// match, or the motion of an assembly is not known.
    pub fn new(mesh: &TetMesh, surface: &Surface, mut roles: Vec<Role>) -> Result<Self, SetupError> {
        assemblies::write_alike(mesh, &mut roles);
        let mut placed_by = vec![PlacedBy::Volume; mesh.vertices.len()];
        let mut touching = Vec::new();
        let mut shapes = Vec::with_capacity(roles.len());
        for (index, role) in roles.iter().enumerate() {
            let family = FamilyId(index as u16);
            let vertices = surface.vertices_of(family);
            for &vertex in vertices {
                placed_by[vertex as usize] = placed_by[vertex as usize].min(role.placed_by());
            }
            shapes.push(match role {
                Role::Plane { flat, .. } => Some(shape::fit_plane(mesh, surface, family, *flat)?),
                Role::Carenage => Some(shape::continued(mesh, surface, &roles, family)?),
                _ => None,
            });
            if shapes[index].is_some() {
                touching.extend(vertices.iter().map(|&vertex| (vertex, index as u32)));
            }
        }
        for vertex in assemblies::resting(surface, &roles, &placed_by) {
            placed_by[vertex as usize] = PlacedBy::Fixed;
        }
        let touches = Csr::from_pairs(mesh.vertices.len(), touching.iter().copied());
        let partners = Partners::new(mesh, surface, &roles, &mut shapes, &placed_by)?;
        let mut offsets = BTreeMap::new();
        for (index, (role, shape)) in roles.iter().zip(&shapes).enumerate() {
            if let (Role::Plane { flat: Some(_), .. }, Some(FamilyShape::Plane(point, normal))) = (role, shape) {
                let family = FamilyId(index as u16);
                let offset = |&vertex: &u32| (vertex, normal.dot(mesh.vertices[vertex as usize] - *point));
                offsets.insert(family, surface.vertices_of(family).iter().map(offset).collect());
            }
        }
        let misplaced = misplaced::misplaced(mesh, surface, &roles);
        let assemblies = Vec::new();
        let mut families = Self { roles, shapes, placed_by, touches, offsets, partners, misplaced, assemblies };
        families.assemblies = Assembly::all(mesh, surface, &families)?;
        Ok(families)
    }

    /// The families whose vertices this stage places, in order.
    pub fn families_of(&self, placed_by: PlacedBy) -> impl Iterator<Item = FamilyId> + '_ {
        (0..self.roles.len())
            .filter(move |&index| self.roles[index].placed_by() == placed_by)
            .map(|index| FamilyId(index as u16))
    }

    /// The families that move: by the design, or because they follow families that do. Planes do
    /// not count, as they only slide.
    pub fn moved(&self) -> impl Iterator<Item = FamilyId> + '_ {
        (0..self.roles.len()).filter(|&index| self.roles[index].placed_by().moves()).map(|index| FamilyId(index as u16))
    }

    /// The assemblies that hang from a wing by more than its tip: those with an attached or a rigid
    /// family.
    pub fn hung(&self) -> impl Iterator<Item = &Assembly> {
        let is_tip = |family: &FamilyId| matches!(self.roles[family.index()], Role::Wingtip { .. });
        self.assemblies.iter().filter(move |assembly| !assembly.families.iter().all(is_tip))
    }

    /// The shapes that a vertex must stay on: the carenages and planes it touches.
    pub fn shapes_at(&self, vertex: u32) -> impl Iterator<Item = ShapeAtVertex<'_>> + '_ {
        self.touches.row(vertex as usize).iter().filter_map(move |&family| self.kept(FamilyId(family as u16), vertex))
    }

    /// The first family that places a vertex.
    pub fn holder(&self, surface: &Surface, vertex: u32) -> Option<FamilyId> {
        self.holders(surface, vertex).next()
    }

    /// The first family but one that places a vertex.
    pub fn other_holder(&self, surface: &Surface, vertex: u32, but: FamilyId) -> Option<FamilyId> {
        self.holders(surface, vertex).find(|&family| family != but)
    }

    fn holders<'a>(&'a self, surface: &'a Surface, vertex: u32) -> impl Iterator<Item = FamilyId> + 'a {
        let of_stage = self.families_of(self.placed_by[vertex as usize]);
        of_stage.filter(move |&family| surface.vertices_of(family).binary_search(&vertex).is_ok())
    }

    /// Whether a vertex must stay on the surface of a carenage.
    pub fn touches_surface(&self, vertex: u32) -> bool {
        self.shapes_at(vertex).any(|kept| matches!(kept.shape, FamilyShape::Surface(_)))
    }

    /// The shape of a carenage or plane family, with the offset of one of its vertices.
    pub fn kept(&self, family: FamilyId, vertex: u32) -> Option<ShapeAtVertex<'_>> {
        let offset = self.offsets.get(&family).and_then(|of| of.get(&vertex)).copied().unwrap_or(0.0);
        Some(ShapeAtVertex { shape: self.shapes[family.index()].as_ref()?, offset })
    }

    /// The constraint of a vertex by the plane families it touches.
    pub fn plane_constraint(&self, vertex: u32) -> Constraint {
        let normals: Vec<DVec3> = self
            .shapes_at(vertex)
            .filter_map(|kept| match kept.shape {
                FamilyShape::Plane(_, normal) => Some(*normal),
                FamilyShape::Surface(_) => None,
            })
            .collect();
        let Some((&first, rest)) = normals.split_first() else { return Constraint::Free };
        // Planes that meet at less than a tenth of a degree count as one plane.
        let mut line: Option<DVec3> = None;
        for normal in rest {
            let direction = first.cross(*normal);
            match line {
                _ if direction.length() < 2e-3 => {}
                None => line = Some(direction.normalize()),
                Some(line) if line.dot(*normal).abs() < 2e-3 => {}
                Some(_) => return Constraint::Held,
            }
        }
        line.map_or(Constraint::InPlane(first), Constraint::OnLine)
    }

    /// The point nearest to `at` on all shapes that a vertex must stay on, in the mesh's unit.
    pub fn settle(&self, vertex: u32, at: DVec3) -> DVec3 {
        self.settle_along(vertex, at, None)
    }

    /// The derivative of [`Self::settle`] by `at`. Where the point lies on a kink of a surface it
    /// is that of the smooth normal.
    pub fn settle_change(&self, vertex: u32, at: DVec3) -> DMat3 {
        let shapes: Vec<ShapeAtVertex> = self.shapes_at(vertex).collect();
        let rounds = match shapes.len() {
            0 => return DMat3::IDENTITY,
            1 => 1,
            _ => ROUNDS,
        };
        let (mut at, mut change) = (at, DMat3::IDENTITY);
        for _ in 0..rounds {
            let before = (at, change);
            for shape in &shapes {
                let (closest, of_shape) = shape.closest_change(at);
                (at, change) = (closest, of_shape * change);
            }
            // Where the vertex is in its place already, the change takes as many rounds as from
            // elsewhere.
            if (at, change) == before {
                break;
            }
        }
        change
    }

    /// The point on all shapes that a vertex must stay on. If there is one shape, the point is
    /// reached from `at` along the unit vector `direction`; otherwise it is the nearest one.
    pub fn settle_along(&self, vertex: u32, at: DVec3, direction: Option<DVec3>) -> DVec3 {
        let shapes: Vec<ShapeAtVertex> = self.shapes_at(vertex).collect();
        match (&shapes[..], direction) {
            ([], _) => at,
            ([shape], Some(direction)) => shape.along(at, direction),
            ([shape], None) => shape.closest(at),
            // Alternating projections converge to the curve where the shapes meet.
            (several, _) => {
                let mut at = at;
                for _ in 0..ROUNDS {
                    let before = at;
                    at = several.iter().fold(at, |at, shape| shape.closest(at));
                    if at == before {
                        break;
                    }
                }
                at
            }
        }
    }
}
