//! Mitsuba's sky and sun: `sunsky`, and `sky` and `sun` alone as its older dialects have them.

use super::Mitsuba;
use super::tree::{Object, Value};
use crate::sky::{Moment, SUN_HALF_ANGLE, Sky};
use steradian_image::{Lookup, Wrap};
use steradian_math::{Transform, Vec3};
use steradian_scene::{EnvironmentMapping, Light, Texture};
use steradian_spectrum::{CIE_Y, ColorSpace, LAMBDA_MIN, Spectrum, SpectrumUse};

/// Texels of the map that a sky is drawn on.
const MAP: [usize; 2] = [1024, 512];
const OF_TIME: [&str; 9] = ["latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"];

impl Mitsuba<'_> {
    pub(super) fn sun_and_sky(&mut self, e: &Object, world: &Transform) -> Vec<Light> {
        let whole = self.float(e, "scale", 1.0);
        let has = |alone: &str| e.kind == "sunsky" || e.kind == alone;
        let sky_scale = if has("sky") { self.float(e, "sky_scale", whole) } else { 0.0 };
        let sun_scale = if has("sun") { self.float(e, "sun_scale", whole) } else { 0.0 };
        let turbidity = self.float(e, "turbidity", 3.0);
        let aperture = self.float(e, "sun_aperture", SUN_HALF_ANGLE.to_degrees() * 2.0);
        let aperture = aperture * self.float(e, "sun_radius_scale", 1.0);
        let darkened = self.flag(e, "complex_sun", false);
        let albedo = self.ground(e);
        for (name, valid, must) in [
            ("turbidity", (1.0..=10.0).contains(&turbidity), "from 1 to 10"),
            ("sun_aperture", aperture > 0.0 && aperture < 180.0, "above 0 and below 180 degrees"),
            ("sky_scale", sky_scale >= 0.0 && sky_scale.is_finite(), "positive"),
            ("sun_scale", sun_scale >= 0.0 && sun_scale.is_finite(), "positive"),
        ] {
            if !valid {
                let span = e.get(name).map_or(e.span, |p| p.span);
                self.error(format!("`{name}` of the emitter `{}` must be {must}", e.kind), span);
                return Vec::new();
            }
        }
        let Some((world_from_sky, sun)) = self.sun_direction(e, world) else { return Vec::new() };
        let Some(sky) = Sky::new(sun, turbidity, |l| albedo.eval_at(l.max(LAMBDA_MIN))) else {
            let below = "the sun is below the horizon, where the model has no sky: this emitter is dark";
            self.reader.diagnostics.push(steradian_syntax::Diagnostic::warning(below, e.span));
            return Vec::new();
        };
        let mut lights = Vec::new();
        if sky_scale > 0.0 {
            let image = self.push_image("sky", sky.map(MAP[0], MAP[1], 1.0), Lookup::Bilinear, Wrap::Repeat);
            let (mapping, scale) = (EnvironmentMapping::LatLong, sky_scale / ColorSpace::Srgb.photometric());
            lights.push(Light::ImageInfinite { world_from_light: world_from_sky, image, mapping, scale });
        }
        if sun_scale > 0.0
            && let Some(to_light) = world_from_sky.vector(sun).try_normalize()
        {
            let half_angle = (0.5 * aperture).to_radians();
            let profile = sky.sun_profile(half_angle, darkened);
            lights.push(Light::Sun { to_light, half_angle, profile, scale: sun_scale / CIE_Y });
        }
        lights
    }

    /// What the ground reflects.
    fn ground(&mut self, e: &Object) -> Spectrum {
        let absent = Spectrum::constant(if self.reader.is_old() { 0.15 } else { 0.3 }, SpectrumUse::Albedo);
        if let Some(child) = self.named(e, "albedo") {
            let t = self.object(child);
            let texture = self.texture(&t, SpectrumUse::Albedo);
            return match texture.map(|t| self.scene.spectrum_textures[t].kind.clone()) {
                Some(Texture::Constant(s)) => s,
                _ => {
                    self.error(format!("`albedo` of the emitter `{}` cannot vary", e.kind), t.span);
                    absent
                }
            };
        }
        let Some(p) = e.get("albedo").cloned() else { return absent };
        self.spectrum_of(&p.value, SpectrumUse::Albedo, p.span).unwrap_or(absent)
    }

    /// The frame of the sky, z up, and the unit direction to the sun in it.
    fn sun_direction(&mut self, e: &Object, world: &Transform) -> Option<(Transform, Vec3)> {
        // Before version 2, y was up, x east and z south; now z is up, x south and y west.
        let old = [[0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let world_from_sky = if self.reader.is_old() { world.mul(&Transform::from_matrix(old)?) } else { *world };
        if let Some(d) = self.vector(e, "sun_direction") {
            if let Some((name, p)) = OF_TIME.iter().find_map(|n| Some((*n, e.get(n)?.span))) {
                self.error(format!("`{name}` beside `sun_direction`: the sun's place is stated twice"), p);
                return None;
            }
            let sun = world_from_sky.inverse_vector(d).try_normalize();
            if sun.is_none() {
                self.error("`sun_direction` must have a direction", e.span);
            }
            return Some((world_from_sky, sun?));
        }
        let mut whole = |name: &str, absent: i64| match e.get(name).map(|p| (p.value.clone(), p.span)) {
            None => absent,
            // Centuries on, the formula is of no use, and neither are the integers that it is made with.
            Some((Value::Integer(n), _)) if (-4000..=9000).contains(&n) => n,
            Some((_, span)) => {
                self.error(format!("`{name}` must be a whole number, of a date"), span);
                absent
            }
        };
        let date = [whole("year", 2010), whole("month", 7), whole("day", 10)];
        let mut number = |name: &str, absent: f32| f64::from(self.float(e, name, absent));
        let time = [number("hour", 15.0), number("minute", 0.0), number("second", 0.0)];
        let (timezone, latitude) = (number("timezone", 9.0), number("latitude", 35.6894));
        let moment = Moment { date, time, timezone, latitude, longitude: number("longitude", 139.6917) };
        let sun = moment.sun();
        if !sun.is_finite() {
            self.error("no sun stands anywhere at such a time and place", e.span);
            return None;
        }
        Some((world_from_sky, sun))
    }
}
