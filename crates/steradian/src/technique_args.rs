//! The lecture's switches on the command line.

use std::fmt::Write;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use steradian_image::{Filter, FilterKind};
use steradian_math::Vec2;
use steradian_scene::{
    Bidirectional, Distribution, IntegratorKind, LobeSampling, MOST_BRANCHES, MisHeuristic, Scene, Stratification,
    Stratify, Whitted, World,
};

const BRANCHES: std::ops::RangeInclusive<i64> = 1..=MOST_BRANCHES as i64;

/// How light is estimated. Every combination of the switches of path tracing has the same expectation, and its own noise and cost.
#[derive(Args, Debug, Clone, Default, PartialEq)]
#[command(
    next_help_heading = "Technique (the lecture's switches; those down to --split lead to the same picture, with other noise)"
)]
pub(crate) struct TechniqueArgs {
    /// Send a ray to a lamp at each hit (next-event estimation)
    #[arg(long, value_name = "on|off")]
    pub light_sampling: Option<Switch>,

    /// How the next direction is drawn
    #[arg(long, value_name = "KIND")]
    pub lobe_sampling: Option<LobeArg>,

    /// How lamps found by both kinds of sampling are weighed (multiple importance sampling)
    #[arg(long, value_name = "KIND")]
    pub mis: Option<MisArg>,

    /// Stratify the random numbers: KIND for all, or DOMAIN=KIND,... for pixel, lens, time, light, lobe; a KIND is sampler,
    /// none, jittered or low-discrepancy
    #[arg(long, value_name = "KIND|DOMAIN=KIND,...")]
    pub stratify: Option<StratifyArg>,

    /// End weak paths by chance: on (below a throughput of 0.5), off, or the throughput below which
    #[arg(long, value_name = "on|off|THRESHOLD")]
    pub roulette: Option<RouletteArg>,

    /// Follow this many directions from the first hit
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(BRANCHES))]
    pub split: Option<u32>,

    /// Pixel reconstruction filter
    #[arg(long, value_name = "NAME")]
    pub filter: Option<FilterArg>,

    /// distribution: k x k rays per pixel
    #[arg(long, visible_alias = "k", value_name = "K", value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub subpixels: Option<u32>,

    /// distribution: a x a points of the lens for each of them
    #[arg(long, visible_alias = "a", value_name = "A", value_parser = clap::value_parser!(u32).range(BRANCHES))]
    pub aperture: Option<u32>,

    /// distribution: s x s shadow rays to each lamp, at each hit
    #[arg(long, visible_alias = "s", value_name = "S", value_parser = clap::value_parser!(u32).range(BRANCHES))]
    pub light_rays: Option<u32>,

    /// distribution: r x r rays over the lobe, at each hit
    #[arg(long, visible_alias = "r", value_name = "R", value_parser = clap::value_parser!(u32).range(BRANCHES))]
    pub lobe_rays: Option<u32>,

    /// distribution: t moments while the shutter is open
    #[arg(long, visible_alias = "t", value_name = "T", value_parser = clap::value_parser!(u32).range(BRANCHES))]
    pub times: Option<u32>,

    /// distribution: the middle of each cell instead of a random point: the regular grids, whose samples clump
    #[arg(long)]
    pub no_jitter: bool,

    /// whitted: light that comes from everywhere, for what diffuse surfaces send each other
    #[arg(long, value_name = "LUMINANCE")]
    pub ambient: Option<f32>,

    /// bdpt: only paths with S vertices from a light and T from the camera, as they are weighted
    #[arg(long, value_name = "S,T")]
    pub strategy: Option<StrategyArg>,

    /// bdpt: the same as if that strategy were alone
    #[arg(long, requires = "strategy")]
    pub unweighted: bool,
}

/// A strategy of bidirectional path tracing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StrategyArg(pub [u32; 2]);

impl FromStr for StrategyArg {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let number = |v: &str| v.trim().parse::<u32>().ok();
        let numbers = s.split_once(',').and_then(|(a, b)| Some([number(a)?, number(b)?]));
        match numbers {
            Some([light, camera]) if camera >= 1 && light.saturating_add(camera) >= 2 && [light, camera] != [1, 1] => Ok(Self([light, camera])),
            _ => Err("expected the vertices from the light and from the camera, as in 2,1: at least two, one of them from the camera".into()),
        }
    }
}

/// A switch.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Switch {
    On,
    Off,
}

/// Importance sampling of the lobe.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LobeArg {
    /// Every direction alike
    Uniform,
    /// In proportion to the cosine
    Cosine,
    /// In proportion to what the surface scatters
    Lobe,
}

/// Multiple importance sampling.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MisArg {
    /// Count only what light sampling finds
    None,
    /// Weights in proportion to the densities
    Balance,
    /// In proportion to their squares
    Power,
}

/// Reconstruction filters with pbrt's default radii.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FilterArg {
    Box,
    Triangle,
    Gaussian,
    Mitchell,
    Sinc,
}

/// Roulette by its threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct RouletteArg(pub Option<f32>);

impl FromStr for RouletteArg {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        match s {
            "on" => Ok(Self(Some(steradian_scene::Techniques::ROULETTE))),
            "off" => Ok(Self(None)),
            number => match number.parse::<f32>() {
                Ok(t) if t > 0.0 && t <= 1.0 => Ok(Self(Some(t))),
                _ => Err("expected on, off, or a number above 0 and at most 1".into()),
            },
        }
    }
}

/// Stratification as typed, and what it means.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct StratifyArg {
    typed: String,
    stratify: Stratify,
}

fn stratification(word: &str) -> Result<Stratification, String> {
    match word {
        "sampler" => Ok(Stratification::Sampler),
        "none" => Ok(Stratification::None),
        "jittered" => Ok(Stratification::Jittered),
        "low-discrepancy" => Ok(Stratification::LowDiscrepancy),
        other => Err(format!("`{other}` is none of sampler, none, jittered, low-discrepancy")),
    }
}

impl FromStr for StratifyArg {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        let mut stratify = Stratify::default();
        for part in s.split(',') {
            let Some((domain, kind)) = part.split_once('=') else {
                stratify = Stratify::all(stratification(part)?);
                continue;
            };
            let kind = stratification(kind)?;
            let target = match domain {
                "pixel" => &mut stratify.pixel,
                "lens" => &mut stratify.lens,
                "time" => &mut stratify.time,
                "light" => &mut stratify.light,
                "lobe" => &mut stratify.lobe,
                other => return Err(format!("`{other}` is none of pixel, lens, time, light, lobe")),
            };
            *target = kind;
        }
        Ok(Self { typed: s.to_owned(), stratify })
    }
}

fn filter(arg: FilterArg) -> Option<Filter> {
    let (kind, radius) = match arg {
        FilterArg::Box => return Some(Filter::pixel_box()),
        FilterArg::Triangle => (FilterKind::Triangle, 2.0),
        FilterArg::Gaussian => (FilterKind::Gaussian { sigma: 0.5 }, 1.5),
        FilterArg::Mitchell => (FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, 2.0),
        FilterArg::Sinc => (FilterKind::Sinc { tau: 3.0 }, 4.0),
    };
    Filter::new(kind, Vec2::splat(radius)).ok()
}

/// Changes the scene's settings as the switches ask. `spp_given` keeps the sample count of the command line.
pub(crate) fn apply(args: &TechniqueArgs, scene: &mut Scene, spp_given: bool) {
    let settings = &mut scene.settings;
    let t = &mut settings.integrator.techniques;
    if let Some(switch) = args.light_sampling {
        t.light_sampling = switch == Switch::On;
    }
    if let Some(lobe) = args.lobe_sampling {
        t.lobe_sampling = match lobe {
            LobeArg::Uniform => LobeSampling::Uniform,
            LobeArg::Cosine => LobeSampling::Cosine,
            LobeArg::Lobe => LobeSampling::Lobe,
        };
    }
    if let Some(mis) = args.mis {
        t.mis = match mis {
            MisArg::None => MisHeuristic::None,
            MisArg::Balance => MisHeuristic::Balance,
            MisArg::Power => MisHeuristic::Power,
        };
    }
    if let Some(s) = &args.stratify {
        t.stratify = s.stratify;
    }
    if let Some(r) = args.roulette {
        t.roulette = r.0;
    }
    if let Some(n) = args.split {
        t.split = n;
    }
    if let Some(f) = args.filter.and_then(filter) {
        settings.filter = f;
    }
    match &mut settings.integrator.kind {
        IntegratorKind::Distribution(d) => {
            let set = |target: &mut u32, value: Option<u32>| *target = value.unwrap_or(*target);
            set(&mut d.subpixels, args.subpixels);
            set(&mut d.aperture, args.aperture);
            set(&mut d.light, args.light_rays);
            set(&mut d.lobe, args.lobe_rays);
            set(&mut d.time, args.times);
            d.jitter &= !args.no_jitter;
            if !spp_given {
                settings.sampler.spp = d.samples_per_pixel();
            }
        }
        IntegratorKind::Whitted(w) => w.ambient = args.ambient.unwrap_or(w.ambient),
        IntegratorKind::Bdpt(b) if args.strategy.is_some() => {
            *b = Bidirectional { strategy: args.strategy.map(|s| s.0), unweighted: args.unweighted };
        }
        _ => {}
    }
}

/// The switches that were given and that this world's integrator does not read, with the integrators that would.
pub(crate) fn idle(args: &TechniqueArgs, world: &World) -> Vec<String> {
    let kind = world.settings().integrator.kind;
    let (mut paths, mut trees, mut points) = (Vec::new(), Vec::new(), Vec::new());
    let note = |list: &mut Vec<&str>, name, given: bool| list.extend(given.then_some(name));
    note(&mut paths, "--light-sampling", args.light_sampling.is_some());
    note(&mut paths, "--lobe-sampling", args.lobe_sampling.is_some());
    note(&mut paths, "--mis", args.mis.is_some());
    note(&mut paths, "--roulette", args.roulette.is_some());
    note(&mut paths, "--split", args.split.is_some());
    note(&mut trees, "--subpixels", args.subpixels.is_some());
    note(&mut trees, "--aperture", args.aperture.is_some());
    note(&mut trees, "--light-rays", args.light_rays.is_some());
    note(&mut trees, "--lobe-rays", args.lobe_rays.is_some());
    note(&mut trees, "--times", args.times.is_some());
    note(&mut trees, "--no-jitter", args.no_jitter);
    note(&mut points, "--ambient", args.ambient.is_some());
    let read_by_paths = match kind {
        IntegratorKind::Path => true,
        IntegratorKind::VolPath => !world.has_media(),
        _ => false,
    };
    [
        (paths, read_by_paths, "path, and with volpath where there are no media"),
        (trees, matches!(kind, IntegratorKind::Distribution(_)), "distribution"),
        (points, matches!(kind, IntegratorKind::Whitted(_)), "whitted"),
    ]
    .into_iter()
    .filter(|(names, read, _)| !read && !names.is_empty())
    .map(|(names, _, whose)| format!("of no effect here, but with --integrator {whose}: {}", names.join(" ")))
    .collect()
}

/// The integrators that only the command line can ask for.
pub(crate) fn whitted() -> IntegratorKind {
    IntegratorKind::Whitted(Whitted::default())
}

/// See [`whitted`].
pub(crate) fn distribution() -> IntegratorKind {
    IntegratorKind::Distribution(Distribution::default())
}

/// The switches as they would be typed, each with a space before it.
pub(crate) fn as_typed(args: &TechniqueArgs, out: &mut String) {
    let mut add = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            let _ = write!(out, " --{name} {value}");
        }
    };
    fn named<T: ValueEnum>(value: Option<T>) -> Option<String> {
        value?.to_possible_value().map(|v| v.get_name().to_owned())
    }
    let number = |v: Option<u32>| v.map(|v| v.to_string());
    add("light-sampling", named(args.light_sampling));
    add("lobe-sampling", named(args.lobe_sampling));
    add("mis", named(args.mis));
    add("stratify", args.stratify.as_ref().map(|s| s.typed.clone()));
    add("roulette", args.roulette.map(|r| r.0.map_or("off".into(), |t| t.to_string())));
    add("split", number(args.split));
    add("filter", named(args.filter));
    add("subpixels", number(args.subpixels));
    add("aperture", number(args.aperture));
    add("light-rays", number(args.light_rays));
    add("lobe-rays", number(args.lobe_rays));
    add("times", number(args.times));
    add("ambient", args.ambient.map(|v| v.to_string()));
    add("strategy", args.strategy.map(|s| format!("{},{}", s.0[0], s.0[1])));
    if args.unweighted {
        out.push_str(" --unweighted");
    }
    if args.no_jitter {
        *out += " --no-jitter";
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stratification_by_domain() {
        let s: StratifyArg = "none,light=jittered".parse().unwrap();
        assert_eq!(s.stratify, Stratify { light: Stratification::Jittered, ..Stratify::all(Stratification::None) });
        assert!("lite=none".parse::<StratifyArg>().unwrap_err().contains("none of pixel"));
        assert!("sometimes".parse::<StratifyArg>().unwrap_err().contains("none of sampler"));
        assert!("0".parse::<RouletteArg>().is_err() && "1.5".parse::<RouletteArg>().is_err());
        assert_eq!("off".parse::<RouletteArg>(), Ok(RouletteArg(None)));
        assert_eq!("0,2".parse(), Ok(StrategyArg([0, 2])));
        for wrong in ["1,1", "2,0", "1", "-1,3", "a,b", "0,1"] {
            assert!(wrong.parse::<StrategyArg>().is_err(), "{wrong}");
        }
    }
}
