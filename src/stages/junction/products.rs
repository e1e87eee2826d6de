//! The derivative of sliding junctions.
//!
//! A vertex of a curve goes to the foot `F(x)` of the place `x = M(s)` on the moved surface, with
//! `s` on its ruling and M the motion of the part, so that its height `h(x)` there is zero. So with
//! `r` for how far the ruling rises
//!
//! `0 = dh + h' (dM + M s' dr)` and `dF = F' (dM + M s' dr) + dF_surface`
//!
//! and `dh`, `dF_surface` are the changes with the surface alone. The strip's network is linear,
//! and the feet of its vertices follow their places and the surface.
//!
//! Junctions that slide on rigid bodies have no products.
//!
//! # Kinks
//!
//! A vertex that has not slid lies on corners of facets, and on the edge between ruling and part.
//! It gets the derivative of the tangent plane and of the ruling. Each one-sided derivative differs
//! from it by about the square of the angle between facets. At a sharp edge of the wing the plane
//! is that of one of the two sides.

use glam::{DMat3, DVec3};

use super::super::surface_network::SurfaceNetwork;
use super::surfaces::On;
use super::{Host, Junctions, Met, Ruling, Strip, start_on};
use crate::families::{Assembly, RootChange, TipStart};
use crate::geometry::fitted_motion::FittedMotion;
use crate::geometry::motion_change::MotionChange;
use crate::mesh::Displacement;
use crate::projection::curved::{BesideChange, CurvedChange};
use crate::relaxation::{Convergence, Stopping};
use crate::stage::{NoProduct, SetUp};

/// Least height that a vertex loses while its ruling rises by one unit. Where it loses less, the
/// ruling only touches the surface.
const LEAST_SLOPE: f64 = 1e-6;

/// The derivative of all slides of a design.
pub(in super::super) struct SlideChange<'a> {
    surface: CurvedChange,
    /// The mesh's vertices of the surface's own points.
    vertices: Vec<u32>,
    /// The motion of each curve.
    roots: Vec<RootChange<'a>>,
    on_curves: Vec<OnCurve>,
    strip: Vec<(u32, BesideChange)>,
}

/// The derivative of a vertex of a curve.
struct OnCurve {
    vertex: u32,
    /// The number of the curve.
    curve: usize,
    /// Its place on the ruling before the motion.
    still: DVec3,
    /// Change of its carried place while the ruling rises by one unit.
    climb: DVec3,
    beside: BesideChange,
}

impl OnCurve {
    /// Change of the height while the ruling rises by one unit.
    fn slope(&self) -> f64 {
        self.beside.by_at.height.dot(self.climb)
    }
}

/// The wings on which junctions slide.
fn on_wings(hosts: &mut [Host]) -> Option<&mut Host> {
    hosts.iter_mut().find(|host| host.on == On::Wings)
}

/// The network of the strips of wings beside junctions.
fn strip_on_wings(hosts: &mut [Host]) -> Option<&mut SurfaceNetwork> {
    match &mut on_wings(hosts)?.strip {
        Strip::Wings(strip) => Some(strip),
        Strip::Body(..) => None,
    }
}

impl Junctions {
    /// The derivative of [`Self::slide`]. `None` without junctions.
    ///
    /// - `before` `[n_vertices]`: the displacement before the slide, in the mesh's unit
    ///
    /// # Errors
    /// - [`NoProduct::Rotation`]: several motions fit a root equally well
    /// - [`NoProduct::Vertex`]: a vertex does not slide smoothly
    /// - [`NoProduct::Backend`]: the backend failed
    pub fn change<'a>(&mut self, set_up: &SetUp<'a>, before: &[DVec3]) -> Result<Option<SlideChange<'a>>, NoProduct> {
        let SetUp { mesh, families, stopping, .. } = *set_up;
        let Some(host) = on_wings(&mut self.hosts) else { return Ok(None) };
        let at = |vertex: u32| mesh.vertices[vertex as usize];
        let rigid = |assembly: &Assembly| assembly.carried(mesh, before, TipStart::Rigid);
        let motions: Vec<FittedMotion> = families.assemblies.iter().map(rigid).collect();
        let gaps = host.gaps(set_up, &motions, before);
        let lost = |vertex: u32| NoProduct::Vertex { vertex, why: "does not meet the surface on which it slides" };
        let surface = CurvedChange::new(host.points(set_up, before), host.triangles.clone(), &host.rims);
        let surface = surface.map_err(|_| lost(host.curves[0].vertices[0]))?;
        let mut roots = Vec::with_capacity(host.curves.len());
        let mut on_curves = Vec::new();
        let mut slide = vec![DVec3::ZERO; mesh.vertices.len()];
        for (number, (curve, &gap)) in host.curves.iter().zip(&gaps).enumerate() {
            let root = families.assemblies[curve.assembly].carried_change(mesh, before, TipStart::Rigid);
            roots.push(root.map_err(|vertex| NoProduct::Rotation { vertex })?);
            let motion = &motions[curve.assembly];
            let part = &self.parts[curve.part];
            let met = match gap {
                0.0 => curve.vertices.iter().map(|_| None).collect(),
                _ => host.meet(set_up, motion, part, &surface, (curve, gap)),
            };
            for (k, (&vertex, met)) in curve.vertices.iter().zip(met).enumerate() {
                let first = start_on(&surface, &host.vertices, vertex).ok_or_else(|| lost(vertex))?;
                let on_part = start_on(&part.1, &part.0, vertex);
                let on_part = (&part.1, on_part.ok_or_else(|| lost(vertex))?);
                let along = curve.directions[k];
                let turn = DMat3::from_quat(motion.rotation());
                let on_curve = match met {
                    Some(Met { reach, foot }) => {
                        slide[vertex as usize] = foot - (at(vertex) + before[vertex as usize]);
                        let ruling = Ruling { from: at(vertex), along, motion };
                        let still = ruling.still(on_part, reach);
                        let climb = if reach < 0.0 {
                            on_part.0.beside_change(on_part.1, at(vertex) + reach * along).by_at.foot * along
                        } else {
                            along
                        };
                        let beside = surface.beside_change(first, still + motion.displacement(still));
                        OnCurve { vertex, curve: number, still, climb: turn * climb, beside }
                    }
                    None if gap == 0.0 => {
                        let beside = surface.tangent_change(first);
                        OnCurve { vertex, curve: number, still: at(vertex), climb: turn * along, beside }
                    }
                    None => return Err(lost(vertex)),
                };
                let slope = on_curve.slope();
                if slope.is_nan() || slope.abs() < LEAST_SLOPE {
                    let why = "slides along its ruling to a place where the ruling only touches the surface";
                    return Err(NoProduct::Vertex { vertex, why });
                }
                on_curves.push(on_curve);
            }
        }
        // At rest nothing relaxes.
        let Strip::Wings(strip) = &mut host.strip else { return Ok(None) };
        if gaps.iter().any(|&gap| gap > 0.0) {
            strip.relax(&mut slide, &stopping)?;
        }
        let moving = strip.moving().map(|(vertex, _)| vertex);
        let of_strip = |vertex: u32| {
            let first = start_on(&surface, &host.vertices, vertex)?;
            let by = slide[vertex as usize];
            let beside = match by {
                DVec3::ZERO => surface.tangent_change(first),
                _ => surface.beside_change(first, at(vertex) + before[vertex as usize] + by),
            };
            Some((vertex, beside))
        };
        let strip = moving.filter_map(of_strip).collect();
        Ok(Some(SlideChange { surface, vertices: host.vertices.clone(), roots, on_curves, strip }))
    }

    /// Change of the displacement that [`Self::slide`] makes.
    ///
    /// - `change` `[n_vertices]`: of the displacement before the slide, in any unit; set at the
    ///   vertices that slide
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed.
    pub fn forward(
        &mut self,
        slides: Option<&SlideChange>,
        change: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let (Some(strip), Some(slides)) = (strip_on_wings(&mut self.hosts), slides) else {
            return Ok(Convergence::nothing_to_do());
        };
        let surface = &slides.surface;
        let own: Vec<DVec3> = slides.vertices.iter().map(|&vertex| change[vertex as usize]).collect();
        let of_points = surface.forward(&own);
        let motions: Vec<Option<MotionChange>> = slides.roots.iter().map(|root| root.forward(change)).collect();
        let mut slide = vec![DVec3::ZERO; change.len()];
        let mut ends = Vec::with_capacity(slides.on_curves.len() + slides.strip.len());
        for on_curve in &slides.on_curves {
            let vertex = on_curve.vertex as usize;
            let by_at = &on_curve.beside.by_at;
            let carried = motions[on_curve.curve].map_or(DVec3::ZERO, |motion| motion.of(on_curve.still));
            let (foot, height) = on_curve.beside.of_surface(surface, &of_points);
            let reach = -(height + by_at.height.dot(carried)) / on_curve.slope();
            let foot = foot + by_at.foot * (carried + on_curve.climb * reach);
            slide[vertex] = foot - change[vertex];
            ends.push((vertex, foot));
        }
        let convergence = strip.forward(&mut slide, stopping)?;
        for (vertex, beside) in &slides.strip {
            let vertex = *vertex as usize;
            let (foot, _) = beside.of_surface(surface, &of_points);
            ends.push((vertex, foot + beside.by_at.foot * (change[vertex] + slide[vertex])));
        }
        ends.into_iter().for_each(|(vertex, foot)| change[vertex] = foot);
        Ok(convergence)
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `gradient` `[n_vertices]`: by the displacement after the slide on entry and before it on
    ///   exit, in any unit
    /// - `stopping`: its tolerance is relative to the argument
    ///
    /// # Errors
    /// The backend failed.
    pub fn reverse(
        &mut self,
        slides: Option<&SlideChange>,
        gradient: &mut Displacement,
        stopping: &Stopping,
    ) -> Result<Convergence, NoProduct> {
        let (Some(strip), Some(slides)) = (strip_on_wings(&mut self.hosts), slides) else {
            return Ok(Convergence::nothing_to_do());
        };
        let surface = &slides.surface;
        let mut by_points = surface.none();
        let mut by_slide = vec![DVec3::ZERO; gradient.len()];
        for (vertex, beside) in &slides.strip {
            let vertex = *vertex as usize;
            let by_foot = std::mem::take(&mut gradient[vertex]);
            beside.add(surface, by_foot, 0.0, &mut by_points);
            let by_at = beside.by_at.reverse(by_foot, 0.0);
            gradient[vertex] = by_at;
            by_slide[vertex] = by_at;
        }
        let convergence = strip.reverse(&mut by_slide, stopping)?;
        let mut by_motions: Vec<Option<MotionChange>> = slides.roots.iter().map(RootChange::none).collect();
        for on_curve in &slides.on_curves {
            let vertex = on_curve.vertex as usize;
            let by_foot = std::mem::take(&mut gradient[vertex]) + by_slide[vertex];
            gradient[vertex] = -by_slide[vertex];
            let by_at = on_curve.beside.by_at.foot.transpose() * by_foot;
            let by_height = -by_at.dot(on_curve.climb) / on_curve.slope();
            on_curve.beside.add(surface, by_foot, by_height, &mut by_points);
            if let Some(by_motion) = &mut by_motions[on_curve.curve] {
                by_motion.add(on_curve.still, on_curve.beside.by_at.reverse(by_foot, by_height));
            }
        }
        for (&vertex, by_point) in slides.vertices.iter().zip(surface.reverse(by_points)) {
            gradient[vertex as usize] += by_point;
        }
        for (root, by_motion) in slides.roots.iter().zip(by_motions) {
            root.reverse(by_motion, gradient);
        }
        Ok(convergence)
    }
}
