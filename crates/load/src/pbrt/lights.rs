//! Light sources and emission of surfaces, scaled so that a light of scale 1 has luminance (or luminous intensity) 1 whatever its spectrum.

use super::Loader;
use super::images::texel_rgb;
use super::params::{Params, SPECTRUM};
use crate::files::describe;
use crate::ies::IesProfile;
use std::rc::Rc;
use steradian_image::{Image, Lookup, Texels, Wrap};
use steradian_math::{Frame, PI, Point3, Transform, Vec3, cos};
use steradian_sampling::warp::{square_to_lat_long, square_to_octahedral};
use steradian_scene::{AreaLight, EnvironmentMapping, Handle, Light, LightGroup, TextureImage};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse, cie};
use steradian_syntax::{Diagnostic, Directive, ParamType, Span};

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
        self.trap_of_light_spectra(p, "L");
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
        let group = Some(self.light_group(p));
        Some(AreaLight { radiance, scale, two_sided, power, image, group, texture: None })
    }

    /// `LightSource "type"`.
    pub(super) fn light_source(&mut self, mut d: Directive) {
        let (kind, span) = (d.text(0).to_string(), d.arg_span(0));
        let mut params = self.params(&mut d);
        let behind_portal = kind == "infinite" && params.raw("portal", &[ParamType::Point3]).is_some();
        let moves = self.state.is_animated() && !behind_portal;
        if self.state.is_animated() {
            if behind_portal {
                params.warning("what shines through a portal does not move; the transform at the start is used", None);
            } else {
                params
                    .diagnostics
                    .push(Diagnostic::note("the light moves; in pbrt it stays where it starts", params.span));
            }
        }
        // A light that moves is stated in a space of its own.
        let ctm = if moves { Transform::IDENTITY } else { self.state.ctm[0] };
        let p = &mut params;
        let light = match kind.as_str() {
            "point" => self.point_light(p, &ctm),
            "spot" => self.spot_light(p, &ctm),
            "distant" => self.distant_light(p, &ctm),
            "infinite" => self.infinite_light(p, &ctm),
            "goniometric" => self.goniometric_light(p, &ctm),
            "projection" => self.projection_light(p, &ctm),
            _ => {
                p.accept_all();
                self.unknown_type("light", &kind, span, &TYPES);
                None
            }
        };
        if light.is_some() {
            let group = self.light_group(p);
            self.scene.groups_of_lights.resize(self.scene.lights.len(), None);
            self.scene.groups_of_lights.push(Some(group));
        }
        let placed = |light: Light| match moves {
            true => Light::Moving { light: Box::new(light), world_from_light: self.state.animated() },
            false => light,
        };
        self.scene.lights.extend(light.map(placed));
        self.diagnostics.append(&mut params.finish());
    }

    /// The group that a light names with `lightgroup`, which pbrt does not know, or one of its own.
    fn light_group(&mut self, p: &mut Params) -> Handle<LightGroup> {
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let mut name = String::new();
        if let Some((word, span)) = p.string("lightgroup") {
            if word.is_empty() || word == "default" || !word.chars().all(plain) {
                p.error(
                    format!(
                        "`lightgroup` is a word of letters, digits, _ and -, and not `default`; it cannot be \"{word}\""
                    ),
                    span,
                );
            }
            name = word;
        }
        let known = self.scene.light_groups.as_slice().iter().position(|g| !name.is_empty() && g.name == name);
        match known {
            Some(index) => Handle::from_index(index),
            None => self.scene.light_groups.push(LightGroup { name }),
        }
    }

    /// The intensity of a light, and the factor that gives it luminous intensity `scale`.
    fn emission(&mut self, p: &mut Params, name: &'static str) -> Option<(Spectrum, f32)> {
        self.trap_of_light_spectra(p, name);
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

    fn goniometric_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let emission = self.emission(p, "I");
        let power = p.float("power", -1.0);
        let image = self.square_image(p, "goniometric")?;
        let (intensity, mut scale) = emission?;
        if power > 0.0 {
            scale *= power_factor(p, power, 4.0 * PI * self.scene.images[image].mean_intensity())?;
        }
        // The picture's pole is y of the light.
        let swap = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
        let world_from_light = ctm.mul(&Transform { m: swap, inv: swap });
        Some(Light::Goniometric { world_from_light, intensity, image, scale })
    }

    fn projection_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let (mut scale, power, fov) = (p.float("scale", 1.0), p.float("power", -1.0), p.float("fov", 90.0));
        if !(fov > 0.0 && fov < 180.0) {
            let span = p.span_of("fov");
            p.error(format!("`fov` must be between 0 and 180 degrees, not {fov}"), span);
            return None;
        }
        let Some((name, span)) = p.string("filename") else {
            p.error(format!("{} needs a `filename`", p.what()), None);
            return None;
        };
        let image = self.light_image(p, &name, span, |_| [Wrap::Clamp; 2])?;
        let picture = &self.scene.images[image];
        scale /= picture.color_space.photometric();
        if power > 0.0 {
            scale *= power_factor(p, power, picture.projected_luminance(fov))?;
        }
        Some(Light::Projection { world_from_light: *ctm, image, screen: None, fov, scale })
    }

    /// The picture of a light that must be in equal-area layout.
    fn square_image(&mut self, p: &mut Params, light: &str) -> Option<Handle<TextureImage>> {
        let Some((name, span)) = p.string("filename") else {
            p.error(format!("{} needs a `filename`", p.what()), None);
            return None;
        };
        if light == "goniometric" && name.to_ascii_lowercase().ends_with(".ies") {
            return self.photometric_image(p, &name, span);
        }
        let image = self.light_image(p, &name, span, |_| [Wrap::Octahedral; 2])?;
        let texels = &self.scene.images[image].texels;
        let (w, h) = (texels.width(), texels.height());
        if w != h {
            let message =
                format!("{name}: the picture of a {light} light must be square (equal-area layout), not {w} x {h}");
            p.error(message, span);
            return None;
        }
        Some(image)
    }

    /// A photometric file as a picture, whose values are candela: a light of scale 1 is as bright as the luminaire.
    fn photometric_image(&mut self, p: &mut Params, name: &str, span: Span) -> Option<Handle<TextureImage>> {
        /// A texel is a quarter of a degree wide.
        const SIZE: usize = 512;
        let path = self.resolve(name);
        let bytes = self.files.read(&path).map_err(|e| p.error(describe(&path, &e), span)).ok()?;
        let profile = IesProfile::parse(&bytes).map_err(|e| p.error(format!("{}: {e}", path.display()), span)).ok()?;
        let middle = |i: usize| (i as f32 + 0.5) / SIZE as f32;
        let value = |i: usize| {
            // The picture's pole is y of the light.
            let d = square_to_octahedral([middle(i % SIZE), middle(i / SIZE)]);
            [profile.candela(Vec3::new(d.x, d.z, d.y)); 3]
        };
        let pixels: Vec<[f32; 3]> = (0..SIZE * SIZE).map(value).collect();
        let picture = Image::from_rgb(SIZE, SIZE, &pixels)?;
        let texels = Texels::from_image(&picture).map_err(|e| p.error(e.to_string(), None)).ok()?;
        let (lookup, wrap) = (Lookup::Bilinear, [Wrap::Octahedral; 2]);
        let image = TextureImage { name: name.to_owned(), texels, lookup, wrap, color_space: ColorSpace::Srgb };
        Some(self.scene.images.push(image))
    }

    fn infinite_light(&mut self, p: &mut Params, ctm: &Transform) -> Option<Light> {
        let given = p.raw("L", SPECTRUM).is_some();
        let illuminance = Some(p.float("illuminance", -1.0)).filter(|&e| e > 0.0);
        let portal = p.take_points("portal");
        let Some((name, span)) = p.string("filename") else {
            if let Some((points, span)) = portal {
                return self.uniform_portal(p, &points, span, illuminance);
            }
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
        let scale = p.float("scale", 1.0);
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
        let scale = self.map_scale(p, scale, image, mapping, illuminance, span)?;
        let Some((points, portal_span)) = portal else {
            return Some(Light::ImageInfinite { world_from_light: *ctm, image, mapping, scale });
        };
        if mapping == EnvironmentMapping::LatLong {
            p.error(format!("{name}: behind a `portal` the picture must be square (equal-area layout)"), span);
            return None;
        }
        let portal = rectangle(p, &points, portal_span)?;
        Some(Light::PortalInfinite { world_from_light: *ctm, image, scale, portal })
    }

    /// The factor of a map, given the illuminance that it is to have.
    fn map_scale(
        &self,
        p: &mut Params,
        scale: f32,
        image: Handle<TextureImage>,
        mapping: EnvironmentMapping,
        illuminance: Option<f32>,
        span: Span,
    ) -> Option<f32> {
        let picture = &self.scene.images[image];
        let scale = scale / picture.color_space.photometric();
        let Some(target) = illuminance else { return Some(scale) };
        let from_map = self.upward_illuminance(image, mapping);
        if from_map > 0.0 {
            return Some(scale * target / from_map);
        }
        let name = &picture.name;
        p.error(format!("{name}: `illuminance` cannot be reached, since no light comes from above"), span);
        None
    }

    /// A uniform sky behind a portal: as in pbrt its spectrum is first turned into a picture of one pixel.
    fn uniform_portal(
        &mut self,
        p: &mut Params,
        points: &[Point3],
        span: Span,
        illuminance: Option<f32>,
    ) -> Option<Light> {
        let Some(radiance) = self.spectrum(p, "L", SpectrumUse::Illuminant) else {
            p.error(format!("{} with a `portal` needs `L` or a `filename`", p.what()), span);
            return None;
        };
        let scale = p.float("scale", 1.0);
        let portal = rectangle(p, points, span)?;
        let space = ColorSpace::Srgb;
        let xyz = cie::xyz_of_table(&radiance.to_dense()).map(|v| v / cie::Y_INTEGRAL);
        let picture = Image::from_rgb(1, 1, &[space.rgb_from_xyz().apply(xyz)])?;
        let texels = Texels::from_image(&picture).map_err(|e| p.error(e.to_string(), None)).ok()?;
        let image = TextureImage {
            name: "sky".into(),
            texels,
            lookup: Lookup::Bilinear,
            wrap: [Wrap::Octahedral; 2],
            color_space: space,
        };
        let image = self.scene.images.push(image);
        let scale = self.map_scale(p, scale, image, EnvironmentMapping::EqualArea, illuminance, span)?;
        Some(Light::PortalInfinite { world_from_light: Transform::IDENTITY, image, scale, portal })
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
                    EnvironmentMapping::LatLong | EnvironmentMapping::LatLongToPoles => {
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

/// What an intensity whose total is `total` must be multiplied by to emit `power`.
fn power_factor(p: &mut Params, power: f32, total: f32) -> Option<f32> {
    if total > 0.0 {
        return Some(power / total);
    }
    p.error(format!("`power` of {} cannot be reached, since its picture is black", p.what()), None);
    None
}

/// The four corners of a portal, which must be a rectangle.
fn rectangle(p: &mut Params, points: &[Point3], span: Span) -> Option<[Point3; 4]> {
    let Ok(corners) = <[Point3; 4]>::try_from(points) else {
        p.error(format!("a `portal` has four corners, not {}", points.len()), span);
        return None;
    };
    let [a, b, c, d] = corners;
    let edges = [b - a, c - b, c - d, d - a].map(Vec3::try_normalize);
    let [Some(ab), Some(bc), Some(dc), Some(ad)] = edges else {
        p.error("two corners of the `portal` are the same", span);
        return None;
    };
    let same = |v: Vec3, w: Vec3| (v.dot(w) - 1.0).abs() <= 1e-3;
    let square = |v: Vec3, w: Vec3| v.dot(w).abs() <= 1e-3;
    if same(ab, dc) && same(bc, ad) && square(ab, bc) && square(bc, dc) && square(dc, ad) && square(ad, ab) {
        return Some(corners);
    }
    p.error("the `portal` is not a rectangle with its corners in order", span);
    None
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
