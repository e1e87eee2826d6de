//! [`ComparisonPage`]: two results of one mesh, vertex by vertex, as a page: whether they agree,
//! how far apart they are by family and by stage, and where they are furthest apart.

use std::borrow::Cow;

use glam::DVec3;

use super::super::beta_text;
use super::chart::{Axis, Chart, WIDE};
use super::html::{Html, count, number, place};
use super::scene::{Scene, Subject};
use super::{SCRIPT, STYLE, begin, view};
use crate::mesh::{CellKind, FamilyId, HybridMesh, measures};
use crate::mover::{Outcome, StageName, StageQuality};
use crate::quality::betas;

/// Most vertices that are listed.
const LISTED: usize = 20;

/// A family smaller than this share of the mesh is looked at from near.
const SMALL: f64 = 0.3;

/// Steps of the distribution of distances in a power of ten.
const STEPS: f64 = 4.0;

/// Two results of one mesh, vertex by vertex. Lengths are in the mesh's unit.
pub struct ComparisonPage<'a> {
    /// What is compared, in words.
    pub name: String,
    /// The names of the two results.
    pub names: [String; 2],
    /// The original mesh.
    pub mesh: HybridMesh<'a>,
    /// The positions of each result `[n_vertices]`, perhaps not finite.
    pub positions: [&'a [DVec3]; 2],
    /// The outcomes whose positions are compared. `None` for two mesh files, of which the first is
    /// the original mesh.
    pub outcomes: Option<[&'a Outcome; 2]>,
    /// The families that the design moves.
    pub bodies: Vec<&'a str>,
    /// The length that distances are relative to, and what it is.
    pub reference: (f64, &'static str),
    /// The largest distance over `reference`.
    pub relative: f64,
    /// The largest `relative` that is accepted.
    pub tolerance: f64,
    /// Names and values of the table of settings.
    pub settings: Vec<(&'static str, String)>,
}

impl ComparisonPage<'_> {
    /// The page as HTML.
    ///
    /// # Errors
    /// The mesh cannot be packed.
    pub fn html(&self) -> std::io::Result<String> {
        let [a, b] = self.positions;
        let distances: Vec<f64> = a.iter().zip(b).map(|(a, b)| a.distance(*b).abs()).collect();
        let worst = furthest(&distances);
        let is_good = self.relative <= self.tolerance;
        let word = if is_good { "within tolerance" } else { "out of tolerance" };
        let mut html = Html::default();
        begin(&mut html, &format!("{}: {word}", self.name), Some(SCRIPT));
        html.markup("<style>").markup(STYLE).markup("</style>\n<body data-state=\"text\">\n<header>\n");
        html.element("p class=\"from\"", format_args!("idmesh {}, {}", env!("CARGO_PKG_VERSION"), self.name));
        html.markup(if is_good { "<h1><span class=\"badge good\">" } else { "<h1><span class=\"badge bad\">" });
        html.text(word).markup("</span> ").text(format_args!("{} against {}", self.names[0], self.names[1]));
        html.markup("</h1>\n").element("p class=\"lead\"", self.lead(is_good));
        html.markup("<dl class=\"cards\">\n");
        self.cards(&distances, &worst, &mut html);
        html.markup("</dl>\n</header>\n<main>\n<div class=\"text\">\n");
        self.families(&distances, &mut html);
        self.worst(&distances, &worst, &mut html);
        distribution(&distances, self.reference.0, self.tolerance, &mut html);
        html.markup("</div>\n");
        let scene = self.scene(&distances, &worst)?;
        view(&scene, &mut html);
        html.markup("<div class=\"text\">\n");
        self.stages(&mut html);
        html.markup("<section class=\"names\"><h2>Settings</h2>\n");
        let rows: Vec<_> = self.settings.iter().map(|(name, value)| vec![(*name).to_owned(), value.clone()]).collect();
        html.table(&["setting", "value"], &rows).markup("</section>\n</div>\n</main>\n");
        html.data("meta", &scene.meta).packed("packed", &scene.packed);
        html.markup("<script>").markup(SCRIPT).markup("</script>\n</body>\n</html>\n");
        Ok(html.finish())
    }

    fn lead(&self, is_good: bool) -> String {
        let [relative, tolerance] = [self.relative, self.tolerance].map(number);
        let of = self.reference.1;
        match (is_good, self.relative.is_finite()) {
            (true, _) => format!("No vertex is further apart than {relative} of {of}; {tolerance} is accepted."),
            (false, true) => format!("A vertex is {relative} of {of} apart; {tolerance} is accepted."),
            (false, false) => "A vertex has no finite position in one of the results.".to_owned(),
        }
    }

    fn cards(&self, distances: &[f64], worst: &[usize], html: &mut Html) {
        let mut card = |name: &'static str, figure: &str, words: &str| {
            html.markup("<div>").element("dt", name).element("dd class=\"figure\"", figure);
            html.element("dd", words).markup("</div>\n");
        };
        if let Some(&vertex) = worst.first() {
            let words = format!("of vertex {vertex}, at {}", place(self.positions[0][vertex].to_array()));
            card("Largest distance", &number(distances[vertex]), &words);
        }
        card(
            "Relative distance",
            &number(self.relative),
            &format!("of {}, {}", self.reference.1, number(self.reference.0)),
        );
        let apart = distances.iter().filter(|distance| **distance != 0.0).count();
        card("Vertices apart", &count(apart), &format!("of {}", count(distances.len())));
    }

    /// The largest and the mean distance on each family, and inside.
    fn families(&self, distances: &[f64], html: &mut Html) {
        let names = &self.mesh.mesh.families;
        let mut is_surface = vec![false; distances.len()];
        let mut of_family: Vec<Vec<u32>> = vec![Vec::new(); names.len()];
        for face in 0..self.mesh.n_faces() as u32 {
            let vertices = self.mesh.face_vertices(face);
            vertices.iter().for_each(|&vertex| is_surface[vertex as usize] = true);
            if let Some(family) = self.mesh.family_of(face) {
                of_family[family.index()].extend(vertices);
            }
        }
        let inside = (0..distances.len() as u32).filter(|&vertex| !is_surface[vertex as usize]).collect();
        let all = names.iter().cloned().zip(of_family).chain([("inside".to_owned(), inside)]);
        let row = |(name, mut vertices): (String, Vec<u32>)| {
            vertices.sort_unstable();
            vertices.dedup();
            let of = || vertices.iter().map(|&vertex| distances[vertex as usize]);
            let largest = of().max_by(f64::total_cmp);
            let mean = of().sum::<f64>() / vertices.len() as f64;
            vec![
                name,
                count(vertices.len()),
                largest.map_or(String::new(), number),
                largest.map_or(String::new(), |_| number(mean)),
                largest.map_or(String::new(), |largest| share(largest, self.reference.0)),
            ]
        };
        html.markup("<section><h2>Distances by family</h2>\n");
        html.table(&["family", "vertices", "largest", "mean", "relative"], &all.map(row).collect::<Vec<_>>());
        html.markup("</section>\n");
    }

    /// The vertices that are furthest apart. Each row has the number by which the view finds it.
    fn worst(&self, distances: &[f64], worst: &[usize], html: &mut Html) {
        if worst.is_empty() {
            return;
        }
        html.markup("<section id=\"worst\"><h2>Furthest apart</h2>\n");
        html.element("p class=\"note\"", "A click on a row shows the vertex in the view.");
        let mut family = vec![None; worst.len()];
        for face in 0..self.mesh.n_faces() as u32 {
            for &vertex in self.mesh.face_vertices(face) {
                if let Some(at) = worst.iter().position(|&other| other == vertex as usize) {
                    family[at] = family[at].or(self.mesh.family_of(face));
                }
            }
        }
        let row = |(&vertex, family): (&usize, Option<FamilyId>)| {
            vec![
                vertex.to_string(),
                number(distances[vertex]),
                place(self.positions[0][vertex].to_array()),
                family.map_or("inside".to_owned(), |family| self.mesh.mesh.families[family.index()].clone()),
            ]
        };
        let rows: Vec<_> = worst.iter().zip(family).map(row).collect();
        html.chosen(&["vertex", "distance", "place", "family"], &rows).markup("</section>\n");
    }

    /// The quality of both outcomes at each stage.
    fn stages(&self, html: &mut Html) {
        let Some([a, b]) = self.outcomes else { return };
        html.markup("<section><h2>Stages</h2>\n<p class=\"note\">").text(format_args!(
            "The smallest beta and the number of inverted cells after each stage: {}, then {}.",
            self.names[0], self.names[1]
        ));
        html.markup("</p>\n");
        let row = |(a, b): (&StageQuality, &StageQuality)| {
            let name = match a.name {
                StageName::Original => "original",
                StageName::Deformed => "deformed",
                StageName::Corrected => "corrected",
                StageName::Final => "final",
            };
            vec![
                name.to_owned(),
                beta_text(a.beta_min, 6),
                beta_text(b.beta_min, 6),
                number((a.beta_min - b.beta_min).abs()),
                count(a.inverted),
                count(b.inverted),
            ]
        };
        let rows: Vec<_> = a.stages.iter().zip(&b.stages).map(row).collect();
        let header = ["stage", "beta min", "beta min", "apart", "inverted", "inverted"];
        html.table(&header, &rows).markup("</section>\n");
    }

    /// The view: the first outcome, or the way from the first file to the second. Vertices without
    /// finite positions stay in their original places.
    fn scene(&self, distances: &[f64], worst: &[usize]) -> std::io::Result<Scene> {
        let moved = self.positions[if self.outcomes.is_some() { 0 } else { 1 }];
        let old = &self.mesh.mesh.vertices;
        let finite = |(at, old): (&DVec3, &DVec3)| if at.is_finite() { *at } else { *old };
        let moved: Vec<DVec3> = moved.iter().zip(old).map(finite).collect();
        let displacement: Vec<DVec3> = moved.iter().zip(old).map(|(at, old)| *at - *old).collect();
        let values = match self.mesh.n_cells() == self.mesh.count(CellKind::Tet) {
            true => betas(&moved, &self.mesh.mesh.tets),
            false => measures(self.mesh, &moved, None).iter().map(|cell| cell.jacobian).collect(),
        };
        let subject = Subject {
            mesh: self.mesh,
            moved: &moved,
            displacement: &displacement,
            values: Cow::Owned(values),
            distances: Some(distances),
        };
        let bodies = if self.outcomes.is_some() { self.bodies.clone() } else { self.small_families(distances) };
        subject.scene(&bodies, |shown| shown.worst_vertices(worst))
    }

    /// The families that are apart and small against the mesh: a far boundary is none of them.
    fn small_families(&self, distances: &[f64]) -> Vec<&str> {
        let names = &self.mesh.mesh.families;
        let mut boxes = vec![None; names.len()];
        let mut is_apart = vec![false; names.len()];
        for face in 0..self.mesh.n_faces() as u32 {
            let Some(family) = self.mesh.family_of(face).map(FamilyId::index) else { continue };
            for &vertex in self.mesh.face_vertices(face) {
                let at = self.mesh.mesh.vertices[vertex as usize];
                let (low, high) = boxes[family].unwrap_or((at, at));
                boxes[family] = Some((low.min(at), high.max(at)));
                is_apart[family] |= distances[vertex as usize] != 0.0;
            }
        }
        let all = boxes.iter().flatten().copied().reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let size = |(low, high): (DVec3, DVec3)| low.distance(high);
        let whole = all.map_or(0.0, size);
        let is_body = |family: usize| is_apart[family] && boxes[family].is_some_and(|own| size(own) < SMALL * whole);
        names.iter().enumerate().filter(|(family, _)| is_body(*family)).map(|(_, name)| name.as_str()).collect()
    }
}

/// The vertices with the largest distances, the largest first. What is not a number is the largest,
/// and distances of zero are left out.
fn furthest(distances: &[f64]) -> Vec<usize> {
    let order = |a: &usize, b: &usize| distances[*b].total_cmp(&distances[*a]).then(a.cmp(b));
    let mut vertices: Vec<usize> = (0..distances.len()).filter(|&vertex| distances[vertex] != 0.0).collect();
    if vertices.len() > LISTED {
        vertices.select_nth_unstable_by(LISTED, order);
        vertices.truncate(LISTED);
    }
    vertices.sort_unstable_by(order);
    vertices
}

/// A length over the reference.
fn share(length: f64, reference: f64) -> String {
    number(if length == 0.0 { 0.0 } else { length / reference })
}

/// The number of vertices by their distance, on logarithmic axes.
fn distribution(distances: &[f64], reference: f64, tolerance: f64, html: &mut Html) {
    html.markup("<section><h2>Distribution of the distances</h2>\n");
    let bin = |distance: f64| (STEPS * distance.log10()).floor() as i64;
    let finite: Vec<f64> =
        distances.iter().copied().filter(|distance| distance.is_finite() && *distance > 0.0).collect();
    let (same, lost) = (
        distances.iter().filter(|distance| **distance == 0.0).count(),
        distances.iter().filter(|distance| !distance.is_finite()).count(),
    );
    let words = format!("{} vertices have the same position to the last bit", count(same));
    let words = if lost > 0 { format!("{words}, and {} have none", count(lost)) } else { words };
    html.element("p class=\"note\"", format_args!("{words}."));
    let bins: Vec<i64> = finite.iter().map(|&distance| bin(distance)).collect();
    let (Some(&first), Some(&last)) = (bins.iter().min(), bins.iter().max()) else {
        html.markup("</section>\n");
        return;
    };
    let mut counts = vec![0usize; (last - first + 1) as usize];
    bins.iter().for_each(|bin| counts[(bin - first) as usize] += 1);
    let edge = |bin: i64| 10f64.powf(bin as f64 / STEPS);
    let most = counts.iter().copied().max().unwrap_or(1);
    let limit = tolerance * reference;
    let (low, high) = (edge(first), edge(last + 1));
    let high = if limit > high && limit < 1e4 * high { limit } else { high };
    let (x, y) = (Axis::powers(low, high), Axis::powers(1.0, most.max(10) as f64));
    let labels = ["distance of the two positions", "vertices in a quarter of a power of ten"];
    let mut chart = Chart::new([WIDE, 210.0], "Distribution of the distances", x, y, labels);
    let steps = counts.iter().enumerate().flat_map(|(at, &count)| {
        let bin = first + at as i64;
        // Half a vertex lies on the axis.
        [edge(bin), edge(bin + 1)].map(|x| [x, if count == 0 { 0.5 } else { count as f64 }])
    });
    let ends = [[edge(first), 0.5]].into_iter().chain(steps).chain([[edge(last + 1), 0.5]]);
    chart.curve("line new", ends);
    if limit >= low && limit <= high {
        chart.mark(limit, "tolerance");
    }
    html.picture(chart.svg).markup("</section>\n");
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fails if a vertex without a position is not the first, or if one that is not apart is
    /// listed.
    #[test]
    fn the_furthest_come_first() {
        assert_eq!(furthest(&[0.0, 2.0, f64::NAN, 0.5, 2.0, 0.0]), [2, 1, 4, 3]);
        let many: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(furthest(&many), (80..100).rev().collect::<Vec<_>>());
        assert!(furthest(&[]).is_empty());
    }
}
