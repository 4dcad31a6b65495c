//! `steradian info`: what is in a scene, or what an image file says about itself.

use std::collections::BTreeSet;
use std::path::Path;

use steradian_image::{Attribute, Format, Image, Precision};
use steradian_load::LoadOptions;
use steradian_scene::{Light, Projection, Scattering, Scene, Shape, World};
use steradian_syntax::Severity;

use crate::args::InfoArgs;
use crate::console::Console;
use crate::failure::{DONE, Failure};
use crate::numbers::{bytes, count, counted};
use crate::{opened, output, overrides};

/// Prints what there is to say; the exit code.
pub(crate) fn run(args: &InfoArgs, console: &Console) -> Result<u8, Failure> {
    if Format::from_name(&args.file.to_string_lossy()).is_some() && !steradian_load::is_model(&args.file) {
        image(&args.file, console)
    } else {
        scene(args, console)
    }
}

/// One line of the table.
fn row(console: &Console, name: &str, value: impl std::fmt::Display) {
    console.out(format_args!("  {name:<12}{value}"));
}

fn scene(args: &InfoArgs, console: &Console) -> Result<u8, Failure> {
    let path = args.file.as_path();
    let options = LoadOptions { model: args.model.options(None), ..LoadOptions::default() };
    let outcome = opened::read(Some(path), &options)?;
    // What is not an error is a row of the table.
    for d in outcome.diagnostics.iter().filter(|d| d.severity == Severity::Error) {
        console.diagnostic(&d.render(&outcome.sources), false);
    }
    let texts = outcome.sources.iter().count();
    let Some(scene) = outcome.scene else { return Err(Failure::Reported) };
    let objects = scene.objects.iter().flat_map(|o| &o.primitives);
    let shapes = tally(scene.primitives.iter().chain(objects).map(|p| shape_name(&p.shape)));
    // Building takes the shapes out of the scene and puts them in their places; only then is it known what is seen where.
    let world = opened::build(scene, None)?;
    console.heading(path.display());
    row(console, "files", counted(texts as u64, "text"));
    row(console, "shapes", shapes);
    contents(&world, console);
    how(world.scene(), console);
    let b = world.bounds();
    if b.is_empty() {
        row(console, "bounds", "nothing to be seen");
    } else {
        let p = |p: steradian_math::Point3| format!("({}, {}, {})", p.x, p.y, p.z);
        row(console, "bounds", format_args!("{} to {}", p(b.min), p(b.max)));
    }
    let census = world.census();
    let sizes = [(census.mesh_bytes, "meshes"), (census.tree_bytes, "trees"), (census.image_bytes, "images")];
    let total: usize = sizes.iter().map(|(n, _)| n).sum();
    let parts = sizes.map(|(n, what)| format!("{what} {}", bytes(n as u64))).join(", ");
    row(console, "memory", format_args!("{} ({parts})", bytes(total as u64)));
    for (name, n) in &outcome.uses {
        let times = if *n > 1 { format!(", {} times", count(*n)) } else { String::new() };
        row(console, "uses", format_args!("{name}{times}"));
    }
    // What is read otherwise than it is written, or not at all.
    let mild: BTreeSet<&str> = outcome.diagnostics.iter().map(|d| d.message.as_str()).collect();
    for message in mild {
        row(console, "differs", message);
    }
    Ok(DONE)
}

fn contents(world: &World, console: &Console) {
    let (scene, census) = (world.scene(), world.census());
    let mut triangles = count(census.triangles as u64);
    if census.instanced_triangles != census.triangles {
        triangles += &format!(", {} with instances", count(census.instanced_triangles as u64));
    }
    if census.degenerate > 0 {
        triangles += &format!(", {} more without area", count(census.degenerate as u64));
    }
    row(console, "triangles", triangles);
    if census.instances > 0 {
        let objects = counted(scene.objects.len() as u64, "object");
        row(console, "instances", format_args!("{} of {objects}", count(census.instances as u64)));
    }
    let area = census.lights.saturating_sub(scene.lights.len());
    let lights = scene.lights.iter().map(light_name).chain(std::iter::repeat_n("area", area));
    row(console, "lights", tally(lights));
    row(console, "materials", tally(scene.materials.iter().map(|m| scattering_name(&m.scattering))));
    let textures = scene.float_textures.len() + scene.spectrum_textures.len();
    row(
        console,
        "textures",
        format_args!("{}, {}", counted(textures as u64, "texture"), counted(scene.images.len() as u64, "image")),
    );
    if !scene.media.is_empty() {
        row(console, "media", count(scene.media.len() as u64));
    }
}

fn shape_name(shape: &Shape) -> &'static str {
    match shape {
        Shape::Triangles(_) => "triangle mesh",
        Shape::Bilinear(_) => "bilinear mesh",
        Shape::Sphere(_) => "sphere",
        Shape::Disk(_) => "disk",
        Shape::Cylinder(_) => "cylinder",
        Shape::Curves(_) => "curve",
        Shape::Distances(_) => "grid of signed distances",
    }
}

fn scattering_name(scattering: &Scattering) -> &'static str {
    match scattering {
        Scattering::Diffuse { .. } => "diffuse",
        Scattering::Conductor { .. } => "conductor",
        Scattering::Dielectric { .. } => "dielectric",
        Scattering::ThinDielectric { .. } => "thin dielectric",
        Scattering::DiffuseTransmission { .. } => "diffuse transmission",
        Scattering::CoatedDiffuse { .. } => "coated diffuse",
        Scattering::CoatedConductor { .. } => "coated conductor",
        Scattering::Hair { .. } => "hair",
        Scattering::Measured(_) => "measured",
        Scattering::Subsurface { .. } => "subsurface",
        Scattering::Mix { .. } => "mix",
        Scattering::MetallicRoughness(_) => "metallic-roughness",
        Scattering::Plastic(_) => "plastic",
        Scattering::Principled(_) => "principled",
        Scattering::Altered { .. } => "altered interface",
        Scattering::Sides { .. } => "two sides",
        Scattering::Interface => "interface",
    }
}

fn how(scene: &Scene, console: &Console) {
    let (film, settings) = (&scene.settings.film, &scene.settings);
    row(console, "camera", camera(scene));
    let [w, h] = film.resolution;
    let crop = if film.size() == film.resolution {
        String::new()
    } else {
        let [x0, x1, y0, y1] = film.pixel_bounds;
        format!(", of which {x0}..{x1} x {y0}..{y1} is rendered")
    };
    row(console, "film", format_args!("{w} x {h} pixels{crop}, {}, \"{}\"", film.color_space.name(), film.filename));
    row(
        console,
        "sampler",
        format_args!(
            "{}, {} per pixel, seed {}",
            settings.sampler.kind.name(),
            counted(u64::from(settings.sampler.spp), "sample"),
            settings.sampler.seed
        ),
    );
    row(
        console,
        "integrator",
        format_args!(
            "{}, at most {}, {}",
            overrides::integrator_name(settings.integrator.kind),
            counted(u64::from(settings.integrator.max_depth), "bounce"),
            overrides::color_name(settings.color)
        ),
    );
    let biased = output::biased_options(settings);
    if !biased.is_empty() {
        row(console, "biased by", biased.join(", "));
    }
}

fn camera(scene: &Scene) -> String {
    let camera = &scene.camera;
    let mut out = match &camera.projection {
        Projection::Perspective { fov } => format!("perspective, {fov} degrees along the shorter side"),
        Projection::Orthographic => "orthographic".to_owned(),
        Projection::Spherical { .. } => "spherical".to_owned(),
        Projection::Realistic { .. } => "lens system".to_owned(),
    };
    if camera.lens_radius > 0.0 {
        out += &format!(", lens of radius {} in focus at {}", camera.lens_radius, camera.focal_distance);
    }
    if camera.world_from_camera.is_animated() {
        out += &format!(", moving, shutter from {} to {}", camera.shutter[0], camera.shutter[1]);
    }
    out
}

fn light_name(light: &Light) -> &'static str {
    match light {
        Light::Point { .. } => "point",
        Light::Spot { .. } => "spot",
        Light::Distant { .. } => "distant",
        Light::Sun { .. } => "disc at infinity",
        Light::Goniometric { .. } => "goniometric",
        Light::Projection { .. } => "projection",
        Light::Cone { .. } => "cone",
        Light::PortalInfinite { .. } => "infinite behind a portal",
        Light::UniformInfinite { .. } => "uniform infinite",
        Light::ImageInfinite { .. } => "image infinite",
        Light::Moving { light, .. } => light_name(light),
    }
}

/// `12 diffuse, 3 conductor`: most frequent first, then by name.
fn tally<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut counts = std::collections::BTreeMap::<&str, u64>::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    let mut sorted: Vec<(&str, u64)> = counts.into_iter().collect();
    sorted.sort_by_key(|&(name, n)| (std::cmp::Reverse(n), name));
    if sorted.is_empty() {
        return "none".into();
    }
    sorted.iter().map(|(name, n)| format!("{} {name}", count(*n))).collect::<Vec<_>>().join(", ")
}

/// Reads an image; a failure names the file.
pub(crate) fn read_image(path: &Path) -> Result<Image, Failure> {
    let name = path.display().to_string();
    let bytes = std::fs::read(path).map_err(|e| Failure::Input(format!("{name}: {}", crate::failure::reason(&e))))?;
    steradian_image::read(&bytes, &name).map_err(|e| Failure::Input(e.to_string()))
}

fn image(path: &Path, console: &Console) -> Result<u8, Failure> {
    let image = read_image(path)?;
    console.heading(path.display());
    row(console, "size", format_args!("{} x {} pixels", image.width(), image.height()));
    let (frame, origin) = (image.frame(), image.metadata.origin);
    if [frame.width, frame.height] != [image.width(), image.height()] {
        row(
            console,
            "part of",
            format_args!("{} x {} pixels, from {}, {}", frame.width, frame.height, origin[0], origin[1]),
        );
    }
    for c in image.channels() {
        let precision = match c.precision {
            Precision::Half => "16-bit float",
            Precision::Float => "32-bit float",
            Precision::Uint => "32-bit integer",
        };
        row(console, "channel", format_args!("{:<14} {precision:<15} {}", c.name, range(&c.samples)));
    }
    if let Some(c) = image.metadata.chromaticities {
        row(
            console,
            "primaries",
            format_args!("red {:?}, green {:?}, blue {:?}, white {:?}", c.red, c.green, c.blue, c.white),
        );
    }
    for (name, value) in &image.metadata.attributes {
        console.out(format_args!("  {name} = {}", attribute(value)));
    }
    Ok(DONE)
}

fn range(samples: &[f32]) -> String {
    let finite = || samples.iter().copied().filter(|v| v.is_finite());
    let bad = samples.len() - finite().count();
    if bad == samples.len() {
        return "no finite values".into();
    }
    let (low, high) = finite().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let mean = finite().map(f64::from).sum::<f64>() / (samples.len() - bad) as f64;
    let bad = if bad > 0 { format!(", {} not finite", counted(bad as u64, "value")) } else { String::new() };
    format!("{low:.4} to {high:.4}, mean {mean:.4}{bad}")
}

fn attribute(value: &Attribute) -> String {
    match value {
        Attribute::Text(t) => format!("{t:?}"),
        Attribute::Int(v) => v.to_string(),
        Attribute::Float(v) => v.to_string(),
        Attribute::Double(v) => v.to_string(),
        Attribute::V2f(v) => format!("{v:?}"),
        Attribute::V3f(v) => format!("{v:?}"),
        Attribute::V2i(v) => format!("{v:?}"),
        Attribute::M44f(v) => format!("{v:?}"),
        Attribute::TextList(v) => format!("{v:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tallies_and_ranges() {
        assert_eq!(tally(["a", "b", "b"].into_iter()), "2 b, 1 a");
        assert_eq!(tally(std::iter::empty()), "none");
        assert_eq!(range(&[1.0, 3.0, f32::NAN]), "1.0000 to 3.0000, mean 2.0000, 1 value not finite");
        assert_eq!(range(&[f32::NAN]), "no finite values");
    }
}
