//! [`Tape`]: numbers with their derivatives by the numbers of which they are made.
//!
//! Each operation writes its result and the derivatives by its arguments on the tape. The product
//! with the derivative of all results is one pass along the tape, and its transpose is one pass
//! back. So both are exact for the operations as they ran, whatever they are.

use glam::DVec3;

/// A number. Its derivatives are on a tape, unless it is a constant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Number {
    pub value: f64,
    place: u32,
}

/// A vector of numbers.
pub(super) type Vector = [Number; 3];

/// The place of constants.
const CONSTANT: u32 = u32::MAX;

/// The derivatives of numbers, in the order in which they were made.
#[derive(Debug)]
pub(super) struct Tape {
    n_inputs: usize,
    /// The end of each number's derivatives `[n_numbers]`.
    ends: Vec<usize>,
    /// Places of the arguments, and the derivatives by them.
    arguments: Vec<(u32, f64)>,
}

/// A constant.
pub(super) fn constant(value: f64) -> Number {
    Number { value, place: CONSTANT }
}

/// A constant vector.
pub(super) fn fixed(value: DVec3) -> Vector {
    value.to_array().map(constant)
}

/// The values of a vector.
pub(super) fn value(vector: Vector) -> DVec3 {
    DVec3::from_array(vector.map(|number| number.value))
}

impl Tape {
    /// A tape that begins with points. The vectors are these points.
    pub fn new(points: &[DVec3]) -> (Self, Vec<Vector>) {
        let n_inputs = 3 * points.len();
        let input = |i: usize, value: DVec3| {
            let numbers = value.to_array();
            std::array::from_fn(|axis| Number { value: numbers[axis], place: (3 * i + axis) as u32 })
        };
        let inputs = points.iter().enumerate().map(|(i, &point)| input(i, point)).collect();
        (Self { n_inputs, ends: vec![0; n_inputs], arguments: Vec::new() }, inputs)
    }

    /// A number with its derivatives by other numbers.
    pub fn number(&mut self, value: f64, by: impl IntoIterator<Item = (Number, f64)>) -> Number {
        let of_numbers = by.into_iter().filter(|(number, _)| number.place != CONSTANT);
        self.arguments.extend(of_numbers.map(|(number, by)| (number.place, by)));
        self.ends.push(self.arguments.len());
        Number { value, place: (self.ends.len() - 1) as u32 }
    }

    /// Changes of some vectors.
    ///
    /// - `change` `[n_points]`: of the points with which the tape begins
    pub fn forward(&self, change: &[DVec3], of: &[Vector]) -> Vec<DVec3> {
        let mut all: Vec<f64> = change.iter().flat_map(DVec3::to_array).collect();
        all.reserve(self.ends.len() - self.n_inputs);
        for place in self.n_inputs..self.ends.len() {
            let own = &self.arguments[self.ends[place - 1]..self.ends[place]];
            all.push(own.iter().map(|&(argument, by)| all[argument as usize] * by).sum());
        }
        let change = |number: Number| if number.place == CONSTANT { 0.0 } else { all[number.place as usize] };
        of.iter().map(|vector| DVec3::from_array(vector.map(change))).collect()
    }

    /// The transpose of [`Self::forward`]: the derivative by the points.
    pub fn reverse(&self, of: &[Vector], by: &[DVec3]) -> Vec<DVec3> {
        let mut all = vec![0.0; self.ends.len()];
        for (number, by) in of.iter().flatten().zip(by.iter().flat_map(DVec3::to_array)) {
            if number.place != CONSTANT {
                all[number.place as usize] += by;
            }
        }
        for place in (self.n_inputs..self.ends.len()).rev() {
            let by_result = all[place];
            for &(argument, by) in &self.arguments[self.ends[place - 1]..self.ends[place]] {
                all[argument as usize] += by * by_result;
            }
        }
        all[..self.n_inputs].chunks_exact(3).map(DVec3::from_slice).collect()
    }

    pub fn add(&mut self, a: Number, b: Number) -> Number {
        self.number(a.value + b.value, [(a, 1.0), (b, 1.0)])
    }

    pub fn sub(&mut self, a: Number, b: Number) -> Number {
        self.number(a.value - b.value, [(a, 1.0), (b, -1.0)])
    }

    pub fn mul(&mut self, a: Number, b: Number) -> Number {
        self.number(a.value * b.value, [(a, b.value), (b, a.value)])
    }

    pub fn div(&mut self, a: Number, b: Number) -> Number {
        let value = a.value / b.value;
        self.number(value, [(a, 1.0 / b.value), (b, -value / b.value)])
    }

    /// A sum of numbers times constants.
    pub fn sum(&mut self, terms: &[(Number, f64)]) -> Number {
        self.number(terms.iter().map(|(number, by)| number.value * by).sum(), terms.iter().copied())
    }

    /// A sum of vectors times constants.
    pub fn sum_of(&mut self, terms: &[(Vector, f64)]) -> Vector {
        std::array::from_fn(|axis| {
            let of_axis = terms.iter().map(|&(vector, by)| (vector[axis], by));
            self.number(of_axis.clone().map(|(number, by)| number.value * by).sum(), of_axis)
        })
    }

    /// The point between two others. The share is a number too.
    pub fn lerp(&mut self, a: Vector, b: Vector, share: Number) -> Vector {
        let t = share.value;
        std::array::from_fn(|axis| {
            let (a, b) = (a[axis], b[axis]);
            self.number(a.value * (1.0 - t) + b.value * t, [(a, 1.0 - t), (b, t), (share, b.value - a.value)])
        })
    }

    pub fn scaled(&mut self, a: Vector, by: Number) -> Vector {
        a.map(|number| self.mul(number, by))
    }

    pub fn dot(&mut self, a: Vector, b: Vector) -> Number {
        let by = (0..3).flat_map(|axis| [(a[axis], b[axis].value), (b[axis], a[axis].value)]);
        self.number(value(a).dot(value(b)), by)
    }

    pub fn cross(&mut self, a: Vector, b: Vector) -> Vector {
        std::array::from_fn(|axis| {
            let (i, j) = ((axis + 1) % 3, (axis + 2) % 3);
            let by = [(a[i], b[j].value), (b[j], a[i].value), (a[j], -b[i].value), (b[i], -a[j].value)];
            self.number(a[i].value * b[j].value - a[j].value * b[i].value, by)
        })
    }

    /// `start` and the distance between two points.
    pub fn farther(&mut self, start: Number, a: Vector, b: Vector) -> Number {
        let way = value(b) - value(a);
        let unit = way.normalize_or_zero().to_array();
        let by = (0..3).flat_map(|axis| [(b[axis], unit[axis]), (a[axis], -unit[axis])]);
        self.number(start.value + way.length(), by.chain([(start, 1.0)]))
    }

    /// The unit vector along a vector.
    pub fn unit(&mut self, a: Vector) -> Vector {
        let (unit, length) = (value(a).normalize_or_zero().to_array(), value(a).length());
        std::array::from_fn(|axis| {
            let by = |other: usize| (f64::from(u8::from(other == axis)) - unit[axis] * unit[other]) / length;
            let by = (0..3).map(|other| (a[other], if length > 0.0 { by(other) } else { 0.0 }));
            self.number(unit[axis], by)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All operations, and differences of what they make.
    #[test]
    fn operations_have_their_derivatives() {
        let points = [DVec3::new(1.0, 2.0, -0.5), DVec3::new(0.3, -1.0, 0.7), DVec3::new(-2.0, 0.4, 1.1)];
        let make = |points: &[DVec3]| {
            let (mut tape, at) = Tape::new(points);
            let [a, b, c] = [at[0], at[1], at[2]];
            let (cross, unit) = (tape.cross(a, b), tape.unit(c));
            let (dot, length) = (tape.dot(a, cross), tape.farther(a[0], b, c));
            let dot = tape.add(dot, b[1]);
            let ratio = tape.div(length, a[1]);
            let less = tape.sub(dot, ratio);
            let product = tape.mul(less, c[2]);
            let share = tape.sum(&[(product, 0.1), (a[2], 2.0), (constant(3.0), 1.0)]);
            let between = tape.lerp(a, unit, share);
            let end = tape.scaled(between, ratio);
            let end = tape.sum_of(&[(end, 0.5), (b, -2.0), (fixed(DVec3::ONE), 1.0)]);
            (tape, vec![end, cross])
        };
        let (tape, ends) = make(&points);
        let direction = [DVec3::new(0.2, 0.5, -1.0), DVec3::new(1.0, -0.3, 0.4), DVec3::new(-0.6, 0.9, 0.1)];
        let change = tape.forward(&direction, &ends);
        let h = 1e-6;
        let at = |h: f64| {
            let moved: Vec<DVec3> = points.iter().zip(direction).map(|(point, by)| *point + by * h).collect();
            make(&moved).1.into_iter().map(value).collect::<Vec<_>>()
        };
        for ((plus, minus), change) in at(h).into_iter().zip(at(-h)).zip(&change) {
            let difference = (plus - minus) / (2.0 * h);
            assert!(difference.distance(*change) < 1e-8 * change.length(), "{difference} instead of {change}");
        }
        let seed = [DVec3::new(0.7, -0.2, 1.3), DVec3::new(0.1, 2.0, -0.4)];
        let gradient = tape.reverse(&ends, &seed);
        let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        assert!((dot(&seed, &change) - dot(&gradient, &direction)).abs() < 1e-13 * dot(&change, &change));
    }
}
