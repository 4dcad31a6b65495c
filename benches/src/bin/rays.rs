//! Ray queries of our tree beside Embree's, on the same triangles and rays, one thread, turn by turn:
//! `cargo run --release -p benches --bin rays -- [--embree LIBRARY] [--level avx2] [--only NAME] [--rounds N] [--json FILE]`.
#![allow(clippy::print_stdout)]

use std::path::PathBuf;
use std::time::Instant;

use benches::embree::{Embree, Quality};
use benches::room::{self, Corners};
use serde::Serialize;
use steradian_bvh::available_levels;
use steradian_geometry::Accel;
use steradian_math::Ray;

/// How many of the rays hit.
type Count<'a> = Box<dyn Fn(&[Ray]) -> usize + 'a>;

/// A name, and how its triangles are made.
type Scene = (&'static str, fn() -> Vec<Corners>);

/// What can be asked, and answered by either.
struct Engine<'a> {
    name: String,
    build_seconds: f64,
    bytes: usize,
    closest: Count<'a>,
    any: Count<'a>,
}

/// One line of the results: millions of rays a second.
#[derive(Serialize)]
struct Row {
    scene: String,
    triangles: usize,
    engine: String,
    build_seconds: f64,
    bytes_per_triangle: f64,
    primary: f64,
    diffuse: f64,
    shadow: f64,
    /// How many of the rays hit, of each kind.
    hits: [usize; 3],
}

fn ours<'a>(accel: &'a Accel, name: String, build_seconds: f64) -> Engine<'a> {
    let closest = |r: &&Ray| accel.closest(r, |_, _| None, |_, _, _, _| true).is_some();
    let any = |r: &&Ray| accel.any(r, |_, _| false, |_, _, _, _| true);
    Engine {
        name,
        build_seconds,
        bytes: accel.byte_size(),
        closest: Box::new(move |rays| rays.iter().filter(closest).count()),
        any: Box::new(move |rays| rays.iter().filter(any).count()),
    }
}

fn theirs(embree: &Embree, name: String) -> Engine<'_> {
    Engine {
        name,
        build_seconds: embree.build_seconds,
        bytes: embree.tree_bytes(),
        closest: Box::new(|rays| rays.iter().filter(|r| embree.closest(r).is_some()).count()),
        any: Box::new(|rays| rays.iter().filter(|r| embree.any(r)).count()),
    }
}

struct Options {
    embree: Option<PathBuf>,
    level: Option<String>,
    only: Option<String>,
    rounds: usize,
    json: Option<PathBuf>,
}

fn options() -> Result<Options, String> {
    let mut o = Options { embree: None, level: None, only: None, rounds: 7, json: None };
    let mut args = std::env::args().skip(1);
    while let Some(name) = args.next() {
        let value = args.next().ok_or_else(|| format!("{name} wants a value"))?;
        match name.as_str() {
            "--embree" => o.embree = Some(value.into()),
            "--level" => o.level = Some(value),
            "--only" => o.only = Some(value),
            "--rounds" => o.rounds = value.parse().map_err(|e| format!("--rounds {value}: {e}"))?,
            "--json" => o.json = Some(value.into()),
            _ => return Err(format!("unknown option {name}")),
        }
    }
    Ok(o)
}

/// Measures all engines on one scene, turn by turn, and keeps each one's best turn.
fn measure(scene: &str, triangles: &[Corners], options: &Options) -> Result<Vec<Row>, String> {
    let input = room::input(triangles);
    let start = Instant::now();
    let mut accel = Accel::build(&input, &[]).map_err(|e| e.to_string())?;
    let build_seconds = start.elapsed().as_secs_f64();
    let levels: Vec<_> = available_levels().into_iter().map(|l| (format!("{l:?}"), l)).collect();
    let wanted = |name: &str| options.level.as_ref().is_none_or(|w| name.to_lowercase().starts_with(w.as_str()));
    if let Some((_, level)) = levels.iter().rev().find(|(name, _)| wanted(name)) {
        accel.set_level(*level);
    }
    let mut others = Vec::new();
    if let Some(library) = &options.embree {
        for (quality, robust) in [(1, true), (1, false), (2, true), (2, false)] {
            let name = format!(
                "Embree {} {}",
                if quality == 1 { "medium" } else { "high" },
                if robust { "robust" } else { "fast" }
            );
            let quality = Quality { build: quality, robust };
            others.push((name, Embree::build(library, "threads=1,set_affinity=0", quality, triangles)?));
        }
    }
    let rays = room::rays(&accel, triangles);
    let label = format!("{:?}", accel.level());
    let mut engines =
        vec![ours(&accel, format!("Steradian {}", label.split('(').next().unwrap_or_default()), build_seconds)];
    engines.extend(others.iter().map(|(name, embree)| theirs(embree, name.clone())));
    let mut best = vec![[f64::INFINITY; 3]; engines.len()];
    let mut hits = vec![[0; 3]; engines.len()];
    for _ in 0..options.rounds {
        for (e, engine) in engines.iter().enumerate() {
            for kind in 0..3 {
                let start = Instant::now();
                hits[e][kind] = if kind == 2 { (engine.any)(&rays[kind]) } else { (engine.closest)(&rays[kind]) };
                best[e][kind] = start.elapsed().as_secs_f64().min(best[e][kind]);
            }
        }
    }
    let rate = |e: usize, kind: usize| rays[kind].len() as f64 / best[e][kind] * 1e-6;
    let row = |(e, engine): (usize, &Engine)| Row {
        scene: scene.into(),
        triangles: triangles.len(),
        engine: engine.name.clone(),
        build_seconds: engine.build_seconds,
        bytes_per_triangle: engine.bytes as f64 / triangles.len() as f64,
        primary: rate(e, 0),
        diffuse: rate(e, 1),
        shadow: rate(e, 2),
        hits: hits[e],
    };
    Ok(engines.iter().enumerate().map(row).collect())
}

fn main() -> Result<(), String> {
    let options = options()?;
    let scenes: [Scene; 4] = [
        ("boxes", room::boxes),
        ("20k", || room::blobs(20_000)),
        ("1M", || room::blobs(1_000_000)),
        ("8M", || room::blobs(8_000_000)),
    ];
    let mut rows = Vec::new();
    for (name, make) in scenes {
        if options.only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        for row in measure(name, &make(), &options)? {
            println!(
                "{:6} {:20} {:5.1} {:5.1} {:5.1} M rays/s (primary, diffuse, shadow)  built in {:7.3} s, {:5.0} bytes a triangle  {:?}",
                row.scene,
                row.engine,
                row.primary,
                row.diffuse,
                row.shadow,
                row.build_seconds,
                row.bytes_per_triangle,
                row.hits
            );
            rows.push(row);
        }
    }
    if let Some(file) = &options.json {
        let text = serde_json::to_string_pretty(&rows).map_err(|e| e.to_string())?;
        std::fs::write(file, text).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    Ok(())
}
