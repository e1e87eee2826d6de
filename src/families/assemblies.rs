//! [`Assembly`]: families that hang together from a wing, and the motion of their root.
//!
//! Families with the roles wingtip, attached and rigid that share vertices are one assembly, such
//! as a pylon with its nacelle, or a winglet with its end. The *root* of an assembly are its
//! vertices that earlier stages place: those that it shares with wings, trailing edges, prescribed
//! and fixed families. For each design the best rigid motion of the root carries the assembly. The
//! paper names such parts as future work.
//!
//! # On a fuselage
//!
//! An assembly on which no wing bears, but a carenage, such as an engine at the rear of a fuselage,
//! rests there: a carenage keeps its shape, and only slides in it, so nothing carries the assembly
//! away. The vertices that it shares with carenages are its root, and stay ([`resting`]).
//!
//! # Several pieces
//!
//! A family may be several pieces that share no vertex, such as the nacelles of both sides. Each
//! piece with a root is an assembly of its own. A piece without a root, such as a spinner, goes
//! with the nearest piece that has one.
//!
//! # Planes
//!
//! An assembly that touches a plane, such as a keel on the symmetry plane, must not leave it. The
//! root's mirror image behind the plane counts in the fit like the root itself. The best motion of
//! a set and its mirror image is symmetric, so it keeps the plane. Families that lie in one plane
//! are one mirror, and so are parallel planes. Planes that meet at an angle other than a right one
//! are replaced by mirrors at right angles through the same line or point, as a set has images
//! behind all of them only then. So there are three mirrors at most.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DQuat, DVec3};

use super::{Families, PlacedBy, RigidMotion, Role, SetupError, TipStart, shape::FamilyShape};
use crate::geometry::fitted_motion::FittedMotion;
use crate::geometry::motion_change::{FittedChange, MotionChange};
use crate::mesh::{
    FamilyId, TetMesh,
    half_edge::{Surface, next},
};

/// The root must extend off its longest line by more than this fraction of the line's length, or
/// its rotation is unknown.
const THIN: f64 = 1e-3;

/// A motion that a user gives may leave a plane by this fraction of the family's distance from the
/// axis, or of the shift.
const OFF_PLANE: f64 = 1e-9;

/// Families that hang together. Made once per mesh.
#[derive(Clone, Debug)]
pub struct Assembly {
    /// The families, ascending. A family may belong to several assemblies.
    pub families: Vec<FamilyId>,
    /// All vertices, ascending.
    pub vertices: Vec<u32>,
    /// The vertices that earlier stages place, ascending. The weight of each in the best motion is
    /// half the length of the assembly's boundary edges at the vertex, so that a finer part of the
    /// boundary does not count more.
    pub root: Vec<(u32, f64)>,
    /// A point and the unit normal of each plane family that the assembly touches.
    planes: Vec<(DVec3, DVec3)>,
    /// A point and the unit normal of each mirror, all at right angles.
    mirrors: Vec<(DVec3, DVec3)>,
}

impl Assembly {
    /// The assemblies of a mesh, in the order of their last families.
    ///
    /// # Errors
    /// See [`Assembly::check`].
    pub(super) fn all(mesh: &TetMesh, surface: &Surface, families: &Families) -> Result<Vec<Self>, SetupError> {
        let mut assemblies = Vec::new();
        for members in joined(surface, &families.roles) {
            let is_root = |vertex: u32| families.placed_by[vertex as usize] < PlacedBy::Rigid;
            let at = |vertex: u32| mesh.vertices[vertex as usize];
            for vertices in with_roots(pieces(surface, &members), is_root, at) {
                let is_there = |vertex: &u32| vertices.binary_search(vertex).is_ok();
                let own = |family: &FamilyId| surface.vertices_of(*family).iter().any(is_there);
                let own: Vec<FamilyId> = members.iter().copied().filter(own).collect();
                let assembly = Self::new(mesh, surface, families, own, vertices);
                assembly.check(mesh, surface, &families.roles)?;
                assemblies.push(assembly);
            }
        }
        Ok(assemblies)
    }

    fn new(mesh: &TetMesh, surface: &Surface, families: &Families, members: Vec<FamilyId>, vertices: Vec<u32>) -> Self {
        let is_root = |vertex: &&u32| families.placed_by[**vertex as usize] < PlacedBy::Rigid;
        let lengths = boundary_lengths(mesh, surface, &members);
        let root: Vec<u32> = vertices.iter().filter(is_root).copied().collect();
        // If an assembly touches the wing only in single vertices, no boundary edge gives these
        // vertices a weight.
        let even = root.iter().all(|vertex| !lengths.contains_key(vertex));
        let weight = |vertex: u32| if even { 1.0 } else { lengths.get(&vertex).copied().unwrap_or(0.0) };
        let touched = families.shapes.iter().enumerate().filter_map(|(index, shape)| match shape {
            Some(FamilyShape::Plane(point, normal)) => {
                let own = surface.vertices_of(FamilyId(index as u16));
                own.iter().any(|vertex| vertices.binary_search(vertex).is_ok()).then_some((*point, *normal))
            }
            _ => None,
        });
        let planes: Vec<(DVec3, DVec3)> = touched.collect();
        Self {
            mirrors: mirrors(&planes),
            planes,
            root: root.iter().map(|&vertex| (vertex, weight(vertex))).collect(),
            families: members,
            vertices,
        }
    }

    /// Whether a vertex belongs to the assembly.
    pub fn has(&self, vertex: u32) -> bool {
        self.vertices.binary_search(&vertex).is_ok()
    }

    /// The assembly's vertices of a family, ascending.
    pub fn vertices_of<'a>(&'a self, surface: &'a Surface, family: FamilyId) -> impl Iterator<Item = u32> + 'a {
        surface.vertices_of(family).iter().copied().filter(|&vertex| self.has(vertex))
    }

    /// Refuses an assembly whose motion is not known.
    ///
    /// # Errors
    /// - [`SetupError::NoRoot`]: attached families, or rigid ones that follow their root, have none
    /// - [`SetupError::ThinRoot`]: the root lies on a line, so its rotation is unknown
    /// - [`SetupError::LeavesPlane`]: a given motion leaves a plane that the family touches
    fn check(&self, mesh: &TetMesh, surface: &Surface, roles: &[Role]) -> Result<(), SetupError> {
        let role = |family: FamilyId| &roles[family.index()];
        let name = |family: FamilyId| mesh.families[family.index()].clone();
        // A wingtip without a root stays, and a warning says so.
        let follows = |&&family: &&FamilyId| {
            let own = matches!(role(family), Role::Rigid { motion: RigidMotion::None | RigidMotion::Given { .. }, .. });
            !own && !matches!(role(family), Role::Wingtip { .. })
        };
        if self.root.is_empty()
            && let Some(&family) = self.families.iter().find(follows)
        {
            return Err(SetupError::NoRoot { family: name(family), role: role(family).name() });
        }
        let turns = |&&family: &&FamilyId| {
            matches!(
                role(family),
                Role::Rigid { motion: RigidMotion::Root, .. } | Role::Attached { start: TipStart::Rigid, .. }
            )
        };
        if let Some(&family) = self.families.iter().find(turns)
            && self.is_thin(mesh)
        {
            return Err(SetupError::ThinRoot { family: name(family), vertices: self.root.len() });
        }
        for &family in &self.families {
            let Role::Rigid { motion: motion @ RigidMotion::Given { .. }, .. } = role(family) else { continue };
            let given = given(motion);
            for &(point, normal) in &self.planes {
                let off = |vertex: u32| {
                    let at = mesh.vertices[vertex as usize];
                    let moved = given.displacement(at);
                    normal.dot(moved).abs() > OFF_PLANE * (at.distance(point) + moved.length())
                };
                if self.vertices_of(surface, family).any(off) {
                    return Err(SetupError::LeavesPlane { family: name(family), normal });
                }
            }
        }
        Ok(())
    }

    /// Whether the root and its mirror images lie on a line.
    fn is_thin(&self, mesh: &TetMesh) -> bool {
        let points: Vec<DVec3> = self.pairs(mesh, &|_| DVec3::ZERO).into_iter().map(|pair| pair.0).collect();
        let farthest = |distance: &dyn Fn(DVec3) -> f64| points.iter().map(|&at| distance(at)).fold(0.0, f64::max);
        let first = points[0];
        let length = farthest(&|at| at.distance(first));
        let last = points.iter().find(|at| at.distance(first) == length).copied().unwrap_or(first);
        let along = (last - first).normalize_or_zero();
        farthest(&|at| (at - first).reject_from_normalized(along).length()) <= THIN * length
    }

    /// The root's vertices before and after their displacement, with their weights, and the same
    /// behind each mirror.
    fn pairs(&self, mesh: &TetMesh, displacement: &dyn Fn(u32) -> DVec3) -> Vec<(DVec3, DVec3, f64)> {
        let pair = |&(vertex, weight): &(u32, f64)| {
            let from = mesh.vertices[vertex as usize];
            (from, from + displacement(vertex), weight)
        };
        let mut pairs: Vec<(DVec3, DVec3, f64)> = self.root.iter().map(pair).collect();
        for &(point, normal) in &self.mirrors {
            let mirrored = |at: DVec3| at - 2.0 * normal.dot(at - point) * normal;
            let images: Vec<_> =
                pairs.iter().map(|&(from, to, weight)| (mirrored(from), mirrored(to), weight)).collect();
            pairs.extend(images);
        }
        pairs
    }

    /// Whether a vertex of the root moves.
    ///
    /// - `displacement` `[n_vertices]`
    pub fn root_moves(&self, displacement: &[DVec3]) -> bool {
        self.root.iter().any(|&(vertex, _)| displacement[vertex as usize] != DVec3::ZERO)
    }

    /// The best motion of the root. The identity, to the last bit, if the root does not move.
    ///
    /// - `displacement` `[n_vertices]`: in the mesh's unit
    pub fn carried(&self, mesh: &TetMesh, displacement: &[DVec3], start: TipStart) -> FittedMotion {
        if start == TipStart::Original || !self.root_moves(displacement) {
            return FittedMotion::identity();
        }
        let pairs = self.pairs(mesh, &|vertex| displacement[vertex as usize]);
        if start == TipStart::Rigid { FittedMotion::rigid(&pairs) } else { FittedMotion::affine(&pairs) }
    }

    /// The motion of a rigid family of the assembly.
    ///
    /// - `displacement` `[n_vertices]`: in the mesh's unit
    pub fn rigid_motion(&self, mesh: &TetMesh, displacement: &[DVec3], motion: &RigidMotion) -> FittedMotion {
        match motion {
            RigidMotion::Root => self.carried(mesh, displacement, TipStart::Rigid),
            RigidMotion::Translation if self.root_moves(displacement) => {
                FittedMotion::translation(&self.pairs(mesh, &|vertex| displacement[vertex as usize]))
            }
            RigidMotion::Translation | RigidMotion::None => FittedMotion::identity(),
            RigidMotion::Given { .. } => given(motion),
        }
    }

    /// The derivative of [`Self::carried`]. It exists where the root does not move, too.
    ///
    /// - `displacement` `[n_vertices]`: in the mesh's unit
    ///
    /// # Errors
    /// Several motions fit equally well. The vertex is the first one of the root.
    pub fn carried_change(
        &self,
        mesh: &TetMesh,
        displacement: &[DVec3],
        start: TipStart,
    ) -> Result<RootChange<'_>, u32> {
        let fit: Fit = match start {
            TipStart::Original => return Ok(RootChange { assembly: self, fitted: None }),
            TipStart::Rigid => FittedChange::rigid,
            TipStart::Affine => FittedChange::affine,
        };
        self.change(mesh, displacement, fit)
    }

    /// The derivative of [`Self::rigid_motion`]. It exists where the root does not move, too.
    ///
    /// - `displacement` `[n_vertices]`: in the mesh's unit
    ///
    /// # Errors
    /// As for [`Self::carried_change`].
    pub fn rigid_change(
        &self,
        mesh: &TetMesh,
        displacement: &[DVec3],
        motion: &RigidMotion,
    ) -> Result<RootChange<'_>, u32> {
        match motion {
            RigidMotion::Root => self.carried_change(mesh, displacement, TipStart::Rigid),
            RigidMotion::Translation => self.change(mesh, displacement, |pairs| Some(FittedChange::translation(pairs))),
            RigidMotion::None | RigidMotion::Given { .. } => Ok(RootChange { assembly: self, fitted: None }),
        }
    }

    fn change(&self, mesh: &TetMesh, displacement: &[DVec3], fit: Fit) -> Result<RootChange<'_>, u32> {
        let Some(&(first, _)) = self.root.first() else { return Ok(RootChange { assembly: self, fitted: None }) };
        let pairs = self.pairs(mesh, &|vertex| displacement[vertex as usize]);
        Ok(RootChange { assembly: self, fitted: Some(fit(&pairs).ok_or(first)?) })
    }
}

/// The derivative of a motion that is fitted to pairs of points, with their weights.
type Fit = fn(&[(DVec3, DVec3, f64)]) -> Option<FittedChange>;

/// The derivative of the motion of an assembly, or of a rigid family, by the displacement of the
/// root.
#[derive(Clone, Debug)]
pub struct RootChange<'a> {
    assembly: &'a Assembly,
    /// `None` if the motion does not depend on the root.
    fitted: Option<FittedChange>,
}

impl RootChange<'_> {
    /// A change of nothing, to which derivatives by the motion are added for [`Self::reverse`].
    /// `None` if the motion does not depend on the root.
    pub fn none(&self) -> Option<MotionChange> {
        self.fitted.as_ref().map(FittedChange::none)
    }

    /// Change of the motion. `None` if it does not depend on the root.
    ///
    /// - `change` `[n_vertices]`: of the displacement
    pub fn forward(&self, change: &[DVec3]) -> Option<MotionChange> {
        let fitted = self.fitted.as_ref()?;
        let mut changes: Vec<DVec3> = self.assembly.root.iter().map(|&(vertex, _)| change[vertex as usize]).collect();
        for &(_, normal) in &self.assembly.mirrors {
            let images: Vec<DVec3> = changes.iter().map(|change| mirrored(*change, normal)).collect();
            changes.extend(images);
        }
        Some(fitted.forward(&changes))
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `by_motion`: the derivative of a number by the motion
    /// - `gradient` `[n_vertices]`: the derivative of the number by the displacement, to which the
    ///   motion's part is added
    pub fn reverse(&self, by_motion: Option<MotionChange>, gradient: &mut [DVec3]) {
        let (Some(fitted), Some(by_motion)) = (&self.fitted, by_motion) else { return };
        let mut by_points = fitted.reverse(&by_motion);
        for &(_, normal) in self.assembly.mirrors.iter().rev() {
            let images = by_points.split_off(by_points.len() / 2);
            by_points.iter_mut().zip(images).for_each(|(by_point, image)| *by_point += mirrored(image, normal));
        }
        for (&(vertex, _), by_point) in self.assembly.root.iter().zip(by_points) {
            gradient[vertex as usize] += by_point;
        }
    }
}

/// The mirror image of a vector.
fn mirrored(vector: DVec3, normal: DVec3) -> DVec3 {
    vector - 2.0 * normal.dot(vector) * normal
}

/// The motion that a user gives; the identity for every other.
fn given(motion: &RigidMotion) -> FittedMotion {
    match *motion {
        RigidMotion::Given { turn, about, shift } => {
            let angle = turn.map(f64::to_radians);
            FittedMotion::turn(DQuat::from_scaled_axis(angle), about, shift)
        }
        _ => FittedMotion::identity(),
    }
}

/// Two given motions are one if they move no corner of the mesh's box apart by more than this
/// fraction of the box's size.
const SAME: f64 = 1e-12;

/// Writes motions that are the same alike: a point of the axis may be any, and a motion that moves
/// nothing may be given or not. So families that move as one body are known by equal motions.
pub(super) fn write_alike(mesh: &TetMesh, roles: &mut [Role]) {
    let low = mesh.vertices.iter().copied().reduce(DVec3::min).unwrap_or_default();
    let high = mesh.vertices.iter().copied().reduce(DVec3::max).unwrap_or_default();
    // Affine motions that agree at these four points agree everywhere.
    let corners = [low, low.with_x(high.x), low.with_y(high.y), low.with_z(high.z)];
    let moved = |motion: &RigidMotion| corners.map(|corner| given(motion).displacement(corner));
    let mut known: Vec<(RigidMotion, [DVec3; 4])> = Vec::new();
    for role in roles {
        let Role::Rigid { motion: motion @ (RigidMotion::None | RigidMotion::Given { .. }), .. } = role else {
            continue;
        };
        let own = moved(motion);
        let apart = |other: &[DVec3; 4]| own.iter().zip(other).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        match known.iter().find(|(_, other)| apart(other) <= SAME * low.distance(high)) {
            Some(&(same, _)) => *motion = same,
            None => known.push((*motion, own)),
        }
    }
}

/// Mirrors at right angles, three at most, whose common points are those of the planes.
///
/// Planes that meet at less than a tenth of a degree count as one plane, as they do for the
/// constraint of a vertex.
///
/// - `planes`: a point and the unit normal of each
fn mirrors(planes: &[(DVec3, DVec3)]) -> Vec<(DVec3, DVec3)> {
    let mut mirrors: Vec<(DVec3, DVec3)> = Vec::new();
    for &(point, normal) in planes {
        let across = mirrors.iter().fold(normal, |rest, (_, of)| rest - of.dot(rest) * *of);
        let length = across.length();
        if length < 2e-3 || mirrors.len() == 3 {
            continue;
        }
        // The new mirror meets the earlier ones where the plane meets them.
        let lift = |(at, of): &(DVec3, DVec3)| normal.dot(*of) * of.dot(point - *at);
        let lifted: f64 = mirrors.iter().map(lift).sum();
        let of = across / length;
        mirrors.push((point + of * (lifted / length), of));
    }
    mirrors
}

/// The families of assemblies in sets of families that touch, each set ascending.
fn joined(surface: &Surface, roles: &[Role]) -> Vec<Vec<FamilyId>> {
    let mut sets: Vec<(Vec<FamilyId>, BTreeSet<u32>)> = Vec::new();
    for (index, role) in roles.iter().enumerate() {
        if !matches!(role.placed_by(), PlacedBy::Rigid | PlacedBy::Attached) {
            continue;
        }
        let family = FamilyId(index as u16);
        let mut set = (vec![family], surface.vertices_of(family).iter().copied().collect::<BTreeSet<u32>>());
        sets.retain_mut(|(others, vertices)| {
            let apart = vertices.is_disjoint(&set.1);
            if !apart {
                set.0.append(others);
                set.1.append(vertices);
            }
            apart
        });
        set.0.sort_unstable();
        sets.push(set);
    }
    sets.into_iter().map(|(set, _)| set).collect()
}

/// The vertices at which assemblies rest on carenages, with no root of another kind. Wingtips alone
/// stay without a root.
///
/// - `placed_by` `[n_vertices]`: by the roles alone
pub(super) fn resting(surface: &Surface, roles: &[Role], placed_by: &[PlacedBy]) -> Vec<u32> {
    let of_carenages = (0..roles.len()).filter(|&index| roles[index] == Role::Carenage);
    let of_carenages = of_carenages.flat_map(|index| surface.vertices_of(FamilyId(index as u16)));
    let of_carenages: BTreeSet<u32> = of_carenages.copied().collect();
    let rests = |members: Vec<FamilyId>| {
        let is_tip = |family: &FamilyId| matches!(roles[family.index()], Role::Wingtip { .. });
        let vertices: BTreeSet<u32> = members.iter().flat_map(|&family| surface.vertices_of(family)).copied().collect();
        let hangs = vertices.iter().any(|&vertex| placed_by[vertex as usize] < PlacedBy::Rigid);
        let on: Vec<u32> = vertices.intersection(&of_carenages).copied().collect();
        if hangs || members.iter().all(is_tip) { Vec::new() } else { on }
    };
    joined(surface, roles).into_iter().flat_map(rests).collect()
}

/// The pieces of some families that share no vertex: the vertices of each, ascending.
fn pieces(surface: &Surface, members: &[FamilyId]) -> Vec<Vec<u32>> {
    let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for corners in members.iter().flat_map(|&family| surface.corners_of(family)) {
        for k in 0..3 {
            around.entry(corners[k]).or_default().push(corners[(k + 1) % 3]);
        }
    }
    let mut pieces = Vec::new();
    while let Some((&start, _)) = around.first_key_value() {
        let (mut piece, mut open) = (Vec::new(), vec![start]);
        while let Some(vertex) = open.pop() {
            if let Some(next) = around.remove(&vertex) {
                piece.push(vertex);
                open.extend(next);
            }
        }
        piece.sort_unstable();
        pieces.push(piece);
    }
    pieces
}

/// Joins each piece without a root with the nearest piece that has one. All pieces are one if none
/// has a root.
///
/// - `at`: the position of a vertex
fn with_roots(pieces: Vec<Vec<u32>>, is_root: impl Fn(u32) -> bool, at: impl Fn(u32) -> DVec3) -> Vec<Vec<u32>> {
    let has_root = |piece: &Vec<u32>| piece.iter().any(|&vertex| is_root(vertex));
    let (mut rooted, loose): (Vec<_>, Vec<_>) = pieces.into_iter().partition(has_root);
    let nearest = |piece: &Vec<u32>| {
        let centre = piece.iter().map(|&vertex| at(vertex)).sum::<DVec3>() / piece.len() as f64;
        let distances = rooted
            .iter()
            .map(|other| other.iter().map(|&vertex| at(vertex).distance_squared(centre)).fold(f64::INFINITY, f64::min));
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(index, _)| index)
    };
    let to: Vec<usize> = loose.iter().map(nearest).collect();
    if rooted.is_empty() && !loose.is_empty() {
        rooted.push(Vec::new());
    }
    for (piece, to) in loose.into_iter().zip(to) {
        rooted[to].extend(piece);
        rooted[to].sort_unstable();
    }
    rooted
}

/// For each vertex of the boundary of an assembly, half the length of the boundary edges at the
/// vertex, in the mesh's unit.
fn boundary_lengths(mesh: &TetMesh, surface: &Surface, members: &[FamilyId]) -> BTreeMap<u32, f64> {
    let mut lengths = BTreeMap::new();
    let loops = members.iter().flat_map(|&family| surface.boundary_loops(family)).flatten();
    for half_edge in loops.filter(|&half_edge| !members.contains(&surface.family_behind(half_edge))) {
        let ends = [surface.origin(half_edge), surface.origin(next(half_edge))];
        let [a, b] = ends.map(|vertex| mesh.vertices[vertex as usize]);
        ends.iter().for_each(|&end| *lengths.entry(end).or_default() += 0.5 * a.distance(b));
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A piece without a root goes with the nearest that has one. Without any root all are one.
    #[test]
    fn pieces_without_a_root_join_the_nearest() {
        let at = |vertex: u32| DVec3::X * [0.0, 1.0, 8.0, 9.0, 6.5, 7.0, 2.0][vertex as usize];
        let pieces = || vec![vec![0, 1], vec![2, 3], vec![4, 5], vec![6]];
        let is_root = |vertex: u32| vertex == 1 || vertex == 3;
        assert_eq!(with_roots(pieces(), is_root, at), [vec![0, 1, 6], vec![2, 3, 4, 5]]);
        assert_eq!(with_roots(pieces(), |_| false, at), [vec![0, 1, 2, 3, 4, 5, 6]]);
        assert_eq!(with_roots(pieces(), |_| true, at), pieces());
    }

    /// Fails if each plane is a mirror.
    #[test]
    fn planes_make_three_mirrors_at_most() {
        let same: Vec<_> = (0..40).map(|i| (DVec3::new(f64::from(i), 0.0, 1.0), DVec3::Y)).collect();
        assert_eq!(mirrors(&same), [same[0]]);
        let round = (0..40).map(|i| {
            let normal = DQuat::from_rotation_x(0.05 * f64::from(i)) * DVec3::Y;
            (normal.cross(DVec3::X) * f64::from(i), normal)
        });
        assert_eq!(mirrors(&round.collect::<Vec<_>>()).len(), 2);
        let axes = DVec3::AXES.map(|axis| (axis * 3.0, axis));
        assert_eq!(mirrors(&[&axes[..], &axes[..], &[(DVec3::ZERO, DVec3::ONE.normalize())]].concat()), axes);
    }

    /// The line of two planes at 60 degrees, and the point of three, lie on their mirrors.
    #[test]
    fn mirrors_meet_where_their_planes_do() {
        let corner = DVec3::new(3.0, -2.0, 0.5);
        let normals = [DVec3::Y, DVec3::new(0.0, 0.5, 0.75f64.sqrt()), DVec3::new(0.6, 0.64, 0.48)];
        // Other points of the same planes.
        let aside = [DVec3::X, DVec3::Y, DVec3::Z].map(|off| off * 7.0);
        let planes: Vec<_> =
            normals.into_iter().zip(aside).map(|(of, off)| (corner + off.reject_from_normalized(of), of)).collect();
        let found = mirrors(&planes);
        assert_eq!(found.len(), 3);
        for (index, (point, of)) in found.iter().enumerate() {
            assert!(of.dot(corner - *point).abs() < 1e-12 && (of.length() - 1.0).abs() < 1e-12, "{point} {of}");
            for (_, other) in &found[..index] {
                assert!(of.dot(*other).abs() < 1e-12, "{of} {other}");
            }
        }
    }
}
