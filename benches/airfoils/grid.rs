//! The volume around half a wing: rings around the airfoil in layers, made irregular as an
//! unstructured mesh is.
//!
//! A vertex has three steps: around the airfoil, along the span, and out to the far field. Its
//! place is blended between the wing and a cylinder. On the wing every vertex stands on the
//! airfoil, wherever its shift along the curve and the span leads.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use idmesh::{
    mesh::{FamilyId, TetMesh},
    quality::volume,
};

use crate::{
    airfoil::{Airfoil, Curve},
    common::Failure,
};

/// Length of the wing, in chords.
pub const SPAN: f64 = 2.0;
/// Radius of the far field.
const FAR: f64 = 3.0;
/// Layers from the wing to the far field.
const LAYERS: usize = 8;
/// Largest shift of a vertex along the curve and the span, in spacings.
const SHIFT: f64 = 0.3;
/// Each row stands a quarter of a spacing to one side, the next one to the other.
const STAGGER: f64 = 0.25;
/// Half the angle that the base of a blunt trailing edge has on the cylinder.
const WAKE: f64 = 0.1;

/// The families.
pub const FAMILIES: [&str; 5] = ["wing", "trailing_edge", "symmetry", "wall", "farfield"];
/// The wing among them.
pub const WING: FamilyId = FamilyId(0);

struct Grid {
    curve: Curve,
    base: f64,
    /// Steps along the curve, from end to end.
    sides: usize,
    /// Steps across the base; none if the trailing edge is sharp.
    across: usize,
    rows: usize,
    /// Share of the way out to the first layer, and by what the next ones grow.
    growth: f64,
}

/// The mesh around a wing with an airfoil, `per_chord` points a chord along the curve and along the
/// span.
///
/// # Errors
/// A tet has no volume: the shifts tangle the mesh.
pub fn mesh(airfoil: Airfoil, per_chord: usize) -> Result<TetMesh, Failure> {
    let curve = Curve::new(airfoil);
    let n = per_chord as f64;
    let sides = (curve.length() * n).round() as usize;
    let across = if airfoil.base > 0.0 { ((airfoil.base * n).round() as usize).max(1) } else { 0 };
    let rows = (SPAN * n).round() as usize;
    let grid = Grid { curve, base: airfoil.base, sides, across, rows, growth: growth(1.0 / (n * FAR)) };
    let around = grid.around();
    let index = |[i, j, k]: [usize; 3]| ((k * (rows + 1) + j) * around + i % around) as u32;
    let mut vertices = Vec::with_capacity(around * (rows + 1) * (LAYERS + 1));
    for k in 0..=LAYERS {
        for j in 0..=rows {
            vertices.extend((0..around).map(|i| grid.place([i, j, k])));
        }
    }
    let mut mesh = TetMesh { vertices, families: FAMILIES.map(str::to_owned).to_vec(), ..TetMesh::default() };
    for k in 0..LAYERS {
        for j in 0..rows {
            for i in 0..around {
                for tet in tets([i, j, k]) {
                    mesh.tets.push(tet.map(index));
                    for left_out in 0..4 {
                        let face = [1, 2, 3].map(|next| tet[(left_out + next) % 4]);
                        let Some(family) = grid.family(i, face) else { continue };
                        mesh.triangles.push(face.map(index));
                        mesh.triangle_family.push(FamilyId(family));
                    }
                }
            }
        }
    }
    let flat = mesh.tets.iter().filter(|&&tet| volume(tet.map(|vertex| mesh.vertices[vertex as usize])) <= 0.0).count();
    if flat > 0 {
        return Err(format!("{per_chord} points a chord: {flat} tets of the benchmark's own mesh are inverted").into());
    }
    Ok(mesh)
}

/// The six tets of a cell, with positive volume, each around its main diagonal. Every other row is
/// turned over along the span, so that the diagonals of the triangles follow the staggered
/// vertices; neighbours still have the same faces.
fn tets([i, j, k]: [usize; 3]) -> Vec<[[usize; 3]; 4]> {
    let turned = j % 2 == 0;
    let orders = [
        ([0, 1, 2], false),
        ([1, 2, 0], false),
        ([2, 0, 1], false),
        ([0, 2, 1], true),
        ([2, 1, 0], true),
        ([1, 0, 2], true),
    ];
    let tet = |(order, odd): ([usize; 3], bool)| {
        let corner = |step: [usize; 3]| {
            let across = if turned { 1 - step[1] } else { step[1] };
            [i + step[0], j + across, k + step[2]]
        };
        let mut step = [0; 3];
        let mut tet = [corner(step); 4];
        for (place, axis) in tet[1..].iter_mut().zip(order) {
            step[axis] = 1;
            *place = corner(step);
        }
        if odd != turned {
            tet.swap(2, 3);
        }
        tet
    };
    orders.into_iter().map(tet).collect()
}

/// The factor by which layers grow whose first one takes a share of the whole.
fn growth(first: f64) -> f64 {
    let whole = |growth: f64| (0..LAYERS as i32).map(|layer| first * growth.powi(layer)).sum::<f64>();
    let (mut low, mut high) = (1.0, 10.0);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if whole(middle) < 1.0 { low = middle } else { high = middle }
    }
    low
}

impl Grid {
    /// Vertices around the airfoil.
    fn around(&self) -> usize {
        self.sides + self.across
    }

    fn place(&self, [i, j, k]: [usize; 3]) -> DVec3 {
        let share = (self.growth.powi(k as i32) - 1.0) / (self.growth.powi(LAYERS as i32) - 1.0);
        let spacing = SPAN / self.rows as f64;
        // Within a circle no shifts turn a triangle over.
        let (radius, turn) = (SHIFT * random([i, j, 0]).sqrt(), TAU * random([i, j, 1]));
        let along = if j == 0 || j == self.rows { 0.0 } else { spacing * radius * turn.sin() };
        let stagger = if j % 2 == 0 { -STAGGER } else { STAGGER };
        let wing = self.around_wing(i, stagger + radius * turn.cos());
        let angle = self.angle(i);
        let far = DVec2::new(0.5, 0.0) + FAR * DVec2::new(angle.cos(), angle.sin());
        let at = wing.lerp(far, share);
        DVec3::new(at.x, spacing * j as f64 + along * (1.0 - share), at.y)
    }

    /// A vertex of the wing, shifted by some spacings; the ends of the curve stay.
    fn around_wing(&self, i: usize, shift: f64) -> DVec2 {
        let at_end = i == 0 || i == self.sides;
        let shift = if at_end { 0.0 } else { shift };
        if i <= self.sides {
            self.curve.at(self.curve.length() * (i as f64 + shift) / self.sides as f64)
        } else {
            let share = ((i - self.sides) as f64 + shift) / self.across as f64;
            DVec2::new(1.0, self.base * (0.5 - share))
        }
    }

    /// Where the cylinder has the vertex: the angle from the wake, through below the airfoil.
    fn angle(&self, i: usize) -> f64 {
        let wake = if self.across > 0 { WAKE } else { 0.0 };
        if i > self.sides {
            return wake * (1.0 - 2.0 * (i - self.sides) as f64 / self.across as f64);
        }
        let from_wake = (2.0 * self.around_wing(i, 0.0).x - 1.0).clamp(-1.0, 1.0).acos();
        let below = 2 * i <= self.sides;
        let angle = wake + from_wake * (PI - wake) / PI;
        if below { TAU - angle } else { angle }
    }

    /// The family of a face of a cell, if it is on the boundary.
    fn family(&self, cell: usize, face: [[usize; 3]; 3]) -> Option<u16> {
        let all = |axis: usize, step: usize| face.iter().all(|corner| corner[axis] == step);
        match () {
            () if all(2, 0) => Some(u16::from(cell >= self.sides)),
            () if all(1, 0) => Some(2),
            () if all(1, self.rows) => Some(3),
            () if all(2, LAYERS) => Some(4),
            () => None,
        }
    }
}

/// A number from 0 to 1 that looks random, the same in every run.
fn random(key: [usize; 3]) -> f64 {
    let mut state = key.iter().fold(0x9e37_79b9_7f4a_7c15_u64, |state, &part| mixed(state ^ (part as u64 + 1)));
    state = mixed(state);
    (state >> 11) as f64 / (1u64 << 53) as f64
}

/// A step of the generator splitmix64.
fn mixed(state: u64) -> u64 {
    let state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let state = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let state = (state ^ (state >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    state ^ (state >> 31)
}
