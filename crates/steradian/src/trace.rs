//! `steradian trace`: one sample of one pixel again, with everything that happens on its way.

use std::panic::{AssertUnwindSafe, catch_unwind};

use serde_json::{Value, json};
use steradian_integrator::Scratch;
use steradian_integrator::record::{Event, PathRecord, RayKind, Technique};
use steradian_math::{Normal3, Point3, Vec3};
use steradian_render::{PixelSampler, Sampled};
use steradian_sampling::Sampler;
use steradian_scene::IntegratorKind;
use steradian_spectrum::Lanes;

use crate::args::TraceArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure};
use crate::opened;

/// Traces and prints; the exit code.
pub(crate) fn run(args: &TraceArgs, console: &Console) -> Result<u8, Failure> {
    let opened = opened::open(args.scene.as_ref(), &args.picture, console)?;
    let [w, h] = opened.scene.settings.film.resolution;
    let [x, y] = args.pixel.0;
    if x >= w || y >= h {
        return Err(Failure::Input(format!("--pixel {x},{y} lies outside the picture of {w} x {h} pixels")));
    }
    if matches!(opened.scene.settings.integrator.kind, IntegratorKind::Mlt(_)) {
        return Err(Failure::Input(
            "the paths of `mlt` are those of chains, and belong to no pixel: trace with --integrator bdpt".into(),
        ));
    }
    let world = opened::build(opened.scene, None)?;
    let pixel_sampler = PixelSampler::new(&world);
    let mut sampler = Sampler::new(&world.settings().sampler);
    let mut record = PathRecord::default();
    // What was recorded up to a broken rule is what the user came for.
    let mut scratch = Scratch::default();
    let sampled = catch_unwind(AssertUnwindSafe(|| {
        pixel_sampler.sample(&mut sampler, args.pixel.0, args.sample, &mut record, &mut scratch)
    }))
    .ok();
    if args.json {
        let value = as_json(args, sampled.as_ref(), &record);
        console.out(serde_json::to_string_pretty(&value).map_err(|e| Failure::Environment(e.to_string()))?);
    } else {
        print(args, sampled.as_ref(), &record, console);
    }
    Ok(DONE)
}

fn print(args: &TraceArgs, sampled: Option<&Sampled>, record: &PathRecord, console: &Console) {
    let [x, y] = args.pixel.0;
    console.heading(format_args!("pixel {x},{y}, sample {}", args.sample));
    if let Some(s) = sampled {
        console.out(format_args!("film position {:.4}, {:.4}; filter weight {}", s.film.x, s.film.y, s.weight));
        if s.wavelengths.is_rgb() {
            console.out("lanes are red, green, blue");
        } else {
            let nm = s.wavelengths.lambda().map(|l| format!("{l:.1}")).join("  ");
            let note =
                if s.wavelengths.secondary_terminated() { " (only the hero is left after dispersion)" } else { "" };
            console.out(format_args!("lanes are wavelengths {nm} nm{note}"));
        }
    }
    for event in &record.events {
        match event {
            Event::Ray(RayKind::Shadow) => {}
            Event::Ray(kind) => console.out(format_args!("{} ray", ray_name(*kind))),
            Event::Vertex(v) => {
                console.out(format_args!("vertex {} at {} normal {}", v.depth, point(v.p), normal(v.n)));
                console.out(format_args!("  {}, lobes {}, throughput {}", v.material, v.lobe, lanes(v.throughput)));
            }
            Event::Contribution(c) => {
                let light = c.light.map_or("light".to_owned(), |l| format!("light {l}"));
                let how = match c.technique {
                    Technique::Hit => "runs into",
                    Technique::LightSampling => "samples",
                };
                let end = c.end.map_or(format!("towards {}", vector(c.direction)), |p| format!("at {}", point(p)));
                let blocked = if c.occluded { ", but something is in the way" } else { "" };
                console.out(format_args!("  {how} {light} {end}{blocked}"));
                console.out(format_args!(
                    "    density {:e}, the other way {:e}, weight {:.4}, adds {}",
                    c.pdf,
                    c.other_pdf,
                    c.weight,
                    lanes(c.value)
                ));
            }
            Event::Bounce(b) => {
                let kind = match (b.specular, b.transmission) {
                    (true, true) => "refracts",
                    (true, false) => "mirrors",
                    (false, true) => "scatters through",
                    (false, false) => "scatters",
                };
                console.out(format_args!(
                    "  {kind} towards {}, density {:e}, weight {}, survives with probability {:.3}",
                    vector(b.direction),
                    b.pdf,
                    lanes(b.weight),
                    b.survival
                ));
            }
        }
    }
    match sampled {
        Some(s) => {
            console.out(format_args!("radiance {}", lanes(s.radiance)));
            let bad = if s.rgb.iter().all(|v| v.is_finite()) { "" } else { "  NOT FINITE" };
            console.heading(format_args!("colour {:e}  {:e}  {:e}{bad}", s.rgb[0], s.rgb[1], s.rgb[2]));
        }
        None => console.heading("the renderer broke one of its own rules here; its words are above"),
    }
}

fn ray_name(kind: RayKind) -> &'static str {
    match kind {
        RayKind::Camera => "camera",
        RayKind::Scattered => "scattered",
        RayKind::Shadow => "shadow",
    }
}

fn point(p: Point3) -> String {
    format!("({:.5}, {:.5}, {:.5})", p.x, p.y, p.z)
}

fn vector(v: Vec3) -> String {
    format!("({:.5}, {:.5}, {:.5})", v.x, v.y, v.z)
}

fn normal(n: Normal3) -> String {
    format!("({:.5}, {:.5}, {:.5})", n.x, n.y, n.z)
}

fn lanes(l: Lanes) -> String {
    format!("[{}]", l.0.map(|v| format!("{v:.5}")).join(" "))
}

/// A number for JSON; what JSON cannot say becomes a text.
fn number(v: f32) -> Value {
    if v.is_finite() { json!(v) } else { json!(v.to_string()) }
}

fn numbers(v: &[f32]) -> Value {
    v.iter().map(|&v| number(v)).collect()
}

fn as_json(args: &TraceArgs, sampled: Option<&Sampled>, record: &PathRecord) -> Value {
    let p3 = |p: Point3| numbers(&[p.x, p.y, p.z]);
    let v3 = |v: Vec3| numbers(&[v.x, v.y, v.z]);
    let events: Vec<Value> = record
        .events
        .iter()
        .map(|event| match event {
            Event::Ray(kind) => json!({ "event": "ray", "kind": ray_name(*kind) }),
            Event::Vertex(v) => json!({
                "event": "vertex", "depth": v.depth, "p": p3(v.p), "n": v3(v.n.to_vec()),
                "material": v.material, "lobe": v.lobe, "throughput": numbers(&v.throughput.0),
            }),
            Event::Contribution(c) => json!({
                "event": "contribution", "depth": c.depth, "light": c.light,
                "technique": match c.technique { Technique::Hit => "hit", Technique::LightSampling => "light sampling" },
                "direction": v3(c.direction), "end": c.end.map(p3), "pdf": number(c.pdf), "other_pdf": number(c.other_pdf),
                "weight": number(c.weight), "value": numbers(&c.value.0), "occluded": c.occluded,
            }),
            Event::Bounce(b) => json!({
                "event": "bounce", "direction": v3(b.direction), "pdf": number(b.pdf), "weight": numbers(&b.weight.0),
                "specular": b.specular, "transmission": b.transmission, "survival": number(b.survival),
            }),
        })
        .collect();
    json!({
        "pixel": args.pixel.0,
        "sample": args.sample,
        "film": sampled.map(|s| numbers(&[s.film.x, s.film.y])),
        "filter_weight": sampled.map(|s| number(s.weight)),
        "wavelengths": sampled.filter(|s| !s.wavelengths.is_rgb()).map(|s| numbers(&s.wavelengths.lambda())),
        "events": events,
        "radiance": sampled.map(|s| numbers(&s.radiance.0)),
        "rgb": sampled.map(|s| numbers(&s.rgb)),
        "finite": sampled.is_some_and(|s| s.rgb.iter().all(|v| v.is_finite())),
    })
}
