//! Camera, film, filter, sampler, integrator and options: what stands before `WorldBegin`.

use super::Loader;
use super::params::Params;
use steradian_image::{Filter, FilterKind};
use steradian_math::{AnimatedTransform, Vec2};
use steradian_sampling::{Randomization, SamplerKind, SamplerSettings};
use steradian_scene::{
    Bands, Bidirectional, Camera, FilmKind, FilmSettings, Handle, IntegratorKind, IntegratorSettings, LightSelection,
    LobeSampling, MOST_BANDS, MOST_PHOTONS, Medium, Metropolis, MisHeuristic, PhotonMapping, Projection,
    RenderSettings, SphericalMapping, Techniques, TestFunction,
};
use steradian_spectrum::{ColorMode, ColorSpace, LAMBDA_MAX, LAMBDA_MIN, PixelSensor};
use steradian_syntax::{Diagnostic, Directive, Kind, Span, did_you_mean};

/// What was declared so far; built when the whole text is read.
#[derive(Default)]
pub(super) struct Declarations {
    camera: Option<(String, Params, AnimatedTransform, Option<Handle<Medium>>)>,
    film: Option<(String, Params, ColorSpace)>,
    filter: Option<(String, Params)>,
    sampler: Option<(String, Params)>,
    integrator: Option<(String, Params)>,
    seed: u64,
    displacement_edge_scale: Option<f32>,
}

impl Declarations {
    /// What the edge lengths of displaced meshes are multiplied by.
    pub fn displacement_edge_scale(&self) -> f32 {
        self.displacement_edge_scale.unwrap_or(1.0)
    }
}

/// What pbrt takes when a scene says nothing.
pub(super) fn default_settings() -> RenderSettings {
    RenderSettings {
        film: FilmSettings::new(1280, 720),
        filter: gaussian(),
        sampler: SamplerSettings { kind: SamplerKind::ZSobol, ..SamplerSettings::default() },
        integrator: IntegratorSettings { kind: IntegratorKind::VolPath, ..IntegratorSettings::default() },
        color: ColorMode::Spectral,
        disable_pixel_jitter: false,
        disable_wavelength_jitter: false,
        disable_texture_filtering: false,
        force_diffuse: false,
        layered_as_pbrt: true,
    }
}

fn gaussian() -> Filter {
    Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::new(1.5, 1.5)).unwrap_or_else(|_| Filter::pixel_box())
}

/// The least that a film needs for each pixel: sums of three colours, weights and moments.
const FILM_BYTES_PER_PIXEL: u64 = 32;

impl Loader<'_> {
    /// Notes a camera, film, filter, sampler or integrator. The last of several counts.
    pub(super) fn declare(&mut self, mut d: Directive) {
        let kind = d.text(0).to_string();
        let params = self.params(&mut d);
        let replaced = match d.kind {
            Kind::Camera => {
                let world_from_camera = AnimatedTransform::new(
                    self.state.ctm[0].inverse(),
                    self.state.times[0],
                    self.state.ctm[1].inverse(),
                    self.state.times[1],
                );
                self.coordinate_systems.insert("camera".into(), self.state.ctm.map(|t| t.inverse()));
                let new = (kind, params, world_from_camera, self.state.outside);
                self.declarations.camera.replace(new).map(|old| old.1.span)
            }
            Kind::Film => self.declarations.film.replace((kind, params, self.state.color_space)).map(|old| old.1.span),
            Kind::PixelFilter => self.declarations.filter.replace((kind, params)).map(|old| old.1.span),
            Kind::Sampler => self.declarations.sampler.replace((kind, params)).map(|old| old.1.span),
            Kind::Integrator => self.declarations.integrator.replace((kind, params)).map(|old| old.1.span),
            // Which accelerator pbrt would build changes nothing in the image.
            _ => None,
        };
        if let Some(first) = replaced {
            let message = format!("a second `{}` replaces the first", d.kind.name());
            self.diagnostics.push(Diagnostic::warning(message, d.span).with_related("the first is here", first));
        }
    }

    /// Makes the settings and the camera from what was declared.
    pub(super) fn build_settings(&mut self) {
        let shutter = self.build_camera();
        self.build_film(shutter[1] - shutter[0]);
        self.build_filter();
        self.build_sampler();
        self.build_integrator();
    }

    fn done(&mut self, params: Params) {
        self.diagnostics.append(&mut params.finish());
    }

    /// Reports a type that pbrt does not have.
    pub(super) fn unknown_type(&mut self, what: &str, kind: &str, span: Span, known: &[&'static str]) {
        let d = Diagnostic::error(format!("unknown {what} \"{kind}\""), span);
        self.diagnostics.push(match did_you_mean(kind, known.iter().copied()) {
            Some(near) => d.with_suggestion(Some(near)),
            None => d.with_hint(format!("it can be {}", known.join(", "))),
        });
    }

    fn build_camera(&mut self) -> [f32; 2] {
        let mut camera = Camera::default();
        let Some((kind, mut params, world_from_camera, medium)) = self.declarations.camera.take() else {
            self.scene.camera = camera;
            return [0.0, 1.0];
        };
        camera.world_from_camera = world_from_camera;
        camera.medium = medium;
        let p = &mut params;
        let (open, close) = (p.float("shutteropen", 0.0), p.float("shutterclose", 1.0));
        if open < close {
            camera.shutter = [open, close];
        } else {
            let span = if p.has("shutterclose") { p.span_of("shutterclose") } else { p.span_of("shutteropen") };
            p.error(format!("the shutter opens at {open} and closes at {close}, so that no light comes in"), span);
        }
        camera.projection = match kind.as_str() {
            "perspective" => {
                let fov = p.float("fov", 90.0);
                if !(fov > 0.0 && fov < 180.0) {
                    let span = p.span_of("fov");
                    p.error(format!("`fov` must be between 0 and 180 degrees, not {fov}"), span);
                }
                Projection::Perspective { fov }
            }
            "orthographic" => Projection::Orthographic,
            "spherical" => {
                let mapping = p.choice(
                    "mapping",
                    &[
                        ("equalarea", SphericalMapping::EqualArea),
                        ("equirectangular", SphericalMapping::Equirectangular),
                    ],
                );
                Projection::Spherical { mapping }
            }
            "realistic" => {
                let diagonal = self.declarations.film.as_mut().map_or(35.0, |f| f.1.float("diagonal", 35.0)) * 1e-3;
                match self.lens_system(p, diagonal) {
                    Some(lens) => Projection::Realistic { lens, diagonal },
                    None => Projection::Orthographic,
                }
            }
            _ => {
                let span = p.span;
                p.accept_all();
                self.unknown_type("camera", &kind, span, &["perspective", "orthographic", "spherical", "realistic"]);
                Projection::Orthographic
            }
        };
        let p = &mut params;
        if kind != "realistic" {
            thin_lens(p, &mut camera);
        }
        let shutter = camera.shutter;
        self.scene.camera = camera;
        self.done(params);
        shutter
    }

    fn build_film(&mut self, exposure_time: f32) {
        let Some((kind, mut params, color_space)) = self.declarations.film.take() else { return };
        let p = &mut params;
        let mut film_kind = FilmKind::Rgb;
        match kind.as_str() {
            "rgb" => {}
            "gbuffer" => {
                let in_world = p.choice("coordinatesystem", &[("camera", false), ("world", true)]);
                film_kind = FilmKind::GBuffer { in_world };
            }
            "spectral" => {
                let count = p.int_in("nbuckets", 16, 1..=MOST_BANDS as i32) as u32;
                let range = [p.float("lambdamin", LAMBDA_MIN), p.float("lambdamax", LAMBDA_MAX)];
                if range[0] >= LAMBDA_MIN && range[0] < range[1] && range[1] <= LAMBDA_MAX {
                    film_kind = FilmKind::Spectral(Bands { count, range });
                } else {
                    let span = if p.has("lambdamin") { p.span_of("lambdamin") } else { p.span_of("lambdamax") };
                    let message = format!(
                        "the film's wavelengths must lie in {LAMBDA_MIN} to {LAMBDA_MAX} nm, and not be {} to {}",
                        range[0], range[1]
                    );
                    p.error(message, span);
                }
            }
            _ => {
                let span = p.span;
                self.unknown_type("film", &kind, span, &["rgb", "gbuffer", "spectral"]);
            }
        }
        let p = &mut params;
        let mut film = FilmSettings { color_space, kind: film_kind, ..FilmSettings::new(1, 1) };
        film.filename = p.string("filename").map_or("pbrt.exr".into(), |s| s.0);
        film.max_component_value = p.float("maxcomponentvalue", f32::INFINITY);
        film.half = p.boolean("savefp16", true);
        film.diagonal = p.float("diagonal", 35.0);
        film.sensor = sensor(p, color_space, exposure_time);
        let (x, y) = (p.int("xresolution", 1280), p.int("yresolution", 720));
        let bounds = p.take_ints("pixelbounds");
        let crop = p.floats("cropwindow");
        if x < 1 || y < 1 {
            let span = if x < 1 { p.span_of("xresolution") } else { p.span_of("yresolution") };
            p.error(format!("the film has no pixels: its resolution is {x} x {y}"), span);
        } else {
            film.resolution = [x as u32, y as u32];
            film.pixel_bounds = pixel_bounds(p, &film, bounds, crop);
            let [w, h] = film.size().map(u64::from);
            let need = w.saturating_mul(h).saturating_mul(FILM_BYTES_PER_PIXEL);
            if need > self.options.max_film_bytes {
                let span = if p.has("xresolution") { p.span_of("xresolution") } else { p.span_of("yresolution") };
                let message = format!(
                    "a film of {w} x {h} pixels would take {} of memory, and the limit is {}",
                    bytes(need),
                    bytes(self.options.max_film_bytes)
                );
                p.error(message, span);
            }
        }
        self.scene.settings.film = film;
        self.done(params);
    }

    fn build_filter(&mut self) {
        let Some((kind, mut params)) = self.declarations.filter.take() else { return };
        let p = &mut params;
        let (kind, radius) = match kind.as_str() {
            "box" => (FilterKind::Box, 0.5),
            "gaussian" => (FilterKind::Gaussian { sigma: p.float("sigma", 0.5) }, 1.5),
            "mitchell" => (FilterKind::Mitchell { b: p.float("B", 1.0 / 3.0), c: p.float("C", 1.0 / 3.0) }, 2.0),
            "sinc" => (FilterKind::Sinc { tau: p.float("tau", 3.0) }, 4.0),
            "triangle" => (FilterKind::Triangle, 2.0),
            _ => {
                let span = p.span;
                p.accept_all();
                self.unknown_type("pixel filter", &kind, span, &["box", "gaussian", "mitchell", "sinc", "triangle"]);
                (FilterKind::Box, 0.5)
            }
        };
        let p = &mut params;
        let radius = Vec2::new(p.float("xradius", radius), p.float("yradius", radius));
        match Filter::new(kind, radius) {
            Ok(filter) => self.scene.settings.filter = filter,
            Err(e) => params.error(format!("{}: {e}", params.what()), None),
        }
        self.done(params);
    }

    fn build_sampler(&mut self) {
        let mut settings = SamplerSettings {
            kind: SamplerKind::ZSobol,
            seed: self.declarations.seed,
            resolution: self.scene.settings.film.resolution,
            ..SamplerSettings::default()
        };
        let Some((kind, mut params)) = self.declarations.sampler.take() else {
            self.scene.settings.sampler = settings;
            return;
        };
        let p = &mut params;
        let mut spp = 16;
        let all = [
            ("fastowen", Randomization::FastOwen),
            ("none", Randomization::None),
            ("permutedigits", Randomization::PermuteDigits),
            ("owen", Randomization::Owen),
        ];
        match kind.as_str() {
            "zsobol" | "paddedsobol" | "sobol" => {
                settings.kind = match kind.as_str() {
                    "zsobol" => SamplerKind::ZSobol,
                    "sobol" => SamplerKind::Sobol,
                    _ => SamplerKind::PaddedSobol,
                };
                settings.randomization = p.choice("randomization", &all);
            }
            "halton" => {
                settings.kind = SamplerKind::Halton;
                settings.randomization = p.choice("randomization", &[all[2], all[1], all[3]]);
            }
            "independent" => {
                settings.kind = SamplerKind::Independent;
                spp = 4;
            }
            "stratified" => {
                settings.kind = SamplerKind::Stratified;
                let strata = [p.int_in("xsamples", 4, 1..=65535), p.int_in("ysamples", 4, 1..=65535)];
                settings.strata = strata.map(|n| n as u32);
                settings.jitter = p.boolean("jitter", true);
            }
            "pmj02bn" => settings.kind = SamplerKind::Pmj02bn,
            _ => {
                let span = p.span;
                p.accept_all();
                let known = ["zsobol", "paddedsobol", "sobol", "halton", "pmj02bn", "independent", "stratified"];
                self.unknown_type("sampler", &kind, span, &known);
            }
        }
        let p = &mut params;
        settings.spp = if settings.kind == SamplerKind::Stratified {
            settings.strata[0].saturating_mul(settings.strata[1])
        } else {
            p.int_in("pixelsamples", spp, 1..=i32::MAX) as u32
        };
        if let Some(seed) = p.maybe_int("seed") {
            settings.seed = i64::from(seed) as u64;
        }
        self.trap_of_samples(&params, &kind, settings.spp);
        self.scene.settings.sampler = settings;
        self.done(params);
    }

    fn build_integrator(&mut self) {
        let Some((kind, mut params)) = self.declarations.integrator.take() else { return };
        let p = &mut params;
        let mut settings = IntegratorSettings::default();
        match kind.as_str() {
            "path" | "volpath" => {
                settings.kind = if kind == "path" { IntegratorKind::Path } else { IntegratorKind::VolPath };
                settings.light_selection = light_selection(p);
                settings.regularize = p.boolean("regularize", false);
            }
            "ambientocclusion" => {
                let (cosine, max_distance) = (p.boolean("cossample", true), p.float("maxdistance", f32::INFINITY));
                settings.kind = IntegratorKind::AmbientOcclusion { cosine, max_distance };
            }
            "simplevolpath" => {
                settings.kind = IntegratorKind::SimpleVolPath;
                if self.scene.lights.iter().any(|l| !l.has_extent()) {
                    p.error("the `simplevolpath` integrator finds lights by chance, and so never a point, spot or distant light", None);
                }
            }
            // Both are the path tracer with techniques taken away. Where pbrt leaves Dirac lobes black when it draws
            // directions without regard for them, they are followed here.
            "simplepath" => {
                let by_lobe = p.boolean("samplebsdf", true);
                settings.light_selection = LightSelection::Power;
                settings.techniques = Techniques {
                    light_sampling: p.boolean("samplelights", true),
                    lobe_sampling: if by_lobe { LobeSampling::Lobe } else { LobeSampling::Uniform },
                    mis: MisHeuristic::None,
                    roulette: None,
                    ..Techniques::default()
                };
            }
            "randomwalk" => {
                settings.techniques = Techniques {
                    light_sampling: false,
                    lobe_sampling: LobeSampling::Uniform,
                    mis: MisHeuristic::None,
                    roulette: None,
                    ..Techniques::default()
                };
            }
            "lightpath" => {
                settings.kind = IntegratorKind::LightPath;
                settings.light_selection = LightSelection::Power;
            }
            "bdpt" => {
                settings.kind = IntegratorKind::Bdpt(Bidirectional::default());
                settings.light_selection = light_selection(p);
                settings.regularize = p.boolean("regularize", false);
                for name in ["visualizestrategies", "visualizeweights"] {
                    if p.boolean(name, false) {
                        let span = p.span_of(name);
                        p.warning(
                            format!("`{name}` writes no files here; --strategy S,T shows what one strategy finds"),
                            span,
                        );
                    }
                }
            }
            "sppm" => {
                let radius = p.float("radius", 1.0);
                let per_iteration = p.maybe_int("photonsperiteration").filter(|&n| n != -1);
                let seed = p.maybe_int("seed").map(|n| i64::from(n) as u64);
                if !(radius > 0.0 && radius.is_finite()) {
                    let span = p.span_of("radius");
                    p.error(format!("`radius` must be positive, not {radius}"), span);
                }
                let most = MOST_PHOTONS as i32;
                if per_iteration.is_some_and(|n| !(1..=most).contains(&n)) {
                    let span = p.span_of("photonsperiteration");
                    let range = format!("`photonsperiteration` must be from 1 to {most}, or -1 for one for each pixel");
                    p.error(range, span);
                }
                let per_iteration = per_iteration.map(|n| n.max(1) as u32);
                settings.kind = IntegratorKind::Sppm(PhotonMapping { radius: Some(radius), per_iteration, seed });
                settings.light_selection = LightSelection::Power;
            }
            "mlt" => {
                let metropolis = Metropolis {
                    bootstrap_samples: p.int_in("bootstrapsamples", 100_000, 1..=i32::MAX) as u32,
                    chains: p.int_in("chains", 1000, 1..=1 << 20) as u32,
                    large_step_probability: p.float("largestepprobability", 0.3),
                    sigma: p.float("sigma", 0.01),
                };
                settings.kind = IntegratorKind::Mlt(metropolis);
                settings.light_selection = LightSelection::Power;
                settings.regularize = p.boolean("regularize", false);
                // The sampler is not asked for anything but this.
                self.scene.settings.sampler.spp = p.int_in("mutationsperpixel", 100, 1..=i32::MAX) as u32;
            }
            "function" => {
                let function = p.choice("function", &TestFunction::ALL);
                let name = p.string("filename").map_or_else(|| format!("{}-mse.txt", function.name()), |s| s.0);
                settings.kind = IntegratorKind::Function(function);
                settings.report = Some(name);
                // Errors are told at the end of each pass, which comes at numbers that suit the samplers.
                p.boolean("skipbad", true);
                if let Some((_, span)) = p.string("imagefilename") {
                    p.warning("`imagefilename` does nothing here", span);
                }
                if self.scene.settings.sampler.kind == SamplerKind::Sobol {
                    p.error("the `sobol` sampler spreads one sequence over all pixels; the `function` integrator wants `paddedsobol`", None);
                }
            }
            _ => {
                let span = p.span;
                p.accept_all();
                let known = [
                    "path",
                    "volpath",
                    "simplepath",
                    "randomwalk",
                    "simplevolpath",
                    "lightpath",
                    "bdpt",
                    "mlt",
                    "sppm",
                    "ambientocclusion",
                    "function",
                ];
                self.unknown_type("integrator", &kind, span, &known);
            }
        }
        if kind != "ambientocclusion" && kind != "function" {
            settings.max_depth = params.int_in("maxdepth", 5, 0..=i32::MAX) as u32;
            if settings.max_depth == 0 {
                // Elsewhere depths are counted from the camera's ray on.
                let what = "`maxdepth` 0 shows what shines and nothing that it lights";
                let hint = "light that is scattered once has depth 1";
                params.diagnostics.push(Diagnostic::warning(what, params.span).with_hint(hint));
            }
            self.trap_of_depth(&params, settings.max_depth);
        }
        if !settings.techniques.light_sampling {
            self.leave_out_points(&mut params);
        }
        self.scene.settings.integrator = settings;
        self.done(params);
    }

    /// Takes away the lights that an integrator without light sampling never finds; pbrt keeps silent about them.
    fn leave_out_points(&mut self, p: &mut Params) {
        let kept: Vec<bool> = self.scene.lights.iter().map(steradian_scene::Light::has_extent).collect();
        let lost = kept.iter().filter(|&&k| !k).count();
        if lost == 0 {
            return;
        }
        let mut of_lights = kept.iter();
        self.scene.lights.retain(|_| of_lights.next() != Some(&false));
        let mut of_groups = kept.iter();
        self.scene.groups_of_lights.retain(|_| of_groups.next() != Some(&false));
        let message =
            format!("points, spots and distant lights are never found by chance: {lost} left out, as in pbrt");
        let hint = "another `Integrator` in the scene shows them";
        p.diagnostics.push(Diagnostic::warning(message, p.span).with_hint(hint));
    }

    /// `Option "name" value`.
    pub(super) fn option(&mut self, d: &Directive) {
        let name: String = d.text(0).chars().filter(|c| !matches!(c, '-' | '_')).flat_map(char::to_lowercase).collect();
        let (value, span) = (d.text(1), d.arg_span(1));
        let boolean = match value {
            "true" => Some(true),
            "false" => Some(false),
            _ => None,
        };
        let settings = &mut self.scene.settings;
        let flag = match name.as_str() {
            "disablepixeljitter" => Some(&mut settings.disable_pixel_jitter),
            "disablewavelengthjitter" => Some(&mut settings.disable_wavelength_jitter),
            "disabletexturefiltering" => Some(&mut settings.disable_texture_filtering),
            "forcediffuse" => Some(&mut settings.force_diffuse),
            _ => None,
        };
        if let Some(flag) = flag {
            match boolean {
                Some(value) => *flag = value,
                None => self.error(format!("option \"{}\" must be true or false, not `{value}`", d.text(0)), span),
            }
            return;
        }
        match name.as_str() {
            "seed" => match value.parse::<i64>() {
                Ok(seed) => self.declarations.seed = seed as u64,
                Err(_) => self.error(format!("option \"seed\" must be an integer, not `{value}`"), span),
            },
            // How pbrt goes about its work; the image is the same.
            "rendercoordsys" | "wavefront" => {}
            "displacementedgescale" => match value.parse::<f32>() {
                Ok(scale) if scale > 0.0 => self.declarations.displacement_edge_scale = Some(scale),
                _ => self.error(format!("option \"displacementedgescale\" must be positive, not `{value}`"), span),
            },
            "pixelstats" | "msereferenceimage" | "msereferenceout" => {
                self.warning(format!("option \"{}\" is not supported and does nothing", d.text(0)), d.arg_span(0));
            }
            _ => {
                let known = [
                    "disablepixeljitter",
                    "disabletexturefiltering",
                    "disablewavelengthjitter",
                    "displacementedgescale",
                    "forcediffuse",
                    "msereferenceimage",
                    "msereferenceout",
                    "pixelstats",
                    "rendercoordsys",
                    "seed",
                    "wavefront",
                ];
                let e = Diagnostic::error(format!("unknown option \"{}\"", d.text(0)), d.arg_span(0));
                self.diagnostics.push(e.with_suggestion(did_you_mean(&name, known)));
            }
        }
    }
}

/// How one light is picked among many.
fn light_selection(p: &mut Params) -> LightSelection {
    p.choice(
        "lightsampler",
        &[
            ("bvh", LightSelection::Tree),
            ("uniform", LightSelection::Uniform),
            ("power", LightSelection::Power),
            ("exhaustive", LightSelection::Exhaustive),
        ],
    )
}

/// Lens and window of the cameras that have no lens system.
fn thin_lens(p: &mut Params, camera: &mut Camera) {
    camera.lens_radius = p.float("lensradius", 0.0);
    camera.focal_distance = p.float("focaldistance", 1e6);
    if camera.lens_radius < 0.0 {
        let span = p.span_of("lensradius");
        p.error("`lensradius` cannot be negative", span);
    }
    if camera.focal_distance <= 0.0 {
        let span = p.span_of("focaldistance");
        p.error("`focaldistance` must be positive", span);
    }
    camera.frame_aspect_ratio = p.maybe_float("frameaspectratio");
    if camera.frame_aspect_ratio.is_some_and(|a| a <= 0.0) {
        let span = p.span_of("frameaspectratio");
        p.error("`frameaspectratio` must be positive", span);
    }
    if let Some((window, span)) = p.floats("screenwindow") {
        match *window {
            [x0, x1, y0, y1] if x0 != x1 && y0 != y1 => camera.screen_window = Some([x0, x1, y0, y1]),
            _ => p.error("`screenwindow` takes four numbers, x0 x1 y0 y1, that span an area", span),
        }
    }
}

fn sensor(p: &mut Params, color_space: ColorSpace, exposure_time: f32) -> PixelSensor {
    let imaging_ratio = exposure_time * p.float("iso", 100.0) / 100.0;
    let white_balance = Some(p.float("whitebalance", 0.0)).filter(|&kelvin| kelvin != 0.0);
    let (name, span) = p.string("sensor").unwrap_or(("cie1931".into(), p.span));
    match PixelSensor::from_name(&name, color_space, white_balance, imaging_ratio) {
        Ok(sensor) => sensor,
        Err(e) => {
            let d = Diagnostic::error(e.to_string(), span);
            p.diagnostics.push(d.with_suggestion(did_you_mean(&name, PixelSensor::names())));
            PixelSensor::default()
        }
    }
}

/// The pixels to render: the crop window if there is one, else the pixel bounds, else all.
fn pixel_bounds(
    p: &mut Params,
    film: &FilmSettings,
    bounds: Option<(Vec<i32>, Span)>,
    crop: Option<(Vec<f32>, Span)>,
) -> [u32; 4] {
    let [w, h] = film.resolution;
    let all = [0, w, 0, h];
    let (chosen, span) = match (bounds, crop) {
        (bounds, Some((c, span))) => {
            if let Some((_, span)) = bounds {
                p.warning("`pixelbounds` is ignored, since there is a `cropwindow`", span);
            }
            let [x0, x1, y0, y1] = *c else {
                p.error(format!("`cropwindow` takes four numbers, but {} are given", c.len()), span);
                return all;
            };
            (film.crop_window([x0.min(x1), x0.max(x1), y0.min(y1), y0.max(y1)]), span)
        }
        (Some((b, span)), None) => {
            let [x0, x1, y0, y1] = *b else {
                p.error(format!("`pixelbounds` takes four integers, but {} are given", b.len()), span);
                return all;
            };
            let clip = |v: i32, n: u32| v.clamp(0, n.min(i32::MAX as u32) as i32) as u32;
            ([clip(x0.min(x1), w), clip(x0.max(x1), w), clip(y0.min(y1), h), clip(y0.max(y1), h)], span)
        }
        (None, None) => return all,
    };
    if chosen[0] >= chosen[1] || chosen[2] >= chosen[3] {
        p.error("no pixels are left inside the bounds", span);
        return all;
    }
    chosen
}

/// A number of bytes for people.
fn bytes(n: u64) -> String {
    let mut value = n as f64;
    let mut unit = "bytes";
    for next in ["KiB", "MiB", "GiB", "TiB", "PiB", "EiB"] {
        if value < 1024.0 {
            break;
        }
        value /= 1024.0;
        unit = next;
    }
    if unit == "bytes" { format!("{n} bytes") } else { format!("{value:.1} {unit}") }
}
