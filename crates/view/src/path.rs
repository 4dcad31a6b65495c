//! One path, told vertex by vertex, with what each contribution brings to its pixel.

use crate::hub::Staged;
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use steradian_integrator::Scratch;
use steradian_integrator::record::{Bounce, Contribution, Event, RayKind, Record, Technique, Vertex};
use steradian_math::{Normal3, Point3, Vec3};
use steradian_render::{PixelSampler, Sampled};
use steradian_sampling::Sampler;
use steradian_spectrum::Lanes;

/// More events than anybody reads: a path that splits at every vertex has millions.
const MOST_EVENTS: usize = 4096;

/// What happens along a path.
#[derive(Default)]
pub(crate) struct Trace {
    pub events: Vec<Event>,
    /// What the lens lets through.
    pub weight: Option<f32>,
    /// The sum of all contributions that nothing is in the way of, in their order.
    pub sum: Lanes,
    pub contributions: u32,
    rays: [u32; 3],
}

impl Trace {
    fn keep(&mut self, event: Event) {
        if self.events.len() < MOST_EVENTS {
            self.events.push(event);
        }
    }
}

impl Record for Trace {
    const DETAILED: bool = true;
    fn ray(&mut self, kind: RayKind) {
        self.rays[kind as usize] += 1;
    }
    fn vertex(&mut self, vertex: Vertex) {
        self.keep(Event::Vertex(vertex));
    }
    fn contribution(&mut self, c: Contribution) {
        self.contributions += 1;
        if !c.occluded {
            self.sum += c.value;
        }
        self.keep(Event::Contribution(c));
    }
    fn weight(&mut self, weight: f32) {
        self.weight = Some(weight);
    }
    fn bounce(&mut self, b: Bounce) {
        self.keep(Event::Bounce(b));
    }
}

/// Luminance of a colour.
pub(crate) fn luminance(rgb: [f32; 3]) -> f32 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// A number for JSON; what JSON cannot say becomes a text.
pub(crate) fn number(v: f32) -> Value {
    if v.is_finite() { json!(v) } else { json!(v.to_string()) }
}

fn numbers(v: &[f32]) -> Value {
    v.iter().map(|&v| number(v)).collect()
}

fn point(p: Point3) -> Value {
    numbers(&[p.x, p.y, p.z])
}

fn vector(v: Vec3) -> Value {
    numbers(&[v.x, v.y, v.z])
}

fn normal(n: Normal3) -> Value {
    numbers(&[n.x, n.y, n.z])
}

/// Traces a sample, and tells it. Does the sum of the contributions have the bits of the sample's radiance? Only where the algorithm
/// tells its contributions can that be asked.
pub(crate) fn tell<'w>(
    pixels: &PixelSampler<'w>,
    (sampler, scratch): (&mut Sampler, &mut Scratch<'w>),
    pixel: [u32; 2],
    sample: u32,
    staged: &Staged,
    command: String,
) -> Value {
    let mut trace = Trace::default();
    let run = catch_unwind(AssertUnwindSafe(|| pixels.sample(sampler, pixel, sample, &mut trace, scratch)));
    let Ok(sampled) = run else {
        return json!({ "pixel": pixel, "sample": sample, "broken": true, "command": command, "events": [] });
    };
    let weight = trace.weight.unwrap_or(1.0);
    let told = pixels.integrator.tells_light();
    let sum = trace.sum * weight;
    let exact = told.then(|| sum.0.map(f32::to_bits) == sampled.radiance.0.map(f32::to_bits));
    let color = |lanes: Lanes| pixels.color(lanes * weight, &sampled);
    let added = trace.events.iter().fold([0.0; 3], |total: [f32; 3], event| match event {
        Event::Contribution(c) if !c.occluded => {
            let rgb = color(c.value);
            std::array::from_fn(|i| total[i] + rgb[i])
        }
        _ => total,
    });
    let world = &staged.world;
    let camera = &world.scene().camera;
    let eye = camera.world_from_camera.at(camera.shutter[0]).point(Point3::default());
    json!({
        "pixel": pixel, "sample": sample, "generation": staged.generation,
        "rgb": numbers(&sampled.rgb), "luminance": number(luminance(sampled.rgb)),
        "radiance": numbers(&sampled.radiance.0), "film": [sampled.film.x, sampled.film.y], "filter_weight": sampled.weight,
        "wavelengths": (!sampled.wavelengths.is_rgb()).then(|| numbers(&sampled.wavelengths.lambda())),
        "lens": weight, "eye": point(eye),
        "told": told, "exact": exact, "sum": numbers(&added), "contributions": trace.contributions,
        "rays": { "camera": trace.rays[0], "scattered": trace.rays[1], "shadow": trace.rays[2] },
        "cut": trace.events.len() >= MOST_EVENTS,
        "events": trace.events.iter().map(|e| event(e, &color)).collect::<Vec<_>>(),
        "command": command,
    })
}

fn event(event: &Event, color: &impl Fn(Lanes) -> [f32; 3]) -> Value {
    match event {
        Event::Ray(_) => Value::Null,
        Event::Vertex(v) => json!({
            "event": "vertex", "depth": v.depth, "p": point(v.p), "n": normal(v.n), "material": v.material, "lobe": v.lobe,
            "throughput": numbers(&v.throughput.0),
        }),
        Event::Contribution(c) => json!({
            "event": "light", "depth": c.depth, "light": c.light, "sampled": c.technique == Technique::LightSampling,
            "direction": vector(c.direction), "end": c.end.map(point), "pdf": number(c.pdf), "other_pdf": number(c.other_pdf),
            "weight": number(c.weight), "value": numbers(&c.value.0), "rgb": numbers(&color(c.value)), "occluded": c.occluded,
        }),
        Event::Bounce(b) => json!({
            "event": "bounce", "direction": vector(b.direction), "pdf": number(b.pdf), "weight": numbers(&b.weight.0),
            "specular": b.specular, "transmission": b.transmission, "survival": number(b.survival),
        }),
    }
}

/// A sample's colour alone; black where it went wrong.
pub(crate) fn value<'w>(
    pixels: &PixelSampler<'w>,
    (sampler, scratch): (&mut Sampler, &mut Scratch<'w>),
    pixel: [u32; 2],
    index: u32,
) -> [f32; 3] {
    use steradian_integrator::record::NoRecord;
    let run =
        catch_unwind(AssertUnwindSafe(|| -> Sampled { pixels.sample(sampler, pixel, index, &mut NoRecord, scratch) }));
    run.map_or([0.0; 3], |s| if s.rgb.iter().all(|v| v.is_finite()) { s.rgb } else { [0.0; 3] })
}
