//! A body whose vertices are all prescribed; every other family is fixed, but for planes, named
//! `symmetry` or `..._plane`. Its chord is along x, its span along y.

use std::path::Path;

use glam::DVec3;
use idmesh::{
    families::Role,
    formats::{self, MeshFile},
    mesh::{FamilyId, HybridMesh},
    mover::{Design, Mover, MoverBuilder},
    springs::Springs,
};

use crate::{
    bodies::{Body, Kind},
    common::Failure,
};

const KINDS: [Kind; 3] = [
    Kind { name: "pitch", unit: "degrees", amounts: &[10.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0, 120.0, 150.0, 180.0] },
    Kind { name: "heave", unit: "chords", amounts: &[0.5, 1.0, 2.0, 3.0] },
    Kind { name: "bending", unit: "chords", amounts: &[0.25, 0.5, 1.0, 2.0] },
];

/// The body.
pub struct Prescribed {
    file: MeshFile,
    family: FamilyId,
    chord: f64,
    /// On the quarter chord, at mid-span and half the height.
    pivot: DVec3,
    half_span: f64,
}

impl Prescribed {
    /// The family of that name.
    ///
    /// # Errors
    /// The mesh cannot be read, it has no such family, or that has no chord or span.
    pub fn read(path: &Path, family: &str) -> Result<Self, Failure> {
        let file = formats::read_mixed(path)?;
        let (mesh, others) = (&file.mesh, &file.others);
        let family = mesh.family(family).ok_or_else(|| format!("{}: no family `{family}`", path.display()))?;
        let triangles = mesh.triangles.iter().zip(&mesh.triangle_family).map(|(face, of)| (&face[..], of));
        let quadrilaterals =
            others.quadrilaterals.iter().zip(&others.quadrilateral_family).map(|(face, of)| (&face[..], of));
        let own = triangles.chain(quadrilaterals).filter(|&(_, &of)| of == family);
        let points = || own.clone().flat_map(|(face, _)| face).map(|&vertex| mesh.vertices[vertex as usize]);
        let low = points().reduce(DVec3::min).ok_or("the body has no vertices")?;
        let high = points().reduce(DVec3::max).ok_or("the body has no vertices")?;
        let (size, middle) = (high - low, (low + high) / 2.0);
        if size.x <= 0.0 || size.y <= 0.0 {
            return Err("the body has no chord along x or no span along y".into());
        }
        let pivot = middle.with_x(low.x + size.x / 4.0);
        Ok(Self { family, chord: size.x, pivot, half_span: size.y / 2.0, file })
    }

    fn family(&self) -> &str {
        &self.file.mesh.families[self.family.index()]
    }

    fn displacement(&self, at: DVec3, kind: usize, amount: f64) -> DVec3 {
        match KINDS[kind].name {
            "pitch" => {
                let (sin, cos) = amount.to_radians().sin_cos();
                let (x, z) = (at.x - self.pivot.x, at.z - self.pivot.z);
                DVec3::new(x * cos + z * sin - x, 0.0, -x * sin + z * cos - z) + self.bend(at, 0.2)
            }
            "heave" => DVec3::Z * (amount * self.chord),
            _ => self.bend(at, amount),
        }
    }

    /// A parabola along the span that lifts the tips by so many chords.
    fn bend(&self, at: DVec3, chords: f64) -> DVec3 {
        DVec3::Z * (chords * self.chord * ((at.y - self.pivot.y) / self.half_span).powi(2))
    }
}

impl Body for Prescribed {
    fn title(&self) -> String {
        format!("body `{}`, prescribed", self.family())
    }

    fn mesh(&self) -> HybridMesh<'_> {
        self.file.cells()
    }

    fn springs(&self) -> &'static Springs {
        Default::default()
    }

    fn kinds(&self) -> &'static [Kind] {
        &KINDS
    }

    fn builder(&self) -> MoverBuilder {
        let MeshFile { mesh, others, .. } = &self.file;
        let mut builder = Mover::builder(mesh.clone()).other_cells(others.clone()).springs(self.springs());
        for family in &mesh.families {
            let is_plane = family == "symmetry" || family.ends_with("_plane");
            builder = builder.role(family, if is_plane { Role::PLANE } else { Role::Fixed });
        }
        builder.role(self.family(), Role::Prescribed)
    }

    fn design(&self, mover: &Mover, kind: usize, amount: f64) -> Design {
        let vertices = mover.family_vertices(self.family()).into_iter().flatten();
        let moved = vertices.map(|&vertex| self.displacement(self.file.mesh.vertices[vertex as usize], kind, amount));
        Design::of_prescribed(self.family(), moved.collect())
    }
}
