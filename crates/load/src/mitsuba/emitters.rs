//! Emitters of Mitsuba that are not surfaces.

use super::Mitsuba;
use super::tree::{Object, Value, origin};
use steradian_image::{Encoding, Lookup, Storage, Texels, Wrap};
use steradian_math::{PI, Transform, Vec3};
use steradian_scene::{EnvironmentMapping, Light, SpectrumInput, Texture};
use steradian_spectrum::{CIE_Y, ColorSpace, Spectrum, SpectrumUse};

impl Mitsuba<'_> {
    /// What an emitter sends: a spectrum, a factor, and a texture if there is one.
    pub(super) fn emission(&mut self, e: &Object, name: &str) -> (Spectrum, f32, Option<SpectrumInput>) {
        let white = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
        // Colours are as bright as they are under white light, spectra as the eye sees them.
        let (of_color, of_spectrum) = (1.0 / ColorSpace::Srgb.photometric(), 1.0 / CIE_Y);
        if let Some(child) = self.named(e, name) {
            let t = self.object(child);
            let scale = if matches!(t.kind.as_str(), "uniform" | "rawconstant" | "regular" | "irregular" | "blackbody")
            {
                of_spectrum
            } else {
                of_color
            };
            // In spectral mode Mitsuba takes pictures for spectra of light, without the white of a lamp.
            let is_picture = t.kind == "bitmap";
            let usage = if is_picture { SpectrumUse::Unbounded } else { SpectrumUse::Illuminant };
            let texture = self.texture(&t, usage);
            return match texture.map(|t| self.scene.spectrum_textures[t].kind.clone()) {
                Some(Texture::Constant(s)) => (s, scale, None),
                _ => (white, scale, texture),
            };
        }
        let Some(p) = e.get(name).cloned() else { return (white, of_color, None) };
        let scale = match &p.value {
            Value::Spectrum(_) | Value::SpectrumFile(_) => of_spectrum,
            _ => of_color,
        };
        (self.spectrum_of(&p.value, SpectrumUse::Illuminant, p.span).unwrap_or(white), scale, None)
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
            "projector" => self.projector(e, &world),
            "envmap" => self.envmap(e, &world),
            "sunsky" | "sky" | "sun" => {
                let lights = self.sun_and_sky(e, &world);
                self.finish(e);
                self.scene.lights.extend(lights);
                return;
            }
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
        let slide = self.named(e, "texture").and_then(|i| {
            let t = self.object(i);
            let image = self.bitmap(&t, true).map(|m| m.image);
            self.finish(&t);
            image
        });
        let cutoff = self.float(e, "cutoff_angle", 20.0);
        let beam = self.float(e, "beam_width", cutoff * 0.75);
        if !(beam >= 0.0 && beam <= cutoff && cutoff <= 180.0) {
            self.error(format!("a cone from {beam} to {cutoff} degrees is none"), e.span);
            return None;
        }
        let (start, end) = (beam.to_radians(), cutoff.to_radians());
        Some(Light::Cone { world_from_light: *world, intensity, scale, start, end, slide })
    }

    fn projector(&mut self, e: &Object, world: &Transform) -> Option<Light> {
        let factor = PI * self.float(e, "scale", 1.0) / ColorSpace::Srgb.photometric();
        // A texture is behind the light, what is stated is the light.
        let (image, usage) = match self.named(e, "irradiance") {
            Some(i) => {
                let t = self.object(i);
                let image = self.bitmap(&t, true)?.image;
                self.finish(&t);
                (image, SpectrumUse::Unbounded)
            }
            None => {
                let (s, scale, _) = self.emission(e, "irradiance");
                let rgb = Storage::F32(s.rgb().map(|v| v * scale).to_vec());
                let texels = Texels::new(1, 1, 3, rgb, Encoding::Linear).ok()?;
                (self.push_image("irradiance", texels, Lookup::Bilinear, Wrap::Clamp), SpectrumUse::Illuminant)
            }
        };
        let texels = &self.scene.images[image].texels;
        let fov = self.field_of_view(e, [texels.width() as u32, texels.height() as u32]);
        // x runs to the left of the picture, as with sensors.
        let world_from_light = world.mul(&Transform::scale(-1.0, 1.0, 1.0)?);
        Some(Light::Projection { world_from_light, image, screen: Some(usage), fov, scale: factor })
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
        // y is up, the first row and the last are the poles, the middle of the picture is at +z, and columns begin at -z towards +x.
        let turned = [[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let world_from_light = world.mul(&Transform::from_matrix(turned)?);
        Some(Light::ImageInfinite { world_from_light, image, mapping: EnvironmentMapping::LatLongToPoles, scale })
    }
}
