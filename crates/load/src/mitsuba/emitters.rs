//! Emitters of Mitsuba that are not surfaces.

use super::Mitsuba;
use super::tree::{Object, origin};
use steradian_image::{Lookup, Wrap};
use steradian_math::{Transform, Vec3, cos};
use steradian_scene::{EnvironmentMapping, Light, SpectrumInput};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};

impl Mitsuba<'_> {
    /// What an emitter sends: a spectrum, a factor, and a texture if there is one.
    pub(super) fn emission(&mut self, e: &Object, name: &str) -> (Spectrum, f32, Option<SpectrumInput>) {
        let scale = 1.0 / ColorSpace::Srgb.photometric();
        let white = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
        if self.named(e, name).is_some() {
            return (white, scale, self.maybe_spectrum(e, name, SpectrumUse::Illuminant));
        }
        let given = e.get(name).cloned();
        let s = given.and_then(|p| self.spectrum_of(&p.value, SpectrumUse::Illuminant, p.span));
        (s.unwrap_or(white), scale, None)
    }

    fn plain_emission(&mut self, e: &Object, name: &str) -> (Spectrum, f32) {
        let (s, scale, texture) = self.emission(e, name);
        if texture.is_some() {
            self.error(format!("a texture as `{name}` of the emitter `{}` is not built", e.kind), e.span);
        }
        (s, scale)
    }

    pub(super) fn emitter(&mut self, e: &Object) {
        let world = self.transform(e, "to_world");
        e.get("sampling_weight");
        let light = match e.kind.as_str() {
            "point" => {
                let (intensity, scale) = self.plain_emission(e, "intensity");
                let at = self.vector(e, "position").map(Transform::translate).unwrap_or(world);
                Some(Light::Point { position: origin(&at), intensity, scale })
            }
            "constant" => {
                let (radiance, scale) = self.plain_emission(e, "radiance");
                Some(Light::UniformInfinite { radiance, scale })
            }
            "directional" => {
                let (radiance, scale) = self.plain_emission(e, "irradiance");
                let d = self.vector(e, "direction").unwrap_or_else(|| world.vector(Vec3::new(0.0, 0.0, 1.0)));
                match (-d).try_normalize() {
                    Some(to_light) => Some(Light::Distant { to_light, radiance, scale }),
                    None => {
                        self.error("a directional emitter needs a direction", e.span);
                        None
                    }
                }
            }
            "spot" => self.spot(e, &world),
            "envmap" => self.envmap(e, &world),
            _ => {
                self.not_built(e);
                return;
            }
        };
        self.finish(e);
        self.scene.lights.extend(light);
    }

    fn spot(&mut self, e: &Object, world: &Transform) -> Option<Light> {
        let (intensity, scale) = self.plain_emission(e, "intensity");
        if self.named(e, "texture").is_some() {
            self.error("a texture of the emitter `spot` is not built", e.span);
        }
        let cutoff = self.float(e, "cutoff_angle", 20.0);
        let beam = self.float(e, "beam_width", cutoff * 0.75);
        if !(beam > 0.0 && beam <= cutoff && cutoff <= 180.0) {
            self.error(format!("a cone from {beam} to {cutoff} degrees is none"), e.span);
            return None;
        }
        self.note_once(
            "spots fall off smoothly between `beam_width` and `cutoff_angle`, not in proportion to the angle",
            e.span,
        );
        let (cos_end, cos_start) = (cos(cutoff.to_radians()), cos(beam.to_radians()));
        Some(Light::Spot { world_from_light: *world, intensity, scale, cos_end, cos_start })
    }

    fn envmap(&mut self, e: &Object, world: &Transform) -> Option<Light> {
        let name = self.text(e, "filename");
        let Some(name) = name else {
            self.error("an environment map needs a `filename`", e.span);
            return None;
        };
        let texels = self.picture(&name, true, e.span)?;
        if let Some(what) = texels.not_finite() {
            self.error(format!("{name}: an environment cannot have {what}"), e.span);
            return None;
        }
        let scale = self.float(e, "scale", 1.0) / ColorSpace::Srgb.photometric();
        let image = self.push_image(&name, texels, Lookup::Bilinear, Wrap::Repeat);
        // y is up, the middle of the picture is at +z, and columns begin at -z towards +x.
        let turned = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let world_from_light = world.mul(&Transform::from_matrix(turned)?);
        Some(Light::ImageInfinite { world_from_light, image, mapping: EnvironmentMapping::LatLong, scale })
    }
}
