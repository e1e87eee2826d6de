//! What is odd about new profiles along the span.

use glam::DVec3;

use super::kept::KeptSection;
use super::span::Span;
use super::{Profile, Remark};

/// A remark tells of a section that moves along the span by more than this share of the span of the
/// sections.
const ALONG: f64 = 0.1;
/// The same for sections side by side, of which one moves by this share of their distance more than
/// the other.
const STRETCHED: f64 = 0.5;

/// A wing with one section is the same all along the span if its vertices are off the section, seen
/// along the span, by less than this share of the section's length in the mean. The cap at a tip
/// lies inside the section, and has few vertices.
const SAME_ALONG: f64 = 0.02;
/// Only vertices that are farther from the section's plane than this share of its length count.
const NEAR_PLANE: f64 = 0.5;

/// A change of a section is a shift if its knots move alike to this share of its length.
const SHIFT: f64 = 1e-3;

/// The section that moves the most along the span, if one moves far.
///
/// - `moves`: place of each old and new section along the span's normal
/// - `ends`: least and greatest place of the wing
pub(super) fn along_span(new: &[&Profile], span: &Span, moves: &[[f64; 2]], ends: [f64; 2]) -> Option<Remark> {
    let n = moves.len();
    let way = |i: usize| moves[i][1] - moves[i][0];
    let whole = if n > 1 { span.eta[n - 1] - span.eta[0] } else { ends[1] - ends[0] };
    let is_stretched = |i: usize, j: usize| (way(i) - way(j)).abs() > STRETCHED * (span.eta[i] - span.eta[j]).abs();
    let is_far = |i: &usize| {
        let before = i.checked_sub(1).is_some_and(|before| is_stretched(before, *i));
        let after = i + 1 < n && is_stretched(i + 1, *i);
        way(*i).abs() > ALONG * whole || before || after
    };
    let far = (0..n).filter(is_far).max_by(|&a, &b| way(a).abs().total_cmp(&way(b).abs()))?;
    Some(Remark::AlongSpan { profile: new[far].number, places: moves[far], wing: ends })
}

/// Reach of a wing beyond the plane of its only section, in the mesh's unit. `None` if the wing is
/// the same all along the span.
///
/// - `off` `[n_positions]`: distance of each vertex of the wing from the section
pub(super) fn reach_of_other_sections(section: &KeptSection, positions: &[DVec3], off: &[f64]) -> Option<f64> {
    let heights = positions.iter().map(|&position| section.plane().distance(position).abs());
    let far = heights.zip(off).filter(|(height, _)| *height > NEAR_PLANE * section.length());
    let (mut n, mut sum, mut reach) = (0, 0.0, 0.0);
    for (height, off) in far {
        n += 1;
        sum += (off * off - height * height).max(0.0).sqrt();
        reach = f64::max(reach, height);
    }
    (n > 0 && sum > SAME_ALONG * section.length() * f64::from(n)).then_some(reach)
}

/// Whether knots of a section move all alike.
///
/// - `length`: of the section, in the mesh's unit
pub(super) fn is_shift(knots: &[DVec3], length: f64) -> bool {
    knots.iter().all(|knot| knot.distance(knots[0]) <= SHIFT * length)
}
