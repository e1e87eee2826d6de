//! What each family does, and so what each vertex may do.

use glam::DVec3;
use thiserror::Error;

use crate::{
    backend::{BackendError, Constraint},
    mesh::{FamilyId, TetMesh, half_edge::Surface},
    profile::ProfileError,
    projection::{
        Target,
        continuation::{self, ContinuationError},
    },
};

/// What the conservative springs of a wingtip pull back to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TipStart {
    /// The start, carried along by the best affine motion of the tip's boundary: a wing that is bent up and gets a
    /// longer tip chord takes its tip with it.
    #[default]
    Affine,
    /// The start, carried along by the best rigid motion of the tip's boundary.
    Rigid,
    /// The start where it was: the paper's words.
    Original,
}

/// What a family does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// Moved by its profiles.
    Wing,
    /// Follows the wing, as a curve and then as a surface.
    TrailingEdge,
    /// Follows the wing, held back by conservative springs.
    Wingtip {
        /// 0 rigid ... 1 freely deformable.
        coefficient: f64,
        /// Where the springs pull to.
        start: TipStart,
    },
    /// Slides on its original surface.
    Carenage,
    /// Slides in its plane.
    Plane,
    /// Does not move.
    Fixed,
    /// Moved as its user says.
    Prescribed,
}

/// Which stage places a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the names are those of the roles")]
pub enum Owner {
    Fixed,
    Prescribed,
    Wing,
    TrailingEdge,
    Wingtip,
    Carenage,
    Plane,
    Volume,
}

impl Role {
    /// The stage that places vertices of a family with this role.
    pub fn owner(self) -> Owner {
        match self {
            Self::Wing => Owner::Wing,
            Self::TrailingEdge => Owner::TrailingEdge,
            Self::Wingtip { .. } => Owner::Wingtip,
            Self::Carenage => Owner::Carenage,
            Self::Plane => Owner::Plane,
            Self::Fixed => Owner::Fixed,
            Self::Prescribed => Owner::Prescribed,
        }
    }
}

/// Why a mesh and its roles do not go together.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SetupError {
    /// A plane family is not flat.
    #[error(
        "family `{family}` has the role plane, but its vertices lie up to {distance:e} off the plane fitted to them \
         (allowed: {allowed:e})"
    )]
    NotPlane {
        /// The family.
        family: String,
        /// Largest distance of a vertex from the plane.
        distance: f64,
        /// What counts as flat.
        allowed: f64,
    },
    /// A carenage could not be continued across the hole under a wing.
    #[error("family `{family}`: {error}")]
    Continuation {
        /// The family.
        family: String,
        /// What went wrong.
        error: ContinuationError,
    },
    /// A wing's old profiles do not fit its surface.
    #[error("profiles of family `{family}`: {error}")]
    Profiles {
        /// The family.
        family: String,
        /// What went wrong.
        error: ProfileError,
    },
    /// A wing has no old profiles.
    #[error("family `{family}` has the role wing, but no old profiles")]
    NoProfiles {
        /// The family.
        family: String,
    },
    /// Wingtip families that touch, and so move as one, shall start differently.
    #[error(
        "the wingtip families `{family}` and `{other}` touch, so they move as one, but their `start` differs, expected \
         the same for both"
    )]
    TipStarts {
        /// The first of the families.
        family: String,
        /// One that differs from it.
        other: String,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}

/// The surface a carenage slides on, or the plane a plane family lies in.
#[derive(Clone, Debug)]
pub enum Shape {
    /// The original triangles, continued across the wings' roots.
    Surface(Target),
    /// A plane through a point with a unit normal.
    Plane(DVec3, DVec3),
}

impl Shape {
    /// The point of the shape nearest to `at`.
    pub fn closest(&self, at: DVec3) -> DVec3 {
        match self {
            Self::Surface(target) => target.closest(at).point,
            Self::Plane(point, normal) => at - *normal * normal.dot(at - *point),
        }
    }

    /// Unit normal of the shape near `at`.
    pub fn normal(&self, at: DVec3) -> DVec3 {
        match self {
            Self::Surface(target) => target.normal(&target.closest(at)),
            Self::Plane(_, normal) => *normal,
        }
    }

    /// Where the line through `from` along a unit direction meets the shape; the closest point if it hardly does.
    pub fn along(&self, from: DVec3, direction: DVec3) -> DVec3 {
        match self {
            Self::Surface(target) => target.along(from, direction),
            Self::Plane(point, normal) => {
                let slope = normal.dot(direction);
                // As in `Target::along`: a line that nearly runs in the plane meets it too far away.
                if slope.abs() < 0.2 {
                    self.closest(from)
                } else {
                    from - direction * (normal.dot(from - *point) / slope)
                }
            }
        }
    }
}

/// The roles of a mesh's families and what follows from them for its vertices.
pub struct Families {
    /// Role of each family `[n_families]`.
    pub roles: Vec<Role>,
    /// Shape of each carenage and plane family `[n_families]`.
    pub shapes: Vec<Option<Shape>>,
    /// Which stage places each vertex `[n_vertices]`.
    pub owner: Vec<Owner>,
    /// The carenage and plane families each vertex touches `[n_vertices]` rows.
    touches: crate::mesh::csr::Csr,
}

impl Families {
    /// Works out what each vertex may do.
    ///
    /// # Errors
    /// A plane family is not flat, or a hole cannot be closed.
    pub fn new(mesh: &TetMesh, surface: &Surface, roles: Vec<Role>) -> Result<Self, SetupError> {
        let mut owner = vec![Owner::Volume; mesh.vertices.len()];
        let mut touching = Vec::new();
        let mut shapes = Vec::with_capacity(roles.len());
        for (index, role) in roles.iter().enumerate() {
            let family = FamilyId(index as u16);
            let vertices = surface.vertices_of(family);
            for &vertex in vertices {
                owner[vertex as usize] = owner[vertex as usize].min(role.owner());
            }
            shapes.push(match role {
                Role::Plane => Some(fit_plane(mesh, surface, family, vertices)?),
                Role::Carenage => Some(continued(mesh, surface, &roles, family)?),
                _ => None,
            });
            if shapes[index].is_some() {
                touching.extend(vertices.iter().map(|&vertex| (vertex, index as u32)));
            }
        }
        let touches = crate::mesh::csr::Csr::from_pairs(mesh.vertices.len(), touching.iter().copied());
        Ok(Self { roles, shapes, owner, touches })
    }

    /// The families with a role that this stage places, in order.
    pub fn placed_by(&self, owner: Owner) -> impl Iterator<Item = FamilyId> + '_ {
        (0..self.roles.len())
            .filter(move |&index| self.roles[index].owner() == owner)
            .map(|index| FamilyId(index as u16))
    }

    /// The families that are moved by the design or follow what is; planes only slide along.
    pub fn moved(&self) -> impl Iterator<Item = FamilyId> + '_ {
        (0..self.roles.len())
            .filter(|&index| !matches!(self.roles[index], Role::Plane | Role::Fixed))
            .map(|index| FamilyId(index as u16))
    }

    /// The shapes a vertex must stay on: of the carenages and planes it touches.
    pub fn shapes_at(&self, vertex: u32) -> impl Iterator<Item = &Shape> + '_ {
        self.touches.row(vertex as usize).iter().filter_map(|&family| self.shapes[family as usize].as_ref())
    }

    /// What the plane families a vertex touches leave it to do.
    pub fn plane_constraint(&self, vertex: u32) -> Constraint {
        let normals: Vec<DVec3> = self
            .shapes_at(vertex)
            .filter_map(|shape| match shape {
                Shape::Plane(_, normal) => Some(*normal),
                Shape::Surface(_) => None,
            })
            .collect();
        let Some((&first, rest)) = normals.split_first() else { return Constraint::Free };
        // Planes that meet at less than a tenth of a degree are one plane for this.
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

    /// The place nearest to `at` on all shapes a vertex must stay on.
    pub fn settle(&self, vertex: u32, at: DVec3) -> DVec3 {
        self.settle_along(vertex, at, None)
    }

    /// The place on all shapes a vertex must stay on, reached along a direction where one shape allows it.
    pub fn settle_along(&self, vertex: u32, at: DVec3, direction: Option<DVec3>) -> DVec3 {
        let shapes: Vec<&Shape> = self.shapes_at(vertex).collect();
        match (&shapes[..], direction) {
            ([], _) => at,
            ([shape], Some(direction)) => shape.along(at, direction),
            ([shape], None) => shape.closest(at),
            // Alternating projections converge to the curve where the shapes meet.
            (several, _) => {
                let mut at = at;
                for _ in 0..100 {
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

fn fit_plane(mesh: &TetMesh, surface: &Surface, family: FamilyId, vertices: &[u32]) -> Result<Shape, SetupError> {
    let at = |vertex: u32| mesh.vertices[vertex as usize];
    let centre = vertices.iter().map(|&vertex| at(vertex)).sum::<DVec3>() / vertices.len().max(1) as f64;
    let area: DVec3 = surface
        .corners_of(family)
        .map(|corners| {
            let [a, b, c] = corners.map(at);
            (b - a).cross(c - a)
        })
        .sum();
    let mut normal = area.normalize_or(DVec3::Y);
    // Rounding must not tilt a coordinate plane: then "in the plane" can hold to the last bit.
    if let Some(axis) = DVec3::AXES.into_iter().find(|axis| axis.dot(normal).abs() > 1.0 - 1e-12) {
        normal = axis;
    }
    let size = vertices.iter().map(|&vertex| at(vertex).distance(centre)).fold(0.0, f64::max);
    let distance = vertices.iter().map(|&vertex| normal.dot(at(vertex) - centre).abs()).fold(0.0, f64::max);
    let allowed = 1e-6 * size;
    if distance > allowed {
        return Err(SetupError::NotPlane { family: mesh.families[family.index()].clone(), distance, allowed });
    }
    Ok(Shape::Plane(centre, normal))
}

/// A carenage's triangles and a patch over every hole that wings leave in it.
fn continued(mesh: &TetMesh, surface: &Surface, roles: &[Role], family: FamilyId) -> Result<Shape, SetupError> {
    let mut triangles: Vec<[u32; 3]> = surface.corners_of(family).collect();
    let own = triangles.clone();
    let mut points = mesh.vertices.clone();
    for rim in surface.boundary_loops(family) {
        let under_a_wing = rim.iter().all(|&half_edge| {
            matches!(
                roles[surface.family_behind(half_edge).index()].owner(),
                Owner::Wing | Owner::TrailingEdge | Owner::Wingtip | Owner::Prescribed
            )
        });
        if under_a_wing {
            let rim: Vec<u32> = rim.iter().map(|&half_edge| surface.origin(half_edge)).collect();
            let patch = continuation::close(&mesh.vertices, &own, &rim)
                .map_err(|error| SetupError::Continuation { family: mesh.families[family.index()].clone(), error })?;
            let (old, new) = (mesh.vertices.len() as u32, points.len() as u32);
            points.extend(patch.points);
            triangles.extend(patch.triangles.into_iter().map(|t| t.map(|v| if v < old { v } else { v - old + new })));
        }
    }
    Ok(Shape::Surface(Target::new(&points, triangles)))
}
