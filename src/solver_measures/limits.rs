//! [`Limits`]: the values that the measures of a moved mesh may have.
//!
//! [`LIMITS`] is the table of all limits. A limit is a largest value, or a smallest value where
//! small values are bad; the limit itself is allowed.

use glam::DVec3;
use thiserror::Error;

use super::{SolverMeasures, Tally, tally::Bad};
use crate::mesh::{HybridMesh, middle_of_cell};
use crate::text::figures::{Shortest, place};
use crate::text::nearest::{did_you_mean, quoted_list};

/// What a limit is for. The order is that of [`LIMITS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Limited {
    NonOrthogonality,
    Skewness,
    AspectRatio,
    #[expect(dead_code, reason = "the limit is one of a number, which no tally has")]
    FacePyramids,
    DualOrthogonality,
    DualAspectRatio,
    DualVolumeRatio,
}

/// A limit that can be given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitRow {
    /// The name in a case file.
    pub name: &'static str,
    /// The measure in words.
    pub words: &'static str,
    /// What the worst value is called: largest or smallest.
    pub worst: &'static str,
    /// What is counted beyond the limit.
    pub counted: &'static str,
    /// Whether the places are vertices; otherwise they are cells.
    pub at_vertices: bool,
    /// The values that a limit may have.
    pub expected: &'static str,
    range: [f64; 2],
    bad: Bad,
    /// The value beyond which OpenFOAM's `checkMesh` fails.
    openfoam: Option<f64>,
}

/// All limits.
pub const LIMITS: [LimitRow; 7] = [
    LimitRow {
        name: "non_orthogonality",
        words: "non-orthogonality in degrees",
        worst: "largest",
        counted: "faces",
        at_vertices: false,
        expected: "degrees, from 0 to 180",
        range: [0.0, 180.0],
        bad: Bad::Large,
        openfoam: Some(90.0),
    },
    LimitRow {
        name: "skewness",
        words: "skewness",
        worst: "largest",
        counted: "faces",
        at_vertices: false,
        expected: "a number from 0 on",
        range: [0.0, f64::MAX],
        bad: Bad::Large,
        openfoam: Some(4.0),
    },
    LimitRow {
        name: "aspect_ratio",
        words: "aspect ratio",
        worst: "largest",
        counted: "cells",
        at_vertices: false,
        expected: "a number from 1 on",
        range: [1.0, f64::MAX],
        bad: Bad::Large,
        openfoam: Some(1000.0),
    },
    LimitRow {
        name: "face_pyramids",
        words: "number of wrong face pyramids",
        worst: "",
        counted: "face pyramids",
        at_vertices: false,
        expected: "a number of face pyramids from 0 on",
        range: [0.0, f64::MAX],
        bad: Bad::Large,
        openfoam: Some(0.0),
    },
    LimitRow {
        name: "dual_orthogonality",
        words: "orthogonality of dual volumes in degrees",
        worst: "smallest",
        counted: "vertices",
        at_vertices: true,
        expected: "degrees, from 0 to 90",
        range: [0.0, 90.0],
        bad: Bad::Small,
        openfoam: None,
    },
    LimitRow {
        name: "dual_aspect_ratio",
        words: "aspect ratio of dual volumes",
        worst: "largest",
        counted: "vertices",
        at_vertices: true,
        expected: "a number from 1 on",
        range: [1.0, f64::MAX],
        bad: Bad::Large,
        openfoam: None,
    },
    LimitRow {
        name: "dual_volume_ratio",
        words: "volume ratio of dual volumes",
        worst: "largest",
        counted: "vertices",
        at_vertices: true,
        expected: "a number from 1 on",
        range: [1.0, f64::MAX],
        bad: Bad::Large,
        openfoam: None,
    },
];

/// A limit that means nothing.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LimitError {
    /// No measure has this name.
    #[error("no limit has the name `{name}`, expected {}{}", quoted_list(&names()),
        did_you_mean(name, &names()).unwrap_or_default())]
    Unknown {
        /// The name that was given.
        name: String,
    },
    /// The value is none that the measure can have.
    #[error("the limit `{name}` is {value}, expected {expected}")]
    OutOfRange {
        /// The limit.
        name: &'static str,
        /// The value that was given.
        value: f64,
        /// The values that the limit may have.
        expected: &'static str,
    },
}

/// The names of all limits.
fn names() -> [&'static str; LIMITS.len()] {
    LIMITS.map(|row| row.name)
}

/// A measure beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exceeded {
    /// The limit's row in [`LIMITS`].
    pub row: &'static LimitRow,
    /// The limit.
    pub limit: f64,
    /// The worst value of the measure, or the number of wrong face pyramids.
    pub value: f64,
    /// Number of places beyond the limit.
    pub count: usize,
    /// The worst place: the number of a cell or of a vertex.
    pub place: Option<u32>,
}

impl Exceeded {
    /// The measure, its limit and its worst place in words.
    ///
    /// - `vertices` `[n_vertices]`: positions, in the mesh's unit
    pub fn text(&self, mesh: HybridMesh, vertices: &[DVec3]) -> String {
        let Self { row, limit, value, count, .. } = self;
        let [value, limit] = apart(*value, *limit).map(Shortest);
        let worst = self
            .worst(mesh, vertices)
            .map_or(String::new(), |(name, at)| format!(", the worst at {name}, at {}", place(at.map(short))));
        match row.worst {
            "" => format!("the {} is {value}, beyond the limit {limit}{worst}", row.words),
            which => {
                // The worst is one of those that are counted.
                let of = if *count > 1 { format!(", as that of {count} {}", row.counted) } else { String::new() };
                format!("the {which} {} is {value}, beyond the limit {limit}{of}{worst}", row.words)
            }
        }
    }

    /// The worst cell or vertex in words, and its position: the mean of the cell's vertices, or the
    /// vertex.
    pub fn worst(&self, mesh: HybridMesh, vertices: &[DVec3]) -> Option<(String, DVec3)> {
        let place = self.place? as usize;
        if self.row.at_vertices {
            return Some((format!("vertex {place}"), vertices[place]));
        }
        let name = mesh.name(place);
        Some((name.to_string(), middle_of_cell(mesh.cell(name), vertices)))
    }
}

/// Two different figures with six significant digits, or with as many more as tell them apart.
fn apart(a: f64, b: f64) -> [f64; 2] {
    let rounded = |digits: usize| [a, b].map(|x| format!("{x:.digits$e}").parse().unwrap_or(x));
    (5..17).map(rounded).find(|[a, b]| a != b).unwrap_or([a, b])
}

/// A figure with six significant digits.
fn short(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// Limits on the measures of a moved mesh. By default there are none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits([Option<f64>; LIMITS.len()]);

impl Limits {
    /// The limits of OpenFOAM's `checkMesh`: beyond them the mesh is not "Mesh OK".
    pub fn openfoam() -> Self {
        Self(LIMITS.map(|row| row.openfoam))
    }

    /// Whether there are no limits.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Option::is_none)
    }

    /// Sets a limit.
    ///
    /// # Errors
    /// No limit has this name, or the value means nothing.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), LimitError> {
        let Some(place) = LIMITS.iter().position(|row| row.name == name) else {
            return Err(LimitError::Unknown { name: name.to_owned() });
        };
        let LimitRow { name, range: [least, most], expected, .. } = LIMITS[place];
        if !(least..=most).contains(&value) {
            return Err(LimitError::OutOfRange { name, value, expected });
        }
        self.0[place] = Some(value);
        Ok(())
    }

    /// The limits that are set, with their rows.
    pub fn all(&self) -> impl Iterator<Item = (&'static LimitRow, f64)> {
        LIMITS.iter().zip(self.0).filter_map(|(row, limit)| Some((row, limit?)))
    }

    /// An empty tally of a measure.
    pub(super) fn tally(&self, of: Limited) -> Tally {
        Tally::new(LIMITS[of as usize].bad, self.0[of as usize])
    }

    /// The measures beyond their limits, in the order of [`LIMITS`].
    ///
    /// - `measures`: taken with these limits
    pub fn exceeded(&self, measures: &SolverMeasures) -> Vec<Exceeded> {
        let all = LIMITS.iter().zip(self.0).zip(measures.limited());
        let exceeded = all.filter_map(|((row, limit), (value, count, place))| {
            let limit = limit?;
            row.bad.is_worse(value, limit).then_some(Exceeded { row, limit, value, count, place })
        });
        exceeded.collect()
    }
}

impl SolverMeasures {
    /// Value, number beyond the limit and worst place of each measure that can be limited, in the
    /// order of [`LIMITS`].
    fn limited(&self) -> [(f64, usize, Option<u32>); LIMITS.len()] {
        let Self { openfoam, su2 } = self;
        let of = |tally: &Tally| (tally.worst, tally.beyond, tally.place);
        let pyramids = openfoam.pyramids;
        [
            of(&openfoam.non_orthogonality),
            of(&openfoam.skewness),
            of(&openfoam.aspect_ratio),
            (pyramids.beyond as f64, pyramids.beyond, pyramids.place),
            of(&su2.orthogonality),
            of(&su2.aspect_ratio),
            of(&su2.volume_ratio),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_beyond_its_limit_differs_from_it_in_words() {
        assert_eq!(apart(70.123456, 65.0), [70.1235, 65.0]);
        assert_eq!(apart(61.58012345, 61.58009), [61.58012, 61.58009]);
        let next = f64::from_bits(61.5801f64.to_bits() + 1);
        assert_eq!(apart(next, 61.5801), [next, 61.5801]);
    }
}
