//! The command line's grammar. The names are a contract: scripts rely on them.

use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use std::path::PathBuf;

use crate::aov::Aov;
use crate::camera_args::CameraArgs;
use crate::engine::Engine;
use crate::keep::KeepArgs;
use crate::merge::MergeArgs;
use crate::model_args::ModelArgs;
use crate::numbers::{Crop, ExposureArg, Memory, Pixel, Positive, Size};
use crate::selftest::SelftestArgs;
use crate::stop::StopArgs;
use crate::submit::SubmitArgs;
use crate::technique_args::TechniqueArgs;
use crate::view::ViewArgs;

/// What `--help` says first.
const ABOUT: &str = "Steradian turns a description of a scene into a photograph of it, by following light.";

const EXAMPLES: &str = "\
Examples:
  steradian render                                  render the scene that is built in
  steradian render kitchen.pbrt -o kitchen.exr      render a pbrt-v4 scene
  steradian render kitchen.pbrt --spp 16 --size 480x270     a quick look
  steradian render helmet.glb                       a picture of a model
  steradian view kitchen.pbrt --open                look at it in a browser, live
  steradian check kitchen.pbrt                      is anything wrong with the scene?
  steradian compare kitchen.exr reference.exr       do two renderings show the same?

Exit codes: 0 done, 1 compared images differ, 2 the input is at fault, 3 the machine is at fault
(no such folder, disk full), 130 interrupted.";

/// The whole command line.
#[derive(Parser, Debug)]
#[command(
    name = "steradian",
    version,
    about = ABOUT,
    after_help = EXAMPLES,
    max_term_width = 100,
    disable_help_subcommand = true,
    arg_required_else_help = true
)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Subcommand, Debug)]
pub(crate) enum Command {
    /// Render a scene to image files
    #[command(after_help = RENDER_NOTES)]
    Render(Box<RenderArgs>),
    /// Join the parts of a distributed render
    #[command(after_help = MERGE_NOTES)]
    Merge(MergeArgs),
    /// Write a job that renders on many machines: Slurm, Kubernetes, OpenCue, GNU parallel
    #[command(after_help = SUBMIT_NOTES)]
    Submit(Box<SubmitArgs>),
    /// Read a scene and report every problem in it
    Check(SceneArg),
    /// Write a scene of any format as pbrt-v4, and name what that format cannot say
    #[command(after_help = CONVERT_NOTES)]
    Convert(ConvertArgs),
    /// Say what is in a scene, or what an image file says about itself
    Info(InfoArgs),
    /// Say whether two images show the same, and how far apart they are
    #[command(after_help = COMPARE_NOTES)]
    Compare(CompareArgs),
    /// Trace one path again and print it vertex by vertex
    #[command(after_help = TRACE_NOTES)]
    Trace(Box<TraceArgs>),
    /// Look at a scene in a browser: a live page with a path explorer
    #[command(after_help = crate::view::NOTES)]
    View(Box<ViewArgs>),
    /// Run the lecture's experiments and write a report that opens in any browser
    #[command(after_help = LAB_NOTES)]
    Lab(LabArgs),
    /// Check on this machine that this build does what the theory says, in a minute
    Selftest(SelftestArgs),
    /// Print completions for a shell
    #[command(
        after_help = "Example: steradian completions bash > ~/.local/share/bash-completion/completions/steradian"
    )]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

const LAB_NOTES: &str = "\
Topics: aliasing supersampling adaptive gloss soft-shadows depth-of-field motion-blur cost penumbra quadrature estimator
importance stratified mis roulette sequences convergence. Without one, all of them.

Every claim of the lecture is predicted, measured, and judged; the exit code is 1 if one does not hold.

Examples:
  steradian lab                           all experiments, in under two minutes
  steradian lab mis penumbra --full -o plates
  steradian lab cost --brute-force m=8,k=2,s=3,r=2,d=2   your numbers in the slide's formula, counted
  steradian lab --quick --json -o report  one JSON object for each claim";

/// `lab`.
#[derive(Args, Debug)]
pub(crate) struct LabArgs {
    /// Topics; all if none is named
    #[arg(value_name = "TOPIC")]
    pub topics: Vec<String>,

    /// The folder for the report, its pictures and numbers [default: steradian-lab]
    #[arg(short, long = "output", value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub output: Option<PathBuf>,

    /// A first look, in under two minutes on two cores; what happens unless --full is given
    #[arg(long, conflicts_with = "full")]
    pub quick: bool,

    /// More samples and finer pictures, in under twenty minutes
    #[arg(long)]
    pub full: bool,

    /// Count brute force with these numbers of the slide too, as in k=2,s=3,r=2,d=2 (m k a s r d n l); for the topic cost
    #[arg(long, value_name = "PARAMETERS")]
    pub brute_force: Option<steradian_lab::BruteForce>,

    /// Start even what would take absurdly many intersection tests
    #[arg(long)]
    pub yes: bool,

    /// Print one JSON object for each claim: topic, claim, predicted, measured, interval, verdict
    #[arg(long)]
    pub json: bool,

    /// Where all random numbers start
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,

    /// Threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MOST_THREADS))]
    pub threads: Option<u16>,

    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,
}

const RENDER_NOTES: &str = "\
Without SCENE, the built-in scene is rendered to steradian.png and steradian.exr.
Without -o, the file that the scene's Film names is written to the current folder, and a PNG beside it.

Ctrl-C stops after the current pass and writes what there is; a second one stops at once.
Options that pbrt-v4 spells differently work too: --outfile, --nthreads, --cropwindow.

Examples:
  steradian render scene.pbrt -o scene.exr -o scene.png --exposure auto
  steradian render scene.pbrt --spp 16 --crop 0.4,0.6,0.4,0.6    a quick look at the middle
  steradian render scene.pbrt --integrator normals -o normals.png
  zcat scene.pbrt.gz | steradian render - -o scene.exr
  steradian render scene.pbrt --error 1% --time 8h --checkpoint scene.ckpt --resume -o scene.exr    over night";

const MERGE_NOTES: &str = "\
Each part holds every sample of some tiles, or some samples of every tile, as sums in a fixed tree: joined in any order
they give the bits of one render.

Example:
  for i in 1 2 3 4; do steradian render scene.pbrt --spp 1024 --shard $i/4 -o $i.part; done    on four machines
  steradian merge 1.part 2.part 3.part 4.part -o scene.exr";

const SUBMIT_NOTES: &str = "\
The job renders every part by itself, each named by scene and settings, and then merges them to the bits of one render. Running it
again does only what is missing.

Examples:
  steradian submit slurm scene.pbrt --spp 1024 --parts 64 --cores 4 -o scene.exr --run
  steradian submit parallel scene.pbrt --spp 64 --parts 8 -o scene.exr && sh scene.parallel.sh";

const CONVERT_NOTES: &str = "\
Meshes and pictures go to the folder OUT-files beside OUT.pbrt. Surfaces that pbrt has not become mixes of those that it has. Scenes
that are rendered in red, green and blue here, as models are, look the same with render --color rgb.

Example:
  steradian convert helmet.glb helmet.pbrt && steradian render helmet.pbrt --color rgb -o helmet.exr";

/// `convert`.
#[derive(Args, Debug)]
pub(crate) struct ConvertArgs {
    /// A scene or model that `render` reads
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: PathBuf,

    /// The scene file to write
    #[arg(value_name = "OUT.pbrt", value_hint = ValueHint::FilePath)]
    pub output: PathBuf,

    /// Overwrite what convert has not written itself
    #[arg(long)]
    pub force: bool,

    #[command(flatten)]
    pub model: ModelArgs,
}

/// `render`.
#[derive(Args, Debug, Clone)]
pub(crate) struct RenderArgs {
    /// A pbrt-v4 scene (.pbrt or .pbrt.gz), a Mitsuba scene (.xml), a model (.gltf .glb .obj .stl .ply), or - for pbrt on standard input
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: Option<PathBuf>,

    /// Take every option that is not given here, and the scene, from an .exr that Steradian wrote
    #[arg(long, value_name = "IMAGE", value_hint = ValueHint::FilePath)]
    pub like: Option<PathBuf>,

    #[command(flatten)]
    pub output: OutputArgs,

    /// Add channels to the .exr: a list of names with commas between them
    #[arg(long, value_name = "NAMES", value_delimiter = ',', help_heading = "Output")]
    pub aov: Vec<Aov>,

    /// Take the noise out with Open Image Denoise, if that is installed; the noisy picture stays in noisy.R .G .B
    #[arg(long, help_heading = "Output")]
    pub denoise: bool,

    /// Render N pictures of a model from all around, -o FILE.png to FILE.0001.png and so on
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=9999), help_heading = "Output")]
    pub turntable: Option<u32>,

    #[command(flatten)]
    pub engine: EngineArgs,
    #[command(flatten)]
    pub picture: PictureArgs,
    #[command(flatten)]
    pub stop: StopArgs,
    #[command(flatten)]
    pub keep: KeepArgs,
    #[command(flatten)]
    pub run: RunArgs,
}

/// On which machines.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Many machines")]
pub(crate) struct EngineArgs {
    /// Render on an engine that others keep, to the bytes of a render here; needs the Python package
    #[arg(long, value_name = "NAME")]
    pub engine: Option<Engine>,

    /// Where the engine is [default: the one that runs here, or else one is started for this render]
    #[arg(long, value_name = "HOST:PORT", requires = "engine")]
    pub address: Option<String>,

    /// In how many parts [default: four for each core there is]
    #[arg(long, value_name = "N", requires = "engine", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub parts: Option<u32>,

    /// Keep finished parts in DIR: the same command goes on with them [default: a folder named by scene and settings beside the picture]
    #[arg(long, value_name = "DIR", requires = "engine", value_hint = ValueHint::DirPath)]
    pub spill: Option<PathBuf>,
}

/// Where the picture goes.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Output")]
pub(crate) struct OutputArgs {
    /// Write the picture to FILE: .exr .hdr .pfm hold light as it is, .png .jpg are tone mapped; may be given several times
    #[arg(short, long = "output", visible_alias = "outfile", value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub output: Vec<PathBuf>,

    /// Write the variance of each pixel's mean to FILE (.exr or .pfm)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub variance: Option<PathBuf>,

    /// Brighten .png and .jpg by this many stops, or find the exposure automatically
    #[arg(long, value_name = "STOPS|auto", default_value = "0", allow_hyphen_values = true)]
    pub exposure: ExposureArg,

    /// The curve from light to screen in .png and .jpg
    #[arg(long, value_name = "NAME", default_value = "agx")]
    pub tonemap: ToneMapArg,

    /// Write .exr with 16-bit floats: half the size, three digits
    #[arg(long)]
    pub half: bool,
}

impl OutputArgs {
    /// The options that write pictures in the same way, each with a space before it.
    pub fn as_typed(&self) -> String {
        let mut out = match self.exposure {
            ExposureArg::Stops(0.0) => String::new(),
            ExposureArg::Stops(stops) => format!(" --exposure {stops}"),
            ExposureArg::Auto => " --exposure auto".into(),
        };
        if let Some(curve) = self.tonemap.to_possible_value() {
            out += &format!(" --tonemap {}", curve.get_name());
        }
        if self.half {
            out += " --half";
        }
        out
    }
}

/// What decides the picture, besides the scene: `trace` needs the same to replay a path.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Picture (each replaces what the scene says)")]
pub(crate) struct PictureArgs {
    /// Samples per pixel
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SPP))]
    pub spp: Option<u32>,

    /// Samples per pixel that the sampler lays its points out for, where that matters: zsobol, stratified [default: --spp]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=MOST_SPP))]
    pub sampler_spp: Option<u32>,

    /// Width and height in pixels, as in 640x360; the field of view along the shorter side stays
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,

    /// Render only this part of the picture, in fractions of its width and height
    #[arg(long, visible_alias = "cropwindow", value_name = "x0,x1,y0,y1")]
    pub crop: Option<Crop>,

    /// Chooses one of 2^64 sets of random numbers
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// How light is followed, or which property of what is seen is shown
    #[arg(long, value_name = "NAME")]
    pub integrator: Option<IntegratorArg>,

    /// Where random numbers come from
    #[arg(long, value_name = "NAME")]
    pub sampler: Option<SamplerArg>,

    /// The most bounces of a path; 0 sees lamps only
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=MOST_DEPTH))]
    pub max_depth: Option<u32>,

    /// Scale samples down that are brighter than MOST in a component: fewer bright dots, and a darker picture; what is taken
    /// away is kept in clamped.R .G .B of the .exr
    #[arg(long, value_name = "MOST")]
    pub clamp: Option<Positive>,

    /// Leave out, in each pixel, sets of samples that bright dots make unlike the others: biased; what is taken away is kept in
    /// outliers.R .G .B of the .exr
    #[arg(long)]
    pub filter_outliers: bool,

    /// Follow wavelengths, or only red, green and blue
    #[arg(long, value_name = "MODE")]
    pub color: Option<ColorArg>,

    #[command(flatten)]
    pub technique: TechniqueArgs,

    #[command(flatten)]
    pub view: CameraArgs,

    #[command(flatten)]
    pub model: ModelArgs,
}

/// More than any picture needs, and the most that single precision sums are good for.
const MOST_SPP: i64 = 1 << 24;
const MOST_DEPTH: i64 = 1_000_000;
const MOST_THREADS: i64 = 1024;

/// How to run.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Run")]
pub(crate) struct RunArgs {
    /// Threads; the picture does not depend on their number [default: one per core]
    #[arg(long, visible_alias = "nthreads", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=MOST_THREADS))]
    pub threads: Option<u16>,

    /// Refuse to render if the scene and the picture would take more memory than this, as in 8G, beside some 15 MB that the program
    /// itself takes; before that, keep the scene's pictures in a scratch file once they are read
    #[arg(long, value_name = "SIZE")]
    pub max_memory: Option<Memory>,

    /// Where that file is made [default: the system's folder for such files]
    #[arg(long, value_name = "DIR", requires = "max_memory", value_hint = ValueHint::DirPath)]
    pub scratch: Option<PathBuf>,

    /// How to show progress: as suits the terminal, or one JSON object a line on standard output
    #[arg(long, value_name = "HOW", default_value = "auto")]
    pub progress: ProgressArg,

    /// Refresh FILE, a .png or .jpg, while rendering
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub preview: Option<PathBuf>,

    /// Show the picture in tev while rendering, tile by tile; its port is 14158 unless another is given
    #[arg(long, value_name = "HOST[:PORT]")]
    pub tev: Option<String>,
    /// Count rays by kind, tests of boxes and of primitives, and the lengths of paths, and write them to FILE as JSON; - is
    /// standard output. Takes time; the picture is the same
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub counters: Option<PathBuf>,

    /// Print errors only
    #[arg(short, long)]
    pub quiet: bool,

    /// Start even what would take absurdly many rays
    #[arg(long)]
    pub yes: bool,
}

/// The forms of progress.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ProgressArg {
    /// A bar on a terminal, lines elsewhere
    Auto,
    /// One JSON object a line, for programs
    Json,
}

/// The integrators.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum IntegratorArg {
    /// Paths from the camera, with light sampling
    Path,
    /// Paths through participating media
    Volpath,
    /// Random walks through participating media, without light sampling
    Simplevolpath,
    /// Paths from lights, with every point connected to the camera
    Lightpath,
    /// Paths from the camera and from lights, connected in every way: for caustics and hidden lamps
    Bdpt,
    /// Photon mapping with a radius that shrinks from sample to sample: for caustics behind glass and in mirrors
    Sppm,
    /// Metropolis light transport: chains of small changes to paths that carry much light; --spp are mutations per pixel
    Mlt,
    /// Whitted 1980: mirrors, refraction, and lamps as points
    Whitted,
    /// Cook 1984: rays distributed over pixel, lens, lamps, lobes and time at each hit
    Distribution,
    /// Shading normals as colours
    Normals,
    /// Reflected share of light
    Albedo,
    /// Distance along the view axis
    Depth,
    /// Surface coordinates as colours
    Uv,
    /// Ambient occlusion
    Ao,
}

/// The samplers.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SamplerArg {
    /// Independent random numbers
    Independent,
    /// A jittered grid
    Stratified,
    /// Halton's sequence
    Halton,
    /// Sobol's sequence over the whole image
    Sobol,
    /// Sobol's first two dimensions, shuffled for each use
    #[value(name = "paddedsobol", alias = "padded")]
    PaddedSobol,
    /// The same along a Z curve: the finest grain for a given number of samples
    #[value(name = "zsobol")]
    ZSobol,
    /// Progressive multi-jittered points that complement each other between pixels, for any number of samples
    #[value(name = "pmj02bn")]
    Pmj02bn,
}

/// The colour modes.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ColorArg {
    /// Red, green and blue
    Rgb,
    /// Four wavelengths a path
    Spectral,
}

/// The tone curves.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ToneMapArg {
    /// Cut off at white
    Clip,
    /// Reinhard 2002, on luminance
    Reinhard,
    /// Hable's film curve
    #[value(alias = "filmic")]
    Hable,
    /// The ACES transform
    Aces,
    /// AgX: bright colours go to white as on film
    Agx,
}

/// A scene, required.
#[derive(Args, Debug)]
pub(crate) struct SceneArg {
    /// A pbrt-v4 scene (.pbrt or .pbrt.gz), a Mitsuba scene (.xml), a model (.gltf .glb .obj .stl .ply), or - for pbrt on standard input
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: PathBuf,

    #[command(flatten)]
    pub model: ModelArgs,
}

/// `info`.
#[derive(Args, Debug)]
pub(crate) struct InfoArgs {
    /// A scene, - for standard input, or an image (.exr .png .jpg .hdr .pfm .tga .bmp .qoi .webp)
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub file: PathBuf,

    #[command(flatten)]
    pub model: ModelArgs,
}

const COMPARE_NOTES: &str = "\
The verdict is statistical: images agree unless they differ by more than their noise explains, and by enough to matter.
Noise is taken from the first of these that there is: several renderings with other seeds (--seed-image), --variance,
channels Variance.R .G .B in a file, the scatter of the difference inside small blocks of pixels.
A verdict of 'agree' is called weak where an error of 1.5 % in brightness could have gone unseen: give more samples.

Examples:
  steradian compare mine.exr reference.exr --diff where.png
  steradian compare seed1.exr reference.exr --seed-image seed2.exr --seed-image seed3.exr --seed-image seed4.exr
  steradian compare --exact before.exr after.exr";

/// `compare`.
#[derive(Args, Debug)]
pub(crate) struct CompareArgs {
    /// The image to judge
    #[arg(value_name = "A", value_hint = ValueHint::FilePath)]
    pub candidate: PathBuf,

    /// The image to judge it by
    #[arg(value_name = "B", value_hint = ValueHint::FilePath)]
    pub reference: PathBuf,

    /// A further rendering of A's scene with another seed; may be given several times
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub seed_image: Vec<PathBuf>,

    /// The variance of A's pixel means, as written by render --variance
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath, conflicts_with = "seed_image")]
    pub variance: Option<PathBuf>,

    /// Take A's noise from B's variance, B having this many samples per pixel and A what its file says
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with_all = ["seed_image", "variance"])]
    pub against_spp: Option<u32>,

    /// Ask for equal bits in every channel and attribute, except date, duration, host and threads
    #[arg(long, conflicts_with_all = ["seed_image", "variance", "against_spp"])]
    pub exact: bool,

    /// Print one JSON object
    #[arg(long)]
    pub json: bool,

    /// Write a picture of where and how visibly the images differ (FLIP, black to yellow)
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub diff: Option<PathBuf>,
}

const TRACE_NOTES: &str = "\
A sample depends on the scene, the options below, the pixel and the sample's number, and on nothing else.
Reports of bad samples name the command that traces them again.";

/// `trace`.
#[derive(Args, Debug)]
pub(crate) struct TraceArgs {
    /// A pbrt-v4 scene (.pbrt or .pbrt.gz), or - for standard input [default: the built-in scene]
    #[arg(value_name = "SCENE", value_hint = ValueHint::FilePath)]
    pub scene: Option<PathBuf>,

    /// The pixel, in the whole image, from 0,0 at the top left
    #[arg(long, value_name = "x,y")]
    pub pixel: Pixel,

    /// The number of the sample in its pixel, from 0
    #[arg(long, value_name = "I", value_parser = clap::value_parser!(u32).range(0..MOST_SPP))]
    pub sample: u32,

    /// Print one JSON object
    #[arg(long)]
    pub json: bool,

    #[command(flatten)]
    pub picture: PictureArgs,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_grammar_is_sound() {
        Cli::command().debug_assert();
    }

    #[test]
    fn flags_of_pbrt_users_mean_what_they_meant() {
        let line =
            "steradian render s.pbrt --outfile a.exr --spp 4 --nthreads 3 --cropwindow 0,.5,0,1 --seed 7 --quiet";
        let Command::Render(r) = Cli::try_parse_from(line.split(' ')).unwrap().command else { panic!("not render") };
        assert_eq!(r.output.output, [PathBuf::from("a.exr")]);
        assert_eq!((r.picture.spp, r.run.threads, r.picture.seed, r.run.quiet), (Some(4), Some(3), Some(7), true));
        assert_eq!(r.picture.crop, Some(Crop([0.0, 0.5, 0.0, 1.0])));
    }
}
