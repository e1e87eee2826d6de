//! [`Remark`]: what is odd about new profiles that are not refused.

use std::fmt;

use crate::text::figures::length;

/// A remark on a new profile that may not be what was meant. Lengths are in the mesh's unit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Remark {
    /// The chord of the new profile points the other way.
    Reversed {
        /// Number of the profile.
        profile: i64,
        /// Angle between the old and the new chord, in degrees.
        degrees: f64,
    },
    /// A section moves far along the span.
    AlongSpan {
        /// Number of the profile.
        profile: i64,
        /// Place of the old and of the new profile along the span.
        places: [f64; 2],
        /// The places between which the wing reached along the span.
        wing: [f64; 2],
    },
    /// The new trailing edge is much thinner than the old one.
    Thin {
        /// Number of the profile.
        profile: i64,
        /// Thickness of the old trailing edge.
        old: f64,
        /// Thickness of the new trailing edge.
        new: f64,
    },
    /// The new trailing edge has a thickness, and the mesh's is sharp.
    Open {
        /// Number of the profile.
        profile: i64,
        /// Thickness of the new trailing edge.
        gap: f64,
    },
    /// One profile alone says how a wing changes that is not the same all along the span.
    Alone {
        /// Number of the profile.
        profile: i64,
        /// Largest distance of the wing from the profile's plane.
        reach: f64,
        /// Length of the profile, about its chord.
        chord: f64,
    },
}

impl Remark {
    /// Whether the remark names a fault that may be the cause of an invalid mesh.
    pub fn is_suspect(&self) -> bool {
        !matches!(self, Self::Alone { .. })
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Reversed { profile, degrees } => write!(
                f,
                "the chord of the new profile {profile} points the other way, {degrees:.0} degrees from the old one: the section \
                 was turned over so; or does its file have leading and trailing edge swapped?"
            ),
            Self::AlongSpan { profile, places: [from, to], wing: [low, high] } => {
                let [from, to, low, high] = [from, to, low, high].map(|place| length(*place, high - low));
                write!(
                    f,
                    "profile {profile} moves along the span, from {from} to {to}, where the wing reaches from {low} to {high}: \
                     the wing was stretched or shortened so; if its span shall stay, the new profile belongs in the old one's \
                     plane"
                )
            }
            Self::Thin { profile, old, new } => write!(
                f,
                "profile {profile}: the new trailing edge is {new:.2e} thick, the old one {old:.2e}: its cells become as thin"
            ),
            Self::Open { profile, gap } => write!(
                f,
                "profile {profile}: the new trailing edge is {gap:.2e} thick, and the mesh's is sharp: it went to the middle of \
                 the new one; a profile with a sharp trailing edge repeats its first point at the end"
            ),
            Self::Alone { profile, reach, chord } => write!(
                f,
                "profile {profile} is the only one, and the wing reaches {} beyond its plane and is not the same all along ({} \
                 is the profile's length): one map of the profile's plane moved the whole span, so a section that turns or \
                 grows also changes sweep, taper or dihedral; profiles near both ends say what is meant",
                length(*reach, *chord),
                length(*chord, *chord)
            ),
        }
    }
}
