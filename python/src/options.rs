//! Keywords whose values are names.

use std::collections::BTreeMap;

use idmesh::backend::Selection;
use idmesh::mover::{Limits, Method, QualityTarget, SPRINGS, Springs};
use idmesh::profile::{PROFILE_MATCHES, ProfileMatch};
use pyo3::prelude::*;
use pyo3::types::{PyMapping, PyString};

use crate::errors::input;

/// The value with this name.
fn named<T: Copy>(py: Python<'_>, keyword: &str, name: &str, values: &[(&str, T)]) -> PyResult<T> {
    let found = values.iter().find(|(known, _)| *known == name);
    found.map(|&(_, value)| value).ok_or_else(|| {
        let known: Vec<String> = values.iter().map(|(known, _)| format!("\"{known}\"")).collect();
        input(py, &format!("`{keyword}` is \"{name}\", expected one of {}", known.join(", ")))
    })
}

/// Where to compute.
pub fn backend(py: Python<'_>, name: &str) -> PyResult<Selection> {
    named(py, "backend", name, &[("auto", Selection::Auto), ("cpu", Selection::Cpu), ("gpu", Selection::Gpu)])
}

/// The target of local optimisation.
pub fn quality(py: Python<'_>, name: &str) -> PyResult<Option<QualityTarget>> {
    let values =
        [("original", Some(QualityTarget::Original)), ("improve", Some(QualityTarget::Improve)), ("off", None)];
    named(py, "quality", name, &values)
}

/// The method of the relaxations.
pub fn method(py: Python<'_>, name: &str) -> PyResult<Method> {
    let values = [
        ("auto", Method::Auto),
        ("multigrid", Method::Multigrid),
        ("chebyshev", Method::Chebyshev),
        ("jacobi", Method::Jacobi),
    ];
    named(py, "method", name, &values)
}

/// The volume's springs.
pub fn springs(py: Python<'_>, name: &str) -> PyResult<&'static Springs> {
    let values: Vec<_> = SPRINGS.iter().map(|springs| (springs.name, springs)).collect();
    named(py, "springs", name, &values)
}

/// Limits on the measures of solvers: a name, or a mapping from the names of limits to values.
pub fn limits(given: &Bound<'_, PyAny>) -> PyResult<Limits> {
    let py = given.py();
    if let Ok(name) = given.cast::<PyString>() {
        return named(py, "limits", name.to_str()?, &[("openfoam", Limits::openfoam())]);
    }
    let Ok(values) = given.cast::<PyMapping>() else {
        return Err(input(py, "`limits` is neither \"openfoam\" nor a mapping from names of limits to values"));
    };
    let mut limits = Limits::default();
    for item in values.items()?.iter() {
        let (name, value): (String, Bound<'_, PyAny>) = item.extract()?;
        let value = value.extract().map_err(|_| input(py, &format!("`limits`: `{name}` is no number")))?;
        limits.set(&name, value).map_err(|error| input(py, &format!("`limits`: {error}")))?;
    }
    Ok(limits)
}

/// A number of sweeps or steps.
pub fn count(py: Python<'_>, keyword: &str, number: i64) -> PyResult<usize> {
    let count = usize::try_from(number).ok().filter(|&count| count > 0);
    count.ok_or_else(|| input(py, &format!("`{keyword}` is {number}, expected a whole number from 1 on")))
}

/// How the profiles of wings are matched, by the wing's name.
pub fn matches(py: Python<'_>, given: BTreeMap<String, String>) -> PyResult<BTreeMap<String, ProfileMatch>> {
    let of_wing = |(wing, name): (String, String)| Ok((wing, named(py, "match", &name, &PROFILE_MATCHES)?));
    given.into_iter().map(of_wing).collect()
}
