//! The section that the vertices beside a plane say, on wings whose sections are known in closed form.
//!
//! The facets of these wings cut up to half a percent of the chord off their sections: rows of 16 or 24 vertices are staggered.

#[path = "common/wing.rs"]
mod wing;

use glam::DVec3;
use idmesh::profile::{cut, distance};
use wing::{Surface, at_y};

/// A NACA 0012 of chord 1 with a sharp trailing edge, at `y`: `t` from -1 (trailing edge, lower side) over 0 (leading edge) to 1.
fn airfoil(t: f64, y: f64) -> DVec3 {
    let x = t * t;
    let polynomial = 0.2969 * t.abs() - 0.126 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1036 * x.powi(4);
    let half = if x == 1.0 { 0.0 } else { 0.6 * polynomial };
    DVec3::new(x, y, half * t.signum())
}

/// A wing with this airfoil all along, from y = 0 to 4, mapped.
#[derive(Clone, Copy)]
struct Wing {
    around: usize,
    /// Distance of its rows.
    row: f64,
    map: fn(DVec3) -> DVec3,
}

impl Wing {
    fn surface(&self) -> Surface {
        let row = |j: usize| {
            let t = |i: usize| {
                let shift = if j % 2 == 1 && i > 0 { 0.5 } else { 0.0 };
                2.0 * (i as f64 + shift) / self.around as f64 - 1.0
            };
            (0..self.around).map(|i| (self.map)(airfoil(t(i), self.row * j as f64))).collect()
        };
        Surface::through(&(0..=(4.0 / self.row).round() as usize).map(row).collect::<Vec<_>>(), true)
    }

    /// How far the flat cut at `y` and the section there lie off the mapped airfoil.
    fn off(&self, y: f64) -> [f64; 2] {
        let surface = self.surface();
        let exact: Vec<DVec3> = (-1000..=1000).map(|i| (self.map)(airfoil(f64::from(i) / 1000.0, y))).collect();
        [cut::cut, cut::section].map(|cut| {
            let found = cut(&surface.vertices, &surface.triangles, &at_y(y)).unwrap();
            distance::max_distance(&found, &exact)
        })
    }
}

fn same(at: DVec3) -> DVec3 {
    at
}

/// On a straight wing the lines lead along the surface.
///
/// Fails if `TURNS` of `carry` is 1, and if `ROUGHER` is 0.6.
#[test]
fn a_straight_wing_has_its_airfoil() {
    let [flat, section] = Wing { around: 16, row: 0.1, map: same }.off(1.87);
    assert!(flat > 4e-3 && section < 1e-6, "{flat:e} {section:e}");
}

/// A wing that bends upward has no straight lines: those through both guides are parabolas, as the wing is.
///
/// Fails if `SMOOTHER` is 0.3, and if `ROUGH` is 3.
#[test]
fn a_bent_wing_has_its_airfoil() {
    let [flat, section] = Wing { around: 24, row: 0.1, map: |at| at + 0.1 * at.y * at.y * DVec3::Z }.off(1.98);
    assert!(flat > 2e-3 && section < 5e-4, "{flat:e} {section:e}");
}

/// At y = 2 the wing grows thicker by a third from one row to the next: no line leads across that.
///
/// Fails if `ROUGHER` is 5.
#[test]
fn the_flat_cut_is_taken_where_nothing_leads_into_the_plane() {
    let step = |at: DVec3| DVec3::new(at.x, at.y, at.z * if at.y > 1.99 { 1.3 } else { 1.0 });
    let [flat, section] = Wing { around: 16, row: 0.1, map: step }.off(2.0 - 1e-5);
    assert!(section < 1e-5 && section == flat, "{flat:e} {section:e}");
}

/// Along a wing that bends up and down a section is a little rough, and better than the facets.
///
/// Fails if `ROUGHER` is 1.02.
#[test]
fn a_section_may_be_a_little_rough() {
    let wave = |at: DVec3| at + 0.1 * (3.0 * at.y).sin() * DVec3::Z;
    let [flat, section] = Wing { around: 16, row: 0.2, map: wave }.off(3.72);
    assert!(section < 0.8 * flat, "{flat:e} {section:e}");
}

/// At y = 2 the chord doubles from one row to the next, or the dihedral begins: away from there the wing is as it was.
///
/// Fails if, of `carry`, `ALIKE` is 10, or `GUIDE` 2 or 0.02.
#[test]
fn no_line_leads_across_a_step() {
    let step = |at: DVec3| DVec3::new(at.x * if at.y > 1.99 { 2.0 } else { 1.0 }, at.y, at.z);
    let kink = |at: DVec3| at + 0.3 * f64::max(at.y - 2.0, 0.0) * DVec3::Z;
    for (map, y) in [(step as fn(DVec3) -> DVec3, 1.87), (step, 3.86), (kink, 3.66)] {
        let [flat, section] = Wing { around: 16, row: 0.1, map }.off(y);
        assert!(flat > 4e-3 && section < 1e-5, "{y}: {flat:e} {section:e}");
    }
}
