//! The class `Result`.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use idmesh::formats::{FileSet, is_surface_file};
use idmesh::mesh::CellMeasures;
use idmesh::mover::{Derivative, Design, Moved, Outcome, Refused};
use idmesh::report::{RunReport, Seconds};
use idmesh::session::{Exit, Outputs, SessionError};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyMapping};

use crate::arrays::{read_only_flat, read_only_rows, rows, vectors, vectors_of};
use crate::errors::{of_product, of_session, other};
use crate::mesh::Mesh;
use crate::mover::{Job, displacements_in, profiles_in};
use crate::work::detached;

/// The mesh that an update moved.
///
/// Vertices and cells are counted as in the undeformed mesh. Arrays are read-only.
#[pyclass(module = "idmesh", name = "Result", frozen)]
pub struct MoveResult {
    /// The outcome without its moved mesh, which is in the arrays below.
    outcome: Mutex<Outcome>,
    refused: Option<Refused>,
    vertices: Py<PyArray2<f64>>,
    displacement: Py<PyArray2<f64>>,
    beta: PyOnceLock<Py<PyArray1<f64>>>,
    report: PyOnceLock<String>,
    job: Arc<Job>,
    /// The design's name in the report. `None` for the design of the case.
    design: Option<&'static str>,
    update_seconds: f64,
}

impl MoveResult {
    /// The arrays take the memory of the moved mesh.
    pub fn new(
        py: Python<'_>,
        mut outcome: Outcome,
        job: Arc<Job>,
        design: Option<&'static str>,
        update_seconds: f64,
    ) -> PyResult<Self> {
        let refused = detached(py, || outcome.check().err())?;
        let (vertices, displacement) = outcome.replace_moved(Moved::default()).into_arrays();
        Ok(Self {
            outcome: Mutex::new(outcome),
            refused,
            vertices: read_only_rows(py, vertices)?.unbind(),
            displacement: read_only_rows(py, displacement)?.unbind(),
            beta: PyOnceLock::new(),
            report: PyOnceLock::new(),
            job,
            design,
            update_seconds,
        })
    }

    /// Why the result may not be used.
    pub fn refused(&self) -> Option<&Refused> {
        self.refused.as_ref()
    }

    fn lock(&self) -> MutexGuard<'_, Outcome> {
        self.outcome.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at the outcome, whose moved mesh is empty. A product may hold it in another thread for
    /// some time.
    fn with<T: Send>(&self, py: Python<'_>, look: impl FnOnce(&Outcome) -> T + Send) -> T {
        py.detach(|| look(&self.lock()))
    }

    /// Looks at the whole outcome, without the interpreter's lock. The moved mesh is copied for it.
    fn with_moved<T: Send>(&self, py: Python<'_>, look: impl FnOnce(&Outcome) -> T + Send) -> PyResult<T> {
        let vertices = self.vertices.bind(py).try_readonly()?;
        let displacement = self.displacement.bind(py).try_readonly()?;
        let (vertices, displacement) = (vertices.as_slice()?, displacement.as_slice()?);
        detached(py, || {
            let mut outcome = self.lock();
            outcome.replace_moved(Moved::from_arrays(vectors_of(vertices), vectors_of(displacement)));
            let looked = look(&outcome);
            outcome.replace_moved(Moved::default());
            looked
        })
    }

    fn of_cells<'py>(
        &self,
        py: Python<'py>,
        measure: fn(&CellMeasures) -> f64,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let all = |outcome: &Outcome| {
            outcome.cell_measures.as_ref().map(|cells| cells.iter().map(measure).collect::<Vec<f64>>())
        };
        self.with(py, all).map(|numbers| read_only_flat(py, numbers)).transpose()
    }
}

fn derivative(frozen: bool) -> Derivative {
    if frozen { Derivative::Frozen } else { Derivative::Exact }
}

#[pymethods]
impl MoveResult {
    /// The moved vertices (n, 3), in the mesh's unit.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.vertices.bind(py).clone()
    }

    /// The displacement (n, 3) of each vertex from the undeformed mesh, in the mesh's unit.
    #[getter]
    fn displacement<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.displacement.bind(py).clone()
    }

    /// beta (m,) of each tet: its volume over the cube of its longest edge.
    #[getter]
    fn beta<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let make = || read_only_flat(py, self.with(py, |outcome| outcome.beta.clone())).map(Bound::unbind);
        Ok(self.beta.get_or_try_init(py, make)?.bind(py).clone())
    }

    /// Scaled Jacobian (m,) of the worst corner of each cell: tets, pyramids, prisms, hexahedra.
    /// None for a mesh of tets.
    #[getter]
    fn jacobian<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        self.of_cells(py, |cell| cell.jacobian)
    }

    /// Shape (m,) of the worst corner of each cell against the undeformed mesh, in the same order.
    /// None for a mesh of tets.
    #[getter]
    fn shape<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        self.of_cells(py, CellMeasures::shape)
    }

    /// The undeformed mesh.
    #[getter]
    fn mesh(&self, py: Python<'_>) -> Py<Mesh> {
        self.job.mesh.clone_ref(py)
    }

    /// Whether the moved mesh is valid: no cell is inverted, the surface does not pass through
    /// itself, and every family is where it belongs.
    #[getter]
    fn valid(&self, py: Python<'_>) -> bool {
        self.with(py, Outcome::is_valid)
    }

    /// Whether every relaxation reached its tolerance.
    #[getter]
    fn converged(&self, py: Python<'_>) -> bool {
        self.with(py, |outcome| outcome.converged)
    }

    /// The number of inverted cells.
    #[getter]
    fn inverted(&self, py: Python<'_>) -> usize {
        self.with(py, |outcome| outcome.inverted)
    }

    /// What `idmesh run --json` writes, as a new dictionary.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let make = || -> PyResult<String> {
            let job = &self.job;
            let exit = self.refused().map_or(0, |refused| Exit::from(refused) as u8);
            let case = job.case.case.path.display().to_string();
            let report =
                RunReport::failed(case, self.design.map(str::to_owned), job.backend.clone(), job.size.clone(), exit);
            // The places of the worst cells are in the moved mesh.
            let mut report = self.with_moved(py, |outcome| {
                let report = report.of_outcome(outcome, self.refused()).with_solver_quality(outcome);
                report.with_outlines(outcome, job.case.old_profiles())
            })?;
            let (read, setup, update) = (job.read_seconds, job.setup_seconds, self.update_seconds);
            report.seconds = Some(Seconds { read, setup, update, write: 0.0, total: read + setup + update });
            serde_json::to_string(&report.with_reasons()).map_err(|error| other(py, &error.to_string()))
        };
        py.import("json")?.call_method1("loads", (self.report.get_or_try_init(py, make)?,))
    }

    /// Whether `forward` and `reverse` have the exact derivative of this result.
    #[getter]
    fn differentiable(&self, py: Python<'_>) -> bool {
        self.with(py, |outcome| outcome.differentiable().is_ok())
    }

    /// Why there is no exact derivative; None if there is one.
    #[getter]
    fn why_not(&self, py: Python<'_>) -> Option<String> {
        self.with(py, |outcome| outcome.differentiable().err().map(|why| why.to_string()))
    }

    /// The change (n, 3) of the vertices for a change of the design in this direction.
    ///
    /// Families and profiles that are left out do not change. Of a vertex of several prescribed
    /// families the last family's change counts.
    ///
    /// - displacements: by prescribed family, (k, 3) in the order of `family_vertices`
    /// - profiles: by wing and number, (k, 3): the change of each point of the result's new
    ///   profiles
    /// - frozen: take what steps and local optimisation added as constant; where they moved
    ///   vertices the derivative is off by an unknown amount
    ///
    /// Raises NotDifferentiable, or InputError for a direction that does not fit the mesh.
    #[pyo3(signature = (profiles = None, displacements = None, *, frozen = false))]
    fn forward<'py>(
        &self,
        py: Python<'py>,
        profiles: Option<&Bound<'_, PyMapping>>,
        displacements: Option<&Bound<'_, PyMapping>>,
        frozen: bool,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut direction = Design::default();
        if let Some(given) = profiles {
            direction.profiles = profiles_in(py, given)?;
        }
        if let Some(given) = displacements {
            let own = |family: &str| self.job.mesh.get().n_vertices_of(family);
            direction.prescribed = displacements_in(py, given, own)?;
        }
        let product =
            self.job.with_engine(py, |engine| engine.forward(&self.lock(), &direction, derivative(frozen)))?;
        Ok(rows(py, product.map_err(|error| of_product(py, &error))?))
    }

    /// The derivative of a number by the design, from its derivative (n, 3) by the vertices.
    ///
    /// - seed: (n, 3) or flat
    /// - frozen: as for `forward`
    ///
    /// Raises NotDifferentiable, or InputError for a seed of another shape.
    #[pyo3(signature = (seed, *, frozen = false))]
    fn reverse<'py>(&self, py: Python<'py>, seed: &Bound<'_, PyAny>, frozen: bool) -> PyResult<Bound<'py, PyAny>> {
        let seed = vectors(seed, "the seed", Some(self.job.size.vertices))?;
        let gradient = self.job.with_engine(py, |engine| engine.reverse(&self.lock(), &seed, derivative(frozen)))?;
        let gradient = gradient.map_err(|error| of_product(py, &error))?;
        let displacements = PyDict::new(py);
        for (family, of_family) in gradient.prescribed {
            displacements.set_item(family, rows(py, of_family))?;
        }
        let profiles = PyDict::new(py);
        let asked = self.with(py, |outcome| outcome.asked.clone());
        for (wing, of_wing) in gradient.profiles {
            let by_number = PyDict::new(py);
            for (profile, by_points) in asked.get(&wing).into_iter().flatten().zip(of_wing) {
                by_number.set_item(profile.number, rows(py, by_points))?;
            }
            profiles.set_item(wing, by_number)?;
        }
        py.import("idmesh._design")?.getattr("Gradient")?.call1((profiles, displacements))
    }

    /// Writes the moved mesh, as an output of `idmesh run`. The extension selects the format. In
    /// the format of the mesh's own file every byte that is no coordinate is kept. With .vtp, .stl
    /// or .glb the moved surfaces alone are written. The file appears whole or not at all, and a
    /// result of the same name goes before.
    ///
    /// A mesh that is not valid gets the name NAME.invalid.EXT, with its faulty cells beside it in
    /// NAME.inverted.vtu. Returns the files written.
    ///
    /// Raises InputError if the file cannot be written or is an input, NotConverged if a vertex has
    /// no finite position.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<Vec<PathBuf>> {
        let case = &self.job.case;
        let write = |outcome: &Outcome| -> Result<Vec<PathBuf>, SessionError> {
            let outputs = match is_surface_file(&path) {
                true => Outputs { surfaces: vec![path], ..Outputs::default() },
                false => Outputs { meshes: vec![path], ..Outputs::default() },
            };
            outputs.check(case)?;
            outputs.remove_earlier(&case.inputs, None)?;
            let mut files = FileSet::default();
            outputs.add_to(&mut files, case, None, outcome)?;
            // The mesh comes first, whatever stands beside it.
            let mut written: Vec<PathBuf> = files.files().map(|(path, _)| path.to_path_buf()).collect();
            written.sort_by_key(|path| path.extension().is_some_and(|extension| extension == "mapbc"));
            outputs.place(files, &case.inputs, None, || Ok(()))?;
            Ok(written)
        };
        self.with_moved(py, write)?.map_err(|error| of_session(py, error))
    }

    /// The moved mesh for pyvista: an UnstructuredGrid with the cells, "displacement" at the
    /// vertices and "beta" on the cells (not a number where a cell is no tet), in a MultiBlock
    /// beside a block of faces for each family.
    ///
    /// Needs pyvista: pip install "idmesh[plot]".
    fn to_pyvista<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("idmesh._pictures")?.call_method1("to_pyvista", (slf,))
    }

    /// Two linked views, of the undeformed and of the moved surfaces. Returns pyvista's Plotter
    /// before it is shown, to which more can be added.
    ///
    /// - families: those to show; without, those that moved, but for families as large as the mesh
    ///
    /// Needs pyvista: pip install "idmesh[plot]".
    #[pyo3(signature = (families = None, *, show = true, off_screen = None))]
    fn plot<'py>(
        slf: &Bound<'py, Self>,
        families: Option<Vec<String>>,
        show: bool,
        off_screen: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("idmesh._pictures")?.call_method1("plot", (slf, families, show, off_screen))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("idmesh._pictures")?.call_method1("table", (slf,))
    }

    fn __reduce__(_slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        let message = "a Result cannot be pickled: hand on its arrays, such as result.vertices, and its report";
        Err(pyo3::exceptions::PyTypeError::new_err(message))
    }

    fn __repr__(&self, py: Python<'_>) -> String {
        let n = self.with(py, |outcome| outcome.mesh().vertices.len());
        let state = match self.refused() {
            None => "valid".to_owned(),
            Some(refused) => refused.message.clone(),
        };
        format!("<idmesh.Result: {n} vertices, {state}>")
    }
}
