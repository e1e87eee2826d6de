//! The wing of a case, moved by its profiles through all stages: cut at planes along its span, and
//! each section twisted or raised the more the nearer it is to the tip. Its chord is along x, its
//! span along y from its lowest y, the root.

use std::path::Path;

use glam::DVec3;
use idmesh::{
    case::Case,
    families::Role,
    formats::{self, MeshFile},
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

const KINDS: [Kind; 3] = [
    Kind { name: "twist", unit: "degrees", amounts: &[10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0, 120.0, 150.0, 180.0] },
    Kind { name: "heave", unit: "chords", amounts: &[0.25, 0.5, 1.0, 2.0] },
    Kind { name: "bending", unit: "chords", amounts: &[0.25, 0.5, 1.0, 2.0] },
];

/// The wing and its sections.
pub struct Sections {
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
        let case = Case::read(path)?;
        let file = formats::read_mixed(&case.mesh)?;
        if !file.others.is_empty() {
            return Err(format!("{}: sections are cut from meshes of tets alone", path.display()).into());
        }
        let mesh = &file.mesh;
        let case = case.for_families(&mesh.families)?;
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
        let old = cut::cut_at_planes(&mesh.vertices, &triangles, &numbered)?;
        let [low, high] = bounds(old[0].points.iter().copied()).unwrap_or(NOWHERE);
        let along = || triangles.iter().flatten().map(|&vertex| mesh.vertices[vertex as usize].y);
        let (root, tip) = (along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max));
        Ok(Self { wing, roles, settings: case.settings, old, chord: high.x - low.x, root, tip, file })
    }

    fn moved(&self, section: &Profile, kind: usize, amount: f64) -> Profile {
        let [low, high] = bounds(section.points.iter().copied()).unwrap_or(NOWHERE);
        let quarter = DVec3::new(low.x + (high.x - low.x) / 4.0, 0.0, (low.z + high.z) / 2.0);
        let outward = (section.points[0].y - self.root) / (self.tip - self.root);
        let place = |at: DVec3| match KINDS[kind].name {
            "twist" => {
                let (sin, cos) = (amount * outward).to_radians().sin_cos();
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
        format!("wing `{}`, moved by {SECTIONS} profiles", self.file.mesh.families[self.wing.index()])
    }

    fn mesh(&self) -> HybridMesh<'_> {
        self.file.cells()
    }

    fn springs(&self) -> &'static Springs {
        self.settings.springs
    }

    fn kinds(&self) -> &'static [Kind] {
        &KINDS
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
