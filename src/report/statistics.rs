//! Smallest, largest and mean beta, and how many tets are inverted.

/// Statistics of the beta of some tets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BetaStatistics {
    /// Smallest; NaN if any beta is NaN or there are none.
    pub min: f64,
    /// Largest; NaN if any beta is NaN or there are none.
    pub max: f64,
    /// Arithmetic mean; NaN if any beta is NaN or there are none.
    pub mean: f64,
    /// How many are not positive: zero, negative or NaN.
    pub inverted: usize,
}

impl BetaStatistics {
    /// Statistics of `beta` `[n_tets]`; the sum runs in order, so the same values give the same bits.
    pub fn of(beta: &[f64]) -> Self {
        let mut sum = 0.0;
        let (mut min, mut max) = (f64::NAN, f64::NAN);
        let mut inverted = 0;
        for (index, &value) in beta.iter().enumerate() {
            sum += value;
            // Plain comparisons would drop a NaN that is not the first value.
            min = if index == 0 || value.is_nan() || value < min { value } else { min };
            max = if index == 0 || value.is_nan() || value > max { value } else { max };
            inverted += usize::from(value.is_nan() || value <= 0.0);
        }
        if sum.is_nan() {
            (min, max) = (f64::NAN, f64::NAN);
        }
        Self { min, max, mean: sum / beta.len() as f64, inverted }
    }
}
