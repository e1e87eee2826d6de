//! [`ProductError`] and [`NotDifferentiable`]: why a product of an outcome cannot be had.

use glam::DVec3;
use thiserror::Error;

use crate::{
    backend::BackendError,
    text::figures::place,
    text::nearest::{did_you_mean, quoted},
};

/// Why an outcome has no derivative.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum NotDifferentiable {
    /// A family moves with a stage that has no products yet, for example with profiles.
    #[error(
        "family `{family}` has the role {role}, and products through the stage of this role are not there yet, \
         expected another role, such as prescribed"
    )]
    Role {
        /// The family.
        family: String,
        /// Its role.
        role: &'static str,
    },
    /// The volume was moved in steps. The stiffness of a step depends on the mesh before it, and
    /// the length of a step on trials.
    #[error(
        "the mesh was moved in {steps} steps, and only one jump has a derivative; allow one step only, or take the \
         frozen derivative, which is that of the jump"
    )]
    Steps {
        /// The steps.
        steps: usize,
    },
    /// Local optimisation moved vertices. It ends when it no longer helps, not at a stationary
    /// point.
    #[error(
        "local optimisation moved {vertices} vertices, and it has no derivative; turn it off, or take the frozen \
         derivative, which holds what it added constant"
    )]
    Optimised {
        /// Number of these vertices.
        vertices: usize,
    },
    /// A relaxation of the update did not converge, so there is no equilibrium to differentiate.
    #[error("a relaxation of the update did not converge, and only an equilibrium has a derivative; allow more sweeps")]
    Unconverged,
    /// Junctions slide on a rigid family, and products through their stage are not there yet.
    #[error(
        "junctions slide on the rigid family `{family}`, and products through their stage are not there yet, \
         expected junction = \"glued\" there"
    )]
    Junction {
        /// The rigid family.
        family: String,
    },
    /// A vertex of a carenage slid to an end of the carenage, where it is held back, or to an edge
    /// too sharp to slide over.
    #[error(
        "vertex {vertex}, originally at {}, slid to an end or to a sharp edge of its carenage, so how it slides on is \
         not known",
        place(*position)
    )]
    Carenage {
        /// The vertex, counted from 0.
        vertex: u32,
        /// Original position of the vertex.
        position: DVec3,
    },
    /// Several rotations fit the motion of the surface around a vertex equally well.
    #[error(
        "the surface around vertex {vertex}, originally at {}, moved so that several rotations fit equally well: it is \
         pressed to a line or turned over",
        place(*position)
    )]
    Rotation {
        /// The vertex, counted from 0.
        vertex: u32,
        /// Original position of the vertex.
        position: DVec3,
    },
    /// A stage places a vertex where its place does not change smoothly.
    #[error("the vertex {vertex}, originally at {}, {why}", place(*position))]
    Vertex {
        /// The vertex, counted from 0.
        vertex: u32,
        /// Original position of the vertex.
        position: DVec3,
        /// The cause.
        why: &'static str,
    },
    /// The match by measure of a new profile has another derivative beside the design. There is the
    /// frozen derivative, which goes by the affine image of the old profile.
    #[error(
        "profile {profile} of wing `{wing}` {why}; match it by points, or take the frozen derivative, which goes by the \
         affine image"
    )]
    Kink {
        /// The wing.
        wing: String,
        /// The number of the profile.
        profile: i64,
        /// The cause.
        why: &'static str,
    },
    /// The match of a new profile with its old one has no derivative.
    #[error("profile {profile} of wing `{wing}` {why}; the old profile's own points, moved, always have a derivative")]
    Match {
        /// The wing.
        wing: String,
        /// The number of the profile.
        profile: i64,
        /// The cause.
        why: &'static str,
    },
}

/// An error of a product.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ProductError {
    /// The outcome has no derivative.
    #[error("no derivative: {0}")]
    NotDifferentiable(#[from] NotDifferentiable),
    /// The outcome was made by another mover.
    #[error("the outcome was made by another mover, expected an outcome of the mover that is asked for its product")]
    OtherMover,
    /// The direction has displacements for a name that is no prescribed family.
    #[error(
        "the direction has displacements for `{name}`, which is none of the mover's prescribed families{}; it has {}",
        did_you_mean(name, known).unwrap_or_default(),
        if known.is_empty() { "none".to_owned() } else { quoted(known) }
    )]
    Unknown {
        /// The name.
        name: String,
        /// The mover's prescribed families.
        known: Vec<String>,
    },
    /// The direction has profiles for a name that is no wing of the outcome's design.
    #[error(
        "the direction has profiles for `{name}`, which is none of the wings{}; the design has profiles for {}",
        did_you_mean(name, known).unwrap_or_default(),
        if known.is_empty() { "none".to_owned() } else { quoted(known) }
    )]
    UnknownWing {
        /// The name.
        name: String,
        /// The wings of the outcome's design.
        known: Vec<String>,
    },
    /// The direction has a profile with a number that the outcome's design does not have, or a
    /// number twice.
    #[error(
        "the direction has profile {profile} of `{wing}`, expected each of the design's numbers at most once: {known:?}"
    )]
    Profile {
        /// The wing.
        wing: String,
        /// The number of the profile.
        profile: i64,
        /// The numbers of the wing's new profiles.
        known: Vec<i64>,
    },
    /// The direction has a wrong number of points for a profile.
    #[error(
        "profile {profile} of `{wing}` has {expected} points in the outcome's design, but the direction has {found} \
         changes for it, expected one for each point"
    )]
    Points {
        /// The wing.
        wing: String,
        /// The number of the profile.
        profile: i64,
        /// Points of the new profile.
        expected: usize,
        /// Changes given.
        found: usize,
    },
    /// The direction has a wrong number of displacements for a family.
    #[error("family `{family}` has {expected} vertices, but the direction has {found} displacements for it")]
    Direction {
        /// The family.
        family: String,
        /// Vertices of the family.
        expected: usize,
        /// Displacements given.
        found: usize,
    },
    /// The seed has a wrong number of vectors.
    #[error("the mesh has {expected} vertices, but the seed has {found} vectors, expected one for each vertex")]
    Seed {
        /// Vertices of the mesh.
        expected: usize,
        /// Vectors given.
        found: usize,
    },
    /// A vector of the direction or the seed is not finite.
    #[error("{of}: vector {row} is {value}, expected finite numbers")]
    NotFinite {
        /// The seed, or the family or profile of the direction.
        of: String,
        /// The vector, counted from 0.
        row: usize,
        /// Its value.
        value: DVec3,
    },
    /// A relaxation of the product did not reach its tolerance.
    #[error("the product did not converge: after {sweeps} sweeps its error is {error:e}; allow more sweeps")]
    NotConverged {
        /// Sweeps of all relaxations of the product.
        sweeps: usize,
        /// Estimated error, relative to the argument's largest load.
        error: f64,
    },
    /// The backend failed.
    #[error(transparent)]
    Backend(#[from] BackendError),
}
