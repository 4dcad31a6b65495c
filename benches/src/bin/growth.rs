//! How time and memory grow: with triangles, lights, threads and samples.
//! `cargo run --release -p benches --bin growth -- [--most 1000000] [--rounds N] [--json FILE] [--only triangles|lights|threads|samples]`.
//!
//! The best turn of each; `benches/peers/run` measures this too, and draws it.
#![allow(clippy::print_stdout)]

use std::fmt::Write;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use benches::CORNELL;
use benches::room;
use serde::Serialize;
use steradian_geometry::Accel;
use steradian_render::{Plan, Quiet, render};
use steradian_scene::World;
use steradian_spectrum::ColorMode;

/// One measurement: what it grows with, how far, in which case, and what came out.
#[derive(Serialize)]
struct Row {
    grows_with: &'static str,
    case: String,
    x: f64,
    y: f64,
    unit: &'static str,
}

struct Options {
    most: usize,
    rounds: usize,
    json: Option<PathBuf>,
    only: Option<String>,
}

fn options() -> Result<Options, String> {
    let mut o = Options { most: 10_000_000, rounds: 5, json: None, only: None };
    let mut args = std::env::args().skip(1);
    while let Some(name) = args.next() {
        let value = args.next().ok_or_else(|| format!("{name} wants a value"))?;
        let number = || value.parse().map_err(|e| format!("{name} {value}: {e}"));
        match name.as_str() {
            "--most" => o.most = number()?,
            "--rounds" => o.rounds = number()?,
            "--json" => o.json = Some(value.into()),
            "--only" => o.only = Some(value),
            _ => return Err(format!("unknown option {name}")),
        }
    }
    Ok(o)
}

/// The shortest of some turns, in seconds.
fn best(rounds: usize, mut turn: impl FnMut()) -> f64 {
    let time = |_| {
        let start = Instant::now();
        turn();
        start.elapsed().as_secs_f64()
    };
    (0..rounds).map(time).fold(f64::INFINITY, f64::min)
}

/// Nanoseconds a ray against the number of triangles, and bytes a triangle.
fn triangles(options: &Options, rows: &mut Vec<Row>) -> Result<(), String> {
    let mut count = 1000;
    while count <= options.most {
        let triangles = room::blobs(count);
        let n = triangles.len() as f64;
        let accel = Accel::build(&room::input(&triangles), &[]).map_err(|e| e.to_string())?;
        let rays = room::rays(&accel, &triangles);
        for (case, rays) in ["primary", "diffuse", "shadow"].iter().zip(&rays) {
            let seconds = best(options.rounds, || {
                let hits = if *case == "shadow" {
                    rays.iter().filter(|r| accel.any(r, |_, _| false, |_, _, _, _| true)).count()
                } else {
                    rays.iter().filter(|r| accel.closest(r, |_, _| None, |_, _, _, _| true).is_some()).count()
                };
                std::hint::black_box(hits);
            });
            let y = seconds / rays.len() as f64 * 1e9;
            rows.push(Row { grows_with: "triangles", case: (*case).into(), x: n, y, unit: "ns a ray" });
        }
        let y = accel.byte_size() as f64 / n;
        rows.push(Row { grows_with: "triangles", case: "tree".into(), x: n, y, unit: "bytes a triangle" });
        count *= 10;
    }
    Ok(())
}

/// A floor under a ceiling of `count` small lamps of different brightness, together always as bright.
fn lamps(count: usize, chosen_by: &str) -> String {
    let n = (count as f32).sqrt().ceil() as usize;
    let (mut corners, cell) = (String::new(), 4.0 / n as f32);
    for i in 0..count {
        let (x, z) = ((i % n) as f32 * cell - 2.0, (i / n) as f32 * cell - 2.0);
        let (size, y) = (cell * (0.2 + 0.6 * (i * 7 % 11) as f32 / 10.0), 2.0 + 0.1 * (i * 5 % 7) as f32);
        let _ = write!(corners, "{x} {y} {z}  {} {y} {z}  {x} {y} {} ", x + size, z + size);
    }
    let indices: String = (0..3 * count).map(|i| format!("{i} ")).collect();
    format!(
        r#"
        Integrator "path" "integer maxdepth" 1 "string lightsampler" "{chosen_by}"
        Film "rgb" "integer xresolution" 64 "integer yresolution" 64
        Sampler "paddedsobol"
        LookAt 0 1 -3  0 0 0  0 1 0
        Camera "perspective" "float fov" 45
        WorldBegin
        Material "diffuse"
        Shape "bilinearmesh" "point3 P" [-4 0 -4  4 0 -4  -4 0 4  4 0 4]
        AreaLightSource "diffuse" "float scale" 4
        Shape "trianglemesh" "point3 P" [{corners}] "integer indices" [{indices}]
        "#
    )
}

/// A world, or why not.
fn world(text: &str, size: Option<[u32; 2]>) -> Result<World, String> {
    let mut scene = steradian::load_text("growth.pbrt", text).map_err(|e| e.to_string())?;
    scene.settings.color = ColorMode::Rgb;
    if let Some([width, height]) = size {
        scene.settings.film = steradian::FilmSettings::new(width, height);
    }
    World::build(scene).map_err(|e| e.to_string())
}

fn draw(world: &World, spp: u32, threads: usize) {
    let plan = Plan { spp, threads, time_limit: None };
    std::hint::black_box(render(world, &plan, &Quiet, &AtomicBool::new(false)).spp);
}

/// Nanoseconds for a camera path with one sampled lamp, against the number of lamps.
fn lights(options: &Options, rows: &mut Vec<Row>) -> Result<(), String> {
    let mut count = 1;
    while count <= options.most.min(100_000) {
        for chosen_by in ["bvh", "power"] {
            let world = world(&lamps(count, chosen_by), None)?;
            let spp = 32;
            let seconds = best(options.rounds, || draw(&world, spp, 1));
            let y = seconds / f64::from(64 * 64 * spp) * 1e9;
            rows.push(Row { grows_with: "lights", case: chosen_by.into(), x: count as f64, y, unit: "ns a path" });
        }
        count *= 10;
    }
    Ok(())
}

/// How many times as fast two threads are as one.
fn threads(options: &Options, rows: &mut Vec<Row>) -> Result<(), String> {
    let world = world(CORNELL, Some([256, 256]))?;
    let (mut one, mut two) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..options.rounds {
        one = one.min(best(1, || draw(&world, 32, 1)));
        two = two.min(best(1, || draw(&world, 32, 2)));
    }
    let row = |x, y| Row { grows_with: "threads", case: "cornell".into(), x, y, unit: "times one thread" };
    rows.extend([row(1.0, 1.0), row(2.0, one / two)]);
    Ok(())
}

/// Resident memory of this process in megabytes; `None` where the system does not tell.
fn resident() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmRSS:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? / 1024.0)
}

/// Memory against samples per pixel.
fn samples(_: &Options, rows: &mut Vec<Row>) -> Result<(), String> {
    let world = world(CORNELL, Some([256, 256]))?;
    for spp in [4, 16, 64, 256] {
        draw(&world, spp, 2);
        if let Some(y) = resident() {
            rows.push(Row { grows_with: "samples", case: "cornell".into(), x: f64::from(spp), y, unit: "MB resident" });
        }
    }
    Ok(())
}

/// The exponent of the growth from the first to the last point of a case.
fn slope(points: &[&Row]) -> Option<f64> {
    let (first, last) = (points.first()?, points.last()?);
    (last.x > first.x).then(|| (last.y / first.y).ln() / (last.x / first.x).ln())
}

type Part = (&'static str, fn(&Options, &mut Vec<Row>) -> Result<(), String>);

fn main() -> Result<(), String> {
    let options = options()?;
    // Memory first: what else is measured here leaves freed pages behind.
    let parts: [Part; 4] = [("samples", samples), ("triangles", triangles), ("lights", lights), ("threads", threads)];
    let mut rows = Vec::new();
    for (name, part) in parts {
        if options.only.as_ref().is_none_or(|only| only == name) {
            part(&options, &mut rows)?;
        }
    }
    let mut told: Vec<(&str, &str)> = Vec::new();
    for row in &rows {
        let key = (row.grows_with, row.case.as_str());
        if told.contains(&key) {
            continue;
        }
        told.push(key);
        let points: Vec<&Row> = rows.iter().filter(|r| (r.grows_with, r.case.as_str()) == key).collect();
        let values: Vec<String> = points.iter().map(|r| format!("{:.0}: {:.2}", r.x, r.y)).collect();
        let slope = slope(&points).map(|s| format!("  slope {s:.3}")).unwrap_or_default();
        println!("{:9} {:8} {}  {}{slope}", row.grows_with, row.case, row.unit, values.join(", "));
    }
    if let Some(file) = &options.json {
        let text = serde_json::to_string_pretty(&rows).map_err(|e| e.to_string())?;
        std::fs::write(file, text).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(())
}
