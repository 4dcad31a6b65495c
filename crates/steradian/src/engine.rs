//! `render --engine ray`: the Python package does it, which knows the engine; this finds it and says what is missing.

use std::ffi::OsString;
use std::process::Command;

use clap::ValueEnum;

use crate::failure::{ENVIRONMENT, Failure, reason};

/// Engines that others keep.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Engine {
    /// Ray: tasks with retries on one machine or many
    Ray,
}

/// What a Python without the package answers, and one without the engine.
const NO_PACKAGE: i32 = 41;
const NO_ENGINE: i32 = 42;

/// Hands the words of the command line, after the program's name, to the Python package; its exit code.
pub(crate) fn run(words: &[OsString]) -> Result<u8, Failure> {
    let python = std::env::var_os("STERADIAN_PYTHON").unwrap_or_else(|| "python3".into());
    let name = python.to_string_lossy().into_owned();
    let ask = format!(
        "import sys\nfrom importlib.util import find_spec as f\n\
         sys.exit({NO_PACKAGE} if f('steradian') is None else {NO_ENGINE} if f('ray') is None else 0)"
    );
    let cannot = |e: std::io::Error| {
        Failure::Environment(format!(
            "--engine needs Python, and {name} cannot be started: {}; STERADIAN_PYTHON names another one",
            reason(&e)
        ))
    };
    match Command::new(&python).arg("-c").arg(ask).status().map_err(cannot)?.code() {
        Some(0) => {}
        Some(NO_PACKAGE) => {
            return Err(Failure::Environment(format!(
                "--engine needs the Python package: {name} -m pip install 'steradian[ray]', or from this source ./python[ray]; \
                 STERADIAN_PYTHON names another Python"
            )));
        }
        Some(NO_ENGINE) => {
            return Err(Failure::Environment(format!("--engine ray needs Ray: {name} -m pip install ray")));
        }
        _ => return Err(Failure::Environment(format!("{name} does not answer as Python does"))),
    }
    let status = Command::new(&python).args(["-m", "steradian.distributed"]).args(words).status().map_err(cannot)?;
    Ok(status.code().and_then(|c| u8::try_from(c).ok()).unwrap_or(ENVIRONMENT))
}
