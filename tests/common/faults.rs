//! What must hold of half an aircraft after any design, found without the crate's own geometry.
//!
//! The fuselages are cylinders of radius 0.5 around the x axis for -2 <= x <= 3.2.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use glam::{DVec2, DVec3};
use idmesh::mesh::TetMesh;

use super::aircraft::{triangles_of, vertices_of};

const RADIUS: f64 = 0.5;
const CYLINDER: RangeInclusive<f64> = -2.0..=3.2;
/// Rounding of a projection, as a fraction of the mesh's size.
const ON_SURFACE: f64 = 1e-9;

/// Everything that is wrong with a moved half aircraft, as a word and what it is about; empty when
/// all is well.
///
/// - `inverted`: tets without positive volume
/// - `folded`: boundary triangles turned by 90 degrees or more
/// - `farfield`: vertices whose bits changed
/// - `symmetry`: vertices whose `y` changed its bits
/// - `fuselage`: vertices of the carenage, junction included, that are off its original triangles;
///   where the old root was and there are none, off the cylinder by more than the facets around are
pub fn faults(mesh: &TetMesh, vertices: &[DVec3]) -> Vec<(&'static str, Vec<usize>)> {
    let all = [
        ("inverted", inverted(mesh, vertices)),
        ("folded", folded(mesh, vertices)),
        ("farfield", bits_changed(&mesh.vertices, vertices, &vertices_of(mesh, "farfield"), &[0, 1, 2])),
        ("symmetry", bits_changed(&mesh.vertices, vertices, &vertices_of(mesh, "symmetry"), &[1])),
        ("fuselage", off_fuselage(mesh, vertices)),
    ];
    all.into_iter().filter(|(_, found)| !found.is_empty()).collect()
}

/// Largest extent of the mesh along an axis.
pub fn size(mesh: &TetMesh) -> f64 {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = mesh.vertices.iter().fold(start, |(low, high), &at| (low.min(at), high.max(at)));
    (high - low).max_element()
}

/// Tets whose volume is not positive, from the triple product of their edges.
pub fn inverted(mesh: &TetMesh, vertices: &[DVec3]) -> Vec<usize> {
    let positive = |tet: [u32; 4]| {
        let [a, b, c, d] = tet.map(|vertex| vertices[vertex as usize]);
        (b - a).dot((c - a).cross(d - a)) > 0.0
    };
    (0..mesh.tets.len()).filter(|&tet| !positive(mesh.tets[tet])).collect()
}

/// Boundary triangles whose normal is turned by 90 degrees or more.
pub fn folded(mesh: &TetMesh, vertices: &[DVec3]) -> Vec<usize> {
    let normal = |at: &[DVec3], triangle: [u32; 3]| {
        let [a, b, c] = triangle.map(|vertex| at[vertex as usize]);
        (b - a).cross(c - a)
    };
    let kept = |triangle| normal(&mesh.vertices, triangle).dot(normal(vertices, triangle)) > 0.0;
    (0..mesh.triangles.len()).filter(|&index| !kept(mesh.triangles[index])).collect()
}

/// Of some vertices, those with other bits in one of these coordinates.
pub fn bits_changed(old: &[DVec3], new: &[DVec3], vertices: &[usize], axes: &[usize]) -> Vec<usize> {
    assert_eq!(old.len(), new.len());
    let changed = |vertex: usize| axes.iter().any(|&axis| old[vertex][axis].to_bits() != new[vertex][axis].to_bits());
    vertices.iter().copied().filter(|&vertex| changed(vertex)).collect()
}

fn off_fuselage(mesh: &TetMesh, vertices: &[DVec3]) -> Vec<usize> {
    let triangles = triangles_of(mesh, "carenage");
    let root: Vec<_> = junction(mesh).iter().map(|edge| edge.map(|vertex| mesh.vertices[vertex])).collect();
    let (on_surface, on_cylinder) = (ON_SURFACE * size(mesh), facets_inside(mesh));
    let off = |&vertex: &usize| {
        let at = vertices[vertex];
        let in_the_old_root = || inside_seen_from_the_side(at, &root) && off_cylinder(at) <= on_cylinder;
        distance_to(at, &triangles, &mesh.vertices) > on_surface && !in_the_old_root()
    };
    vertices_of(mesh, "carenage").into_iter().filter(off).collect()
}

/// Distance of a point from a triangle.
fn distance_to_triangle(at: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let over = |p: DVec3, q: DVec3| (q - p).cross(at - p).dot(normal) >= 0.0;
    if over(a, b) && over(b, c) && over(c, a) {
        return (at - a).dot(normal).abs() / normal.length();
    }
    let to_edge = |p: DVec3, q: DVec3| {
        let along = ((at - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
        at.distance(p + (q - p) * along)
    };
    to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
}

/// Distance of a point from the triangles of a family where `vertices` puts them.
pub fn distance_to(at: DVec3, triangles: &[[usize; 3]], vertices: &[DVec3]) -> f64 {
    let distances = triangles.iter().map(|triangle| distance_to_triangle(at, triangle.map(|vertex| vertices[vertex])));
    distances.min_by(f64::total_cmp).unwrap()
}

/// How far a point is from the cylinder; infinitely far beyond its ends.
fn off_cylinder(at: DVec3) -> f64 {
    if CYLINDER.contains(&at.x) { (DVec2::new(at.y, at.z).length() - RADIUS).abs() } else { f64::INFINITY }
}

/// How far the middles of the fuselage's edges beside the root lie off the cylinder.
fn facets_inside(mesh: &TetMesh) -> f64 {
    let rim: BTreeSet<usize> = junction(mesh).into_iter().flatten().collect();
    let beside = triangles_of(mesh, "carenage").into_iter().filter(|triangle| triangle.iter().any(|v| rim.contains(v)));
    beside.flat_map(edges).map(|[a, b]| off_cylinder((mesh.vertices[a] + mesh.vertices[b]) / 2.0)).fold(0.0, f64::max)
}

/// The edges of the curve between the wing with its trailing edge and the fuselage.
pub fn junction(mesh: &TetMesh) -> Vec<[usize; 2]> {
    let edges_of = |family: &str| triangles_of(mesh, family).into_iter().flat_map(edges).collect::<BTreeSet<_>>();
    let wing = &edges_of("wing") | &edges_of("trailing_edge");
    (&wing & &edges_of("carenage")).into_iter().collect()
}

fn edges([a, b, c]: [usize; 3]) -> [[usize; 2]; 3] {
    [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
}

/// Whether a point lies inside a closed curve, both seen along the span (even-odd rule).
fn inside_seen_from_the_side(at: DVec3, curve: &[[DVec3; 2]]) -> bool {
    let crosses =
        |&&[a, b]: &&[DVec3; 2]| (a.x > at.x) != (b.x > at.x) && at.z < a.z + (b.z - a.z) * (at.x - a.x) / (b.x - a.x);
    curve.iter().filter(crosses).count() % 2 == 1
}
