//! What the command line replaces in a scene, and the same written out again: for a replay command and for the picture's metadata.

use std::fmt::Write;

use clap::ValueEnum;
use steradian_sampling::sampler::SamplerKind;
use steradian_scene::{Bidirectional, IntegratorKind, Metropolis, PhotonMapping, Scene};
use steradian_spectrum::ColorMode;

use crate::args::{ColorArg, IntegratorArg, PictureArgs, SamplerArg};
use crate::console::Console;

/// Changes the scene's settings as the command line asks.
pub(crate) fn apply(picture: &PictureArgs, scene: &mut Scene, console: &Console) {
    if let Some(size) = picture.size {
        resize(scene, size.0, console);
    }
    picture.view.apply(scene, console);
    let settings = &mut scene.settings;
    if let Some(crop) = picture.crop {
        settings.film.pixel_bounds = at_least_a_pixel(settings.film.crop_window(crop.0), settings.film.resolution);
    }
    let sampler = &mut settings.sampler;
    if let Some(kind) = picture.sampler {
        sampler.kind = sampler_kind(kind);
        sampler.strata = [0, 0];
    }
    if let Some(spp) = picture.spp {
        sampler.spp = spp;
        sampler.strata = [0, 0];
    }
    if let Some(planned) = picture.sampler_spp {
        sampler.spp = planned;
        sampler.strata = [0, 0];
    }
    if let Some(seed) = picture.seed {
        sampler.seed = seed;
    }
    if let Some(integrator) = picture.integrator {
        settings.integrator.kind = integrator_kind(integrator, settings.integrator.kind);
    }
    crate::technique_args::apply(&picture.technique, scene, picture.spp.is_some());
    let settings = &mut scene.settings;
    if let Some(depth) = picture.max_depth {
        settings.integrator.max_depth = depth;
    }
    if let Some(most) = picture.clamp {
        settings.film.max_component_value = most.0;
    }
    if let Some(color) = picture.color {
        settings.color = match color {
            ColorArg::Rgb => ColorMode::Rgb,
            ColorArg::Spectral => ColorMode::Spectral,
        };
    }
}

/// Another resolution; a crop keeps its place in the picture.
fn resize(scene: &mut Scene, new: [u32; 2], console: &Console) {
    let film = &mut scene.settings.film;
    let old = film.resolution;
    let [x0, x1, y0, y1] = film.pixel_bounds;
    let scaled =
        |edge: u32, axis: usize| (f64::from(edge) * f64::from(new[axis]) / f64::from(old[axis].max(1))).round() as u32;
    film.resolution = new;
    film.pixel_bounds = at_least_a_pixel([scaled(x0, 0), scaled(x1, 0), scaled(y0, 1), scaled(y1, 1)], new);
    scene.settings.sampler.resolution = new;
    let [before, after] = [old, new].map(|[w, h]| f64::from(w) / f64::from(h.max(1)));
    let fixed = scene.camera.screen_window.is_some() || scene.camera.frame_aspect_ratio.is_some();
    if fixed && (after / before - 1.0).abs() > 0.01 {
        console.warning("the scene's camera fixes its frame, so that with these proportions pixels are not square");
    }
}

/// A crop that is thinner than a pixel shows the pixel that it lies in.
fn at_least_a_pixel([x0, x1, y0, y1]: [u32; 4], size: [u32; 2]) -> [u32; 4] {
    let axis = |a: u32, b: u32, n: u32| {
        let a = a.min(n - 1);
        (a, b.clamp(a + 1, n))
    };
    let ((x0, x1), (y0, y1)) = (axis(x0, x1, size[0].max(1)), axis(y0, y1, size[1].max(1)));
    [x0, x1, y0, y1]
}

fn sampler_kind(arg: SamplerArg) -> SamplerKind {
    match arg {
        SamplerArg::Independent => SamplerKind::Independent,
        SamplerArg::Stratified => SamplerKind::Stratified,
        SamplerArg::Halton => SamplerKind::Halton,
        SamplerArg::Sobol => SamplerKind::Sobol,
        SamplerArg::PaddedSobol => SamplerKind::PaddedSobol,
        SamplerArg::ZSobol => SamplerKind::ZSobol,
        SamplerArg::Pmj02bn => SamplerKind::Pmj02bn,
    }
}

fn integrator_kind(arg: IntegratorArg, in_scene: IntegratorKind) -> IntegratorKind {
    match (arg, in_scene) {
        (IntegratorArg::Path, _) => IntegratorKind::Path,
        (IntegratorArg::Volpath, _) => IntegratorKind::VolPath,
        (IntegratorArg::Simplevolpath, _) => IntegratorKind::SimpleVolPath,
        (IntegratorArg::Lightpath, _) => IntegratorKind::LightPath,
        (IntegratorArg::Bdpt, IntegratorKind::Bdpt(_)) => in_scene,
        (IntegratorArg::Bdpt, _) => IntegratorKind::Bdpt(Bidirectional::default()),
        (IntegratorArg::Sppm, IntegratorKind::Sppm(_)) => in_scene,
        (IntegratorArg::Sppm, _) => IntegratorKind::Sppm(PhotonMapping::default()),
        (IntegratorArg::Mlt, IntegratorKind::Mlt(_)) => in_scene,
        (IntegratorArg::Mlt, _) => IntegratorKind::Mlt(Metropolis::default()),
        (IntegratorArg::Whitted, _) => crate::technique_args::whitted(),
        (IntegratorArg::Distribution, _) => crate::technique_args::distribution(),
        (IntegratorArg::Normals, _) => IntegratorKind::Normals,
        (IntegratorArg::Albedo, _) => IntegratorKind::Albedo,
        (IntegratorArg::Depth, _) => IntegratorKind::Depth,
        (IntegratorArg::Uv, _) => IntegratorKind::Uv,
        // The scene's own parameters, where it has some.
        (IntegratorArg::Ao, IntegratorKind::AmbientOcclusion { .. }) => in_scene,
        (IntegratorArg::Ao, _) => IntegratorKind::AmbientOcclusion { cosine: true, max_distance: f32::INFINITY },
    }
}

/// The name that the command line gives the integrator.
pub(crate) fn integrator_name(kind: IntegratorKind) -> &'static str {
    match kind {
        IntegratorKind::Path => "path",
        IntegratorKind::VolPath => "volpath",
        IntegratorKind::SimpleVolPath => "simplevolpath",
        IntegratorKind::LightPath => "lightpath",
        IntegratorKind::Bdpt(_) => "bdpt",
        IntegratorKind::Sppm(_) => "sppm",
        IntegratorKind::Mlt(_) => "mlt",
        IntegratorKind::Whitted(_) => "whitted",
        IntegratorKind::Distribution(_) => "distribution",
        IntegratorKind::Function(_) => "function",
        IntegratorKind::Normals => "normals",
        IntegratorKind::Albedo => "albedo",
        IntegratorKind::Depth => "depth",
        IntegratorKind::Uv => "uv",
        IntegratorKind::AmbientOcclusion { .. } => "ao",
    }
}

/// The name that the command line gives the colour mode.
pub(crate) fn color_name(mode: ColorMode) -> &'static str {
    match mode {
        ColorMode::Rgb => "rgb",
        ColorMode::Spectral => "spectral",
    }
}

/// The options as they would be typed, each with a space before it; empty if there are none.
pub(crate) fn as_typed(picture: &PictureArgs) -> String {
    let mut out = String::new();
    let mut add = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            let space = if value.is_empty() { "" } else { " " };
            let _ = write!(out, " --{name}{space}{value}");
        }
    };
    fn named<T: ValueEnum>(value: Option<T>) -> Option<String> {
        value?.to_possible_value().map(|v| v.get_name().to_owned())
    }
    add("spp", picture.spp.map(|v| v.to_string()));
    add("sampler-spp", picture.sampler_spp.map(|v| v.to_string()));
    add("size", picture.size.map(|v| v.to_string()));
    add("crop", picture.crop.map(|v| v.to_string()));
    add("seed", picture.seed.map(|v| v.to_string()));
    add("integrator", named(picture.integrator));
    add("sampler", named(picture.sampler));
    add("max-depth", picture.max_depth.map(|v| v.to_string()));
    add("clamp", picture.clamp.map(|v| v.to_string()));
    add("color", named(picture.color));
    picture.view.as_typed(&mut add);
    picture.model.as_typed(&mut add);
    if picture.filter_outliers {
        out += " --filter-outliers";
    }
    crate::technique_args::as_typed(&picture.technique, &mut out);
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numbers::{Crop, Size};

    #[test]
    fn options_are_typed_out_in_full() {
        let picture = PictureArgs {
            spp: Some(8),
            sampler_spp: Some(64),
            size: Some(Size([32, 16])),
            crop: Some(Crop([0.0, 0.5, 0.25, 1.0])),
            seed: Some(u64::MAX),
            integrator: Some(IntegratorArg::Ao),
            sampler: Some(SamplerArg::ZSobol),
            max_depth: Some(3),
            clamp: Some(crate::numbers::Positive(2.5)),
            filter_outliers: true,
            color: Some(ColorArg::Rgb),
            technique: crate::technique_args::TechniqueArgs { split: Some(4), ..Default::default() },
            view: crate::camera_args::CameraArgs { fov: Some(35.5), ..Default::default() },
            model: crate::model_args::ModelArgs { no_ground: true, ..Default::default() },
        };
        assert_eq!(
            as_typed(&picture),
            " --spp 8 --sampler-spp 64 --size 32x16 --crop 0,0.5,0.25,1 --seed 18446744073709551615 --integrator ao --sampler zsobol \
             --max-depth 3 --clamp 2.5 --color rgb --fov 35.5 --no-ground --filter-outliers --split 4"
        );
        assert_eq!(as_typed(&PictureArgs::default()), "");
    }

    #[test]
    fn a_crop_never_vanishes() {
        assert_eq!(at_least_a_pixel([5, 5, 0, 0], [10, 10]), [5, 6, 0, 1]);
        assert_eq!(at_least_a_pixel([10, 10, 9, 12], [10, 10]), [9, 10, 9, 10]);
    }
}
