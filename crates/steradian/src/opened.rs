//! From a name on the command line to a scene: reads it, reports its problems, applies what the command line replaces.

use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use steradian_image::{Scratch, Texels};
use steradian_load::{Disk, FileAccess, Input, LoadOptions, LoadOutcome, Memory, ModelOptions, load, load_pbrt};
use steradian_scene::{Error, Scene, World};
use steradian_syntax::Severity;

use crate::args::{PictureArgs, RunArgs};
use crate::console::Console;
use crate::failure::{Failure, reason};
use crate::hashing::Hashing;
use crate::numbers;

/// The scene that is rendered when none is named.
pub(crate) const SHOWCASE: &str = include_str!("../showcase/showcase.pbrt");
/// What messages call it.
pub(crate) const SHOWCASE_NAME: &str = "showcase.pbrt (built in)";

/// A scene with where it came from.
pub(crate) struct Opened {
    /// The scene, changed as the command line asked.
    pub scene: Scene,
    /// How the user would name it again.
    pub name: String,
    /// A hash of all that was read, before the command line changed anything.
    pub hash: String,
    /// How long reading took.
    pub time: Duration,
}

/// Reads a scene: a file, `-` for standard input, or the one that is built in.
pub(crate) fn read(path: Option<&Path>, options: &LoadOptions) -> Result<LoadOutcome, Failure> {
    read_hashed(path, options).map(|(outcome, _)| outcome)
}

/// As `read`, with a hash of all that was read.
fn read_hashed(path: Option<&Path>, options: &LoadOptions) -> Result<(LoadOutcome, String), Failure> {
    let memory = Memory::new();
    let files = Hashing::new(if path.is_some() { &Disk } else { &memory as &dyn FileAccess });
    let outcome = read_through(path, options, &files)?;
    let hash = files.hash();
    Ok((outcome, hash))
}

/// As `read`, from files that somebody watches.
pub(crate) fn read_watched(
    path: Option<&Path>,
    options: &LoadOptions,
    files: &dyn FileAccess,
) -> Result<LoadOutcome, Failure> {
    let memory = Memory::new();
    read_through(path, options, &Hashing::new(if path.is_some() { files } else { &memory as &dyn FileAccess }))
}

fn read_through(path: Option<&Path>, options: &LoadOptions, files: &Hashing) -> Result<LoadOutcome, Failure> {
    match path {
        None => {
            let input = Input::Text { name: SHOWCASE_NAME, text: SHOWCASE, directory: Path::new("") };
            files.note(SHOWCASE_NAME, SHOWCASE.as_bytes());
            Ok(load_pbrt(input, files, options))
        }
        Some(path) if path == Path::new("-") => {
            let mut bytes = Vec::new();
            let refused = |e: std::io::Error| Failure::Environment(format!("standard input: {}", reason(&e)));
            std::io::stdin().lock().read_to_end(&mut bytes).map_err(refused)?;
            let text = String::from_utf8(bytes).map_err(|e| {
                let at = e.utf8_error().valid_up_to();
                Failure::Input(format!("standard input: not UTF-8 text (byte {at} is not part of a character)"))
            })?;
            let input = Input::Text { name: "<stdin>", text: &text, directory: Path::new("") };
            files.note("<stdin>", text.as_bytes());
            Ok(load_pbrt(input, files, options))
        }
        Some(path) => {
            if options.model != ModelOptions::default() {
                // What is said about a model is a part of it. The size is the picture's, and told elsewhere.
                let said = ModelOptions { size: None, ..options.model.clone() };
                files.note("options", format!("{said:?}").as_bytes());
            }
            Ok(load(Input::File(path), files, options))
        }
    }
}

/// Reads a scene for rendering: prints its problems, fails if one is an error, applies `picture`.
pub(crate) fn open(path: Option<&PathBuf>, picture: &PictureArgs, console: &Console) -> Result<Opened, Failure> {
    let start = Instant::now();
    let memory = machine_memory();
    // A size on the command line replaces the scene's, however absurd that is.
    let options = LoadOptions {
        max_film_bytes: if picture.size.is_some() { u64::MAX } else { memory },
        model: picture.model.options(picture.size.map(|s| s.0)),
        ..LoadOptions::default()
    };
    let (outcome, hash) = read_hashed(path.map(PathBuf::as_path), &options)?;
    report(&outcome, console);
    let name = path.map_or(SHOWCASE_NAME.to_owned(), |p| p.display().to_string());
    let Some(mut scene) = outcome.scene else { return Err(Failure::Reported) };
    crate::overrides::apply(picture, &mut scene, console);
    check_memory(&scene, memory)?;
    Ok(Opened { scene, name, hash, time: start.elapsed() })
}

/// Prints all problems; without errors, only a few of many warnings.
pub(crate) fn report(outcome: &LoadOutcome, console: &Console) {
    const MOST_WARNINGS: usize = 20;
    let mut mild = 0;
    for d in &outcome.diagnostics {
        if d.severity != Severity::Error {
            mild += 1;
            if console.is_quiet() || mild > MOST_WARNINGS {
                continue;
            }
        }
        console.diagnostic(&d.render(&outcome.sources), false);
    }
    if mild > MOST_WARNINGS {
        console.say(format_args!(
            "... and {}; `steradian check` shows all",
            numbers::counted((mild - MOST_WARNINGS) as u64, "more warning")
        ));
    }
    let errors = outcome.errors();
    if errors > 0 {
        console.error(format_args!("the scene cannot be used: {}", numbers::counted(errors as u64, "error")));
    }
}

/// Builds what rendering needs.
pub(crate) fn build(scene: Scene, scratch: Option<&Scratch>) -> Result<World, Failure> {
    World::build_in(scene, scratch).map_err(|e| match e {
        Error::Scratch { .. } => Failure::Environment(e.to_string()),
        other => Failure::Input(other.to_string()),
    })
}

/// What of the memory that the user allows, or the machine has, a world and its film leave.
///
/// # Errors
/// If they take more than the user allows.
pub(crate) fn memory_left(world: &World, film: u64, limit: Option<u64>) -> Result<u64, Failure> {
    let census = world.census();
    let scene = (census.tree_bytes + census.mesh_bytes + census.image_bytes + census.medium_bytes) as u64;
    let left = limit.unwrap_or_else(machine_memory).checked_sub(scene.saturating_add(film));
    let (None, Some(limit)) = (left, limit) else { return Ok(left.unwrap_or(0)) };
    Err(Failure::Input(format!(
        "the scene takes {} and the picture {}, more than --max-memory {}; a smaller --size or a --crop makes the picture smaller",
        numbers::bytes(scene),
        numbers::bytes(film),
        numbers::bytes(limit)
    )))
}

/// The file for the pictures of a scene that would take more memory than the user allows, if they do.
pub(crate) fn scratch(scene: &Scene, film: u64, args: &RunArgs, console: &Console) -> Result<Option<Scratch>, Failure> {
    let Some(limit) = args.max_memory else { return Ok(None) };
    let all = |of: fn(&Texels) -> usize| scene.images.iter().map(|i| of(&i.texels) as u64).sum::<u64>();
    // A picture, the same enlarged to powers of two at the worst, and its halvings.
    let pictures = all(Texels::bytes) + all(with_halvings);
    let meshes = scene.triangle_meshes.iter().map(|m| size_of_val(m.positions.as_slice()) as u64).sum::<u64>();
    if pictures.saturating_add(film).saturating_add(meshes) <= limit.0 || pictures == 0 {
        return Ok(None);
    }
    let folder = args.scratch.clone().unwrap_or_else(std::env::temp_dir);
    let file = tempfile::tempfile_in(&folder).map_err(|e| {
        Failure::Environment(format!("no scratch file can be made in {}: {}", folder.display(), reason(&e)))
    })?;
    console.say(format_args!(
        "--max-memory {}: the scene's pictures, {} with their smaller copies, are kept in a file in {}, from which the system reads \
         what is looked at",
        numbers::bytes(limit.0),
        numbers::bytes(pictures),
        folder.display()
    ));
    Ok(Some(Scratch::new(file)))
}

fn with_halvings(t: &Texels) -> usize {
    let side = |n: usize| n.checked_next_power_of_two().unwrap_or(n);
    (side(t.width()) * side(t.height())).saturating_mul(t.channels() * t.kind().bytes()) / 3 * 4
}

/// Refuses what would not end, unless the user insists.
pub(crate) fn check_cost(world: &World, insisted: bool) -> Result<(), Failure> {
    let settings = world.settings();
    let Some(per_sample) = settings.integrator.predicted_rays(&world.light_census()) else { return Ok(()) };
    let [w, h] = settings.film.size();
    let rays = per_sample * f64::from(w) * f64::from(h) * f64::from(settings.sampler.spp);
    if rays <= steradian_scene::ABSURD_RAYS || insisted {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "this would take up to {rays:.1e} rays ({per_sample:.1e} for each of {} samples of {w} x {h} pixels), about {:.0e} hours at \
         a million rays a second; lower --max-depth or the counts of rays, or insist with --yes",
        settings.sampler.spp,
        rays / 3.6e9
    )))
}

/// Refuses a film that cannot fit.
fn check_memory(scene: &Scene, memory: u64) -> Result<(), Failure> {
    let film = &scene.settings.film;
    let need = film_bytes(film.size(), scene.settings.sampler.spp, 0);
    if need > memory {
        let [w, h] = film.size();
        return Err(Failure::Input(format!(
            "a picture of {w} x {h} pixels would take {} of memory, and this machine has {}; choose a smaller --size or a --crop",
            numbers::bytes(need),
            numbers::bytes(memory)
        )));
    }
    Ok(())
}

/// The memory that a film takes while it is rendered and written: one plane of sums for each binary digit of the sample
/// count, twice (a pass that is interrupted is undone), and the picture, its variance and what is encoded from them. Each of
/// `layers` colours that are kept besides is summed as well.
pub(crate) fn film_bytes(size: [u32; 2], spp: u32, layers: usize) -> u64 {
    const SUM: u64 = 24;
    const PICTURE: u64 = 60;
    const COLOR: u64 = 12;
    let planes = u64::from(32 - spp.leading_zeros());
    let sums = 2 * (SUM + COLOR * layers as u64) * planes;
    (u64::from(size[0]) * u64::from(size[1])).saturating_mul(sums + PICTURE + 2 * COLOR * layers as u64)
}

/// The machine's memory, where the system says; otherwise a size that no picture needs by mistake.
fn machine_memory() -> u64 {
    let kib = std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| {
        text.lines().find_map(|l| l.strip_prefix("MemTotal:")?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok())
    });
    kib.map_or(64 << 30, |k| k.saturating_mul(1024))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_of_absurd_films_does_not_overflow() {
        assert_eq!(film_bytes([u32::MAX, u32::MAX], u32::MAX, 0), u64::MAX);
        assert_eq!(film_bytes([1, 1], 1, 0), 108);
        assert!(machine_memory() > 1 << 20);
    }
}
