//! What goes wrong, as Python's exceptions: the classes are the package's own, in `steradian/errors.py`.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use steradian::embed::{Report, Trouble};

/// An exception of the package, by the name of its class.
fn raise(py: Python<'_>, class: &str, argument: Bound<'_, PyAny>) -> PyErr {
    let made = py.import("steradian.errors").and_then(|m| m.getattr(class)).and_then(|c| c.call1((argument,)));
    match made {
        Ok(error) => PyErr::from_value(error),
        Err(e) => e,
    }
}

/// A problem of a scene as a dictionary.
pub(crate) fn report<'py>(py: Python<'py>, r: &Report) -> PyResult<Bound<'py, PyDict>> {
    let d = PyDict::new(py);
    d.set_item("severity", r.severity)?;
    d.set_item("message", &r.message)?;
    d.set_item("file", r.file.as_deref())?;
    d.set_item("line", r.line)?;
    d.set_item("column", r.column)?;
    d.set_item("hint", r.hint.as_deref())?;
    d.set_item("text", &r.text)?;
    Ok(d)
}

/// As an exception.
pub(crate) fn error(py: Python<'_>, trouble: Trouble) -> PyErr {
    match trouble {
        Trouble::Scene(reports) => {
            let list = reports.iter().map(|r| report(py, r)).collect::<PyResult<Vec<_>>>();
            match list.and_then(|list| PyList::new(py, list)) {
                Ok(list) => raise(py, "SceneError", list.into_any()),
                Err(e) => e,
            }
        }
        Trouble::Input(what) => text(py, "InputError", &what),
        Trouble::Environment(what) => text(py, "MachineError", &what),
    }
}

/// An exception with a sentence.
pub(crate) fn text(py: Python<'_>, class: &str, what: &str) -> PyErr {
    raise(py, class, pyo3::types::PyString::new(py, what).into_any())
}
