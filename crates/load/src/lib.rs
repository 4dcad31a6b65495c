//! Scene files to `Scene`, with diagnostics.
//!
//! [`load`] reads whatever the name of a file says it is: pbrt-v4 text ([`load_pbrt`]), a Mitsuba scene, or a model
//! ([`load_model`]: glTF, OBJ, STL, PLY). All problems of a scene are reported in one run, each with its place; nothing is printed. Files are opened only
//! through [`FileAccess`].

mod export;
mod files;
mod gltf;
mod ies;
mod mitsuba;
mod model;
pub mod nanovdb;
mod pbrt;
pub mod ply;
mod sky;
mod tensor;

pub use export::{Exported, PBRT_MARK, to_pbrt};
pub use files::{Disk, FileAccess, Memory};
pub use model::{EnvironmentMap, ModelOptions, Up, is_model, load_model};
pub use pbrt::{Input, LoadOptions, LoadOutcome, load_pbrt};

/// Reads a scene in the format that its name tells; pbrt where it tells none.
pub fn load(input: Input, files: &dyn FileAccess, options: &LoadOptions) -> LoadOutcome {
    match input {
        Input::File(path) if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("xml")) => {
            mitsuba::load(path, files, &options.model)
        }
        Input::File(path) if is_model(path) => load_model(path, files, &options.model),
        _ => load_pbrt(input, files, options),
    }
}
