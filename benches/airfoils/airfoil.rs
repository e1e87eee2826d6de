//! NACA's airfoils of four digits in closed form, their chord from x = 0 to 1.

use std::f64::consts::PI;

use glam::DVec2;

/// Steps of a side in the curve that distances are measured from: its chords lie within 1e-6 of the
/// airfoil.
const STEPS: usize = 2000;

/// An airfoil.
#[derive(Clone, Copy, Debug)]
pub struct Airfoil {
    /// Largest camber.
    pub camber: f64,
    /// Where it is largest.
    pub place: f64,
    /// Thickness.
    pub thickness: f64,
    /// Thickness of the trailing edge; 0 is sharp.
    pub base: f64,
}

impl Airfoil {
    /// The symmetric airfoil, 12 % thick.
    pub fn naca_0012(base: f64) -> Self {
        Self { camber: 0.0, place: 0.4, thickness: 0.12, base }
    }

    /// The airfoil with 2 % of camber.
    pub fn naca_2412(base: f64) -> Self {
        Self { camber: 0.02, ..Self::naca_0012(base) }
    }

    /// The point at a parameter: -1 and 1 are the lower and the upper end of the trailing edge, 0
    /// is the leading edge.
    pub fn point(&self, parameter: f64) -> DVec2 {
        // The airfoil is a smooth function of the root of x.
        let root = (PI / 2.0 * parameter.abs()).sin();
        let x = root * root;
        let powers = 0.2969 * root - x * (0.1260 + x * (0.3516 - x * (0.2843 - x * 0.1036)));
        let half = 5.0 * self.thickness * powers + self.base / 2.0 * x;
        let Self { camber, place, .. } = *self;
        let (divisor, constant) =
            if x < place { (place * place, 0.0) } else { ((1.0 - place).powi(2), 1.0 - 2.0 * place) };
        let line = camber / divisor * (constant + 2.0 * place * x - x * x);
        let slope = 2.0 * camber / divisor * (place - x);
        let normal = DVec2::new(-slope, 1.0).normalize();
        DVec2::new(x, line) + normal * half.copysign(parameter)
    }

    /// Points from the lower end of the trailing edge over the leading edge to the upper end,
    /// closer where it turns.
    ///
    /// - `steps`: of each side
    pub fn points(&self, steps: usize) -> Vec<DVec2> {
        let steps = steps as i64;
        (-steps..=steps).map(|step| self.point(step as f64 / steps as f64)).collect()
    }
}

/// An airfoil's curve, by arc length.
pub struct Curve {
    airfoil: Airfoil,
    points: Vec<DVec2>,
    arc: Vec<f64>,
}

impl Curve {
    /// The curve of an airfoil.
    pub fn new(airfoil: Airfoil) -> Self {
        let points = airfoil.points(STEPS);
        let mut arc = vec![0.0];
        for pair in points.windows(2) {
            arc.push(arc[arc.len() - 1] + pair[0].distance(pair[1]));
        }
        Self { airfoil, points, arc }
    }

    /// Length from end to end.
    pub fn length(&self) -> f64 {
        self.arc[self.arc.len() - 1]
    }

    /// The point at an arc length, on the airfoil itself.
    pub fn at(&self, arc: f64) -> DVec2 {
        let above = self.arc.partition_point(|&other| other <= arc).clamp(1, self.arc.len() - 1);
        let share = ((arc - self.arc[above - 1]) / (self.arc[above] - self.arc[above - 1])).clamp(0.0, 1.0);
        self.airfoil.point(((above - 1) as f64 + share) / STEPS as f64 - 1.0)
    }

    /// Distance of a point from the curve, its base left out.
    pub fn distance(&self, point: DVec2) -> f64 {
        let to_segment = |pair: &[DVec2]| {
            let (along, from) = (pair[1] - pair[0], point - pair[0]);
            let share = (from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
            from.distance_squared(along * share)
        };
        self.points.windows(2).map(to_segment).fold(f64::INFINITY, f64::min).sqrt()
    }
}
