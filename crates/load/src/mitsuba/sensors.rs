//! Sensors, films, filters and samplers of Mitsuba.

use super::Mitsuba;
use super::tree::Object;
use steradian_image::{Filter, FilterKind};
use steradian_math::{Transform, Vec2, atan, tan};
use steradian_scene::{Camera, FilmSettings, Projection};

impl Mitsuba<'_> {
    pub(super) fn sensor(&mut self, o: &Object) {
        self.has_sensor = true;
        let film = self.child(o, "film").map(|i| self.object(i));
        let mut size = [768, 576];
        if let Some(film) = &film {
            size = [self.count(film, "width", 768).max(1), self.count(film, "height", 576).max(1)];
        }
        let mut camera = Camera::default();
        let world = self.transform(o, "to_world");
        // x of a sensor runs to the left of its picture.
        let mirrored = Transform::scale(-1.0, 1.0, 1.0).unwrap_or(Transform::IDENTITY);
        camera.world_from_camera = world.mul(&mirrored).into();
        for name in ["near_clip", "far_clip", "shutter_open", "shutter_close"] {
            o.get(name);
        }
        match o.kind.as_str() {
            "perspective" | "thinlens" => {
                let fov = self.field_of_view(o, size);
                camera.projection = Projection::Perspective { fov };
                let shift = ["principal_point_offset_x", "principal_point_offset_y"].map(|n| self.float(o, n, 0.0));
                if shift != [0.0; 2] {
                    let [w, h] = size.map(|n| n as f32);
                    let (x, y) = (w / w.min(h), h / w.min(h));
                    let (dx, dy) = (2.0 * x * shift[0], 2.0 * y * shift[1]);
                    camera.screen_window = Some([-x + dx, x + dx, -y - dy, y - dy]);
                }
                if o.kind == "thinlens" {
                    camera.lens_radius = self.float(o, "aperture_radius", 0.0);
                    camera.focal_distance = self.float(o, "focus_distance", 1e4);
                }
            }
            "orthographic" => {
                camera.projection = Projection::Orthographic;
                // The sensor's square reaches from -1 to 1 along x.
                let h = size[1] as f32 / size[0] as f32;
                camera.screen_window = Some([-1.0, 1.0, -h, h]);
            }
            _ => self.not_built(o),
        }
        if let Some(sampler) = self.child(o, "sampler").map(|i| self.object(i)) {
            // Which points a sampler makes changes the noise, not the picture.
            self.scene.settings.sampler.spp = self.count(&sampler, "sample_count", 4).max(1);
            sampler.get("seed");
            self.finish(&sampler);
        }
        self.film(film.as_ref(), size);
        if let Some(medium) = self.child(o, "medium") {
            camera.medium = self.medium(medium);
        }
        self.finish(o);
        self.scene.camera = camera;
    }

    /// The full angle along the shorter side, in degrees.
    pub(super) fn field_of_view(&mut self, o: &Object, [w, h]: [u32; 2]) -> f32 {
        let (w, h) = (w as f32, h as f32);
        let diagonal = (w * w + h * h).sqrt();
        let (half, along) = if o.params.contains_key("fov") {
            let fov = self.float(o, "fov", 45.0);
            if !(fov > 0.0 && fov < 180.0) {
                self.error("`fov` must be between 0 and 180 degrees", o.span);
                return 45.0;
            }
            let along = match self.text(o, "fov_axis").as_deref() {
                None | Some("x") => w,
                Some("y") => h,
                Some("diagonal") => diagonal,
                Some("smaller") => w.min(h),
                Some("larger") => w.max(h),
                Some(other) => {
                    self.error(format!("`fov_axis` cannot be `{other}`"), o.span);
                    w
                }
            };
            (tan(0.5 * fov.to_radians()), along)
        } else {
            // Of a film of 36 by 24 millimetres.
            let length = self.text(o, "focal_length").unwrap_or("50mm".into());
            let length: f32 = length.trim_end_matches("mm").trim().parse().unwrap_or(50.0);
            (0.5 * (36.0f32 * 36.0 + 24.0 * 24.0).sqrt() / length.max(1e-3), diagonal)
        };
        2.0 * atan(half * w.min(h) / along).to_degrees()
    }

    fn film(&mut self, film: Option<&Object>, [w, h]: [u32; 2]) {
        let filename = std::mem::take(&mut self.scene.settings.film.filename);
        let mut settings = FilmSettings { filename, ..FilmSettings::new(w, h) };
        let mut filter = gaussian(0.5);
        if let Some(o) = film {
            if o.kind != "hdrfilm" && o.kind != "ldrfilm" {
                self.not_built(o);
            }
            let x = self.count(o, "crop_offset_x", 0).min(w - 1);
            let y = self.count(o, "crop_offset_y", 0).min(h - 1);
            let cw = self.count(o, "crop_width", w - x).clamp(1, w - x);
            let ch = self.count(o, "crop_height", h - y).clamp(1, h - y);
            settings.pixel_bounds = [x, x + cw, y, y + ch];
            // How the file is written is for the command line to say.
            for name in ["file_format", "pixel_format", "component_format", "compensate", "sample_border", "banner"] {
                o.get(name);
            }
            if let Some(f) = self.child(o, "rfilter").map(|i| self.object(i)) {
                filter = self.filter(&f);
                self.finish(&f);
            }
            self.finish(o);
        }
        self.scene.settings.film = settings;
        self.scene.settings.sampler.resolution = [w, h];
        if let Some(filter) = filter {
            self.scene.settings.filter = filter;
        }
    }

    fn filter(&mut self, f: &Object) -> Option<Filter> {
        let of = |kind, radius: f32| Filter::new(kind, Vec2::new(radius, radius)).ok();
        match f.kind.as_str() {
            "box" => of(FilterKind::Box, 0.5),
            "tent" => of(FilterKind::Triangle, self.float(f, "radius", 1.0)),
            "gaussian" => gaussian(self.float(f, "stddev", 0.5)),
            "mitchell" => {
                let (b, c) = (self.float(f, "B", 1.0 / 3.0), self.float(f, "C", 1.0 / 3.0));
                of(FilterKind::Mitchell { b, c }, 2.0)
            }
            "catmullrom" => of(FilterKind::Mitchell { b: 0.0, c: 0.5 }, 2.0),
            "lanczos" => {
                let lobes = self.count(f, "lobes", 3).max(1) as f32;
                of(FilterKind::Sinc { tau: lobes }, lobes)
            }
            _ => {
                self.not_built(f);
                None
            }
        }
    }
}

/// Cut off at four standard deviations.
fn gaussian(sigma: f32) -> Option<Filter> {
    Filter::new(FilterKind::Gaussian { sigma }, Vec2::new(4.0 * sigma, 4.0 * sigma)).ok()
}
