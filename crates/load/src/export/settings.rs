//! Options, camera, film, filter, sampler and integrator.

use super::Writer;
use super::text::{integers, list, number, quoted, transform};
use std::fmt::Write;
use steradian_image::FilterKind;
use steradian_sampling::SamplerKind;
use steradian_scene::{FilmKind, IntegratorKind, LightSelection, Projection, SphericalMapping};
use steradian_spectrum::{ColorMode, ColorSpace, PixelSensor};

impl Writer<'_> {
    pub(super) fn settings(&mut self) {
        let s = &self.scene.settings;
        if s.color == ColorMode::Rgb {
            self.head("# This scene was made for light in red, green and blue: steradian render --color rgb");
        }
        let options = [
            ("disabletexturefiltering", s.disable_texture_filtering),
            ("disablepixeljitter", s.disable_pixel_jitter),
            ("disablewavelengthjitter", s.disable_wavelength_jitter),
            ("forcediffuse", s.force_diffuse),
        ];
        for (name, _) in options.into_iter().filter(|o| o.1) {
            self.head(&format!("Option \"{name}\" true"));
        }
        if s.sampler.seed != 0 {
            self.head(&format!("Option \"seed\" {}", s.sampler.seed as i32));
        }
        self.camera();
        self.film();
        let filter = &s.filter;
        let radius = filter.radius();
        let (name, more) = match filter.kind() {
            FilterKind::Box => ("box", String::new()),
            FilterKind::Triangle => ("triangle", String::new()),
            FilterKind::Gaussian { sigma } => ("gaussian", format!(" \"float sigma\" {}", number(sigma))),
            FilterKind::Mitchell { b, c } => {
                ("mitchell", format!(" \"float B\" {} \"float C\" {}", number(b), number(c)))
            }
            FilterKind::Sinc { tau } => ("sinc", format!(" \"float tau\" {}", number(tau))),
        };
        let (rx, ry) = (number(radius.x), number(radius.y));
        self.head(&format!("PixelFilter \"{name}\" \"float xradius\" {rx} \"float yradius\" {ry}{more}"));
        self.sampler();
        self.integrator();
    }

    fn camera(&mut self) {
        let camera = &self.scene.camera;
        if let Some(m) = camera.medium {
            self.head(&format!("MediumInterface \"\" \"medium{}\"", m.index()));
        }
        let moving = camera.world_from_camera;
        let [open, close] = camera.shutter;
        if moving.is_animated() {
            self.head(&format!("TransformTimes {} {}", number(moving.start_time), number(moving.end_time)));
            self.head(&format!("ActiveTransform StartTime {}", transform(&moving.start.inverse())));
            self.head(&format!("ActiveTransform EndTime {}", transform(&moving.end.inverse())));
            self.head("ActiveTransform All");
        } else {
            self.head(&transform(&moving.start.inverse()));
        }
        let mut text = match &camera.projection {
            Projection::Perspective { fov } => format!("Camera \"perspective\" \"float fov\" {}", number(*fov)),
            Projection::Orthographic => "Camera \"orthographic\"".into(),
            Projection::Spherical { mapping } => {
                let name = if *mapping == SphericalMapping::EqualArea { "equalarea" } else { "equirectangular" };
                format!("Camera \"spherical\" \"string mapping\" \"{name}\"")
            }
            Projection::Realistic { .. } => {
                self.note("a camera with real lenses is written as a perspective of 50 degrees");
                "Camera \"perspective\" \"float fov\" 50".into()
            }
        };
        if close > open {
            let _ = write!(text, "\n  \"float shutteropen\" {} \"float shutterclose\" {}", number(open), number(close));
        }
        if camera.lens_radius > 0.0 {
            let (r, d) = (number(camera.lens_radius), number(camera.focal_distance));
            let _ = write!(text, "\n  \"float lensradius\" {r} \"float focaldistance\" {d}");
        }
        if let Some(window) = camera.screen_window {
            let _ = write!(text, "\n  \"float screenwindow\" {}", list(&window));
        }
        if let Some(aspect) = camera.frame_aspect_ratio {
            let _ = write!(text, "\n  \"float frameaspectratio\" {}", number(aspect));
        }
        self.head(&text);
        if camera.medium.is_some() {
            self.head("MediumInterface \"\" \"\"");
        }
    }

    fn film(&mut self) {
        let (film, [open, close]) = (&self.scene.settings.film, self.scene.camera.shutter);
        let space = film.color_space;
        if space != ColorSpace::Srgb {
            self.head(&format!("ColorSpace \"{}\"", space.name()));
        }
        let kind = match film.kind {
            FilmKind::Rgb => "\"rgb\"".to_string(),
            FilmKind::GBuffer { in_world } => {
                let place = if in_world { "world" } else { "camera" };
                format!("\"gbuffer\" \"string coordinatesystem\" \"{place}\"")
            }
            FilmKind::Spectral(bands) => {
                let [low, high] = bands.range.map(number);
                let n = bands.count;
                format!("\"spectral\" \"integer nbuckets\" {n} \"float lambdamin\" {low} \"float lambdamax\" {high}")
            }
        };
        let [x, y] = film.resolution;
        let mut text = format!(
            "Film {kind} \"integer xresolution\" {x} \"integer yresolution\" {y} \"integer pixelbounds\" {}\n  \"string filename\" \"{}\"",
            integers(film.pixel_bounds),
            quoted(&film.filename)
        );
        let ratio = film.sensor.imaging_ratio();
        let exposure = if close > open { close - open } else { 1.0 };
        let _ = write!(text, " \"float iso\" {}", number(100.0 * ratio / exposure));
        let named = PixelSensor::names()
            .find(|name| PixelSensor::from_name(name, space, None, ratio).is_ok_and(|known| known == film.sensor));
        match named {
            Some("cie1931") => {}
            Some(name) => {
                let _ = write!(text, " \"string sensor\" \"{name}\"");
            }
            None => self.note("the film's white balance is left out"),
        }
        if film.max_component_value.is_finite() {
            let _ = write!(text, " \"float maxcomponentvalue\" {}", number(film.max_component_value));
        }
        if !film.half {
            text += " \"bool savefp16\" false";
        }
        self.head(&text);
        if space != ColorSpace::Srgb {
            self.head("ColorSpace \"srgb\"");
        }
    }

    fn sampler(&mut self) {
        let s = &self.scene.settings.sampler;
        let name = s.kind.name();
        let count = if s.kind == SamplerKind::Stratified {
            let [x, y] = s.strata;
            format!("\"integer xsamples\" {x} \"integer ysamples\" {y}")
        } else {
            format!("\"integer pixelsamples\" {}", s.spp)
        };
        self.head(&format!("Sampler \"{name}\" {count}"));
    }

    fn integrator(&mut self) {
        let i = &self.scene.settings.integrator;
        let lights = match i.light_selection {
            LightSelection::Uniform => "uniform",
            LightSelection::Power => "power",
            LightSelection::Tree => "bvh",
            LightSelection::Exhaustive => "exhaustive",
        };
        let sampler = format!(" \"string lightsampler\" \"{lights}\"");
        let regularize = if i.regularize { " \"bool regularize\" true" } else { "" };
        let depth = format!(" \"integer maxdepth\" {}", i.max_depth.min(i32::MAX as u32));
        let text = match i.kind {
            IntegratorKind::Path => format!("\"path\"{depth}{sampler}{regularize}"),
            IntegratorKind::VolPath => format!("\"volpath\"{depth}{sampler}{regularize}"),
            IntegratorKind::SimpleVolPath => format!("\"simplevolpath\"{depth}"),
            IntegratorKind::LightPath => format!("\"lightpath\"{depth}"),
            IntegratorKind::Bdpt(_) => format!("\"bdpt\"{depth}{sampler}{regularize}"),
            IntegratorKind::AmbientOcclusion { cosine, max_distance } => format!(
                "\"ambientocclusion\" \"bool cossample\" {cosine} \"float maxdistance\" {}",
                number(max_distance)
            ),
            IntegratorKind::Sppm(photons) => {
                let n = photons.per_iteration.map_or(-1, |n| n as i32);
                let radius = photons.radius.map(|r| format!(" \"float radius\" {}", number(r))).unwrap_or_default();
                format!("\"sppm\"{depth} \"integer photonsperiteration\" {n}{radius}")
            }
            IntegratorKind::Mlt(m) => format!(
                "\"mlt\"{depth}{regularize} \"integer bootstrapsamples\" {} \"integer chains\" {} \"integer mutationsperpixel\" {} \"float largestepprobability\" {} \"float sigma\" {}",
                m.bootstrap_samples,
                m.chains,
                self.scene.settings.sampler.spp,
                number(m.large_step_probability),
                number(m.sigma)
            ),
            _ => {
                self.note("the integrator is one that pbrt has not; `path` stands for it");
                format!("\"path\"{depth}{sampler}")
            }
        };
        self.head(&format!("Integrator {text}"));
    }
}
