//! `steradian render`.

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use steradian_image::{Format, Metadata, write_bytes_atomically};
use steradian_render::{Adaptive, BadSample, Fault, Goals, Label, Layers, Outcome, Rendered, Share, Snapshot, Task};
use steradian_scene::{IntegratorKind, RenderSettings, World};

use crate::aov::{self, Aov};
use crate::args::RenderArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure, INTERRUPTED};
use crate::numbers::ExposureArg;
use crate::oidn::Oidn;
use crate::output::{self, Outputs, Story, Taken};
use crate::progress::{Display, percent};
use crate::sampler_error::SamplerError;
use crate::watch::Watch;
use crate::{again, counting, denoise, interrupt, keep, numbers, opened, overrides, stop, technique_args, tev};

/// Renders and writes; the exit code.
pub(crate) fn run(args: &RenderArgs, console: &Console) -> Result<u8, Failure> {
    let console = console.quiet(args.run.quiet);
    interrupt::listen();
    let (args, expected_hash) = again::complete(args)?;
    match args.turntable {
        Some(frames) => turntable(&args, frames, &console),
        None => one(&args, expected_hash, &console),
    }
}

/// Pictures from all around, one after the other.
fn turntable(args: &RenderArgs, frames: u32, console: &Console) -> Result<u8, Failure> {
    if !args.scene.as_deref().is_some_and(steradian_load::is_model) {
        return Err(Failure::Input("--turntable goes around a model: .gltf .glb .obj .stl .ply".into()));
    }
    if args.output.output.is_empty() {
        return Err(Failure::Input("--turntable needs -o FILE, whose name the pictures get with a number".into()));
    }
    if args.keep.shard.is_some() || args.keep.checkpoint.is_some() || args.output.variance.is_some() {
        return Err(Failure::Input("--turntable makes pictures only: no shards, checkpoints or variance".into()));
    }
    let digits = frames.to_string().len().max(4);
    for frame in 0..frames {
        let mut this = args.clone();
        let start = args.picture.model.turn.unwrap_or(0.0);
        this.picture.model.turn = Some(start + 360.0 * frame as f32 / frames as f32);
        for path in &mut this.output.output {
            let extension = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            path.set_extension(format!("{:0digits$}.{extension}", frame + 1));
        }
        let code = one(&this, None, console)?;
        if code != DONE {
            return Ok(code);
        }
    }
    Ok(DONE)
}

/// One picture.
fn one(args: &RenderArgs, expected_hash: Option<String>, console: &Console) -> Result<u8, Failure> {
    // Before the scene is read, as far as the command line alone decides: a scene may take minutes to read.
    let part = part_file(args)?;
    counting::check(args)?;
    let known = !args.output.output.is_empty() || args.scene.is_none();
    let early = if known { Some(prepare(args, part, None)?) } else { None };
    let oidn = if args.denoise { Some(Oidn::load().map_err(Failure::Environment)?) } else { None };
    let resume = keep::open(&args.keep)?;
    let viewer = args.run.tev.as_deref().map(tev::connect).transpose()?;

    let display = Display::new(args.run.progress, console);
    display.phase("load");
    let mut opened = opened::open(args.scene.as_ref(), &args.picture, console)?;
    let outputs = match early {
        Some(outputs) => outputs,
        None => prepare(args, part, Some(&opened.scene.settings.film.filename))?,
    };
    if expected_hash.is_some_and(|hash| hash != opened.hash) {
        console.warning("the scene's files are not those that the image of --like was made from");
    }
    let spp = args.stop.most_spp(args.picture.spp, opened.scene.settings.sampler.spp);
    if let Some(snapshot) = &resume {
        continue_points(snapshot, args, &mut opened.scene.settings, console);
    }
    display.phase("build");
    let start = Instant::now();
    let size = opened.scene.settings.film.size();
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    let denoising = if args.denoise { pixels.saturating_mul(denoise::BYTES_A_PIXEL) } else { 0 };
    let film = |layers| opened::film_bytes(size, spp.min(1 << 12), layers).saturating_add(denoising);
    let scratch = opened::scratch(&opened.scene, film(0), &args.run, console)?;
    let world = opened::build(opened.scene, scratch.as_ref())?;
    let layers = aov::layers(&args.aov, args.picture.filter_outliers, &world)?;
    let memory = args.run.max_memory.map(|limit| limit.0);
    let left = opened::memory_left(&world, film(layers.width()), memory)?;
    opened::check_cost(&world, args.run.yes)?;
    for what in technique_args::idle(&args.picture.technique, &world) {
        console.warning(what);
    }
    console.say(format_args!(
        "{}: read in {}, prepared in {}",
        opened.name,
        numbers::duration(opened.time),
        numbers::duration(start.elapsed())
    ));

    let threads = args.run.threads.map_or_else(default_threads, usize::from);
    let share = keep::share(args.keep.shard, world.settings());
    let goals = goals(args, world.settings(), share, &layers)?;
    let identity = keep::identity(world.settings(), &opened.hash, goals.adaptive, share, &layers);
    if let (Some(snapshot), Some(path)) = (&resume, &args.keep.checkpoint) {
        keep::check(path, snapshot, &identity)?;
        let done = snapshot.film.average_samples();
        console.say(format_args!("going on from {} with {done:.1} samples per pixel", path.display()));
    }
    let story = Story {
        scene: &opened.name,
        scene_hash: &opened.hash,
        settings: world.settings(),
        picture: &args.picture,
        stop: &args.stop,
    };
    let manifest = output::manifest(&story);
    let note = output::note_of_metadata(&manifest);
    let label = Label { identity: &identity, note: &note };
    let mut watch = Watch::new(display, args, &outputs, &manifest, is_raw(&world), viewer, console);
    if matches!(world.settings().integrator.kind, IntegratorKind::Function(_)) {
        watch.sampler_error = Some(SamplerError::default());
    }
    let working = interrupt::Working::begin();
    let plan = args.stop.plan(spp, threads);
    let task = Task { world: &world, plan, goals, layers: &layers, label, resume };
    let before = task.resume.as_ref().map_or(0, |s| s.film.total_samples());
    let (rendered, counters) = quietly(|| counting::run(task, args.run.counters.is_some(), &watch, interrupt::flag()));
    watch.finish(&rendered.film);
    watch.display.phase("write");
    report_bad_samples(&rendered, args, console);
    let extras = Extras { aovs: &args.aov, layers: &layers, world: &world, oidn: oidn.as_ref().map(|o| (o, left)) };
    let (mut failed, taken) = write(&rendered, &outputs, &watch, part, (&manifest, threads), label, &extras);
    let report = world.settings().integrator.report.as_ref().zip(watch.sampler_error.as_ref());
    if let Some((path, found)) = report {
        let written = write_bytes_atomically(Path::new(path), found.table().as_bytes());
        failed.extend(written.err().map(|e| format!("cannot write {path}: {e}")));
    }
    if let (Some(path), Some(counters)) = (&args.run.counters, &counters) {
        let samples = rendered.film.total_samples().saturating_sub(before);
        failed.extend(counting::write(path, &counting::json(counters, samples), console).err());
    }
    drop(working);
    if !failed.is_empty() {
        return Err(Failure::Environment(failed.join("\n")));
    }
    summary(&rendered, &outputs, args, part, console);
    taken.iter().for_each(|t| t.say(console));
    let files = outputs.pictures.iter().chain(&outputs.variance).map(PathBuf::as_path).chain(part);
    watch.display.summary(&rendered, &files.map(|p| p.display().to_string()).collect::<Vec<_>>());
    Ok(if rendered.outcome == Outcome::Interrupted { INTERRUPTED } else { DONE })
}

/// What goes into the picture's file besides the picture.
struct Extras<'a> {
    aovs: &'a [Aov],
    layers: &'a Layers,
    world: &'a World,
    /// The denoiser, and the memory that it may take.
    oidn: Option<(&'a Oidn, u64)>,
}

/// Writes the checkpoint, the part and the pictures: everything that can be written. What could not; and what biased options took.
fn write(
    rendered: &Rendered,
    outputs: &Outputs,
    watch: &Watch,
    part: Option<&Path>,
    (manifest, threads): (&Metadata, usize),
    label: Label,
    extras: &Extras,
) -> (Vec<String>, Vec<Taken>) {
    let Extras { aovs, layers, world, oidn } = *extras;
    let (mut failed, mut taken) = (Vec::new(), Vec::new());
    if let Some(keeper) = &watch.keeper {
        failed.extend(keeper.finish(&rendered.encode(&label)).err());
    }
    // A second signal ends the program at once; the first one, which ended the render, does not end this.
    let go_on = AtomicBool::new(false);
    if let Some(path) = part {
        // A part that is not complete is gone on with or thrown away; either way nobody looks.
        let (share, spp) = rendered.share();
        let finished = rendered.outcome == Outcome::Finished;
        let seen = finished.then(|| aov::seen(aovs, world, (share.part(), spp), threads, &go_on)).flatten().flatten();
        failed.extend(keep::store(path, &rendered.encode_part(&label, seen.as_ref())).err());
    }
    if part.is_none() {
        let (mut picture, variance) = output::images(rendered, manifest, Some(threads));
        match output::add_layers(&mut picture, &rendered.film, layers.names()) {
            Ok(found) => taken = found,
            Err(e) => failed.push(format!("what was kept beside the picture cannot be added: {e}")),
        }
        match aov::add(&mut picture, aovs, rendered, world, threads, &go_on) {
            Ok(_) => {}
            Err(e) => failed.push(format!("the channels of --aov cannot be added: {e}")),
        }
        if let Some((oidn, memory)) = oidn
            && let Err(e) = denoise::denoise(oidn, &mut picture, world, (threads, rendered.spp), memory)
        {
            failed.push(format!("the picture is not denoised: {e}"));
        }
        failed.extend(outputs.write(&picture, Some(&variance), watch.raw));
    }
    (failed, taken)
}

/// What decides which samples are taken. Where samples bring light to all pixels, none can be given to the noisy ones alone.
pub(crate) fn goals(
    args: &RenderArgs,
    settings: &RenderSettings,
    share: Share,
    layers: &Layers,
) -> Result<Goals, Failure> {
    let goals = args.stop.goals(share, &args.output);
    let kind = settings.integrator.kind;
    if !kind.starts_at_lights() {
        return Ok(goals);
    }
    let name = overrides::integrator_name(kind);
    if kind.splats() && !layers.is_empty() {
        return Err(Failure::Input(format!(
            "`{name}` does not tell parts of the light from each other: leave out --aov {}",
            layers.names().join(" ")
        )));
    }
    let chains = matches!(kind, IntegratorKind::Mlt(_));
    let of_errors = args.aov.iter().any(|a| matches!(a, Aov::Variance | Aov::Error));
    if chains && (args.stop.error.is_some() || args.output.variance.is_some() || of_errors) {
        return Err(Failure::Input(
            "the steps of `mlt` are no independent samples, so that nothing is known of the error: leave out --error, \
             --variance and --aov variance or error"
                .into(),
        ));
    }
    if args.stop.adaptive.is_some() {
        return Err(Failure::Input(format!(
            "--adaptive gives samples to the pixels that need them, and samples of `{name}` bring light to all pixels alike"
        )));
    }
    Ok(Goals { adaptive: Adaptive::No, ..goals })
}

/// The file for a part of a distributed render, if one is to be made.
fn part_file(args: &RenderArgs) -> Result<Option<&Path>, Failure> {
    let parts = || args.output.output.iter().map(PathBuf::as_path).filter(|p| keep::is_part(p));
    let wrong = |what: &str| Err(Failure::Input(what.to_owned()));
    match (args.keep.shard, parts().next(), args.output.output.len()) {
        (None, None, _) => Ok(None),
        (None, Some(_), _) => wrong("a .part is made by --shard I/N"),
        (Some(_), Some(path), 1) if args.output.variance.is_none() && args.run.preview.is_none() => {
            if args.stop.is_open_ended() || args.stop.adaptive.is_some() {
                return wrong(
                    "with --shard the number of samples is fixed: --time, --error and --adaptive do not apply",
                );
            }
            output::check(path)?;
            Ok(Some(path))
        }
        (Some(_), _, _) => wrong("--shard makes no picture: give one -o FILE.part, and make the picture with merge"),
    }
}

/// The pictures to write; none where a part is made.
fn prepare(args: &RenderArgs, part: Option<&Path>, scene_file: Option<&str>) -> Result<Outputs, Failure> {
    if let Some(path) = &args.run.preview {
        let name = path.display().to_string();
        if !matches!(Format::from_name(&name), Some(Format::Png | Format::Jpeg)) {
            return Err(Failure::Input(format!("{name}: a preview is a .png or .jpg")));
        }
        output::check(path)?;
    }
    let outputs = Outputs::prepare(&args.output, scene_file, part.is_some())?;
    let takes = |p: &PathBuf, aov: Aov| match Format::from_name(&p.to_string_lossy()) {
        Some(Format::Exr) => true,
        Some(Format::Png) => aov == Aov::Alpha,
        _ => false,
    };
    if let Some(lost) = args.aov.iter().find(|&&aov| part.is_none() && !outputs.pictures.iter().any(|p| takes(p, aov)))
    {
        return Err(Failure::Input(format!("--aov {} needs an .exr to be written to", lost.name())));
    }
    if args.denoise && !outputs.pictures.iter().any(|p| takes(p, Aov::Depth)) {
        return Err(Failure::Input("--denoise needs an .exr, which keeps the noisy picture too".into()));
    }
    Ok(outputs)
}

/// Points that were laid out for a number of samples stay so when a render goes on to more.
fn continue_points(snapshot: &Snapshot, args: &RenderArgs, settings: &mut RenderSettings, console: &Console) {
    let stored = snapshot.identity.get("sampler-spp").and_then(|v| v.parse::<u32>().ok());
    let Some(stored) = stored.filter(|&n| n != settings.sampler.spp && args.picture.sampler_spp.is_none()) else {
        return;
    };
    let strata = settings.sampler.strata;
    settings.sampler.spp = stored;
    settings.sampler.strata = if args.picture.spp.is_some() { [0, 0] } else { strata };
    console.say(format_args!(
        "the {} points were laid out for {}, and stay so: the picture will be that of --sampler-spp {stored}",
        settings.sampler.kind.name(),
        numbers::counted(u64::from(stored), "sample"),
    ));
}

/// One thread per core that this process may use.
pub(crate) fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get)
}

/// Whether pixels are numbers that no exposure may change.
fn is_raw(world: &World) -> bool {
    matches!(
        world.settings().integrator.kind,
        IntegratorKind::Function(_)
            | IntegratorKind::Normals
            | IntegratorKind::Albedo
            | IntegratorKind::Depth
            | IntegratorKind::Uv
    )
}

/// Runs `f` without the words that a panic prints by itself: the renderer catches those of samples, and they are reported with
/// what is needed to replay them. A panic of the renderer itself goes on, and is printed then.
pub(crate) fn quietly<T>(f: impl FnOnce() -> T) -> T {
    type Hook = Box<dyn Fn(&std::panic::PanicHookInfo<'_>) + Sync + Send + 'static>;
    struct Restore(Mutex<Option<Hook>>);
    impl Drop for Restore {
        fn drop(&mut self) {
            // A hook cannot be changed by a thread that is panicking.
            if !std::thread::panicking()
                && let Ok(mut hook) = self.0.lock()
                && let Some(hook) = hook.take()
            {
                std::panic::set_hook(hook);
            }
        }
    }
    let restore = Restore(Mutex::new(Some(std::panic::take_hook())));
    std::panic::set_hook(Box::new(|_| {}));
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(f));
    drop(restore);
    result.unwrap_or_else(|payload| {
        let words = payload.downcast_ref::<String>().cloned();
        panic!("{}", words.or_else(|| payload.downcast_ref::<&str>().map(|s| (*s).into())).unwrap_or_default())
    })
}

/// Says which samples went wrong and how to trace them again.
fn report_bad_samples(rendered: &Rendered, args: &RenderArgs, console: &Console) {
    const SHOWN: usize = 3;
    if rendered.bad_count == 0 {
        return;
    }
    let total = numbers::counted(rendered.bad_count, "sample");
    console.warning(format_args!("{total} went wrong and counted as black; to see what happened:"));
    for bad in rendered.bad.iter().take(SHOWN) {
        let what = match &bad.fault {
            Fault::NotFinite => "the radiance is not a finite number".to_owned(),
            Fault::Panic(message) => format!("the renderer broke one of its own rules: {message}"),
        };
        console.say(format_args!("  {}\n    {what}", replay(bad, args)));
    }
}

/// The command that traces a sample again.
fn replay(bad: &BadSample, args: &RenderArgs) -> String {
    let scene = args.scene.as_deref().map_or(String::new(), |p| format!(" {}", shell_word(p)));
    let [x, y] = bad.pixel;
    format!("steradian trace{scene} --pixel {x},{y} --sample {}{}", bad.sample, overrides::as_typed(&args.picture))
}

/// A path as one word of a shell.
fn shell_word(path: &Path) -> String {
    crate::model_args::quoted(&path.to_string_lossy())
}

/// Says where the picture is and what to try next.
fn summary(rendered: &Rendered, outputs: &Outputs, args: &RenderArgs, part: Option<&Path>, console: &Console) {
    let [least, most] = rendered.film.samples();
    let interrupted = rendered.outcome == Outcome::Interrupted;
    if interrupted && least == 0 && part.is_none() {
        console.say("stopped before every pixel had its first sample: the picture has holes");
    } else if interrupted && least != most && part.is_none() && args.stop.adaptive() == Adaptive::No {
        console.say("stopped inside a pass that had been resumed: some tiles are a pass ahead");
    }
    let why = match rendered.outcome {
        Outcome::Finished => "",
        Outcome::ErrorReached => ", good enough,",
        Outcome::TimeLimit => ", out of time,",
        Outcome::Interrupted => ", interrupted,",
    };
    console.say(format_args!(
        "{}{why} in {}, {:.1} Mrays/s{}",
        stop::samples_in_words(rendered),
        numbers::duration(rendered.elapsed),
        numbers::mega_rate(rendered.rays.total(), rendered.elapsed),
        rendered.error.map_or(String::new(), |e| format!(", error {}", percent(e))),
    ));
    if let Some(bound) = rendered.bound {
        console.say(args.stop.statement(bound));
    }
    outputs.say(console);
    if let Some(part) = part {
        let state = if interrupted { ", which is not complete" } else { "" };
        console.say(format_args!("wrote {}{state}", part.display()));
        return;
    }
    console.say(format_args!("next: {}", suggestion(args, outputs)));
}

fn suggestion(args: &RenderArgs, outputs: &Outputs) -> String {
    let exr = outputs.pictures.iter().find(|p| p.extension().is_some_and(|e| e == "exr"));
    match (&args.scene, exr) {
        (None, _) => {
            "steradian render SCENE.pbrt renders a scene of yours; steradian render --spp 256 makes this one cleaner"
                .into()
        }
        (Some(_), _) if args.output.exposure == ExposureArg::Auto => {
            "--spp N takes more samples; --integrator normals, albedo or ao shows what the camera sees".into()
        }
        (Some(_), Some(exr)) if outputs.pictures.len() == 1 => {
            format!("steradian info {} tells how it was made", shell_word(exr))
        }
        (Some(_), Some(exr)) => format!(
            "--exposure auto if the PNG is too dark or too bright; steradian info {} tells how it was made",
            shell_word(exr)
        ),
        (Some(_), None) => {
            "--exposure auto if the picture is too dark or too bright; -o FILE.exr keeps the light as it is".into()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::{Cli, Command};
    use clap::Parser;

    #[test]
    fn a_replay_command_can_be_pasted() {
        let line = ["steradian", "render", "my scene's.pbrt", "--spp", "4", "--seed", "9", "--threads", "2"];
        let Command::Render(args) = Cli::try_parse_from(line).unwrap().command else { panic!("not render") };
        let bad = BadSample { pixel: [3, 4], sample: 2, fault: Fault::NotFinite };
        assert_eq!(
            replay(&bad, &args),
            "steradian trace 'my scene'\\''s.pbrt' --pixel 3,4 --sample 2 --spp 4 --seed 9",
            "threads are left out because they change nothing"
        );
    }

    #[test]
    fn a_panic_of_the_renderer_itself_is_not_lost() {
        let caught = std::panic::catch_unwind(|| quietly(|| panic!("rule {} broken", 7)));
        let payload = caught.unwrap_err();
        assert_eq!(payload.downcast_ref::<String>().unwrap(), "rule 7 broken");
        assert_eq!(quietly(|| 5), 5);
    }
}
