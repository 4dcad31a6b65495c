//! `steradian convert`.

use std::path::Path;

use steradian_image::write_bytes_atomically;
use steradian_load::{LoadOptions, to_pbrt};

use crate::args::ConvertArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure};
use crate::opened;

/// Writes a scene as pbrt-v4, with its meshes and pictures in a folder beside it; the exit code.
pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<u8, Failure> {
    let options = LoadOptions { model: args.model.options(None), ..LoadOptions::default() };
    let outcome = opened::read(Some(&args.scene), &options)?;
    for d in &outcome.diagnostics {
        console.diagnostic(&d.render(&outcome.sources), true);
    }
    let Some(scene) = outcome.scene else { return Err(Failure::Reported) };
    if args.output.extension().is_none_or(|e| e != "pbrt") {
        return Err(Failure::Input(format!("{}: only .pbrt can be written", args.output.display())));
    }
    let stem = args.output.file_stem().map_or("scene".into(), |s| s.to_string_lossy().into_owned());
    let beside = args.output.parent().unwrap_or(Path::new(""));
    let exported = to_pbrt(&scene, &format!("{stem}-files"));
    let refused = |e: &dyn std::fmt::Display| Failure::Environment(format!("{}: {e}", args.output.display()));
    if !exported.files.is_empty() {
        std::fs::create_dir_all(beside.join(format!("{stem}-files"))).map_err(|e| refused(&e))?;
    }
    for (name, bytes) in &exported.files {
        write_bytes_atomically(&beside.join(name), bytes).map_err(|e| refused(&e))?;
    }
    write_bytes_atomically(&args.output, exported.text.as_bytes()).map_err(|e| refused(&e))?;
    for note in &exported.notes {
        console.out(format!("note: {note}"));
    }
    console.heading(format_args!("{}: written, with {} files", args.output.display(), exported.files.len()));
    Ok(DONE)
}
