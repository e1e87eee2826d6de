//! Matches the points of a surface with the vertices of a family by their triangles.

use std::collections::{BTreeSet, HashMap};
use std::path::Path;

use glam::DVec3;

use super::displacement_error::DisplacementError;
use super::plausible::SIZE;
use super::same_triangles::{Reading, Triangles, Unread, readings, together};
use crate::formats::Surface;
use crate::mesh::{FamilyId, TetMesh};
use crate::text::figures::length;
use crate::text::shorten;

/// A family of the mesh.
pub(super) struct Family<'a> {
    pub name: &'a str,
    /// Its vertices, ascending.
    pub vertices: &'a [u32],
    /// Whether it has quadrilaterals, of which `triangles` holds halves.
    pub has_quadrilaterals: bool,
    /// Its triangles, between vertices of the mesh.
    pub triangles: &'a [[u32; 3]],
    /// Largest distance between an original position in a file and its vertex, in the mesh's unit.
    pub tolerance: f64,
}

/// A family or a surface with its vertices numbered from 0 on.
struct Numbered {
    corners: Vec<[u32; 3]>,
    /// Vertex of the mesh or point of the file of each number.
    vertices: Vec<u32>,
}

impl Numbered {
    fn family(vertices: &[u32], triangles: &[[u32; 3]]) -> Self {
        let number: HashMap<u32, u32> = vertices.iter().copied().zip(0..).collect();
        let corners = triangles.iter().map(|corners| corners.map(|vertex| number[&vertex])).collect();
        Self { corners, vertices: vertices.to_vec() }
    }

    /// The points of triangles in their order.
    fn surface(surface: &Surface) -> Self {
        let used: BTreeSet<u32> = surface.triangles.as_flattened().iter().copied().collect();
        Self::family(&used.into_iter().collect::<Vec<_>>(), &surface.triangles)
    }

    /// The same with equal points as one.
    fn merged(&self, points: &[DVec3]) -> Self {
        let mut known = HashMap::new();
        let mut vertices = Vec::new();
        let mut number = Vec::with_capacity(self.vertices.len());
        for &point in &self.vertices {
            let bits = points[point as usize].to_array().map(|value| (value + 0.0).to_bits());
            number.push(*known.entry(bits).or_insert_with(|| {
                vertices.push(point);
                (vertices.len() - 1) as u32
            }));
        }
        let corners = self.corners.iter().map(|corners| corners.map(|corner| number[corner as usize])).collect();
        Self { corners, vertices }
    }

    fn triangles(&self) -> Triangles<'_> {
        Triangles { n_points: self.vertices.len(), corners: &self.corners }
    }
}

/// The point of each vertex of a family, by the triangles.
pub(super) fn by_triangles(
    surface: &Surface,
    path: &Path,
    mesh: &TetMesh,
    family: &Family,
) -> Result<Vec<usize>, DisplacementError> {
    let bad = |what: String| DisplacementError::BadSurface { path: path.to_path_buf(), what };
    let remedy =
        "expected the family's own triangles, or an array `original` with the original positions at the points";
    if surface.triangles.is_empty() || !surface.others().is_empty() {
        let found = if surface.triangles.is_empty() { "no triangles" } else { "more than triangles" };
        let others = surface.others();
        let others = if others.is_empty() { String::new() } else { format!(" ({others})") };
        return Err(bad(format!("the surface has {found}{others}, {remedy}")));
    }
    let of_family = Numbered::family(family.vertices, family.triangles);
    let mut of_surface = Numbered::surface(surface);
    if of_surface.vertices.len() != of_family.vertices.len() {
        of_surface = of_surface.merged(&surface.points);
    }
    let [found, expected] = [&of_surface, &of_family].map(|of| (of.vertices.len(), of.corners.len()));
    if found != expected {
        return Err(bad(format!(
            "the surface has {} points at {} triangles, the family `{}` has {} at {}; {remedy}",
            found.0, found.1, family.name, expected.0, expected.1
        )));
    }
    let distance = |vertices: &[u32], &(vertex, point): &(u32, u32)| {
        let point = surface.points[of_surface.vertices[point as usize] as usize];
        mesh.vertices[vertices[vertex as usize] as usize].distance_squared(point)
    };
    let cost = |vertices: &[u32], reading: &Reading| -> f64 {
        reading.pairs.iter().map(|pair| distance(vertices, pair)).sum()
    };
    let ambiguous = |one: String, other: String| DisplacementError::Ambiguous { path: path.to_path_buf(), one, other };
    let parts = readings(&of_family.triangles(), &of_surface.triangles()).map_err(|unread| match unread {
        Unread::Differ => bad(format!(
            "the surface has as many points and triangles as the family `{}`, but its triangles join others; {remedy}",
            family.name
        )),
        Unread::Regular => bad(format!("the surface is too regular to be matched by its triangles, {remedy}")),
    })?;
    let mean = |cost: f64, n: usize| (cost / n as f64).sqrt();
    let size = extent(mesh, family.vertices);
    let mut taken = Vec::new();
    let mut least = 0.0;
    for part in &parts {
        let costs: Vec<f64> = part.iter().map(|reading| cost(&of_family.vertices, reading)).collect();
        let mut order: Vec<usize> = (0..part.len()).collect();
        order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        let words = |at: usize| {
            let (vertex, point) = part[at].pairs[0];
            let n = part[at].pairs.len();
            format!(
                "point {} is vertex {}, and {n} vertices move by {} in the mean",
                of_surface.vertices[point as usize],
                of_family.vertices[vertex as usize],
                length(mean(costs[at], n), size)
            )
        };
        let in_order: Vec<usize> =
            order.iter().copied().filter(|&at| is_in_order(&part[at], &of_family, &of_surface)).collect();
        match order[..] {
            [only] if in_order != [only] => {
                let what = "neither the points of the surface nor its triangles stand in the order of the family";
                return Err(bad(format!("{what} `{}`, {remedy}", shorten(family.name))));
            }
            [first, second, ..] if in_order != [first] || costs[first] == costs[second] => {
                let other = in_order.iter().copied().find(|&at| at != first).unwrap_or(second);
                return Err(ambiguous(words(first), words(other)));
            }
            _ => {}
        }
        least += costs[order[0]];
        taken.push(&part[order[0]]);
    }
    let point_of = together(&of_family.triangles(), &of_surface.triangles(), &taken).ok_or_else(|| {
        bad(format!("the triangles of the surface are not those of the family `{}` as a whole; {remedy}", family.name))
    })?;
    check_other_families(mesh, family, &of_surface, least, &cost).map_err(|name| {
        let of = |name: &str| format!("it is the family `{}`", shorten(name));
        ambiguous(of(family.name), format!("{}, which is nearer", of(&name)))
    })?;
    let points: Vec<usize> = point_of.into_iter().map(|point| of_surface.vertices[point as usize] as usize).collect();
    check_size(surface, mesh, family, &of_family, &points).map_err(bad)?;
    Ok(points)
}

/// Whether points and vertices stand in the same order, or the triangles do.
fn is_in_order(reading: &Reading, family: &Numbered, surface: &Numbered) -> bool {
    if reading.pairs.iter().all(|(vertex, point)| vertex == point) {
        return true;
    }
    let point_of: HashMap<u32, u32> = reading.pairs.iter().copied().collect();
    // Other parts of the family have readings of their own.
    family.corners.iter().zip(&surface.corners).all(|(vertices, points)| {
        let of_vertices = vertices.map(|vertex| point_of.get(&vertex).copied());
        of_vertices.contains(&None) || points.iter().all(|&point| of_vertices.contains(&Some(point)))
    })
}

/// Checks that the surface is no other family of the mesh that is nearer to it. The error is the
/// name of such a family.
fn check_other_families(
    mesh: &TetMesh,
    family: &Family,
    of_surface: &Numbered,
    least: f64,
    cost: &impl Fn(&[u32], &Reading) -> f64,
) -> Result<(), String> {
    let mut n_triangles = vec![0; mesh.families.len()];
    mesh.triangle_family.iter().for_each(|of| n_triangles[of.index()] += 1);
    for (index, name) in mesh.families.iter().enumerate() {
        if name == family.name || n_triangles[index] != of_surface.corners.len() {
            continue;
        }
        let triangles = mesh.triangles_of(&[FamilyId(index as u16)]);
        let vertices: BTreeSet<u32> = triangles.as_flattened().iter().copied().collect();
        let other = Numbered::family(&vertices.into_iter().collect::<Vec<_>>(), &triangles);
        let nearest =
            |part: &Vec<Reading>| part.iter().map(|reading| cost(&other.vertices, reading)).fold(f64::MAX, f64::min);
        match readings(&other.triangles(), &of_surface.triangles()) {
            Err(Unread::Differ) => {}
            Ok(parts) if parts.iter().map(nearest).sum::<f64>() > least => {}
            Ok(_) | Err(Unread::Regular) => return Err(name.clone()),
        }
    }
    Ok(())
}

/// Compares the lengths of all edges before and after. The error is the fault, in words.
fn check_size(
    surface: &Surface,
    mesh: &TetMesh,
    family: &Family,
    of_family: &Numbered,
    points: &[usize],
) -> Result<(), String> {
    let around = |at: &dyn Fn(u32) -> DVec3| -> f64 {
        let edges = of_family.corners.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        edges.map(|(a, b)| at(a).distance(at(b))).sum()
    };
    let before = around(&|vertex| mesh.vertices[of_family.vertices[vertex as usize] as usize]);
    let times = around(&|vertex| surface.points[points[vertex as usize]]) / before;
    if (SIZE.recip()..=SIZE).contains(&times) || times.is_nan() {
        return Ok(());
    }
    let name = shorten(family.name);
    Err(format!("the surface is {times:.3e} times as large as the family `{name}`, expected the mesh's unit of length"))
}

/// The largest extent of some vertices along an axis.
fn extent(mesh: &TetMesh, vertices: &[u32]) -> f64 {
    let at = || vertices.iter().map(|&vertex| mesh.vertices[vertex as usize]);
    let low = at().fold(DVec3::INFINITY, DVec3::min);
    (at().fold(DVec3::NEG_INFINITY, DVec3::max) - low).max_element()
}
