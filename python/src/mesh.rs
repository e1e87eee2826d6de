//! The undeformed mesh, as arrays.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::Arc;

use idmesh::case::{LoadError, LoadedCase};
use idmesh::families::SetupError;
use idmesh::formats::{self, MeshFile};
use idmesh::mesh::{CellKind, FamilyId, families_inside};
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;

use crate::arrays::{indices, read_only_flat, read_only_rows};
use crate::errors::{input, of_session};
use crate::work::detached;

/// Where the mesh comes from.
enum Source {
    File(Box<MeshFile>),
    Case(Arc<LoadedCase>),
}

/// A mesh before its motion: vertices, cells by kind, and named families of boundary faces.
///
/// Vertices are counted from 0, in the order of the file. Arrays are read-only.
#[pyclass(module = "idmesh", frozen)]
pub struct Mesh {
    source: Source,
    vertices: PyOnceLock<Py<PyArray2<f64>>>,
    cells: PyOnceLock<Py<PyDict>>,
}

impl Mesh {
    /// The mesh of a case.
    pub fn of_case(case: Arc<LoadedCase>) -> Self {
        Self::new(Source::Case(case))
    }

    fn new(source: Source) -> Self {
        Self { source, vertices: PyOnceLock::new(), cells: PyOnceLock::new() }
    }

    fn file(&self) -> &MeshFile {
        match &self.source {
            Source::File(file) => file,
            Source::Case(case) => &case.file,
        }
    }

    fn family(&self, py: Python<'_>, name: &str) -> PyResult<FamilyId> {
        let mesh = &self.file().mesh;
        mesh.family(name).ok_or_else(|| {
            let error = SetupError::UnknownFamily { name: name.to_owned(), known: mesh.families.clone() };
            input(py, &error.to_string())
        })
    }

    /// The number of vertices of a family. `None` if the mesh has no such family.
    pub fn n_vertices_of(&self, name: &str) -> Option<usize> {
        Some(self.vertices_of(self.file().mesh.family(name)?).len())
    }

    /// The vertices of a family, ascending.
    pub fn vertices_of(&self, family: FamilyId) -> Vec<u32> {
        let hybrid = self.file().cells();
        let faces = (0..hybrid.n_faces() as u32).filter(|&face| hybrid.family_of(face) == Some(family));
        let found: BTreeSet<u32> = faces.flat_map(|face| hybrid.face_vertices(face)).copied().collect();
        found.into_iter().collect()
    }
}

/// Tells the user of what was passed over in the file, by Python's `warnings`.
pub fn warn_of(py: Python<'_>, file: &MeshFile) -> PyResult<()> {
    for warning in file.warnings() {
        py.import("warnings")?.call_method1("warn", (warning.as_str(),))?;
    }
    Ok(())
}

#[pymethods]
impl Mesh {
    /// Reads a mesh file; its extension selects the format.
    ///
    /// Raises InputError if the file cannot be read.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let file = detached(py, || formats::read_mixed(&path))?;
        let file = file.map_err(|error| of_session(py, LoadError::from(error).into()))?;
        warn_of(py, &file)?;
        Ok(Self::new(Source::File(Box::new(file))))
    }

    /// The vertices (n, 3), in the unit of the file.
    #[getter]
    pub fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let make = || read_only_rows(py, self.file().mesh.vertices.clone()).map(Bound::unbind);
        Ok(self.vertices.get_or_try_init(py, make)?.bind(py).clone())
    }

    /// The vertices of each cell by kind: "tets" (m, 4), "pyramids" (m, 5), "prisms" (m, 6) and
    /// "hexahedra" (m, 8), with the order of CGNS within a cell. A kind without cells has no rows.
    #[getter]
    pub fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let make = || -> PyResult<Py<PyDict>> {
            let (file, cells) = (self.file(), PyDict::new(py));
            let arrays = [
                indices(py, file.mesh.tets.clone())?,
                indices(py, file.others.pyramids.clone())?,
                indices(py, file.others.prisms.clone())?,
                indices(py, file.others.hexahedra.clone())?,
            ];
            for (kind, array) in CellKind::ALL.iter().zip(arrays) {
                array.call_method1("setflags", (false,))?;
                cells.set_item(kind.plural(), array)?;
            }
            Ok(cells.unbind())
        };
        // Who changes the mapping changes a copy.
        self.cells.get_or_try_init(py, make)?.bind(py).copy()
    }

    /// The vertices of each tet (m, 4).
    #[getter]
    pub fn tets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.cells(py)?.as_any().get_item("tets")
    }

    /// The names of the families, in the order of the file.
    #[getter]
    pub fn families(&self) -> Vec<String> {
        self.file().mesh.families.clone()
    }

    /// The names of the families whose faces lie inside the volume, between two cells.
    #[getter]
    fn inside(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        let file = self.file();
        let inside = detached(py, || families_inside(file.cells()))?;
        let families = file.mesh.families.iter().zip(inside);
        Ok(families.filter(|&(_, inside)| inside).map(|(family, _)| family.clone()).collect())
    }

    /// The names of the families with a symmetry condition in the file (OpenFOAM, CGNS).
    #[getter]
    fn symmetries(&self) -> Vec<String> {
        let mesh = &self.file().mesh;
        self.file().symmetries().iter().filter(|name| mesh.family(name).is_some()).cloned().collect()
    }

    /// The vertices (k,) of a family, ascending.
    ///
    /// Raises InputError if the mesh has no such family.
    pub fn family_vertices<'py>(&self, py: Python<'py>, family: &str) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let family = self.family(py, family)?;
        read_only_flat(py, detached(py, || self.vertices_of(family))?)
    }

    /// The vertices (k, 3) of each triangle of a family.
    ///
    /// Raises InputError if the mesh has no such family.
    pub fn family_triangles<'py>(&self, py: Python<'py>, family: &str) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let family = self.family(py, family)?;
        indices(py, self.file().mesh.triangles_of(&[family]))
    }

    /// The vertices (k, 4) of each quadrilateral of a family.
    ///
    /// Raises InputError if the mesh has no such family.
    pub fn family_quadrilaterals<'py>(&self, py: Python<'py>, family: &str) -> PyResult<Bound<'py, PyArray2<u32>>> {
        let family = self.family(py, family)?;
        let others = &self.file().others;
        let quadrilaterals = others.quadrilaterals.iter().zip(&others.quadrilateral_family);
        indices(py, quadrilaterals.filter(|&(_, of)| *of == family).map(|(face, _)| *face).collect())
    }

    fn __repr__(&self) -> String {
        let hybrid = self.file().cells();
        let cells: Vec<String> = CellKind::ALL
            .iter()
            .map(|&kind| (hybrid.count(kind), kind.plural()))
            .filter(|&(count, _)| count > 0)
            .map(|(count, kind)| format!("{count} {kind}"))
            .collect();
        format!(
            "<idmesh.Mesh: {} vertices, {}, families {}>",
            hybrid.vertices().len(),
            cells.join(", "),
            self.families().join(", ")
        )
    }
}
