//! A straight wing of chord 1 and span 4, NACA 0012 all along, and its profiles.

use glam::DVec3;
use idmesh::profile::Profile;

use super::wing::Surface;

/// The airfoil in the plane at `y`, from the lower side of the trailing edge to the upper one, `te`
/// apart.
fn airfoil(te: f64, y: f64) -> Vec<DVec3> {
    let point = |i: i32| {
        let t = f64::from(i) / 40.0;
        let x = t * t;
        let polynomial = 0.2969 * t.abs() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
        let half = if x == 1.0 { 0.0 } else { 0.6 * polynomial } + 0.5 * te * x;
        DVec3::new(x, y, half * t.signum())
    };
    (-40..=40).map(point).collect()
}

/// Profiles of the wing, their points moved by a map.
pub fn profiles(te: f64, stations: &[f64], map: impl Fn(DVec3) -> DVec3) -> Vec<Profile> {
    let profile =
        |(i, &y): (usize, &f64)| Profile { number: i as i64, points: airfoil(te, y).into_iter().map(&map).collect() };
    stations.iter().enumerate().map(profile).collect()
}

/// The wing, its vertices moved by a map.
pub fn wing(te: f64, map: impl Fn(DVec3) -> DVec3) -> Surface {
    let row = |j: usize| {
        let mut row = airfoil(te, 0.1 * j as f64);
        row.truncate(if te == 0.0 { 80 } else { 81 });
        row.into_iter().map(&map).collect()
    };
    Surface::through(&(0..=40).map(row).collect::<Vec<_>>(), te == 0.0)
}

pub fn same(at: DVec3) -> DVec3 {
    at
}
