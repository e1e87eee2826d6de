//! [`FillingChange`]: the derivative of the points that close a hole, and the transpose.
//!
//! The lattice of the new points lies in the chart of the rim, so it goes, turns and scales with
//! the rim. Within the chart it grows with the rim's median edge, and the spline follows its
//! samples: their places and their heights.
//!
//! Which samples count and which points of the lattice lie inside are choices. Where one changes,
//! the patch jumps by the error of the spline and by the sag of its facets, which no derivative
//! shows.

use glam::{DVec2, DVec3};
use nalgebra::DMatrix;

use super::{Chart, ContinuationError, LEAST_SPACING, Patch, Sample, Spline, TERMS, kernel, middle_edge, quadratic};

/// The axes of a rim are known if its extents differ by more than this fraction of them. Those of a
/// rounder rim turn at will, and their turn counts as none.
const ROUND: f64 = 1e-6;

/// The derivative of the points of [`super::close`].
#[derive(Debug)]
pub struct FillingChange {
    rim: Vec<u32>,
    chart: Chart,
    /// The vertices of the rim, from the origin of the chart `[n_rim]`.
    offsets: Vec<DVec3>,
    /// One over twice the area of the rim; below 0 where the rim runs clockwise about the normal.
    per_area: f64,
    /// One over the difference of the extents along the axes; zero for a round rim.
    per_difference: f64,
    /// The vertex of the rim that gives its size.
    farthest: usize,
    /// The samples, each with its offset from the origin of the chart.
    samples: Vec<(DVec3, Sample)>,
    spline: Spline,
    /// The height of each new point in the chart by the place of each sample, and by its height as
    /// z.
    by_samples: Vec<DVec3>,
    /// The new points in the chart, and their offsets from its origin.
    lattice: Vec<(DVec2, DVec3)>,
    /// The ends of the edge of the rim whose length is the distance of the new points, by their
    /// places in the rim. `None` if their distance is the least one.
    edge: Option<[usize; 2]>,
}

/// A change of a chart, or a derivative by it.
#[derive(Clone, Copy, Default)]
struct ChartChange {
    origin: DVec3,
    /// Rotation vector of the axes.
    turn: DVec3,
    /// As a fraction of the size.
    scale: f64,
}

impl FillingChange {
    /// The derivative at these points.
    ///
    /// - arguments: as for [`super::close`]
    ///
    /// # Errors
    /// As for [`super::close`].
    pub fn new(points: &[DVec3], triangles: &[[u32; 3]], rim: &[u32]) -> Result<Self, ContinuationError> {
        let Patch { chart, samples, spline, inside, .. } = Patch::new(points, triangles, rim)?;
        let offset = |point: u32| points[point as usize] - chart.origin;
        let offsets: Vec<DVec3> = rim.iter().map(|&vertex| offset(vertex)).collect();
        let extent = |axis: DVec3| offsets.iter().map(|offset| offset.dot(axis).powi(2)).sum::<f64>();
        let [long, short] = [chart.axes[0], chart.axes[1]].map(extent);
        let is_round = (long - short).abs() <= ROUND * (long + short);
        let area = area(&offsets).dot(chart.axes[2]);
        if area == 0.0 {
            return Err(ContinuationError::Undetermined { at: points[rim[0] as usize] });
        }
        let by_samples = spline
            .by_samples(&samples, &inside)
            .ok_or(ContinuationError::Undetermined { at: points[rim[0] as usize] })?;
        let polygon: Vec<DVec2> = rim.iter().map(|&vertex| chart.flat(points[vertex as usize])).collect();
        let middle = middle_edge(&polygon);
        let ends = |k: usize| [k, (k + 1) % rim.len()];
        let is_middle = |&[a, b]: &[usize; 2]| polygon[a].distance(polygon[b]) == middle;
        let edge = (0..rim.len()).map(ends).find(is_middle).filter(|_| middle > LEAST_SPACING);
        let farthest = (0..rim.len()).max_by(|&a, &b| offsets[a].length().total_cmp(&offsets[b].length()));
        let lattice = inside.into_iter().map(|flat| (flat, chart.lift(flat, spline.height(flat)) - chart.origin));
        Ok(Self {
            rim: rim.to_vec(),
            per_area: 1.0 / area,
            per_difference: if is_round { 0.0 } else { 1.0 / (long - short) },
            farthest: farthest.unwrap_or(0),
            lattice: lattice.collect(),
            samples: samples.into_iter().map(|sample| (offset(sample.point), sample)).collect(),
            offsets,
            chart,
            spline,
            edge,
            by_samples,
        })
    }

    /// Number of the new points.
    pub fn n_points(&self) -> usize {
        self.lattice.len()
    }

    /// Change of the new points.
    ///
    /// - `changes` `[n_points]`: of the points of the surface
    pub fn forward(&self, changes: &[DVec3]) -> Vec<DVec3> {
        let chart = self.chart_forward(changes);
        let Chart { axes, size, .. } = self.chart;
        let of_place = |point: u32, offset: DVec3| self.place_forward(&chart, offset, changes[point as usize]);
        let of_samples = self.samples.iter().map(|(offset, sample)| of_place(sample.point, *offset));
        let of_samples: Vec<DVec3> = of_samples.collect();
        let by_samples = self.by_samples.chunks(of_samples.len());
        let heights = by_samples.map(|by| by.iter().zip(&of_samples).map(|(by, of)| by.dot(*of)).sum::<f64>());
        let growth = self.edge.map_or(0.0, |[a, b]| {
            let [from, to] = [a, b].map(|k| of_place(self.rim[k], self.offsets[k]).truncate());
            self.per_edge([a, b]).dot(to - from)
        });
        let of_point = |(&(flat, offset), height): (&(DVec2, DVec3), f64)| {
            let along = (flat * growth).extend(height + self.spline.slope(flat).dot(flat * growth));
            let along = axes[0] * along.x + axes[1] * along.y + axes[2] * along.z;
            chart.origin + chart.turn.cross(offset) + offset * chart.scale + along * size
        };
        self.lattice.iter().zip(heights).map(of_point).collect()
    }

    /// The transpose of [`Self::forward`].
    ///
    /// - `by_new`: derivative of a number by the new points
    /// - `gradient` `[n_points]`: by the points of the surface, to which the part of the new points
    ///   is added
    pub fn reverse(&self, by_new: &[DVec3], gradient: &mut [DVec3]) {
        let Chart { axes, size, .. } = self.chart;
        let mut by_chart = ChartChange::default();
        let mut by_growth = 0.0;
        for (&(flat, offset), &by_point) in self.lattice.iter().zip(by_new) {
            by_chart.origin += by_point;
            by_chart.turn += offset.cross(by_point);
            by_chart.scale += offset.dot(by_point);
            let along = flat.extend(self.spline.slope(flat).dot(flat));
            by_growth += DVec3::from(axes.map(|axis| axis.dot(by_point))).dot(along) * size;
        }
        let mut by_places = vec![DVec3::ZERO; self.samples.len()];
        for (by_point, by_samples) in by_new.iter().zip(self.by_samples.chunks(self.samples.len())) {
            let by_height = size * axes[2].dot(*by_point);
            by_places.iter_mut().zip(by_samples).for_each(|(by_place, by)| *by_place += *by * by_height);
        }
        for ((offset, sample), by_place) in self.samples.iter().zip(by_places) {
            gradient[sample.point as usize] += self.place_reverse(&mut by_chart, *offset, by_place);
        }
        if let Some([a, b]) = self.edge {
            let by_end = (self.per_edge([a, b]) * by_growth).extend(0.0);
            for (k, by_place) in [(a, -by_end), (b, by_end)] {
                gradient[self.rim[k] as usize] += self.place_reverse(&mut by_chart, self.offsets[k], by_place);
            }
        }
        self.chart_reverse(by_chart, gradient);
    }

    /// Change of the place of a point in the chart, with its height as z.
    ///
    /// - `offset`: of the point from the origin of the chart
    fn place_forward(&self, chart: &ChartChange, offset: DVec3, change: DVec3) -> DVec3 {
        let shift = change - chart.origin - chart.turn.cross(offset) - offset * chart.scale;
        DVec3::from(self.chart.axes.map(|axis| axis.dot(shift))) / self.chart.size
    }

    /// The transpose of [`Self::place_forward`]: the derivative by the point. That by the chart is
    /// added.
    fn place_reverse(&self, by_chart: &mut ChartChange, offset: DVec3, by_place: DVec3) -> DVec3 {
        let axes = self.chart.axes;
        let by_shift = (axes[0] * by_place.x + axes[1] * by_place.y + axes[2] * by_place.z) / self.chart.size;
        by_chart.origin -= by_shift;
        by_chart.turn -= offset.cross(by_shift);
        by_chart.scale -= offset.dot(by_shift);
        by_shift
    }

    /// Relative growth of an edge of the rim in the chart, by the shift of its second end.
    fn per_edge(&self, [a, b]: [usize; 2]) -> DVec2 {
        let [a, b] = [a, b].map(|k| DVec3::from(self.place(k)).truncate() / self.chart.size);
        (b - a) / (b - a).length_squared()
    }

    fn chart_forward(&self, changes: &[DVec3]) -> ChartChange {
        let n = self.rim.len();
        let [along, across, normal] = self.chart.axes;
        let origin = self.rim.iter().map(|&vertex| changes[vertex as usize]).sum::<DVec3>() / n as f64;
        let shift = |k: usize| changes[self.rim[k] as usize] - origin;
        let area = (0..n).map(|k| shift(k).cross(self.chord(k))).sum::<DVec3>();
        let tilt = area.reject_from_normalized(normal) * self.per_area;
        let product = |k: usize| {
            let [x, y, z] = self.place(k);
            let [dx, dy] = [along, across].map(|axis| shift(k).dot(axis) - z * axis.dot(tilt));
            dx * y + x * dy
        };
        let spin = (0..n).map(product).sum::<f64>() * self.per_difference;
        let far = self.offsets[self.farthest];
        let scale = far.dot(shift(self.farthest)) / far.length_squared();
        ChartChange { origin, turn: normal.cross(tilt) + normal * spin, scale }
    }

    fn chart_reverse(&self, by_chart: ChartChange, gradient: &mut [DVec3]) {
        let n = self.rim.len();
        let [along, across, normal] = self.chart.axes;
        let by_product = by_chart.turn.dot(normal) * self.per_difference;
        let mut by_tilt = by_chart.turn.cross(normal);
        let mut by_shift = vec![DVec3::ZERO; n];
        for (k, by_shift) in by_shift.iter_mut().enumerate() {
            let [x, y, z] = self.place(k);
            let by_place = (along * y + across * x) * by_product;
            *by_shift += by_place;
            by_tilt -= by_place * z;
        }
        let by_area = by_tilt.reject_from_normalized(normal) * self.per_area;
        for (k, by_shift) in by_shift.iter_mut().enumerate() {
            *by_shift += self.chord(k).cross(by_area);
        }
        let far = self.offsets[self.farthest];
        by_shift[self.farthest] += far * (by_chart.scale / far.length_squared());
        let by_origin = (by_chart.origin - by_shift.iter().sum::<DVec3>()) / n as f64;
        for (&vertex, by_shift) in self.rim.iter().zip(by_shift) {
            gradient[vertex as usize] += by_shift + by_origin;
        }
    }

    /// A vertex of the rim, along the axes of the chart.
    fn place(&self, k: usize) -> [f64; 3] {
        self.chart.axes.map(|axis| axis.dot(self.offsets[k]))
    }

    /// From the vertex of the rim before `k` to the one after it.
    fn chord(&self, k: usize) -> DVec3 {
        let n = self.offsets.len();
        self.offsets[(k + 1) % n] - self.offsets[(k + n - 1) % n]
    }
}

/// The area vector of a closed curve, twice its area long.
///
/// - `offsets`: its vertices
fn area(offsets: &[DVec3]) -> DVec3 {
    (0..offsets.len()).map(|k| offsets[k].cross(offsets[(k + 1) % offsets.len()])).sum()
}

impl Spline {
    /// The derivatives of the heights at some points by the place of each sample, and by its height
    /// as z, one row after the other. `None` if the matrix has no inverse.
    ///
    /// The coefficients are large and of both signs, and the heights are not. So the derivatives by
    /// them are put together here, once for both products.
    fn by_samples(&self, samples: &[Sample], at: &[DVec2]) -> Option<Vec<DVec3>> {
        let n = samples.len();
        let centre = |j: usize| self.centres[j];
        // The coefficients' shares in the heights, times the inverse.
        let share = |row: usize, k: usize| match row.checked_sub(n) {
            None => kernel(at[k].distance_squared(centre(row))),
            Some(term) => quadratic(at[k])[term],
        };
        let shares = Self::matrix(samples).lu().solve(&DMatrix::from_fn(n + TERMS, at.len(), share))?;
        // How the equations change with the centre of each sample, over its coefficient.
        let equation = |row: usize, j: usize| match row.checked_sub(n) {
            None => kernel_slope(centre(row) - centre(j)),
            Some(term) => -quadratic_slopes(centre(j))[term],
        };
        let along = DMatrix::from_fn(n, n + TERMS, |j, row| equation(row, j).x) * &shares;
        let across = DMatrix::from_fn(n, n + TERMS, |j, row| equation(row, j).y) * &shares;
        let slopes: Vec<DVec2> = (0..n).map(|j| self.slope(centre(j))).collect();
        let derivative = |k: usize, j: usize| {
            let of_centre = DVec2::new(along[(j, k)], across[(j, k)]) - kernel_slope(at[k] - centre(j));
            let height = shares[(j, k)];
            (of_centre * self.coefficients[j] - slopes[j] * height).extend(height)
        };
        Some((0..at.len()).flat_map(|k| (0..n).map(move |j| (k, j))).map(|(k, j)| derivative(k, j)).collect())
    }

    /// Slope of the height.
    fn slope(&self, at: DVec2) -> DVec2 {
        let n = self.centres.len();
        let pairs = self.centres.iter().zip(&self.coefficients);
        let bent: DVec2 = pairs.map(|(&centre, &weight)| kernel_slope(at - centre) * weight).sum();
        let terms = quadratic_slopes(at).into_iter().zip(&self.coefficients[n..]);
        bent + terms.map(|(slope, &weight)| slope * weight).sum::<DVec2>()
    }
}

/// Slopes of [`quadratic`].
fn quadratic_slopes(p: DVec2) -> [DVec2; TERMS] {
    [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (2.0 * p.x, 0.0), (p.y, p.x), (0.0, 2.0 * p.y)].map(DVec2::from)
}

/// Slope of [`kernel`] by the vector whose squared length it takes.
fn kernel_slope(by: DVec2) -> DVec2 {
    let square = by.length_squared();
    if square > 0.0 { by * (square * (2.0 * square.ln() + 1.0)) } else { DVec2::ZERO }
}

#[cfg(test)]
mod tests {
    use super::super::close;
    use super::*;
    use crate::projection::tests::{dot, lattice, noise};

    /// Central differences of the filling itself, the rim one way round and the other.
    ///
    /// Fails if the chart does not shift, turn, spin or scale, if the lattice does not grow, or if
    /// places of samples count for nothing.
    #[test]
    fn new_points_follow_the_surface() {
        let (points, triangles, mut rim) = lattice(|x, y| (2.0 * x).sin() * (0.4 + y) - 0.5 * y * y);
        for _ in 0..2 {
            rim.reverse();
            let change = FillingChange::new(&points, &triangles, &rim).unwrap();
            let all: Vec<DVec3> = (0..points.len()).map(noise).collect();
            // Only the rim, and only the surface around it.
            let on_rim = |k: usize| rim.contains(&(k as u32));
            let parts = [true, false].map(|is_rim| {
                (0..points.len()).map(|k| if on_rim(k) == is_rim { all[k] } else { DVec3::ZERO }).collect::<Vec<_>>()
            });
            for changes in parts.iter().chain([&all]) {
                let h = 1e-5;
                let filled = |h: f64| {
                    let moved: Vec<DVec3> = points.iter().zip(changes).map(|(at, by)| *at + *by * h).collect();
                    close(&moved, &triangles, &rim).unwrap().points
                };
                let found = change.forward(changes);
                assert!(found.len() > 4 && found.len() == change.n_points());
                let size = dot(&found, &found).sqrt();
                for ((plus, minus), found) in filled(h).into_iter().zip(filled(-h)).zip(&found) {
                    let expected = (plus - minus) / (2.0 * h);
                    assert!(found.distance(expected) < 1e-6 * size, "{found} instead of {expected}");
                }
            }
            let seed: Vec<DVec3> = (0..change.n_points()).map(|k| noise(k + 500)).collect();
            let mut gradient = vec![DVec3::ZERO; points.len()];
            change.reverse(&seed, &mut gradient);
            let (one, other) = (dot(&seed, &change.forward(&all)), dot(&gradient, &all));
            assert!((one - other).abs() < 1e-12 * one.abs().max(1.0), "{one} {other}");
        }
    }

    /// Fails if the chart does not scale. The filling does not tell: the lattice's distance is that
    /// of an edge of the rim, but for very fine rims.
    #[test]
    fn a_chart_follows_its_rim() {
        let (points, triangles, rim) = lattice(|x, y| (2.0 * x).sin() * (0.4 + y) - 0.5 * y * y);
        let changes: Vec<DVec3> = (0..points.len()).map(noise).collect();
        let chart = |h: f64| {
            let moved: Vec<DVec3> = points.iter().zip(&changes).map(|(at, by)| *at + *by * h).collect();
            let on_rim: Vec<DVec3> = rim.iter().map(|&vertex| moved[vertex as usize]).collect();
            Chart::new(&on_rim, &moved, &triangles, &rim)
        };
        let change = FillingChange::new(&points, &triangles, &rim).unwrap();
        let found = change.chart_forward(&changes);
        let h = 1e-6;
        let [plus, minus] = [h, -h].map(chart);
        let near = |found: DVec3, expected: DVec3| assert!(found.distance(expected) < 1e-8, "{found} {expected}");
        near(found.origin, (plus.origin - minus.origin) / (2.0 * h));
        for (axis, own) in change.chart.axes.into_iter().enumerate() {
            near(found.turn.cross(own), (plus.axes[axis] - minus.axes[axis]) / (2.0 * h));
        }
        let scale = (plus.size - minus.size) / (2.0 * h) / change.chart.size;
        assert!((found.scale - scale).abs() < 1e-8, "{} {scale}", found.scale);
    }
}
