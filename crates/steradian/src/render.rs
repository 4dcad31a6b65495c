//! `steradian render`.

use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use steradian_render::{BadSample, Fault, Outcome, Plan, Rendered};
use steradian_scene::{IntegratorKind, World};

use crate::args::RenderArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure, INTERRUPTED};
use crate::numbers::ExposureArg;
use crate::output::{self, Outputs, Story};
use crate::progress::{Display, percent};
use crate::{interrupt, numbers, opened, overrides};

/// Renders and writes; the exit code.
pub(crate) fn run(args: &RenderArgs, console: &Console) -> Result<u8, Failure> {
    let console = console.quiet(args.run.quiet);
    interrupt::listen();
    // Before the scene is read, as far as the command line alone decides: a scene may take minutes to read.
    let known = !args.output.output.is_empty() || args.scene.is_none();
    let early = if known { Some(Outputs::prepare(&args.output, None)?) } else { None };

    let opened = opened::open(args.scene.as_ref(), &args.picture, &console)?;
    let outputs = match early {
        Some(outputs) => outputs,
        None => Outputs::prepare(&args.output, Some(&opened.scene.settings.film.filename))?,
    };
    let start = Instant::now();
    let world = opened::build(opened.scene)?;
    opened::check_cost(&world, args.run.yes)?;
    console.say(format_args!(
        "{}: read in {}, prepared in {}",
        opened.name,
        numbers::duration(opened.time),
        numbers::duration(start.elapsed())
    ));

    let threads = args.run.threads.map_or_else(default_threads, usize::from);
    let plan = Plan { spp: world.settings().sampler.spp, threads, time_limit: None };
    let working = interrupt::Working::begin();
    let display = Display::new(&console);
    let rendered = quietly(|| steradian_render::render(&world, &plan, &display, interrupt::flag()));
    display.finish();

    report_bad_samples(&rendered, args, &console);
    let story = Story { scene: &opened.name, settings: world.settings(), picture: &args.picture, threads };
    let (picture, variance) = output::images(&rendered, &story);
    let failed = outputs.write(&picture, Some(&variance), is_raw(&world));
    drop(working);
    if !failed.is_empty() {
        return Err(Failure::Environment(failed.join("\n")));
    }
    summary(&rendered, &outputs, args, &console);
    Ok(if rendered.outcome == Outcome::Interrupted { INTERRUPTED } else { DONE })
}

/// One thread per core that this process may use.
pub(crate) fn default_threads() -> usize {
    std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get)
}

/// Whether pixels are numbers that no exposure may change.
fn is_raw(world: &World) -> bool {
    matches!(
        world.settings().integrator.kind,
        IntegratorKind::Normals | IntegratorKind::Albedo | IntegratorKind::Depth | IntegratorKind::Uv
    )
}

/// Runs `f` without the words that a panic prints by itself: the renderer catches those of samples, and they are reported with
/// what is needed to replay them. A panic of the renderer itself goes on, and is printed then.
fn quietly<T>(f: impl FnOnce() -> T) -> T {
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
    let s = path.to_string_lossy();
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if !s.is_empty() && s.chars().all(plain) { s.into_owned() } else { format!("'{}'", s.replace('\'', "'\\''")) }
}

/// Says where the picture is and what to try next.
fn summary(rendered: &Rendered, outputs: &Outputs, args: &RenderArgs, console: &Console) {
    let rays = rendered.rays.total();
    if rendered.outcome == Outcome::Interrupted && rendered.spp == 0 {
        console.say("stopped before every pixel had its first sample: the picture has holes");
    }
    console.say(format_args!(
        "{} per pixel{} in {}, {:.1} Mrays/s{}",
        numbers::counted(u64::from(rendered.spp), "sample"),
        if rendered.outcome == Outcome::Interrupted { ", interrupted," } else { "" },
        numbers::duration(rendered.elapsed),
        numbers::mega_rate(rays, rendered.elapsed),
        rendered.film.relative_error().map_or(String::new(), |e| format!(", error {}", percent(e))),
    ));
    for path in outputs.pictures.iter().chain(&outputs.variance) {
        console.say(format_args!("wrote {}", path.display()));
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
