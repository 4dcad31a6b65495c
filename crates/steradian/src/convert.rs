//! `steradian convert`.

use std::io::Read;
use std::path::{Path, PathBuf};

use steradian_image::write_bytes_atomically;
use steradian_load::{LoadOptions, to_pbrt};

use crate::args::ConvertArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure, reason};
use crate::numbers::counted;
use crate::opened;

/// Writes a scene as pbrt-v4, with its meshes and pictures in a folder beside it; the exit code.
pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<u8, Failure> {
    let out = args.output.as_path();
    let name = out.display();
    let Some(stem) = out.file_stem().filter(|_| out.extension().is_some_and(|e| e == "pbrt")) else {
        return Err(Failure::Input(format!("{name}: only scenes of pbrt are written; call it something.pbrt")));
    };
    let folder = format!("{}-files", stem.to_string_lossy());
    let beside = out.parent().unwrap_or(Path::new("")).to_path_buf();
    refuse_to_overwrite(args, &beside.join(&folder))?;
    let options = LoadOptions { model: args.model.options(None), ..LoadOptions::default() };
    let outcome = opened::read(Some(&args.scene), &options)?;
    opened::report(&outcome, console);
    let Some(scene) = outcome.scene else { return Err(Failure::Reported) };
    let exported = to_pbrt(&scene, &folder).map_err(|e| Failure::Input(format!("{}: {e}", args.scene.display())))?;
    if !exported.files.is_empty() {
        let path = beside.join(&folder);
        std::fs::create_dir_all(&path)
            .map_err(|e| Failure::Environment(format!("{}: {}", path.display(), reason(&e))))?;
    }
    // The scene comes last: where it is, its files are.
    let files = exported.files.iter().map(|(name, bytes)| (beside.join(name), bytes.as_slice()));
    for (path, bytes) in files.chain([(out.to_path_buf(), exported.text.as_bytes())]) {
        write_bytes_atomically(&path, bytes).map_err(|e| Failure::Environment(e.to_string()))?;
    }
    for note in &exported.notes {
        console.say(format_args!("warning: {note}"));
    }
    let files = counted(exported.files.len() as u64, "file");
    console.heading(format_args!("{name}: written, with {files} in {}", beside.join(folder).display()));
    Ok(DONE)
}

/// What an earlier conversion wrote may be replaced. What somebody else wrote may not, unless they insist, and never the scene itself.
fn refuse_to_overwrite(args: &ConvertArgs, folder: &Path) -> Result<(), Failure> {
    let (input, output) = (followed(&args.scene), followed(&args.output));
    let is_part = |input: &PathBuf| followed(folder).is_some_and(|f| input.starts_with(f));
    if input.is_some() && input == output || input.as_ref().is_some_and(is_part) {
        return Err(Failure::Input(format!("{}: would be written over what it is read from", args.output.display())));
    }
    if args.force {
        return Ok(());
    }
    let hint = "--force permits it";
    if args.output.exists() && !is_ours(&args.output) {
        return Err(Failure::Input(format!(
            "{}: exists, and was not written by convert; {hint}",
            args.output.display()
        )));
    }
    if folder.exists() && !args.output.exists() {
        return Err(Failure::Input(format!("{}: exists, and may hold other files; {hint}", folder.display())));
    }
    Ok(())
}

fn followed(path: &Path) -> Option<PathBuf> {
    std::fs::canonicalize(path).ok()
}

/// Whether a file begins as what is written here does.
fn is_ours(path: &Path) -> bool {
    let mut start = vec![0; steradian_load::PBRT_MARK.len()];
    std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut start)).is_ok()
        && start == steradian_load::PBRT_MARK.as_bytes()
}
