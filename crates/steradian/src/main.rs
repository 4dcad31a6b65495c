//! The `steradian` binary: hands its arguments to the library and turns the answer into an exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(steradian::run(std::env::args_os()))
}
