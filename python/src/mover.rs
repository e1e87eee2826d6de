//! The class `Mover`.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, ThreadId};
use std::time::{Duration, Instant};

use idmesh::DVec3;
use idmesh::backend::{self, Backend, Selection};
use idmesh::case::{Case, GivenWing, LoadedCase};
use idmesh::mover::{Design, Limits, Mover as Engine, Outcome, Settings, Start};
use idmesh::profile::{Profile, ProfileMatch};
use idmesh::report;
use idmesh::session::SessionError;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyMapping, PyTuple};

use crate::arrays::{rows, vectors};
use crate::errors::{input, of_refused, of_session, other};
use crate::mesh::{Mesh, warn_of};
use crate::options;
use crate::result::MoveResult;
use crate::roles;
use crate::work::detached;

/// Ctrl-C is looked for at the first stage that begins so long after the last look.
const LOOK: Duration = Duration::from_millis(50);

/// What a mover and its results share.
pub struct Job {
    /// Moves the mesh. A thread that waits for it has let go of the interpreter's lock.
    engine: Mutex<Engine>,
    /// The thread that is in an update or a product.
    at_work: Mutex<Option<ThreadId>>,
    pub case: Arc<LoadedCase>,
    pub mesh: Py<Mesh>,
    pub backend: report::Backend,
    pub size: report::Mesh,
    pub read_seconds: f64,
    pub setup_seconds: f64,
}

/// Moves one mesh to design after design.
///
/// The set-up is made once. Each update starts from the undeformed mesh, so a result depends on its
/// design alone. Other threads of Python run while a mover works; several threads may use one
/// mover, one after another. A mover is pickled as its arguments, and set up again where it is
/// unpickled.
#[pyclass(module = "idmesh", frozen)]
pub struct Mover {
    job: Arc<Job>,
    /// The design that stands for what an update is not given.
    design: Design,
    /// The name of the function that makes such a mover, its arguments and its keywords.
    origin: Py<PyTuple>,
    starts_from_last: AtomicBool,
    /// See `idmesh._restore.fingerprint`.
    fingerprint: PyOnceLock<u32>,
}

/// Reads what a mover needs and sets it up.
fn set_up(
    py: Python<'_>,
    selection: Selection,
    origin: Py<PyTuple>,
    load: impl FnOnce() -> Result<LoadedCase, SessionError> + Send,
) -> PyResult<Mover> {
    let start = Instant::now();
    let made = detached(py, || -> Result<_, SessionError> {
        let case = load()?;
        let read_seconds = start.elapsed().as_secs_f64();
        let backend: Arc<dyn Backend> = backend::select(selection)?.into();
        let setup = Instant::now();
        let engine = case.mover(backend.clone())?;
        Ok((case, engine, backend.info(), read_seconds, setup.elapsed().as_secs_f64()))
    })?;
    let (case, engine, info, read_seconds, setup_seconds) = made.map_err(|error| of_session(py, error))?;
    py.check_signals()?;
    warn_of(py, &case.file)?;
    for warning in case.warnings() {
        py.import("warnings")?.call_method1("warn", (warning.as_str(),))?;
    }
    let mut design = case.design.clone();
    let mesh = &case.file.mesh;
    for (family, _) in mesh.families.iter().zip(case.roles()).filter(|(_, role)| role.name() == "prescribed") {
        let n = engine.family_vertices(family).map_or(0, <[u32]>::len);
        design.prescribed.entry(family.clone()).or_insert_with(|| vec![DVec3::ZERO; n]);
    }
    let size = report::Mesh::of(case.file.cells());
    let case = Arc::new(case);
    let mesh = Py::new(py, Mesh::of_case(case.clone()))?;
    let backend = report::Backend::of(info);
    Ok(Mover {
        job: Arc::new(Job {
            engine: Mutex::new(engine),
            at_work: Mutex::new(None),
            case,
            mesh,
            backend,
            size,
            read_seconds,
            setup_seconds,
        }),
        design,
        origin,
        starts_from_last: AtomicBool::new(false),
        fingerprint: PyOnceLock::new(),
    })
}

/// The profiles of each wing in a mapping of mappings.
pub fn profiles_in(py: Python<'_>, given: &Bound<'_, PyMapping>) -> PyResult<BTreeMap<String, Vec<Profile>>> {
    let mut found = BTreeMap::new();
    for item in given.items()?.iter() {
        let (wing, profiles): (String, Bound<'_, PyAny>) = item.extract()?;
        let Ok(profiles) = profiles.cast_into::<PyMapping>() else {
            let message = format!("the profiles of `{wing}` are no mapping, expected arrays (k, 3) by their numbers");
            return Err(input(py, &message));
        };
        let mut of_wing = Vec::new();
        for item in profiles.items()?.iter() {
            let (number, points): (i64, Bound<'_, PyAny>) = item.extract()?;
            let points = vectors(&points, &format!("profile {number} of `{wing}`"), None)?;
            of_wing.push(Profile { number, points });
        }
        found.insert(wing, of_wing);
    }
    Ok(found)
}

/// The wings of a mapping of old profiles, in its order.
///
/// - `families`: of each wing that is not one family with the wing's name
/// - `matches`: how the profiles of a wing are matched, where each design does not decide
///
/// # Errors
/// The profiles of a wing are no arrays, or a wing has families or a match and no old profiles.
fn given_wings(
    py: Python<'_>,
    old_profiles: Option<&Bound<'_, PyMapping>>,
    mut families: BTreeMap<String, Vec<String>>,
    mut matches: BTreeMap<String, ProfileMatch>,
) -> PyResult<Vec<GivenWing>> {
    let mut wings = Vec::new();
    let mut profiles = old_profiles.map(|given| profiles_in(py, given)).transpose()?.unwrap_or_default();
    for name in old_profiles.map(|given| given.keys()).transpose()?.iter().flat_map(|names| names.iter()) {
        let name: String = name.extract()?;
        let families = families.remove(&name).unwrap_or_else(|| vec![name.clone()]);
        let old = profiles.remove(&name).unwrap_or_default();
        let matched = matches.remove(&name);
        wings.push(GivenWing { name, families, old, matched });
    }
    let without = families.keys().map(|name| ("wings", name)).chain(matches.keys().map(|name| ("match", name))).next();
    match without {
        None => Ok(wings),
        Some((of, name)) => Err(input(py, &format!("`{of}` has `{name}`, expected its profiles in `old_profiles`"))),
    }
}

/// The displacements of each family in a mapping.
///
/// - `wanted`: the number of vertices of a family, if it is known
pub fn displacements_in(
    py: Python<'_>,
    given: &Bound<'_, PyMapping>,
    wanted: impl Fn(&str) -> Option<usize>,
) -> PyResult<BTreeMap<String, Vec<DVec3>>> {
    let mut found = BTreeMap::new();
    for item in given.items()?.iter() {
        let (family, rows): (String, Bound<'_, PyAny>) = item.extract()?;
        let rows = vectors(&rows, &format!("the displacement of `{family}`"), wanted(&family))?;
        if let Some(row) = rows.iter().position(|row| !row.is_finite()) {
            let value = rows[row];
            let message = format!("the displacement of `{family}` has {value} in row {row}, expected finite numbers");
            return Err(input(py, &message));
        }
        found.insert(family, rows);
    }
    Ok(found)
}

impl Mover {
    /// The design for an update: what is given, and the mover's own design for the rest.
    fn design_of(
        &self,
        py: Python<'_>,
        profiles: Option<&Bound<'_, PyMapping>>,
        displacements: Option<&Bound<'_, PyMapping>>,
    ) -> PyResult<Design> {
        let mut design = self.design.clone();
        let given = profiles.map(|given| profiles_in(py, given)).transpose()?.unwrap_or_default();
        for (wing, profiles) in given {
            let own = design.profiles.entry(wing).or_default();
            for profile in profiles {
                match own.iter_mut().find(|own| own.number == profile.number) {
                    Some(own) => *own = profile,
                    None => own.push(profile),
                }
            }
        }
        if let Some(given) = displacements {
            let wanted = |family: &str| self.design.prescribed.get(family).map(Vec::len);
            design.prescribed.extend(displacements_in(py, given, wanted)?);
        }
        Ok(design)
    }

    /// Runs an update in this thread, without the interpreter's lock.
    fn run(&self, py: Python<'_>, design: &Design, progress: Option<&Py<PyAny>>) -> PyResult<(Outcome, f64)> {
        let threading = py.import("threading")?;
        let is_main = threading.call_method0("main_thread")?.is(&threading.call_method0("current_thread")?);
        let caught: Mutex<Option<PyErr>> = Mutex::new(None);
        let done = self.job.with_engine(py, |engine| {
            let looked = Cell::new(Instant::now());
            let tell = |stage: &str| -> ControlFlow<()> {
                let mut caught = caught.lock().unwrap_or_else(PoisonError::into_inner);
                if caught.is_some() {
                    return ControlFlow::Break(());
                }
                // Only the main thread gets signals.
                let looks = is_main && looked.get().elapsed() >= LOOK;
                if progress.is_none() && !looks {
                    return ControlFlow::Continue(());
                }
                looked.set(Instant::now());
                let heard = Python::attach(|py| {
                    py.check_signals()?;
                    progress.map_or(Ok(()), |progress| progress.call1(py, (stage,)).map(drop))
                });
                *caught = heard.err();
                if caught.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            };
            let start = Instant::now();
            let outcome = engine.update_telling(design, &tell);
            outcome.map(|outcome| (outcome, start.elapsed().as_secs_f64()))
        })?;
        if let Some(error) = caught.into_inner().unwrap_or_else(PoisonError::into_inner) {
            return Err(error);
        }
        done.map_err(|error| of_session(py, self.job.case.about(error).into()))
    }
}

impl Job {
    /// Works with the mover, without the interpreter's lock. Threads take turns.
    ///
    /// # Errors
    /// `IdmeshError`: this thread is at work with the mover already, or an earlier work panicked.
    pub fn with_engine<T: Send>(&self, py: Python<'_>, work: impl FnOnce(&mut Engine) -> T + Send) -> PyResult<T> {
        let here = thread::current().id();
        let done = detached(py, || {
            let at_work = || self.at_work.lock().unwrap_or_else(PoisonError::into_inner);
            if *at_work() == Some(here) {
                return Err("the `progress` of an update asked the same mover for more, which would wait for itself");
            }
            let Ok(mut engine) = self.engine.lock() else {
                return Err("an earlier update ended in a fault of idmesh, make a new mover");
            };
            *at_work() = Some(here);
            let _end = AtWork(&self.at_work);
            Ok(work(&mut engine))
        })?;
        done.map_err(|message| other(py, message))
    }
}

/// Ends the work of a thread, also if it panics.
struct AtWork<'m>(&'m Mutex<Option<ThreadId>>);

impl Drop for AtWork<'_> {
    fn drop(&mut self) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// A path that stays the same when the working folder changes.
fn absolute(py: Python<'_>, path: &Path) -> PyResult<PathBuf> {
    std::path::absolute(path).map_err(|error| input(py, &format!("{}: {error}", path.display())))
}

/// Arguments to pickle: no later change of the caller's arrays or mappings reaches them.
fn origin(py: Python<'_>, make: &str, path: &Path, keywords: Bound<'_, PyDict>) -> PyResult<Py<PyTuple>> {
    let keywords = py.import("copy")?.call_method1("deepcopy", (keywords,))?;
    Ok((make, path, keywords).into_pyobject(py)?.unbind())
}

#[pymethods]
impl Mover {
    /// Reads a mesh and sets a mover up.
    ///
    /// - mesh: the file
    /// - roles: the role of each family on the boundary, as a name or as a mapping with "role" and
    ///   the keys of the case file's table, such as {"role": "plane", "flat": 1e-4}
    /// - old_profiles: for each wing, arrays (k, 3) by number. Of two wings that share a curve the
    ///   first moves it, and the other one gives way beside it
    /// - wings: the families of each wing of several families, with the role "wing", by the wing's
    ///   name; any other wing of `old_profiles` is the family of its name
    /// - backend: "auto" takes a hardware GPU if there is one; "gpu" never falls back to the CPU
    /// - springs, method, tolerance, max_sweeps, quality, max_steps: as in the case file
    /// - limits: "openfoam", or a mapping from names of limits to values, as in the case file; a
    ///   mesh beyond them is not valid
    /// - match: "points" or "measure" by the name of a wing, as in the case file; of other wings
    ///   each design decides
    ///
    /// Raises InputError, or DeviceError if there is no usable GPU.
    #[new]
    #[pyo3(signature = (
        mesh, roles, *, old_profiles = None, wings = None, backend = "auto", springs = "rotation-aware-wall", method = "auto",
        tolerance = 1e-4, max_sweeps = 200_000, quality = "original", max_steps = 64,
        limits = None, r#match = None
    ))]
    #[allow(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        mesh: PathBuf,
        roles: &Bound<'_, PyMapping>,
        old_profiles: Option<&Bound<'_, PyMapping>>,
        wings: Option<BTreeMap<String, Vec<String>>>,
        backend: &str,
        springs: &str,
        method: &str,
        tolerance: f64,
        max_sweeps: i64,
        quality: &str,
        max_steps: i64,
        limits: Option<&Bound<'_, PyAny>>,
        r#match: Option<BTreeMap<String, String>>,
    ) -> PyResult<Self> {
        let selection = options::backend(py, backend)?;
        let mesh = absolute(py, &mesh)?;
        let mut settings = Settings::default();
        settings.springs = options::springs(py, springs)?;
        settings.method = options::method(py, method)?;
        settings.stopping.tolerance = tolerance;
        settings.stopping.max_sweeps = options::count(py, "max_sweeps", max_sweeps)?;
        settings.quality = options::quality(py, quality)?;
        settings.max_steps = options::count(py, "max_steps", max_steps)?;
        settings.limits = limits.map_or(Ok(Limits::default()), options::limits)?;
        let keywords = PyDict::new(py);
        keywords.set_item("roles", roles)?;
        keywords.set_item("old_profiles", old_profiles)?;
        keywords.set_item("wings", &wings)?;
        keywords.set_item("backend", backend)?;
        keywords.set_item("springs", springs)?;
        keywords.set_item("method", method)?;
        keywords.set_item("tolerance", tolerance)?;
        keywords.set_item("max_sweeps", max_sweeps)?;
        keywords.set_item("quality", quality)?;
        keywords.set_item("max_steps", max_steps)?;
        keywords.set_item("limits", limits)?;
        keywords.set_item("match", &r#match)?;
        let origin = origin(py, "mesh", &mesh, keywords)?;
        let roles = roles::parse(roles)?;
        let matches = options::matches(py, r#match.unwrap_or_default())?;
        let wings = given_wings(py, old_profiles, wings.unwrap_or_default(), matches)?;
        set_up(py, selection, origin, || Ok(LoadedCase::of_mesh(mesh, roles, wings, settings)?))
    }

    /// Reads a case file and all files that it names, and sets a mover up. The keywords replace
    /// what the case file says.
    ///
    /// Raises InputError, or DeviceError if there is no usable GPU.
    #[staticmethod]
    #[pyo3(signature = (
        path, *, backend = "auto", tolerance = None, quality = None, limits = None, r#match = None
    ))]
    fn from_case(
        py: Python<'_>,
        path: PathBuf,
        backend: &str,
        tolerance: Option<f64>,
        quality: Option<&str>,
        limits: Option<&Bound<'_, PyAny>>,
        r#match: Option<BTreeMap<String, String>>,
    ) -> PyResult<Self> {
        let selection = options::backend(py, backend)?;
        let path = absolute(py, &path)?;
        let target = quality.map(|name| options::quality(py, name)).transpose()?;
        let own_limits = limits.map(options::limits).transpose()?;
        let keywords = PyDict::new(py);
        keywords.set_item("backend", backend)?;
        keywords.set_item("tolerance", tolerance)?;
        keywords.set_item("quality", quality)?;
        keywords.set_item("limits", limits)?;
        keywords.set_item("match", &r#match)?;
        let matches = options::matches(py, r#match.unwrap_or_default())?;
        let origin = origin(py, "case", &path, keywords)?;
        let mut unknown: Option<String> = None;
        let mover = set_up(py, selection, origin, || {
            let mut loaded = Case::load(path)?;
            for (wing, matched) in matches {
                match loaded.case.profiles.get_mut(&wing) {
                    Some(source) => source.matched = Some(matched),
                    None => unknown = Some(wing),
                }
            }
            if let Some(tolerance) = tolerance {
                loaded.case.settings.stopping.tolerance = tolerance;
            }
            if let Some(target) = target {
                loaded.case.settings.quality = target;
            }
            if let Some(limits) = own_limits {
                loaded.case.settings.limits = limits;
            }
            Ok(loaded)
        })?;
        match unknown {
            None => Ok(mover),
            Some(wing) => Err(input(py, &format!("`match` has `{wing}`, expected a wing of the case"))),
        }
    }

    /// The undeformed mesh.
    #[getter]
    fn mesh(&self, py: Python<'_>) -> Py<Mesh> {
        self.job.mesh.clone_ref(py)
    }

    /// The undeformed vertices (n, 3), in the mesh's unit; read-only.
    #[getter]
    fn vertices<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.job.mesh.get().vertices(py)
    }

    /// The vertices of each tet (m, 4); read-only.
    #[getter]
    fn tets<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.job.mesh.get().tets(py)
    }

    /// The vertices of each cell, by kind; see Mesh.cells.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.job.mesh.get().cells(py)
    }

    /// The names of the families, in the order of the file.
    #[getter]
    fn families(&self) -> Vec<String> {
        self.job.mesh.get().families()
    }

    /// The old profiles of each wing: arrays (k, 3) in the mesh's unit, by number.
    #[getter]
    fn old_profiles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        for (wing, profiles) in self.job.case.old_profiles() {
            found.set_item(wing, by_number(py, profiles)?)?;
        }
        Ok(found)
    }

    /// The design of the case, or the undeformed one. An update takes from it what it is not given.
    #[getter]
    fn design<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (profiles, displacements) = (PyDict::new(py), PyDict::new(py));
        for (wing, of_wing) in &self.design.profiles {
            profiles.set_item(wing, by_number(py, of_wing)?)?;
        }
        for (family, displacement) in &self.design.prescribed {
            displacements.set_item(family, rows(py, displacement.clone()))?;
        }
        py.import("idmesh._design")?.getattr("Design")?.call1((profiles, displacements))
    }

    /// The vertices (k,) of a family, ascending: the order of its displacements.
    ///
    /// Raises InputError if the mesh has no such family.
    fn family_vertices<'py>(&self, py: Python<'py>, family: &str) -> PyResult<Bound<'py, PyArray1<u32>>> {
        self.job.mesh.get().family_vertices(py, family)
    }

    /// The vertices (k, 3) of each triangle of a family.
    ///
    /// Raises InputError if the mesh has no such family.
    fn family_triangles<'py>(&self, py: Python<'py>, family: &str) -> PyResult<Bound<'py, PyArray2<u32>>> {
        self.job.mesh.get().family_triangles(py, family)
    }

    /// Sets where the springs of later updates start.
    ///
    /// With "last" they start from the last design, which is faster for small changes; a result
    /// then depends on earlier designs, within the tolerance. The default is "undeformed".
    fn start_from(&self, py: Python<'_>, start: &str) -> PyResult<()> {
        let from = match start {
            "undeformed" => Start::Undeformed,
            "last" => Start::LastDesign,
            other => {
                let message = format!("`start` is \"{other}\", expected \"undeformed\" or \"last\"");
                return Err(input(py, &message));
            }
        };
        self.job.with_engine(py, |engine| engine.start_from(from))?;
        self.starts_from_last.store(from == Start::LastDesign, Ordering::Relaxed);
        Ok(())
    }

    /// Moves the undeformed mesh to a design. What is left out is taken from `design`.
    ///
    /// - profiles: by wing and number, points (k, 3) in the mesh's unit
    /// - displacements: by prescribed family, (k, 3) in the order of `family_vertices`
    /// - check: raise InvalidMesh or NotConverged, which carry the result, if it may not be used
    /// - progress: hears the name of each stage; an exception in it ends the update at the next
    ///   stage, and is raised
    ///
    /// Raises InputError if the design does not fit the mesh.
    #[pyo3(signature = (profiles = None, displacements = None, *, check = true, progress = None))]
    fn update<'py>(
        &self,
        py: Python<'py>,
        profiles: Option<&Bound<'_, PyMapping>>,
        displacements: Option<&Bound<'_, PyMapping>>,
        check: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Bound<'py, MoveResult>> {
        let design = self.design_of(py, profiles, displacements)?;
        let (outcome, seconds) = self.run(py, &design, progress.as_ref())?;
        let name = (profiles.is_some() || displacements.is_some()).then_some("given to update");
        let result = Bound::new(py, MoveResult::new(py, outcome, self.job.clone(), name, seconds)?)?;
        match result.get().refused() {
            Some(refused) if check => Err(of_refused(py, refused, Some(result.clone().into_any().unbind()))),
            _ => Ok(result),
        }
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, mover) = (slf.py(), slf.get());
        let module = py.import("idmesh._restore")?;
        let restore = module.getattr("restore")?;
        let fingerprint =
            mover.fingerprint.get_or_try_init(py, || module.call_method1("fingerprint", (slf,))?.extract::<u32>())?;
        let origin = mover.origin.bind(py);
        let last = mover.starts_from_last();
        let arguments = (origin.get_item(0)?, origin.get_item(1)?, origin.get_item(2)?, last, fingerprint);
        Ok((restore, arguments).into_pyobject(py)?.into_any())
    }

    /// A copy is set up again, from the same files, and shares nothing.
    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let reduced = Self::__reduce__(slf)?;
        slf.py().import("idmesh._restore")?.call_method1("copied", reduced.get_item(1)?.cast_into::<PyTuple>()?)
    }

    /// Whether the springs of an update start from the last design; see `start_from`.
    #[getter]
    fn starts_from_last(&self) -> bool {
        self.starts_from_last.load(Ordering::Relaxed)
    }

    /// Every file that was read.
    #[getter]
    fn inputs(&self) -> Vec<PathBuf> {
        self.job.case.inputs.clone()
    }

    fn __repr__(&self) -> String {
        let report::Backend { kind, adapter, .. } = &self.job.backend;
        let report::Mesh { vertices, tets, .. } = &self.job.size;
        let mesh = self.job.case.case.mesh.display();
        format!("<idmesh.Mover: {mesh}, {vertices} vertices, {tets} tets, on {kind} ({adapter})>")
    }
}

fn by_number<'py>(py: Python<'py>, profiles: &[Profile]) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    for profile in profiles {
        found.set_item(profile.number, rows(py, profile.points.clone()))?;
    }
    Ok(found)
}
