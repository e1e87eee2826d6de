//! [`Tally`]: the worst value of a measure, where it is, and how many values lie beyond a limit.

/// The side on which a value of a measure is bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bad {
    /// Large values are bad, and a limit is a largest value.
    Large,
    /// Small values are bad, and a limit is a smallest value.
    Small,
}

impl Bad {
    /// Whether one value is worse than another. A value that is not a number is the worst.
    pub fn is_worse(self, value: f64, than: f64) -> bool {
        match self {
            _ if value.is_nan() => !than.is_nan(),
            Self::Large => value > than,
            Self::Small => value < than,
        }
    }
}

/// The worst value of a measure over a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally {
    bad: Bad,
    limit: Option<f64>,
    /// The worst value; NaN if a value is not a number. Infinite if there is no value.
    pub worst: f64,
    /// The place of a worst value: the number of a cell in the order of
    /// [`HybridMesh`](crate::mesh::HybridMesh), or of a vertex. Of equal values the first in the
    /// order of [`Connections`](super::Connections) counts. `None` if there is no value.
    pub place: Option<u32>,
    /// Number of values beyond the limit. 0 without a limit.
    pub beyond: usize,
}

impl Tally {
    /// A tally without values.
    pub(super) fn new(bad: Bad, limit: Option<f64>) -> Self {
        let worst = if bad == Bad::Large { f64::NEG_INFINITY } else { f64::INFINITY };
        Self { bad, limit, worst, place: None, beyond: 0 }
    }

    /// Adds a value.
    pub(super) fn add(&mut self, value: f64, place: u32) {
        if self.place.is_none() || self.bad.is_worse(value, self.worst) {
            (self.worst, self.place) = (value, Some(place));
        }
        self.beyond += usize::from(self.limit.is_some_and(|limit| self.bad.is_worse(value, limit)));
    }

    /// Adds the values of another tally, which come after the own ones.
    pub(super) fn join(&mut self, other: &Self) {
        if other.place.is_some() && (self.place.is_none() || self.bad.is_worse(other.worst, self.worst)) {
            (self.worst, self.place) = (other.worst, other.place);
        }
        self.beyond += other.beyond;
    }

    /// The limit, if there is one.
    pub(super) fn limit(&self) -> Option<f64> {
        self.limit
    }

    /// Gives the place the name that it has in another order.
    pub(super) fn rename(&mut self, name: impl Fn(u32) -> u32) {
        self.place = self.place.map(name);
    }

    /// The worst value; NaN if there is none.
    pub fn value(&self) -> f64 {
        if self.place.is_some() { self.worst } else { f64::NAN }
    }
}
