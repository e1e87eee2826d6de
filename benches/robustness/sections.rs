//! The wing of a case, moved by its profiles through all stages: cut at planes along its span, and
//! each section twisted or raised the more the nearer it is to the tip. Its chord is along x, its
//! span along y from its lowest y, the root.
//!
//! A wing with parts that hang from it keeps the old profiles of its case, which miss the parts. It
//! makes the motions of [`WITH_PARTS`].

use std::path::Path;

use glam::DVec3;
use idmesh::{
    case::Case,
    families::Role,
    formats::MeshFile,
    geometry::{NOWHERE, bounds},
    mesh::{FamilyId, HybridMesh},
    mover::{Design, Mover, MoverBuilder, Settings},
    profile::{Profile, cut, stations},
    springs::Springs,
};

use crate::{
    bodies::{Body, Kind},
    common::Failure,
};

/// Sections cut from the wing: neighbours turn by 16 degrees against each other at the largest
/// twist.
const SECTIONS: usize = 10;

/// Chord in the symmetry plane of the wings with parts.
const ROOT_CHORD: f64 = 2.0;

const KINDS: [Kind; 3] = [
    Kind { name: "twist", unit: "degrees", amounts: &[10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0, 120.0, 150.0, 180.0] },
    Kind { name: "heave", unit: "chords", amounts: &[0.25, 0.5, 1.0, 2.0] },
    Kind { name: "bending", unit: "chords", amounts: &[0.25, 0.5, 1.0, 2.0] },
];

/// Motions of a wing with parts. The twist goes from a quarter of the amount in the symmetry plane
/// to the amount at the tip, the tip is raised in proportion to the distance from the symmetry
/// plane, and the other motions are the same all along the span.
const WITH_PARTS: [Kind; 6] = [
    Kind { name: "twist", unit: "degrees", amounts: &[10.0, 20.0, 40.0] },
    Kind { name: "tip up", unit: "root chords", amounts: &[0.25, 0.5] },
    Kind { name: "raised", unit: "root chords", amounts: &[0.075, 0.15] },
    Kind { name: "thicker", unit: "%", amounts: &[30.0, 60.0] },
    Kind { name: "thinner", unit: "%", amounts: &[20.0, 40.0] },
    Kind { name: "longer chord", unit: "%", amounts: &[10.0, 20.0] },
];

/// The wing and its sections.
pub struct Sections {
    kinds: &'static [Kind],
    file: MeshFile,
    wing: FamilyId,
    roles: Vec<Role>,
    settings: Settings,
    old: Vec<Profile>,
    /// The innermost section's.
    chord: f64,
    root: f64,
    tip: f64,
}

impl Sections {
    /// The wing of a case. Of the case count the roles and the settings, without its profiles.
    ///
    /// # Errors
    /// A file cannot be read, the case has not one wing, or that cannot be cut.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let loaded = Case::load(path)?;
        let given: Vec<Profile> = loaded.old_profiles().flat_map(|(_, old)| old.to_vec()).collect();
        let (case, file) = (loaded.case, loaded.file);
        if !file.others.is_empty() {
            return Err(format!("{}: sections are cut from meshes of tets alone", path.display()).into());
        }
        let mesh = &file.mesh;
        let roles: Vec<Role> = mesh.families.iter().map(|name| case.families[name].role.clone()).collect();
        let mut wings = (0..roles.len()).filter(|&family| roles[family] == Role::Wing);
        let (Some(wing), None) = (wings.next(), wings.next()) else {
            return Err(format!("{}: expected one family with the role wing", path.display()).into());
        };
        let wing = FamilyId(wing as u16);
        let of_wing = mesh.triangles.iter().zip(&mesh.triangle_family).filter(|&(_, &family)| family == wing);
        let triangles: Vec<[u32; 3]> = of_wing.map(|(&triangle, _)| triangle).collect();
        let planes = stations::evenly(&mesh.vertices, &triangles, SECTIONS)?;
        let numbered: Vec<_> = (0..).zip(planes).collect();
        let hangs = |role: &Role| matches!(role, Role::Attached { .. } | Role::Rigid { .. });
        let has_parts = roles.iter().any(hangs);
        let old = if has_parts { given } else { cut::cut_at_planes(&mesh.vertices, &triangles, &numbered)? };
        let kinds = if has_parts { &WITH_PARTS[..] } else { &KINDS[..] };
        let [low, high] = bounds(old[0].points.iter().copied()).unwrap_or(NOWHERE);
        let along = || triangles.iter().flatten().map(|&vertex| mesh.vertices[vertex as usize].y);
        let (root, tip) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        Ok(Self { kinds, wing, roles, settings: case.settings, old, chord: high.x - low.x, root, tip, file })
    }

    fn moved(&self, section: &Profile, kind: usize, amount: f64) -> Profile {
        let [low, high] = bounds(section.points.iter().copied()).unwrap_or(NOWHERE);
        let quarter = DVec3::new(low.x + (high.x - low.x) / 4.0, 0.0, (low.z + high.z) / 2.0);
        let outward = (section.points[0].y - self.root) / (self.tip - self.root);
        let has_parts = self.kinds.len() == WITH_PARTS.len();
        let of_centre = section.points[0].y / self.tip;
        let (twist, nose) = match has_parts {
            true => {
                (0.25 + 0.75 * of_centre, section.points.iter().copied().reduce(|a, b| if b.x < a.x { b } else { a }))
            }
            false => (outward, None),
        };
        let nose = nose.unwrap_or(quarter);
        let place = |at: DVec3| match self.kinds[kind].name {
            "tip up" => at + DVec3::Z * (amount * ROOT_CHORD * of_centre),
            "raised" => at + DVec3::Z * (amount * ROOT_CHORD),
            "thicker" => DVec3::new(at.x, at.y, nose.z + (at.z - nose.z) * (1.0 + amount / 100.0)),
            "thinner" => DVec3::new(at.x, at.y, nose.z + (at.z - nose.z) * (1.0 - amount / 100.0)),
            "longer chord" => DVec3::new(nose.x + (at.x - nose.x) * (1.0 + amount / 100.0), at.y, at.z),
            "twist" => {
                let (sin, cos) = (amount * twist).to_radians().sin_cos();
                let (x, z) = (at.x - quarter.x, at.z - quarter.z);
                DVec3::new(quarter.x + x * cos + z * sin, at.y, quarter.z - x * sin + z * cos)
            }
            "heave" => at + DVec3::Z * (amount * self.chord * outward),
            _ => at + DVec3::Z * (amount * self.chord * outward * outward),
        };
        Profile { number: section.number, points: section.points.iter().map(|&at| place(at)).collect() }
    }
}

impl Body for Sections {
    fn title(&self) -> String {
        format!("wing `{}`, moved by {} profiles", self.file.mesh.families[self.wing.index()], self.old.len())
    }

    fn mesh(&self) -> HybridMesh<'_> {
        self.file.cells()
    }

    fn springs(&self) -> &'static Springs {
        self.settings.springs
    }

    fn kinds(&self) -> &'static [Kind] {
        self.kinds
    }

    fn builder(&self) -> MoverBuilder {
        let builder = Mover::builder(self.file.mesh.clone()).settings(self.settings);
        let families = self.file.mesh.families.iter().zip(&self.roles);
        let builder = families.fold(builder, |builder, (family, role)| builder.role(family, role.clone()));
        builder.wing("wing", &[&self.file.mesh.families[self.wing.index()]], self.old.clone(), None)
    }

    fn design(&self, _mover: &Mover, kind: usize, amount: f64) -> Design {
        Design::of_wing("wing", self.old.iter().map(|section| self.moved(section, kind, amount)).collect())
    }
}
