//! Work without the interpreter's lock.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::OnceLock;

use pyo3::prelude::*;

use crate::errors::other;

/// The process in which idmesh worked first.
static OWNER: OnceLock<u32> = OnceLock::new();

/// Does work without the interpreter's lock, so that other threads of Python go on.
///
/// # Errors
/// - The process was forked after idmesh had worked: the threads that share the work are not in the
///   child, which would wait for them for ever.
/// - The work panicked, which is a fault of idmesh.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    let here = std::process::id();
    if *OWNER.get_or_init(|| here) != here {
        return Err(other(
            py,
            "idmesh started before this process was forked, and its threads are not in the child: \
             use the start method spawn or forkserver (multiprocessing.get_context(\"spawn\"))",
        ));
    }
    py.detach(|| catch_unwind(AssertUnwindSafe(work)))
        .map_err(|panic| other(py, &format!("a fault of idmesh, please report it: {}", words(panic.as_ref()))))
}

/// What a panic says.
fn words(panic: &(dyn Any + Send)) -> &str {
    match (panic.downcast_ref::<&str>(), panic.downcast_ref::<String>()) {
        (Some(words), _) => words,
        (_, Some(words)) => words,
        _ => "a panic without words",
    }
}
