//! What moves, and how: a body of which every vertex is prescribed, or a wing that follows
//! profiles.

use idmesh::{
    mesh::HybridMesh,
    mover::{Design, Mover, MoverBuilder},
    springs::Springs,
};

/// One kind of motion, from small to absurd.
pub struct Kind {
    /// What it is called.
    pub name: &'static str,
    /// What its amounts are in.
    pub unit: &'static str,
    /// How far it goes, ascending.
    pub amounts: &'static [f64],
}

/// A body in its mesh.
pub trait Body {
    /// What the table begins with: the body and what is special about it.
    fn title(&self) -> String;

    /// The mesh around it.
    fn mesh(&self) -> HybridMesh<'_>;

    /// The springs it is moved by.
    fn springs(&self) -> &'static Springs;

    /// What it is made to do.
    fn kinds(&self) -> &'static [Kind];

    /// What a mover is made by.
    fn builder(&self) -> MoverBuilder;

    /// The design that makes so much of the motion number `kind`.
    fn design(&self, mover: &Mover, kind: usize, amount: f64) -> Design;
}
