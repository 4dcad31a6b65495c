//! `steradian view`: the live page. Here is what it needs of files and of the command line; the rest is in the crate `view`.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use clap::{Args, Parser, ValueHint};
use steradian_image::{Attribute, Format, Image, WriteOptions, encode};
use steradian_load::{Disk, FileAccess, LoadOptions, LoadOutcome};
use steradian_render::Film;
use steradian_sampling::sampler::SamplerKind;
use steradian_scene::{RenderSettings, Scene};
use steradian_syntax::Severity;
use steradian_view::{Options, Refusal, Said, Server, Settings, Stage};

use crate::args::{PictureArgs, SamplerArg};
use crate::console::Console;
use crate::failure::{DONE, Failure};
use crate::model_args::quoted;
use crate::output::{self, Story};
use crate::stop::StopArgs;
use crate::{interrupt, opened, overrides};

pub(crate) const NOTES: &str = "\
The page needs nothing but a browser: open the address that is printed. Its last part is a secret of this run.
From another machine: ssh -L 7700:127.0.0.1:7700 THAT-MACHINE, and open the same address here.

Examples:
  steradian view                          the built-in scene
  steradian view kitchen.pbrt --open      a scene, in your browser at once; it is read again when its files change";

/// `view`.
#[derive(Args, Debug)]
pub(crate) struct ViewArgs {
    /// A pbrt-v4 scene (.pbrt or .pbrt.gz), a Mitsuba scene (.xml), a model (.gltf .glb .obj .stl .ply) [default: the built-in scene]
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: Option<PathBuf>,

    /// Serve on this port [default: 7700, or any if that is taken]
    #[arg(long, value_name = "N")]
    pub port: Option<u16>,

    /// Serve on this address of the machine; others than the loopback let other machines in that know the secret
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1")]
    pub host: IpAddr,

    /// Open the page in a browser
    #[arg(long)]
    pub open: bool,

    /// Threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    #[command(flatten)]
    pub picture: PictureArgs,
}

/// Serves until interrupted; the exit code.
pub(crate) fn run(args: &ViewArgs, console: &Console) -> Result<u8, Failure> {
    interrupt::listen();
    if args.scene.as_deref() == Some(Path::new("-")) {
        return Err(Failure::Input("a page needs a file: what comes on standard input cannot be read again".into()));
    }
    let stage = Arc::new(Desk::new(args.scene.clone(), &args.picture));
    let outcome = stage.read()?;
    opened::report(&outcome, console);
    let Some(scene) = outcome.scene else { return Err(Failure::Reported) };
    let threads = args.threads.map_or_else(crate::render::default_threads, usize::from);
    let settings = Settings { host: args.host, port: args.port, threads };
    let server = steradian_view::start(stage, scene, &settings).map_err(|refusal| match refusal {
        Refusal::Input(what) => Failure::Input(what),
        Refusal::Machine(e) => Failure::Environment(format!(
            "cannot serve on {}{}: {}",
            args.host,
            args.port.map_or(String::new(), |p| format!(" port {p}")),
            crate::failure::reason(&e)
        )),
    })?;
    serve(&server, args, console);
    Ok(DONE)
}

fn serve(server: &Server, args: &ViewArgs, console: &Console) {
    let working = interrupt::Working::begin();
    // The address is the result: programs read it.
    console.out(server.url());
    if !server.address().ip().is_loopback() {
        console.warning(
            "whoever can reach this machine and has the address with its secret can use the page; nothing is encrypted",
        );
    }
    console.say("open this address in a browser; Ctrl-C ends");
    if args.open
        && let Err(e) = browse(&server.url())
    {
        console.warning(format_args!("no browser could be opened: {}", crate::failure::reason(&e)));
    }
    while !interrupt::flag().load(Ordering::SeqCst) {
        std::thread::sleep(Duration::from_millis(50));
    }
    drop(working);
}

/// Asks the desktop to open an address.
fn browse(url: &str) -> io::Result<()> {
    let (program, first): (&str, &[&str]) = if cfg!(target_os = "macos") {
        ("open", &[])
    } else if cfg!(windows) {
        ("rundll32", &["url.dll,FileProtocolHandler"])
    } else {
        ("xdg-open", &[])
    };
    let mut command = std::process::Command::new(program);
    command.args(first).arg(url).stdin(std::process::Stdio::null());
    command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null());
    command.spawn().map(|_| ())
}

/// When a file last changed, and its size; none where there is no file.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> Stamp {
    let data = std::fs::metadata(path).ok()?;
    Some((data.modified().ok()?, data.len()))
}

/// The files of a scene, remembered as they are read.
#[derive(Default)]
struct Watched(Mutex<BTreeMap<PathBuf, Stamp>>);

impl Watched {
    fn note(&self, path: &Path) {
        let mut files = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        files.entry(path.to_owned()).or_insert_with(|| stamp(path));
    }
}

impl FileAccess for Watched {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        self.note(path);
        Disk.read(path)
    }

    fn exists(&self, path: &Path) -> bool {
        // A file that is missing may come.
        self.note(path);
        Disk.exists(path)
    }
}

/// What the page's server needs of the command line.
struct Desk {
    scene: Option<PathBuf>,
    picture: PictureArgs,
    files: Watched,
}

/// The options of a page, as the command line reads them.
#[derive(Parser, Debug)]
#[command(no_binary_name = true, disable_help_flag = true)]
struct Typed {
    #[command(flatten)]
    picture: PictureArgs,
}

/// Options that name files or change how a scene is read stay as they were given on the command line.
const OF_THE_PAGE: [&str; 31] = [
    "spp",
    "sampler-spp",
    "size",
    "crop",
    "seed",
    "integrator",
    "sampler",
    "max-depth",
    "clamp",
    "color",
    "look-at",
    "fov",
    "lens-radius",
    "focal-distance",
    "shutter-interval",
    "light-sampling",
    "lobe-sampling",
    "mis",
    "stratify",
    "roulette",
    "split",
    "filter",
    "subpixels",
    "aperture",
    "light-rays",
    "lobe-rays",
    "times",
    "no-jitter",
    "ambient",
    "strategy",
    "unweighted",
];

impl Desk {
    fn new(scene: Option<PathBuf>, picture: &PictureArgs) -> Self {
        Self { scene, picture: picture.clone(), files: Watched::default() }
    }

    /// Reads the scene, and remembers its files as they are now.
    fn read(&self) -> Result<LoadOutcome, Failure> {
        self.files.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
        let options =
            LoadOptions { model: self.picture.model.options(self.picture.size.map(|s| s.0)), ..LoadOptions::default() };
        opened::read_watched(self.scene.as_deref(), &options, &self.files)
    }

    /// The options, with those that the page may not change.
    fn parse(&self, options: &Options) -> Result<PictureArgs, String> {
        let unknown: BTreeSet<&str> =
            options.keys().map(String::as_str).filter(|name| !OF_THE_PAGE.contains(name)).collect();
        if let Some(name) = unknown.first() {
            return Err(format!("the page has no option --{name}"));
        }
        let flag = |name: &str| name == "no-jitter" || name == "unweighted";
        let words = options.iter().map(
            |(name, value)| {
                if flag(name) { format!("--{name}") } else { format!("--{name}={value}") }
            },
        );
        let typed = Typed::try_parse_from(words).map_err(|e| {
            let text = e.to_string();
            let line = text.lines().find(|l| !l.trim().is_empty()).unwrap_or_default();
            line.trim_start_matches("error: ").to_owned()
        })?;
        Ok(PictureArgs {
            model: self.picture.model.clone(),
            filter_outliers: self.picture.filter_outliers,
            ..typed.picture
        })
    }
}

impl Stage for Desk {
    fn name(&self) -> String {
        match &self.scene {
            // Its name alone: where it lies is nobody's business.
            Some(path) => path.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            None => opened::SHOWCASE_NAME.into(),
        }
    }

    fn options(&self) -> Options {
        let own = PictureArgs { model: Default::default(), filter_outliers: false, ..self.picture.clone() };
        let typed = overrides::as_typed(&own);
        let pairs = typed.split(" --").filter(|p| !p.trim().is_empty());
        pairs
            .map(|pair| {
                let (name, value) = pair.split_once(' ').unwrap_or((pair, ""));
                (name.trim().to_owned(), value.trim().to_owned())
            })
            .collect()
    }

    fn open(&self) -> Result<Scene, Vec<String>> {
        let outcome = self.read().map_err(|f| vec![f.to_string()])?;
        let errors = || outcome.diagnostics.iter().filter(|d| d.severity == Severity::Error);
        let reports: Vec<String> = errors().map(|d| d.render(&outcome.sources)).collect();
        outcome.scene.ok_or(reports)
    }

    fn changed(&self) -> bool {
        let files = self.files.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let changed = files.iter().any(|(path, then)| stamp(path) != *then);
        if changed {
            // Told once; what is read next is remembered as it is then.
            let mut files = self.files.0.lock().unwrap_or_else(PoisonError::into_inner);
            files.iter_mut().for_each(|(path, then)| *then = stamp(path));
        }
        changed
    }

    fn apply(&self, options: &mut Options, said: Said) -> Result<Said, String> {
        let mut picture = self.parse(options)?;
        let mut scene = Scene::new(said.settings);
        scene.camera = said.camera;
        let console = Console::new().quiet(true);
        overrides::apply(&picture, &mut scene, &console);
        // A page has no last sample, so its points must not depend on how many there will be.
        if scene.settings.sampler.kind == SamplerKind::ZSobol && picture.sampler.is_none() {
            picture.sampler = Some(SamplerArg::PaddedSobol);
            options.insert("sampler".into(), "paddedsobol".into());
            scene.settings.sampler.kind = SamplerKind::PaddedSobol;
        }
        Ok(Said { camera: scene.camera, settings: scene.settings })
    }

    fn command(&self, word: &str, options: &Options, more: &str) -> String {
        let scene = self.scene.as_deref().map_or(String::new(), |p| format!(" {}", quoted(&p.to_string_lossy())));
        let more = if more.is_empty() { String::new() } else { format!(" {more}") };
        let typed = self.parse(options).map(|p| overrides::as_typed(&p)).unwrap_or_default();
        format!("steradian {word}{scene}{more}{typed}")
    }

    fn picture(
        &self,
        options: &Options,
        settings: &RenderSettings,
        film: &Film,
        took: Duration,
    ) -> Result<Vec<u8>, String> {
        let picture = self.parse(options)?;
        let [least, most] = film.samples();
        if most == 0 {
            return Err("there is no picture yet".into());
        }
        let story =
            Story { scene: &self.name(), scene_hash: "", settings, picture: &picture, stop: &StopArgs::default() };
        let mut meta = output::manifest(&story);
        meta.set("samplesPerPixel", Attribute::Int(i32::try_from(least).unwrap_or(i32::MAX)));
        meta.set("steradian.renderSeconds", Attribute::Float(took.as_secs_f32()));
        let [w, h] = film.size();
        let mut image = Image::from_rgb(w, h, &film.mean()).ok_or("the picture has no pixels")?;
        image.metadata = meta;
        encode(&image, Format::Exr, "steradian.exr", &WriteOptions::default()).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn desk() -> Desk {
        Desk::new(Some("my scene.pbrt".into()), &PictureArgs::default())
    }

    fn options(pairs: &[(&str, &str)]) -> Options {
        pairs.iter().map(|(a, b)| ((*a).to_owned(), (*b).to_owned())).collect()
    }

    #[test]
    fn a_page_speaks_the_command_lines_language_but_names_no_files() {
        let said = options(&[
            ("integrator", "bdpt"),
            ("max-depth", "3"),
            ("no-jitter", ""),
            ("look-at", "0,0,-5,0,0,0,0,1,0"),
        ]);
        assert_eq!(
            desk().command("trace", &said, "--pixel 1,2 --sample 0"),
            "steradian trace 'my scene.pbrt' --pixel 1,2 --sample 0 --integrator bdpt --max-depth 3 --look-at 0,0,-5,0,0,0,0,1,0 --no-jitter"
        );
        for wrong in ["env", "allow-outside", "define", "camera", "output", "threads"] {
            assert!(desk().parse(&options(&[(wrong, "/etc/passwd")])).unwrap_err().contains(wrong));
        }
        for (name, value) in [("spp", "0"), ("integrator", "magic"), ("fov", "200"), ("spp", "4 --env /x")] {
            assert!(desk().parse(&options(&[(name, value)])).is_err(), "{name} {value}");
        }
    }

    #[test]
    fn every_option_of_the_page_is_one_of_the_command_line() {
        use clap::CommandFactory;
        let command = Typed::command();
        let known: BTreeSet<&str> = command.get_arguments().filter_map(|a| a.get_long()).collect();
        assert!(OF_THE_PAGE.iter().all(|name| known.contains(name)));
    }

    #[test]
    fn what_was_typed_comes_back_as_options() {
        let picture = Typed::try_parse_from(["--spp=8", "--no-jitter", "--size=32x16", "--look-at=0,0,-5,0,0,0,0,1,0"]);
        let desk = Desk::new(None, &picture.unwrap().picture);
        let expected =
            options(&[("spp", "8"), ("no-jitter", ""), ("size", "32x16"), ("look-at", "0,0,-5,0,0,0,0,1,0")]);
        assert_eq!(desk.options(), expected);
    }

    #[test]
    fn a_file_that_changes_is_noticed_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.pbrt");
        std::fs::write(&path, "WorldBegin\n").unwrap();
        let desk = Desk::new(Some(path.clone()), &PictureArgs::default());
        assert!(desk.open().is_ok() && !desk.changed());
        std::fs::write(&path, "WorldBegin\nShpae \"sphere\"\n").unwrap();
        assert!(desk.changed() && !desk.changed());
        let reports = desk.open().unwrap_err();
        assert!(reports[0].contains("a.pbrt:2:1") && reports[0].contains("^^^^^"), "{reports:?}");
    }
}
