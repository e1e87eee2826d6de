//! Sliding junctions: where a part meets a wing or a rigid body, its curve slides on their surface,
//! and the part keeps its shape.
//!
//! A junction that is glued is stretched as the wing is, and the part with it. A junction that
//! slides ([`Junction::Slide`](crate::families::Junction::Slide)) is the curve in which the part,
//! carried as one body, meets the moved surface:
//!
//! 1. The part is continued beyond the curve by its [rulings](super::rulings), and carried by the
//!    motion of its assembly. Each vertex of the curve goes along its own ruling until it meets the
//!    moved surface. So vertices keep their distances along the curve, and cannot bunch.
//! 2. A vertex that goes back into the part goes along the part's surface.
//! 3. The moved surface is continued across the hole under the part, and its triangles are curved
//!    ([`CurvedSurface`]).
//! 4. A spring network spreads the slide over a strip of the surface beside the curve. Its vertices
//!    go back onto the moved surface, so that its shape stays as it is. Vertices on leading edges
//!    stay.
//!
//! A pylon's rear edge meets its nacelle at ten to thirty degrees, so that its curve moves by two
//! to six times what the nacelle moves up or down, which is many edges. So the strip on a body is
//! wider, and follows in steps ([`SurfaceNetwork::follow`]).
//!
//! Nothing is done where the glued curve fits the carried part already. `surfaces` has what slides
//! on what, `products` the derivative of slides on wings. The paper names parts that hang from
//! wings as future work.

mod products;
mod surfaces;

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use glam::DVec3;
use rayon::prelude::*;

use self::surfaces::{On, Sliding, facing, lies_on, sliding};
use super::rulings;
use super::surface_network::SurfaceNetwork;
use crate::constraint::Constraint;
use crate::families::SetupError;
use crate::geometry::fitted_motion::FittedMotion;
use crate::mesh::{Displacement, FamilyId, TetMesh};
use crate::projection::curved::{Beside, CurvedSurface, Start};
use crate::relaxation::Convergence;
use crate::stage::{SetUp, StageError};
use crate::text::figures::near;
use crate::volume::route::OnBody;

/// The surface around a curve that is kept reaches so many times as far from the curve's centre as
/// the curve.
const REGION: f64 = 2.5;

/// A curve whose vertices fit the carried part to this fraction of its extent stays glued.
const FITS: f64 = 1e-12;

/// A ruling may rise so many times as far as the largest distance of the glued curve from the
/// carried part, which is as far as the moved surface is from the ruling's start. Beyond it the
/// surface goes away from the ruling.
const MOST: f64 = 4.0;

/// A vertex lies on its ruling if it is nearer than this fraction of the longest edge at its foot.
/// A foot at the end of the surface is farther off.
const ON_RULING: f64 = 0.05;

/// All sliding junctions of a mesh.
pub(super) struct Junctions {
    hosts: Vec<Host>,
    /// The undeformed surface of each part, with its vertices `[n_points]`, ascending.
    parts: Vec<(Vec<u32>, CurvedSurface)>,
    last: MadeByJunctions,
}

/// What the junctions keep of their last design.
#[derive(Default)]
pub struct MadeByJunctions {
    slides: BTreeMap<FamilyId, f64>,
    before: Vec<(u32, DVec3)>,
}

/// A surface on which junctions slide.
struct Host {
    on: On,
    curves: Vec<Curve>,
    /// The mesh's vertices of the surface around the curves `[n_points]`, ascending.
    vertices: Vec<u32>,
    /// As indices of `vertices`.
    triangles: Vec<[u32; 3]>,
    rims: Vec<Vec<u32>>,
    strip: Strip,
    /// For a path of steps: what slides on a body.
    on_body: Option<OnBody>,
}

/// What goes with the curves.
enum Strip {
    /// A network of the undeformed surface: wings change by less than a strip's width.
    Wings(SurfaceNetwork),
    /// The edges, and the vertices that may move: a body may move farther.
    Body(Vec<[u32; 2]>, HashSet<u32>),
}

/// A curve in which a part meets a surface.
struct Curve {
    /// The number of the assembly.
    assembly: usize,
    /// Index of the part.
    part: usize,
    /// A family of the part and one of the surface, for each vertex `[n]`.
    families: Vec<[FamilyId; 2]>,
    /// `[n]`
    vertices: Vec<u32>,
    /// The rulings before the motion `[n]`; each rises by one unit above the surface.
    directions: Vec<DVec3>,
    extent: f64,
}

impl Junctions {
    /// Finds the junctions that slide.
    ///
    /// - `shaped`: vertices of wings that stay, because the sections of wings are checked at them
    ///
    /// # Errors
    /// - [`SetupError::Junction`]: a junction cannot slide
    /// - [`SetupError::Backend`]: the backend failed
    pub fn new(set_up: &SetUp, shaped: &[u32]) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        let (mut found, mut parts) = (Vec::<(On, Vec<Curve>)>::new(), Vec::new());
        for (assembly, of) in families.assemblies.iter().enumerate() {
            let Some(Sliding { part, on }) = sliding(set_up, assembly)? else { continue };
            let is_own = |corners: &[u32; 3]| of.has(corners[0]);
            let own = part.iter().flat_map(|&family| surface.triangles_of(family));
            let own = own.filter(|&&triangle| is_own(&surface.triangles[triangle as usize]));
            let mut half_edges: Vec<Vec<u32>> = vec![Vec::new(); on.len()];
            for half_edge in own.flat_map(|&triangle| 3 * triangle..3 * triangle + 3) {
                if !part.contains(&surface.family_behind(half_edge))
                    && let Some(behind) = lies_on(set_up, assembly, on[0].1 == On::Wings, half_edge)?
                {
                    let of = on.iter().position(|(_, on)| *on == behind);
                    half_edges[of.expect("what slides is there")].push(half_edge);
                }
            }
            for ((family, on), half_edges) in on.into_iter().zip(half_edges) {
                if half_edges.is_empty() {
                    return Err(refused(set_up, family, on.is_met_by_none().to_owned()));
                }
                let loops = rulings::loops(surface, half_edges.iter().copied()).ok_or_else(|| {
                    let [family, _] = families_at(set_up, half_edges[0]);
                    let behind = behind(set_up, half_edges[0]);
                    let body = "; families of one body all slide, and have the same motion";
                    let hint = if on == On::Wings { "" } else { body };
                    refused(set_up, family, format!("its curve on `{behind}` is not closed{hint}"))
                })?;
                for half_edges in loops {
                    let curve = Curve::new(set_up, (assembly, parts.len()), &half_edges)?;
                    curve.check(set_up, &part, on)?;
                    match found.iter_mut().find(|(other, _)| *other == on) {
                        Some((_, curves)) => curves.push(curve),
                        None => found.push((on, vec![curve])),
                    }
                }
            }
            let triangles = part.iter().flat_map(|&family| surface.corners_of(family)).filter(is_own).collect();
            let (vertices, triangles) = numbered(triangles);
            let points = vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]).collect();
            let own = CurvedSurface::new(points, triangles, &[])
                .map_err(|error| refused(set_up, part[0], error.to_string()))?;
            parts.push((vertices, own));
        }
        let hosts = found.into_iter().map(|(on, curves)| Host::new(set_up, shaped, on, curves));
        Ok(Self { hosts: hosts.collect::<Result<_, SetupError>>()?, parts, last: MadeByJunctions::default() })
    }

    /// The largest distance by which a vertex slid from its glued place in the last run, in the
    /// mesh's unit, of each family whose junction slides: on a wing of the attached family, on a
    /// body of the rigid one.
    pub fn slides(&self) -> &BTreeMap<FamilyId, f64> {
        &self.last.slides
    }

    /// The vertices that the last run moved, with their displacements before it, in the mesh's
    /// unit.
    pub fn before(&self) -> &[(u32, DVec3)] {
        &self.last.before
    }

    /// Exchanges what the junctions keep of their last design with what they kept of another one.
    pub fn exchange(&mut self, made: &mut MadeByJunctions) {
        std::mem::swap(&mut self.last, made);
    }

    /// Triangles that continue the part of an assembly by its rulings beyond the curves that slide,
    /// before the motion, in the mesh's unit. They reach beyond each curve as far as the curve is
    /// off the part, and half as far again.
    ///
    /// - `back`: the place of a moved vertex before the motion of the assembly
    pub fn continuation(&self, assembly: usize, mesh: &TetMesh, back: impl Fn(u32) -> DVec3) -> Vec<[DVec3; 3]> {
        let at = |vertex: u32| mesh.vertices[vertex as usize];
        let mut triangles = Vec::new();
        for curve in self.hosts.iter().flat_map(|host| &host.curves).filter(|curve| curve.assembly == assembly) {
            let n = curve.vertices.len();
            let reach =
                1.5 * curve.vertices.iter().map(|&vertex| back(vertex).distance(at(vertex))).fold(0.0, f64::max);
            for (k, next) in (0..n).map(|k| (k, (k + 1) % n)).filter(|_| reach > 0.0) {
                let [near, near_next] = [k, next].map(|k| at(curve.vertices[k]));
                let [far, far_next] = [k, next].map(|k| at(curve.vertices[k]) + reach * curve.directions[k]);
                triangles.extend([[near_next, near, far], [near_next, far, far_next]]);
            }
        }
        triangles
    }

    /// The vertices that may slide on rigid bodies. Empty if they were taken.
    pub fn take_on_bodies(&mut self) -> Vec<OnBody> {
        self.hosts.iter_mut().filter_map(|host| host.on_body.take()).collect()
    }

    /// Slides the junctions.
    ///
    /// - `motions`: the motion of each assembly
    ///
    /// # Errors
    /// - [`StageError::Junction`]: a part does not meet the moved surface
    /// - [`StageError::Backend`]: the backend failed
    pub fn slide(
        &mut self,
        set_up: &SetUp,
        motions: &[FittedMotion],
        displacement: &mut Displacement,
    ) -> Result<Convergence, StageError> {
        let MadeByJunctions { slides, before } = &mut self.last;
        slides.clear();
        before.clear();
        let mut convergence = Convergence::nothing_to_do();
        for host in &mut self.hosts {
            let (placed, of_host) = host.slide(set_up, motions, &self.parts, displacement, slides)?;
            convergence = convergence.and(of_host);
            for (vertex, foot) in placed {
                before.push((vertex, displacement[vertex as usize]));
                displacement[vertex as usize] = foot - set_up.mesh.vertices[vertex as usize];
            }
        }
        Ok(convergence)
    }
}

impl Host {
    fn new(set_up: &SetUp, shaped: &[u32], on: On, curves: Vec<Curve>) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, families, backend, method, .. } = *set_up;
        let at = |vertex: u32| mesh.vertices[vertex as usize];
        let own: Vec<FamilyId> =
            families.families_of(on.placed_by()).filter(|family| on.has(families, *family)).collect();
        let is_own = |t: &[u32; 3]| on.assembly().is_none_or(|assembly| families.assemblies[assembly].has(t[0]));
        let regions: Vec<(DVec3, f64)> = curves.iter().map(|curve| curve.ball(set_up, REGION)).collect();
        let in_region = |t: &[u32; 3]| {
            let in_ball = |&(centre, radius): &(DVec3, f64)| t.iter().any(|&v| at(v).distance(centre) < radius);
            is_own(t) && regions.iter().any(in_ball)
        };
        let corners = own.iter().flat_map(|&family| surface.corners_of(family));
        let mut triangles: Vec<[u32; 3]> = corners.filter(in_region).collect();
        if on != On::Wings {
            triangles = facing(&mesh.vertices, triangles, curves.iter().map(|curve| &curve.vertices[..]));
        }
        let (vertices, triangles) = numbered(triangles);
        let number = |vertex: u32| vertices.binary_search(&vertex).ok().map(|place| place as u32);
        // The curve runs with the part on its left, so the rim of the hole runs the other way.
        let rim = |curve: &Curve| curve.vertices.iter().rev().filter_map(|&vertex| number(vertex)).collect();
        let rims: Vec<Vec<u32>> = curves.iter().map(rim).collect();
        let points: Vec<DVec3> = vertices.iter().map(|&vertex| at(vertex)).collect();
        let still = CurvedSurface::new(points, triangles.clone(), &rims)
            .map_err(|error| refused(set_up, curves[0].families[0][0], error.to_string()))?;

        let shaped: HashSet<u32> = shaped.iter().copied().collect();
        let on_curve: HashSet<u32> = curves.iter().flat_map(|curve| &curve.vertices).copied().collect();
        let mut around: HashMap<u32, BTreeSet<FamilyId>> = HashMap::new();
        for (triangle, family) in surface.triangles.iter().zip(&surface.family) {
            triangle.iter().filter(|&&vertex| number(vertex).is_some()).for_each(|&vertex| {
                around.entry(vertex).or_default().insert(*family);
            });
        }
        let own_triangles = own.iter().flat_map(|&family| surface.triangles_of(family));
        let all_edges = surface.edges_of(own_triangles);
        let edges: Vec<[u32; 2]> =
            all_edges.into_iter().filter(|edge| edge.iter().all(|&end| number(end).is_some())).collect();
        // On a coarse surface the strip may be narrower than an edge.
        let beside: HashSet<u32> =
            edges.iter().filter(|edge| edge.iter().any(|end| on_curve.contains(end))).flatten().copied().collect();
        let strips: Vec<(&Curve, f64)> = curves.iter().map(|curve| (curve, on.strip() * curve.extent)).collect();
        let near = |vertex: u32| {
            strips.iter().any(|(curve, width)| curve.vertices.iter().any(|&on| at(on).distance(at(vertex)) < *width))
        };
        let may_move = |vertex: u32| {
            let is_inside = around.get(&vertex).is_some_and(|of| of.iter().all(|family| own.contains(family)));
            is_inside
                && families.placed_by[vertex as usize] == on.placed_by()
                && families.shapes_at(vertex).next().is_none()
                && !families.partners.is_tied(vertex)
                && !shaped.contains(&vertex)
                && !on_curve.contains(&vertex)
                && number(vertex).is_some_and(|place| !still.is_sharp(place) && !still.turns(place))
                && (beside.contains(&vertex) || near(vertex))
        };
        let free: HashSet<u32> = vertices.par_iter().copied().filter(|&vertex| may_move(vertex)).collect();
        let constraint = |vertex: u32| if free.contains(&vertex) { Constraint::Free } else { Constraint::Held };
        let network = || SurfaceNetwork::new(&mesh.vertices, &edges, constraint, backend, method);
        let wings = (on == On::Wings).then(network).transpose()?;
        let on_body = (on != On::Wings).then(|| {
            let sliding = free.iter().chain(&on_curve).filter_map(|&vertex| {
                let start = still.start_at(number(vertex)?)?;
                Some((vertex, start))
            });
            OnBody { vertices: sliding.collect(), surface: still.clone() }
        });
        let strip = wings.map_or_else(|| Strip::Body(edges.clone(), free.clone()), Strip::Wings);
        Ok(Self { on, curves, vertices, triangles, rims, strip, on_body })
    }

    /// The feet to which vertices slide.
    fn slide(
        &mut self,
        set_up: &SetUp,
        motions: &[FittedMotion],
        parts: &[(Vec<u32>, CurvedSurface)],
        displacement: &[DVec3],
        slides: &mut BTreeMap<FamilyId, f64>,
    ) -> Result<(Vec<(u32, DVec3)>, Convergence), StageError> {
        let SetUp { mesh, stopping, .. } = set_up;
        let start = |vertex: u32| mesh.vertices[vertex as usize];
        let gaps = self.gaps(set_up, motions, displacement);
        for curve in &self.curves {
            curve.families.iter().for_each(|of| *slides.entry(self.on.reported(*of)).or_default() += 0.0);
        }
        if gaps.iter().all(|&gap| gap == 0.0) {
            return Ok((Vec::new(), Convergence::nothing_to_do()));
        }
        let surface = CurvedSurface::new(self.points(set_up, displacement), self.triangles.clone(), &self.rims)
            .map_err(|error| {
                self.curves[0].missed(set_up, 0, &format!("leaves a hole in it that cannot be closed, {error}"))
            })?;
        let mut slide = vec![DVec3::ZERO; mesh.vertices.len()];
        let mut placed: Vec<(u32, DVec3)> = Vec::new();
        for (curve, &gap) in self.curves.iter().zip(&gaps).filter(|(_, gap)| **gap > 0.0) {
            let met = self.meet(set_up, &motions[curve.assembly], &parts[curve.part], &surface, (curve, gap));
            for (k, met) in met.into_iter().enumerate() {
                let why = format!("does not meet the moved surface within {:.3e} of its carried place", MOST * gap);
                let Met { foot, .. } = met.ok_or_else(|| curve.missed(set_up, k, &why))?;
                let vertex = curve.vertices[k];
                let by = foot - (start(vertex) + displacement[vertex as usize]);
                slide[vertex as usize] = by;
                placed.push((vertex, foot));
                let farthest = slides.entry(self.on.reported(curve.families[k])).or_default();
                *farthest = farthest.max(by.length());
            }
        }
        let vertices = &self.vertices;
        let strip = match &mut self.strip {
            Strip::Wings(strip) => strip,
            Strip::Body(edges, free) => {
                let feet: HashMap<u32, DVec3> = placed.iter().copied().collect();
                let now = |vertex: u32| start(vertex) + displacement[vertex as usize];
                let on_surface = |vertex: u32, at: DVec3| {
                    start_on(&surface, vertices, vertex).map_or(at, |first| surface.beside(first, at).foot)
                };
                let place = |vertex: u32, progress: f64| match feet.get(&vertex) {
                    Some(&foot) if progress >= 1.0 => foot,
                    Some(&foot) => on_surface(vertex, now(vertex).lerp(foot, progress)),
                    None => now(vertex),
                };
                let on_curves: Vec<u32> = self.curves.iter().flat_map(|curve| &curve.vertices).copied().collect();
                let stiff = |positions: &[DVec3], ends: [DVec3; 2]| stiffness_beside(positions, &on_curves, ends);
                let mut positions: Vec<DVec3> = (0..mesh.vertices.len() as u32).map(now).collect();
                let constraint = |vertex: u32| if free.contains(&vertex) { Constraint::Free } else { Constraint::Held };
                let convergence =
                    SurfaceNetwork::follow(set_up, &mut positions, edges, constraint, stiff, place, on_surface)?;
                let moved = free.iter().chain(feet.keys()).map(|&vertex| (vertex, positions[vertex as usize]));
                let moved = moved.filter(|&(vertex, at)| at != now(vertex));
                return Ok((moved.collect(), convergence));
            }
        };
        let convergence = strip.relax(&mut slide, stopping)?;
        let moving: Vec<u32> = strip.moving().map(|(vertex, _)| vertex).collect();
        let beside = moving.par_iter().filter(|&&vertex| slide[vertex as usize] != DVec3::ZERO).filter_map(|&vertex| {
            let at = start(vertex) + displacement[vertex as usize] + slide[vertex as usize];
            Some((vertex, surface.beside(start_on(&surface, vertices, vertex)?, at).foot))
        });
        placed.extend(beside.collect::<Vec<_>>());
        Ok((placed, convergence))
    }

    /// The largest distance of each glued curve from the carried part; zero if it fits.
    fn gaps(&self, set_up: &SetUp, motions: &[FittedMotion], displacement: &[DVec3]) -> Vec<f64> {
        let of_curve = |curve: &Curve| {
            let motion = &motions[curve.assembly];
            let at = |vertex: u32| set_up.mesh.vertices[vertex as usize];
            let gap = |&vertex: &u32| motion.displacement(at(vertex)).distance(displacement[vertex as usize]);
            let gap = curve.vertices.iter().map(gap).fold(0.0, f64::max);
            if gap <= FITS * curve.extent { 0.0 } else { gap }
        };
        self.curves.iter().map(of_curve).collect()
    }

    /// The moved points of the surface around the curves.
    fn points(&self, set_up: &SetUp, displacement: &[DVec3]) -> Vec<DVec3> {
        let at = |&vertex: &u32| set_up.mesh.vertices[vertex as usize] + displacement[vertex as usize];
        self.vertices.iter().map(at).collect()
    }

    /// The places in which the rulings of a curve meet the moved surface `[n]`.
    fn meet(
        &self,
        set_up: &SetUp,
        motion: &FittedMotion,
        part: &(Vec<u32>, CurvedSurface),
        surface: &CurvedSurface,
        (curve, gap): (&Curve, f64),
    ) -> Vec<Option<Met>> {
        let vertices = &self.vertices;
        let met = (0..curve.vertices.len()).into_par_iter().map(|k| {
            let vertex = curve.vertices[k];
            let ruling = Ruling { from: set_up.mesh.vertices[vertex as usize], along: curve.directions[k], motion };
            let of_part = start_on(&part.1, &part.0, vertex)?;
            let first = start_on(surface, vertices, vertex)?;
            ruling.meets((&part.1, of_part), (surface, first), MOST * gap)
        });
        met.collect()
    }
}

/// A vertex of the mesh as a start on a surface.
///
/// - `vertices`: the mesh's vertices of the surface's own points, ascending
fn start_on(surface: &CurvedSurface, vertices: &[u32], vertex: u32) -> Option<Start> {
    let place = vertices.binary_search(&vertex).ok()?;
    surface.start_at(place as u32)
}

/// Where a ruling meets a surface.
struct Met {
    /// How far the ruling rises, in the mesh's unit.
    reach: f64,
    foot: DVec3,
}

/// The stiffness of an edge beside curves. An edge beside a curve is stiffer than one far off, so
/// that the acute corner behind a pylon goes with the curve; a short one is stiffer still, so that
/// a narrow strip between the curve and an end of the body is squeezed evenly.
///
/// - `positions` `[n_vertices]`: of the mesh
fn stiffness_beside(positions: &[DVec3], on_curves: &[u32], [a, b]: [DVec3; 2]) -> f64 {
    let (middle, length) = (0.5 * (a + b), a.distance(b));
    let away = on_curves.iter().map(|&vertex| positions[vertex as usize].distance_squared(middle));
    let away = away.fold(f64::INFINITY, f64::min).sqrt().max(0.5 * length);
    1.0 / (length.powi(4) * away.sqrt())
}

/// A ruling of a part, carried by a motion.
struct Ruling<'a> {
    from: DVec3,
    along: DVec3,
    motion: &'a FittedMotion,
}

impl Ruling<'_> {
    /// Where the ruling meets a surface, if it rises by at most `most` up to there.
    ///
    /// - `part`, `surface`: with the ruling's start on them
    fn meets(&self, part: (&CurvedSurface, Start), surface: (&CurvedSurface, Start), most: f64) -> Option<Met> {
        let at = |reach: f64| {
            let at = self.still(part, reach);
            at + self.motion.displacement(at)
        };
        let beside = |reach: f64| surface.0.beside(surface.1, at(reach));
        let still = 1e-15 * surface.0.size();
        let mut near = (0.0, beside(0.0));
        if near.1.height.abs() > still {
            // Out of the part is into the wing.
            let sign = near.1.height.signum();
            let mut far = (sign * (1.1 * near.1.height.abs()).min(most), near.1);
            loop {
                far.1 = beside(far.0);
                if far.1.height * sign <= 0.0 {
                    break;
                }
                if far.0.abs() >= most {
                    return None;
                }
                near = far;
                far.0 = sign * (2.0 * far.0.abs()).min(most);
            }
            near = between(near, far, still, beside);
        }
        let (reach, Beside { foot, triangle, .. }) = near;
        (foot.distance(at(reach)) <= ON_RULING * surface.0.longest_edge(triangle)).then_some(Met { reach, foot })
    }

    /// The place to which the ruling rises on the part before the motion.
    ///
    /// - `part`: with the ruling's start on it
    fn still(&self, part: (&CurvedSurface, Start), reach: f64) -> DVec3 {
        let at = self.from + reach * self.along;
        if reach < 0.0 { part.0.beside(part.1, at).foot } else { at }
    }
}

/// The zero of the height between two places of a ruling (regula falsi, Illinois).
fn between(
    mut near: (f64, Beside),
    mut far: (f64, Beside),
    still: f64,
    beside: impl Fn(f64) -> Beside,
) -> (f64, Beside) {
    let (mut of_near, mut of_far) = (near.1.height, far.1.height);
    let mut side = 0;
    for _ in 0..100 {
        if of_far == of_near {
            break;
        }
        let reach = far.0 - of_far * (far.0 - near.0) / (of_far - of_near);
        let next = (reach, beside(reach));
        let height = next.1.height;
        if height * of_far > 0.0 {
            (far, of_far) = (next, height);
            of_near *= if side == 1 { 0.5 } else { 1.0 };
            side = 1;
        } else {
            (near, of_near) = (next, height);
            of_far *= if side == -1 { 0.5 } else { 1.0 };
            side = -1;
        }
        if height.abs() <= still || (far.0 - near.0).abs() <= 1e-15 * far.0.abs() {
            break;
        }
    }
    if near.1.height.abs() < far.1.height.abs() { near } else { far }
}

impl Curve {
    fn new(set_up: &SetUp, (assembly, part): (usize, usize), half_edges: &[u32]) -> Result<Self, SetupError> {
        let SetUp { mesh, surface, .. } = *set_up;
        let vertices = half_edges.iter().map(|&half_edge| surface.origin(half_edge)).collect();
        let families = half_edges.iter().map(|&half_edge| families_at(set_up, half_edge)).collect();
        let touches = |vertex: u32| {
            let at = near(mesh.vertices[vertex as usize]);
            let [family, _] = families_at(set_up, half_edges[0]);
            refused(set_up, family, format!("it only touches `{}`, at {at}", behind(set_up, half_edges[0])))
        };
        let directions = rulings::directions(mesh, surface, half_edges).map_err(touches)?;
        let mut curve = Self { assembly, part, families, vertices, directions, extent: 0.0 };
        curve.extent = 2.0 * curve.ball(set_up, 1.0).1;
        Ok(curve)
    }

    /// The centre of the vertices, and so many times the largest distance of a vertex from there.
    fn ball(&self, set_up: &SetUp, times: f64) -> (DVec3, f64) {
        let points = self.vertices.iter().map(|&vertex| set_up.mesh.vertices[vertex as usize]);
        let centre = points.clone().sum::<DVec3>() / self.vertices.len() as f64;
        (centre, times * points.map(|point| point.distance(centre)).fold(0.0, f64::max))
    }

    /// Refuses a curve with a vertex that cannot slide.
    ///
    /// # Errors
    /// [`SetupError::Junction`]
    fn check(&self, set_up: &SetUp, part: &[FamilyId], on: On) -> Result<(), SetupError> {
        let SetUp { mesh, surface, families, .. } = *set_up;
        let vertices: HashSet<u32> = self.vertices.iter().copied().collect();
        let refused = |vertex: u32, why: String| {
            let of =
                self.vertices.iter().position(|&other| other == vertex).map_or(self.families[0], |k| self.families[k]);
            let at = near(mesh.vertices[vertex as usize]);
            Err(refused(set_up, of[0], format!("its curve on `{}` {why}, at {at}", mesh.families[of[1].index()])))
        };
        for (triangle, &family) in surface.triangles.iter().zip(&surface.family) {
            let is_of = on.has(families, family) || part.contains(&family);
            if let Some(&vertex) = triangle.iter().find(|vertex| !is_of && vertices.contains(vertex)) {
                return refused(vertex, format!("also touches `{}`", mesh.families[family.index()]));
            }
        }
        let stays = |&&vertex: &&u32| {
            families.placed_by[vertex as usize] != on.placed_by() || families.partners.is_tied(vertex)
        };
        match self.vertices.iter().find(stays) {
            Some(&vertex) => refused(vertex, "has a vertex that may not slide".to_owned()),
            None => Ok(()),
        }
    }

    /// The error of a vertex that does not meet its surface.
    fn missed(&self, set_up: &SetUp, k: usize, why: &str) -> StageError {
        let [family, other] = self.families[k].map(|family| set_up.mesh.families[family.index()].clone());
        let at = set_up.mesh.vertices[self.vertices[k] as usize];
        StageError::Junction { family, other, at, why: why.to_owned() }
    }
}

/// The families before and behind a half-edge.
fn families_at(set_up: &SetUp, half_edge: u32) -> [FamilyId; 2] {
    [set_up.surface.family[half_edge as usize / 3], set_up.surface.family_behind(half_edge)]
}

/// The name of the family behind a half-edge.
fn behind<'a>(set_up: &SetUp<'a>, half_edge: u32) -> &'a str {
    &set_up.mesh.families[set_up.surface.family_behind(half_edge).index()]
}

fn refused(set_up: &SetUp, family: FamilyId, why: String) -> SetupError {
    SetupError::Junction { family: set_up.mesh.families[family.index()].clone(), why }
}

/// The vertices of some triangles, ascending, and the triangles by their places in this list.
fn numbered(mut triangles: Vec<[u32; 3]>) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    let number = |vertex: u32| vertices.partition_point(|&other| other < vertex) as u32;
    triangles.iter_mut().for_each(|triangle| *triangle = triangle.map(number));
    (vertices, triangles)
}
