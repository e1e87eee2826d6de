//! The exceptions. Their classes are Python's, in `idmesh/_errors.py`: one for each exit code of
//! the command line.

use idmesh::mover::{ProductError, Refused};
use idmesh::session::{Exit, SessionError};
use pyo3::prelude::*;

/// An exception of one of the classes in `idmesh._errors`.
///
/// - `result`: for the classes that carry one
fn made(py: Python<'_>, class: &str, message: &str, hint: Option<&str>, result: Option<Py<PyAny>>) -> PyErr {
    let make = || -> PyResult<Bound<'_, PyAny>> {
        let class = py.import("idmesh._errors")?.getattr(class)?;
        let text = match hint {
            Some(hint) => format!("{message}\nhint: {hint}"),
            None => message.to_owned(),
        };
        let error = class.call1((text,))?;
        error.setattr("hint", hint)?;
        if let Some(result) = result {
            error.setattr("result", result)?;
        }
        Ok(error)
    };
    make().map_or_else(|error| error, PyErr::from_value)
}

/// `InputError`: what the caller gave is wrong.
pub fn input(py: Python<'_>, message: &str) -> PyErr {
    made(py, "InputError", message, None, None)
}

/// `IdmeshError`: for what has no class of its own.
pub fn other(py: Python<'_>, message: &str) -> PyErr {
    made(py, "IdmeshError", message, None, None)
}

/// The exception for an error of the library.
pub fn of_session(py: Python<'_>, error: SessionError) -> PyErr {
    made(py, class_of(error.exit()), &error.to_string(), error.hint().as_deref(), None)
}

/// The exception for a result that may not be used, with the result.
pub fn of_refused(py: Python<'_>, refused: &Refused, result: Option<Py<PyAny>>) -> PyErr {
    made(py, class_of(Exit::from(refused)), &refused.message, refused.hint.as_deref(), result)
}

/// The exception for an error of a product.
pub fn of_product(py: Python<'_>, error: &ProductError) -> PyErr {
    let class = match error {
        ProductError::NotDifferentiable(_) => "NotDifferentiable",
        ProductError::NotConverged { .. } => "NotConverged",
        ProductError::Backend(_) => "DeviceError",
        _ => "InputError",
    };
    made(py, class, &error.to_string(), None, None)
}

fn class_of(exit: Exit) -> &'static str {
    match exit {
        Exit::NotConverged => "NotConverged",
        Exit::Inverted => "InvalidMesh",
        Exit::NoGpu => "DeviceError",
        Exit::NotDifferentiable => "NotDifferentiable",
        Exit::BadInput | Exit::Failed => "InputError",
    }
}
