//! The native half of the Python package `steradian`: scenes, renders, parts, pictures and the sampling toolbox, as classes and
//! functions over NumPy arrays. `python/steradian` puts a face on it.

// Functions that Python calls take what Python has.
#![allow(clippy::needless_pass_by_value)]

mod image;
mod sampling;
mod scene;
mod trouble;

use pyo3::prelude::*;

/// Does what a command line says, as the program `steradian` does; the exit code. `args` are the words after the program's name.
#[pyfunction]
fn run(py: Python<'_>, args: Vec<String>) -> u8 {
    let words =
        std::iter::once("steradian".to_owned()).chain(args).map(Into::into).collect::<Vec<std::ffi::OsString>>();
    py.detach(|| steradian::run(words))
}

/// The native module.
#[pymodule]
fn _steradian(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("__version__", env!("CARGO_PKG_VERSION"))?;
    m.add_function(wrap_pyfunction!(run, m)?)?;
    scene::register(m)?;
    image::register(m)?;
    sampling::register(m)
}
