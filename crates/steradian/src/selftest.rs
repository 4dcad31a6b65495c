//! `steradian selftest`: does this build, on this machine, do what the theory says? Scenes whose radiance is known exactly, densities
//! that must integrate to one and match their samples, and the same bits whatever the threads.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use clap::Args;
use steradian_bsdf::{Bsdf, Conductor, Dielectric, Diffuse, Lobe, TransportMode, TrowbridgeReitz};
use steradian_load::{Input, LoadOptions, Memory, load_pbrt};
use steradian_math::{Vec3, sin_cos};
use steradian_render::{
    Goals, Identity, Label, Layers, Part, Plan, Quiet, Rendered, Share, Snapshot, Task, join, render, run,
};
use steradian_sampling::rng::Rng;
use steradian_sampling::statistics::chi_square_quantile;
use steradian_scene::World;
use steradian_spectrum::Lanes;

use crate::console::Console;
use crate::failure::{DIFFERS, DONE, Failure};
use crate::{numbers, opened};

/// The options.
#[derive(Args, Debug)]
pub(crate) struct SelftestArgs {
    /// Threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

/// One check: what holds, and what is known about it.
type Check = (&'static str, fn(usize) -> Result<String, String>);

const CHECKS: [Check; 5] = [
    ("a white furnace is white", furnace),
    ("light between walls adds up to the series that it should", series),
    ("directions come as often as their density says", chi_square),
    ("the picture is the same for any number of threads", threads_agree),
    ("parts and interruptions change no bit", parts_agree),
];

/// Runs all checks; the exit code.
pub(crate) fn run_all(args: &SelftestArgs, console: &Console) -> Result<u8, Failure> {
    let threads = args.threads.map_or_else(crate::render::default_threads, usize::from);
    let start = Instant::now();
    let mut failed = 0;
    for (name, check) in CHECKS {
        match check(threads) {
            Ok(what) => console.out(format_args!("  ok      {name}: {what}")),
            Err(what) => {
                failed += 1;
                console.out(format_args!("  FAILED  {name}: {what}"));
            }
        }
    }
    let time = numbers::duration(start.elapsed());
    if failed == 0 {
        console.heading(format_args!("all {} checks passed in {time}: this build can be trusted here", CHECKS.len()));
        return Ok(DONE);
    }
    console.heading(format_args!("{failed} of {} checks failed: do not trust pictures of this build", CHECKS.len()));
    Ok(DIFFERS)
}

fn world(text: &str) -> Result<World, String> {
    let input = Input::Text { name: "selftest", text, directory: "".as_ref() };
    let outcome = load_pbrt(input, &Memory::new(), &LoadOptions::default());
    let words = || outcome.diagnostics.iter().map(|d| d.render(&outcome.sources)).collect::<String>();
    let scene = outcome.scene.as_ref().ok_or_else(words)?;
    World::build(scene.clone()).map_err(|e| e.to_string())
}

fn rendered(world: &World, spp: u32, threads: usize) -> Rendered {
    render(world, &Plan { spp, threads, time_limit: None }, &Quiet, &AtomicBool::new(false))
}

/// The mean brightness must be `expected`, to 6 standard errors (a false alarm in 5e8 runs) and the rounding of tables.
fn expect(what: &str, world: &World, expected: f64, threads: usize) -> Result<String, String> {
    const TABLES: f64 = 3e-3;
    let r = rendered(world, 256, threads);
    if r.bad_count > 0 {
        return Err(format!("{what}: {} samples are not finite", r.bad_count));
    }
    let n = r.film.mean().len() as f64;
    let mean = r.film.mean().iter().map(|p| f64::from(p[1])).sum::<f64>() / n;
    let error = (r.film.variance().iter().map(|p| f64::from(p[1])).sum::<f64>()).sqrt() / n;
    let said = format!("{what} {mean:.4}, expected {expected:.4} +- {error:.4}");
    if (mean - expected).abs() <= 6.0 * error + TABLES * expected { Ok(said) } else { Err(said) }
}

/// A body that absorbs nothing cannot be seen in uniform light.
fn furnace(threads: usize) -> Result<String, String> {
    let head = |color: &str| {
        format!(
            "Film \"rgb\" \"integer xresolution\" [ 16 ] \"integer yresolution\" [ 16 ]\nSampler \"paddedsobol\"\n\
             Integrator \"path\" \"integer maxdepth\" [ 60 ]\nLookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [ 30 ]\n\
             {color}\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
        )
    };
    let ball = "Shape \"sphere\" \"float radius\" [ 0.9 ]\n";
    let mut words = Vec::new();
    for (name, material) in [
        ("chalk", "Material \"diffuse\" \"rgb reflectance\" [ 1 1 1 ]\n"),
        ("glass", "Material \"dielectric\" \"float eta\" [ 1.5 ]\n"),
    ] {
        words.push(expect(name, &world(&(head("") + material + ball))?, 1.0, threads)?);
    }
    Ok(words.join("; "))
}

/// Inside a shining ball of albedo one half, light adds up to 1 + 1/2 + 1/4 + ...
fn series(threads: usize) -> Result<String, String> {
    let text = "Film \"rgb\" \"integer xresolution\" [ 8 ] \"integer yresolution\" [ 8 ]\nSampler \"independent\"\n\
                Integrator \"path\" \"integer maxdepth\" [ 7 ]\nCamera \"perspective\"\nWorldBegin\n\
                AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\n\
                Material \"diffuse\" \"rgb reflectance\" [ 0.5 0.5 0.5 ]\nShape \"sphere\" \"float radius\" [ 2 ]\n";
    let expected = (0..=7).map(|k| 0.5f64.powi(k)).sum();
    expect("inside", &world(text)?, expected, threads)
}

/// Pearson's test of sampled directions against the integral of their density over a grid.
fn chi_square(_threads: usize) -> Result<String, String> {
    let lobes: [(&str, Bsdf); 3] = [
        ("diffuse", Diffuse::new(Lanes::splat(0.5)).into()),
        ("metal", Conductor::new(TrowbridgeReitz::new(0.5, 0.3), Lanes::splat(0.2), Lanes::splat(3.0)).into()),
        ("rough glass", Dielectric::new(1.5, TrowbridgeReitz::new(0.4, 0.4)).into()),
    ];
    let mut words = Vec::new();
    for (name, lobe) in lobes {
        let (statistic, limit) = statistic(&lobe);
        let said = format!("{name} {statistic:.0} of at most {limit:.0}");
        if statistic > limit {
            return Err(said);
        }
        words.push(said);
    }
    Ok(format!("chi-square {}", words.join(", ")))
}

/// Pearson's statistic, and the value that it exceeds once in a million times.
fn statistic(lobe: &Bsdf) -> (f64, f64) {
    const ROWS: usize = 16;
    const COLUMNS: usize = 32;
    const SAMPLES: u32 = 200_000;
    let wo = Vec3::new(0.5, 0.2, 0.0);
    let wo = Vec3::new(wo.x, wo.y, (1.0 - wo.length_squared()).sqrt());
    let mut rng = Rng::new(3, 7);
    let mut counts = [[0.0f64; COLUMNS]; ROWS];
    for _ in 0..SAMPLES {
        let Some(s) = lobe.sample(wo, rng.f32(), rng.f32_2d(), TransportMode::Radiance) else { continue };
        let row = ((s.wi.z + 1.0) * 0.5 * ROWS as f32) as usize;
        let turn = steradian_math::atan2(s.wi.y, s.wi.x) / std::f32::consts::TAU;
        let column = ((if turn < 0.0 { turn + 1.0 } else { turn }) * COLUMNS as f32) as usize;
        counts[row.min(ROWS - 1)][column.min(COLUMNS - 1)] += 1.0;
    }
    let (mut statistic, mut cells, mut rest) = (0.0, 0u32, (0.0, 0.0));
    for (row, line) in counts.iter().enumerate() {
        for (column, &count) in line.iter().enumerate() {
            let expected = f64::from(SAMPLES) * cell(lobe, wo, [row, column], [ROWS, COLUMNS]);
            if expected < 10.0 {
                rest = (rest.0 + expected, rest.1 + count);
            } else {
                statistic += (count - expected) * (count - expected) / expected;
                cells += 1;
            }
        }
    }
    if rest.0 > 10.0 {
        statistic += (rest.1 - rest.0) * (rest.1 - rest.0) / rest.0;
        cells += 1;
    }
    (statistic, chi_square_quantile(1.0 - 1e-6, f64::from(cells.max(2) - 1)))
}

/// The integral of the density over a cell of cos theta and phi, by the midpoint rule.
fn cell(lobe: &Bsdf, wo: Vec3, at: [usize; 2], of: [usize; 2]) -> f64 {
    const STEPS: usize = 12;
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let middle = |k: usize, n: usize, at: usize| (at as f32 + (k as f32 + 0.5) / STEPS as f32) / n as f32;
            let z = 2.0 * middle(i, of[0], at[0]) - 1.0;
            let (sin, cos) = sin_cos(middle(j, of[1], at[1]) * std::f32::consts::TAU);
            let r = (1.0 - z * z).max(0.0).sqrt();
            sum += f64::from(lobe.pdf(wo, Vec3::new(r * cos, r * sin, z), TransportMode::Radiance));
        }
    }
    sum * 4.0 * std::f64::consts::PI / (of[0] * of[1] * STEPS * STEPS) as f64
}

fn showcase() -> Result<World, String> {
    let input = Input::Text { name: opened::SHOWCASE_NAME, text: opened::SHOWCASE, directory: "".as_ref() };
    let outcome = load_pbrt(input, &Memory::new(), &LoadOptions::default());
    let mut scene = outcome.scene.ok_or("the built-in scene has errors")?;
    scene.settings.film.resolution = [96, 54];
    scene.settings.film.pixel_bounds = [0, 96, 0, 54];
    scene.settings.sampler.resolution = [96, 54];
    World::build(scene).map_err(|e| e.to_string())
}

fn threads_agree(threads: usize) -> Result<String, String> {
    let world = showcase()?;
    let digest = |r: &Rendered| {
        let mut hasher = blake3::Hasher::new();
        r.film.mean().iter().flatten().for_each(|v| {
            hasher.update(&v.to_bits().to_le_bytes());
        });
        hasher.finalize().to_hex()[..16].to_owned()
    };
    let one = digest(&rendered(&world, 8, 1));
    for n in [2, threads.max(2), 7] {
        if digest(&rendered(&world, 8, n)) != one {
            return Err(format!("{n} threads differ from one"));
        }
    }
    Ok(format!("fingerprint {one}, which every machine should give for this version"))
}

fn parts_agree(threads: usize) -> Result<String, String> {
    let world = showcase()?;
    let whole = rendered(&world, 9, threads);
    let identity = Identity::new();
    let mut parts = Vec::new();
    for index in 0..3 {
        let share = Share::Samples(Part { index, count: 3 });
        let label = Label { identity: &identity, note: &[] };
        let plan = Plan { spp: 9, threads, time_limit: None };
        let goals = Goals { share, ..Goals::default() };
        let part = run(
            Task { world: &world, plan, goals, layers: &Layers::default(), label, resume: None },
            &Quiet,
            &AtomicBool::new(false),
        );
        parts.push(Snapshot::decode(&part.encode(&label)).map_err(|e| e.to_string())?);
    }
    let films: Vec<_> = parts.iter().rev().map(|p| &p.film).collect();
    let joined = join(whole.film.bounds, &films, 9).map_err(|e| e.to_string())?;
    if joined == whole.film { Ok("three parts, stored and joined backwards".into()) } else { Err("they do".into()) }
}
