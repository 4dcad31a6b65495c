//! Light sources and emission of surfaces, scaled so that a light of scale 1 has luminance (or luminous intensity) 1 whatever its spectrum.

use super::Loader;
use super::images::texel_rgb;
use super::params::{Params, SPECTRUM};
use std::rc::Rc;
use steradian_image::{Texels, Wrap};
use steradian_math::{Frame, PI, Point3, Transform, Vec3, cos};
use steradian_sampling::warp::{square_to_lat_long, square_to_octahedral};
use steradian_scene::{AreaLight, EnvironmentMapping, Handle, Light, TextureImage};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};
use steradian_syntax::Directive;

const TYPES: [&str; 6] = ["point", "spot", "distant", "infinite", "goniometric", "projection"];

impl Loader<'_> {
    /// `AreaLightSource "diffuse"`: the emission of the shapes that follow.
    pub(super) fn area_light_source(&mut self, mut d: Directive) {
        let (kind, span) = (d.text(0).to_string(), d.arg_span(0));
        let mut params = self.params(&mut d);
        self.state.area_light = None;
        if kind == "diffuse" {
            if let Some(light) = self.area_light(&mut params) {
                self.state.area_light = Some(Rc::new((light, span)));
            }
        } else {
            params.accept_all();
            self.unknown_type("area light", &kind, span, &["diffuse"]);
        }
        self.diagnostics.append(&mut params.finish());
    }

    fn area_light(&mut self, p: &mut Params) -> Option<AreaLight> {
        let space = self.state.color_space;
        let given = self.spectrum(p, "L", SpectrumUse::Illuminant);
        let mut scale = p.float("scale", 1.0);
        let two_sided = p.boolean("twosided", false);
        let power = Some(p.float("power", -1.0)).filter(|&phi| phi > 0.0);
        let image = match p.string("filename") {
            Some((name, span)) => {
                if given.is_some() {
                    p.error(format!("{} has both `L` and `filename`", p.what()), span);
                }
                Some(self.light_image(p, &name, span, |_| [Wrap::Clamp; 2])?)
            }
            None => None,
        };
        let radiance = given.unwrap_or_else(|| white(space));
        scale /= positive_photometric(p, "L", &radiance)?;
        Some(AreaLight { radiance, scale, two_sided, power, image })
    }

    /// `LightSource "type"`.
    pub(super) fn light_source(&mut self, mut d: Directive) {
        let (kind, span) = (d.text(0).to_string(), d.arg_span(0));
        let mut params = self.params(&mut d);
        if self.state.is_animated() {
            params.warning("lights do not move; the transform at the start is used", None);
        }
        let ctm = self.state.ctm[0];
        let p = &mut params;
        let light = match kind.as_str() {
            "point" => self.point_light(p, &ctm),
            "spot" => self.spot_light(p, &ctm),
            "distant" => self.distant_light(p, &ctm),
            "infinite" => self.infinite_light(p, &ctm),
            "goniometric" | "projection" => {
                p.error(format!("the `{kind}` light is not supported yet"), None);
                p.accept_all();
                None
            }
            _ => {
                p.accept_all();
                self.unknown_type("light", &kind, span, &TYPES);
                None
            }
        };
        self.scene.lights.extend(light);
        self.diagnostics.append(&mut params.finish());
    }

    /// The intensity of a light, and the factor that gives it luminous intensity `scale`.
    fn emission(&mut self, p: &mut Params, name: &'static str) -> Option<(Spectrum, f32)> {
        let spectrum = match self.spectrum(p, name, SpectrumUse::Illuminant) {
            Some(s) => s,
            None => white(self.state.color_space),
        };
        let scale = p.float("scale", 1.0) / positive_photometric(p, name, &spectrum)?;
        Some((spectrum, scale))
    }

    fn point_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let emission = self.emission(p, "I");
        let power = p.float("power", -1.0);
        let from = p.point("from", Point3::default());
        let (intensity, mut scale) = emission?;
        if power > 0.0 {
            scale *= power / (4.0 * PI);
        }
        Some(Light::Point { position: ctm.point(from), intensity, scale })
    }

    fn spot_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let emission = self.emission(p, "I");
        let (cone, delta) = (p.float("coneangle", 30.0), p.float("conedeltaangle", 5.0));
        let power = p.float("power", -1.0);
        let (from, to) = (p.point("from", Point3::default()), p.point("to", Point3::new(0.0, 0.0, 1.0)));
        if !(cone > 0.0 && cone <= 180.0) {
            let span = p.span_of("coneangle");
            p.error(format!("`coneangle` must be from 0 to 180 degrees, not {cone}"), span);
            return None;
        }
        if !(delta >= 0.0 && delta <= cone) {
            let span = p.span_of("conedeltaangle");
            p.error(format!("`conedeltaangle` must be from 0 to `coneangle`, not {delta}"), span);
            return None;
        }
        let axis = direction(p, from, to)?;
        let (intensity, mut scale) = emission?;
        let (cos_end, cos_start) = (cos(cone.to_radians()), cos((cone - delta).to_radians()));
        if power > 0.0 {
            // The falloff between the two angles lets through half of the light there.
            scale *= power / (2.0 * PI * ((1.0 - cos_start) + (cos_start - cos_end) / 2.0));
        }
        let local_from_axis = along_z(axis);
        let world_from_light = ctm.mul(&Transform::translate(from.to_vec())).mul(&local_from_axis);
        Some(Light::Spot { world_from_light, intensity, scale, cos_end, cos_start })
    }

    fn distant_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let emission = self.emission(p, "L");
        let illuminance = p.float("illuminance", -1.0);
        let (from, to) = (p.point("from", Point3::default()), p.point("to", Point3::new(0.0, 0.0, 1.0)));
        let axis = direction(p, from, to)?;
        let (radiance, mut scale) = emission?;
        if illuminance > 0.0 {
            scale *= illuminance;
        }
        Some(Light::Distant { to_light: ctm.vector(-axis).try_normalize()?, radiance, scale })
    }

    fn infinite_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let given = p.raw("L", SPECTRUM).is_some();
        let illuminance = Some(p.float("illuminance", -1.0)).filter(|&e| e > 0.0);
        if let Some((_, span)) = p.take_points("portal") {
            p.warning("the `portal` of an infinite light is not supported yet and is ignored", span);
        }
        let Some((name, span)) = p.string("filename") else {
            let (radiance, mut scale) = self.emission(p, "L")?;
            // A uniform sky of radiance L lights an upward surface with pi L.
            if let Some(e) = illuminance {
                scale *= e / PI;
            }
            return Some(Light::UniformInfinite { radiance, scale });
        };
        if given {
            p.error(format!("{} has both `L` and `filename`", p.what()), span);
        }
        let mut scale = p.float("scale", 1.0);
        // pbrt takes squares in equal-area layout only; what is twice as wide as high is the usual latitude and longitude.
        let is_square = |t: &Texels| t.width() == t.height();
        let wrap = |t: &Texels| if is_square(t) { [Wrap::Octahedral; 2] } else { [Wrap::Repeat, Wrap::Clamp] };
        let image = self.light_image(p, &name, span, wrap)?;
        let texels = &self.scene.images[image].texels;
        let (width, height) = (texels.width(), texels.height());
        let mapping = if is_square(texels) { EnvironmentMapping::EqualArea } else { EnvironmentMapping::LatLong };
        if mapping == EnvironmentMapping::LatLong && width != 2 * height {
            p.warning(
                format!("{name}: {width} x {height} pixels are neither square nor twice as wide as high; taken as latitude and longitude"),
                span,
            );
        }
        scale /= self.scene.images[image].color_space.photometric();
        if let Some(target) = illuminance {
            let from_map = self.upward_illuminance(image, mapping);
            if from_map > 0.0 {
                scale *= target / from_map;
            } else {
                p.error(format!("{name}: `illuminance` cannot be reached, since no light comes from above"), span);
            }
        }
        Some(Light::ImageInfinite { world_from_light: *ctm, image, mapping, scale })
    }

    /// What an environment map sends onto a surface that faces +z of light space: the integral of luminance times cosine.
    fn upward_illuminance(&self, image: Handle<TextureImage>, mapping: EnvironmentMapping) -> f32 {
        let image = &self.scene.images[image];
        let y_row = image.color_space.xyz_from_rgb().0[1];
        let (w, h) = (image.texels.width(), image.texels.height());
        let mut sum = 0.0f64;
        for y in 0..h {
            for x in 0..w {
                let st = [(x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32];
                // Solid angle of the unit square around this point.
                let (direction, jacobian) = match mapping {
                    EnvironmentMapping::EqualArea => (square_to_octahedral(st), 4.0 * PI),
                    EnvironmentMapping::LatLong => {
                        let d = square_to_lat_long(st);
                        (d, 2.0 * PI * PI * steradian_math::safe_sqrt(1.0 - d.z * d.z))
                    }
                };
                if direction.z > 0.0 {
                    let rgb = texel_rgb(&image.texels, x, y);
                    let luminance = y_row[0] * rgb[0] + y_row[1] * rgb[1] + y_row[2] * rgb[2];
                    sum += f64::from(luminance * direction.z * jacobian);
                }
            }
        }
        (sum / (w * h) as f64) as f32
    }
}

/// The white of a colour space, as a light.
fn white(space: ColorSpace) -> Spectrum {
    Spectrum::rgb_illuminant(space, [1.0; 3])
}

/// The photometric value that a light's scale is divided by; a light that cannot be seen is an error.
pub(super) fn positive_photometric(p: &mut Params, name: &str, spectrum: &Spectrum) -> Option<f32> {
    let value = spectrum.photometric();
    if value > 0.0 {
        return Some(value);
    }
    let span = p.span_of(name);
    p.error(format!("`{name}` of {} emits nothing that can be seen", p.what()), span);
    None
}

fn direction(p: &mut Params, from: Point3, to: Point3) -> Option<Vec3> {
    let d = (to - from).try_normalize();
    if d.is_none() {
        p.error(format!("`from` and `to` of {} must differ", p.what()), None);
    }
    d
}

/// A rotation that takes +z to `axis`.
fn along_z(axis: Vec3) -> Transform {
    let f = Frame::from_z(axis);
    let m = [[f.x.x, f.y.x, f.z.x, 0.0], [f.x.y, f.y.y, f.z.y, 0.0], [f.x.z, f.y.z, f.z.z, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let transpose = [0, 1, 2, 3].map(|i| [m[0][i], m[1][i], m[2][i], m[3][i]]);
    Transform { m, inv: transpose }
}
