//! The numbers of a scene under names, for programs that change some and render again: `camera.fov`, `lights.0.scale`,
//! `materials.wall.reflectance`.

use crate::{
    AreaLight, Arena, Coat, FloatInput, FloatTexture, HairColor, Handle, Ior, Light, Material, Metal, Projection,
    Roughness, Scattering, Scene, SpectrumInput, SpectrumTexture, Texture, TextureImage, Translucency,
};
use std::collections::BTreeMap;
use std::fmt;
use steradian_math::{Point3, Transform, Vec3};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};

/// A value as programs see it.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Float(f32),
    /// A whole number.
    Integer(u64),
    /// A colour in linear Rec. 709, a point or a direction.
    Triple([f32; 3]),
    /// A transform, row by row.
    Matrix([[f32; 4]; 4]),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Float(v) => write!(f, "{v}"),
            Self::Integer(v) => write!(f, "{v}"),
            Self::Triple(v) => write!(f, "{v:?}"),
            Self::Matrix(v) => write!(f, "{v:?}"),
        }
    }
}

/// Why a parameter keeps its value.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ParameterError {
    /// There is none of that name.
    #[error("there is no parameter `{0}`")]
    Unknown(String),
    /// The value is of another kind.
    #[error("`{name}` is {wanted}, not {given}")]
    Kind {
        /// The parameter.
        name: String,
        /// What it is.
        wanted: &'static str,
        /// What was given.
        given: String,
    },
    /// The value makes no sense.
    #[error("`{name}` cannot be {given}: {why}")]
    Range {
        /// The parameter.
        name: String,
        /// What was given.
        given: String,
        /// What is allowed.
        why: &'static str,
    },
}

/// Where a parameter is kept.
enum Slot<'a> {
    Float(&'a mut f32, Limits),
    Count(&'a mut u32, [u32; 2]),
    Seed(&'a mut u64),
    Point(&'a mut Point3),
    Direction(&'a mut Vec3),
    Camera(&'a mut steradian_math::AnimatedTransform),
    Place(&'a mut Transform),
    /// A factor, kept in this unit.
    Strength(&'a mut f32, f32),
    /// The strength of an emitter is kept in units of its spectrum's brightness.
    Emission(&'a mut Spectrum, &'a mut f32),
    FloatInput(&'a mut FloatInput, &'a mut Arena<FloatTexture>, Limits),
    SpectrumInput(&'a mut SpectrumInput, &'a mut Arena<SpectrumTexture>),
}

/// What a number may be.
#[derive(Clone, Copy)]
struct Limits {
    allows: fn(f32) -> bool,
    why: &'static str,
}

const ANY: Limits = Limits { allows: f32::is_finite, why: "it must be a finite number" };
const POSITIVE: Limits = Limits { allows: |v| v > 0.0 && v.is_finite(), why: "it must be more than zero" };
const NOT_NEGATIVE: Limits = Limits { allows: |v| v >= 0.0 && v.is_finite(), why: "it must not be negative" };
const SHARE: Limits = Limits { allows: |v| (0.0..=1.0).contains(&v), why: "it must be from 0 to 1" };
const COSINE: Limits = Limits { allows: |v| v > -1.0 && v < 1.0, why: "it must be between -1 and 1" };
const ANGLE: Limits = Limits { allows: |v| v > 0.0 && v < 180.0, why: "it must be between 0 and 180 degrees" };

impl Scene {
    /// All parameters with their values, in a fixed order. A texture that varies has none.
    pub fn parameters(&mut self) -> Vec<(String, Value)> {
        let mut out = Vec::new();
        self.visit(&mut |name, slot| {
            if let Some(value) = slot.value() {
                out.push((name.to_owned(), value));
            }
        });
        out
    }

    /// Gives a parameter another value.
    ///
    /// # Errors
    /// Where the name is unknown or the value is not for it.
    pub fn set_parameter(&mut self, name: &str, value: &Value) -> Result<(), ParameterError> {
        let mut result = Err(ParameterError::Unknown(name.to_owned()));
        self.visit(&mut |this, slot| {
            if this == name {
                result = slot.set(name, value);
            }
        });
        result
    }

    fn visit(&mut self, found: &mut dyn FnMut(&str, Slot)) {
        let camera = &mut self.camera;
        if let Projection::Perspective { fov } = &mut camera.projection {
            found("camera.fov", Slot::Float(fov, ANGLE));
        }
        if !matches!(camera.projection, Projection::Realistic { .. }) {
            found("camera.lens_radius", Slot::Float(&mut camera.lens_radius, NOT_NEGATIVE));
            found("camera.focal_distance", Slot::Float(&mut camera.focal_distance, POSITIVE));
        }
        let [open, close] = &mut camera.shutter;
        found("camera.shutter_open", Slot::Float(open, ANY));
        found("camera.shutter_close", Slot::Float(close, ANY));
        if !camera.world_from_camera.is_animated() {
            found("camera.to_world", Slot::Camera(&mut camera.world_from_camera));
        }
        let settings = &mut self.settings;
        found("sampler.spp", Slot::Count(&mut settings.sampler.spp, [1, 1 << 24]));
        found("sampler.seed", Slot::Seed(&mut settings.sampler.seed));
        found("integrator.max_depth", Slot::Count(&mut settings.integrator.max_depth, [0, 1_000_000]));
        for (i, light) in self.lights.iter_mut().enumerate() {
            visit_light(&format!("lights.{i}"), light, &self.images, found);
        }
        for (i, primitive) in self.primitives.iter_mut().enumerate() {
            if let Some(AreaLight { radiance, scale, image: None, texture: None, .. }) = &mut primitive.area_light {
                found(&format!("shapes.{i}.emission"), Slot::Emission(radiance, scale));
            }
        }
        let names = material_names(&self.materials);
        let mut inputs = Inputs { floats: &mut self.float_textures, spectra: &mut self.spectrum_textures, found };
        for (handle, name) in names {
            inputs.material(&format!("materials.{name}"), &mut self.materials[handle].scattering);
        }
    }
}

/// Materials by name where that is theirs alone, else by number.
fn material_names(materials: &Arena<Material>) -> Vec<(Handle<Material>, String)> {
    let mut count: BTreeMap<&str, usize> = BTreeMap::new();
    materials.iter().for_each(|m| *count.entry(&m.name).or_default() += 1);
    let name = |h: Handle<Material>| match materials[h].name.as_str() {
        name if name.is_empty() || count[name] > 1 => h.index().to_string(),
        name => name.to_owned(),
    };
    materials.handles().map(|h| (h, name(h))).collect()
}

fn visit_light(name: &str, light: &mut Light, images: &Arena<TextureImage>, found: &mut dyn FnMut(&str, Slot)) {
    if let Light::Projection { scale, image, .. }
    | Light::ImageInfinite { scale, image, .. }
    | Light::PortalInfinite { scale, image, .. } = light
    {
        let unit = 1.0 / images[*image].color_space.photometric();
        found(&format!("{name}.scale"), Slot::Strength(scale, unit));
    }
    match light {
        Light::Point { position, intensity, scale } => {
            found(&format!("{name}.intensity"), Slot::Emission(intensity, scale));
            found(&format!("{name}.position"), Slot::Point(position));
        }
        Light::Spot { world_from_light, intensity, scale, .. }
        | Light::Cone { world_from_light, intensity, scale, .. }
        | Light::Goniometric { world_from_light, intensity, scale, .. } => {
            found(&format!("{name}.intensity"), Slot::Emission(intensity, scale));
            found(&format!("{name}.to_world"), Slot::Place(world_from_light));
        }
        Light::Distant { to_light, radiance, scale } => {
            found(&format!("{name}.radiance"), Slot::Emission(radiance, scale));
            found(&format!("{name}.to_light"), Slot::Direction(to_light));
        }
        Light::Sun { to_light, profile, scale, .. } => {
            if let [radiance] = profile.as_mut_slice() {
                found(&format!("{name}.radiance"), Slot::Emission(radiance, scale));
            }
            found(&format!("{name}.to_light"), Slot::Direction(to_light));
        }
        Light::UniformInfinite { radiance, scale } => {
            found(&format!("{name}.radiance"), Slot::Emission(radiance, scale));
        }
        Light::Projection { world_from_light, .. } | Light::ImageInfinite { world_from_light, .. } => {
            found(&format!("{name}.to_world"), Slot::Place(world_from_light));
        }
        Light::PortalInfinite { .. } => {}
        // Its place is in the space that moves.
        Light::Moving { light, .. } => visit_light(name, light, images, found),
    }
}

/// The textures that materials look things up in.
struct Inputs<'a, 'f> {
    floats: &'a mut Arena<FloatTexture>,
    spectra: &'a mut Arena<SpectrumTexture>,
    found: &'f mut dyn FnMut(&str, Slot),
}

impl Inputs<'_, '_> {
    fn float(&mut self, name: &str, input: &mut FloatInput, limits: Limits) {
        (self.found)(name, Slot::FloatInput(input, self.floats, limits));
    }

    fn spectrum(&mut self, name: &str, input: &mut SpectrumInput) {
        (self.found)(name, Slot::SpectrumInput(input, self.spectra));
    }

    fn roughness(&mut self, name: &str, r: &mut Roughness) {
        self.float(&format!("{name}roughness_u"), &mut r.u, NOT_NEGATIVE);
        self.float(&format!("{name}roughness_v"), &mut r.v, NOT_NEGATIVE);
    }

    fn metal(&mut self, name: &str, metal: &mut Metal) {
        match metal {
            Metal::Ior { eta, k } => {
                self.spectrum(&format!("{name}eta"), eta);
                self.spectrum(&format!("{name}k"), k);
            }
            Metal::Reflectance(r) => self.spectrum(&format!("{name}reflectance"), r),
        }
    }

    fn ior(&mut self, name: &str, eta: &mut Ior) {
        if let Ior::Constant(v) = eta {
            (self.found)(name, Slot::Float(v, POSITIVE));
        }
    }

    fn coat(&mut self, name: &str, coat: &mut Coat) {
        self.roughness(&format!("{name}interface_"), &mut coat.roughness);
        self.ior(&format!("{name}interface_eta"), &mut coat.eta);
        self.float(&format!("{name}thickness"), &mut coat.thickness, NOT_NEGATIVE);
        self.spectrum(&format!("{name}albedo"), &mut coat.albedo);
        self.float(&format!("{name}g"), &mut coat.g, COSINE);
    }

    fn material(&mut self, name: &str, scattering: &mut Scattering) {
        let p = format!("{name}.");
        match scattering {
            Scattering::Diffuse { reflectance } => self.spectrum(&format!("{p}reflectance"), reflectance),
            Scattering::Conductor { metal, roughness } => {
                self.metal(&p, metal);
                self.roughness(&p, roughness);
            }
            Scattering::Dielectric { eta, roughness } => {
                self.ior(&format!("{p}eta"), eta);
                self.roughness(&p, roughness);
            }
            Scattering::ThinDielectric { eta } => self.ior(&format!("{p}eta"), eta),
            Scattering::DiffuseTransmission { reflectance, transmittance, scale } => {
                self.spectrum(&format!("{p}reflectance"), reflectance);
                self.spectrum(&format!("{p}transmittance"), transmittance);
                (self.found)(&format!("{p}scale"), Slot::Float(scale, NOT_NEGATIVE));
            }
            Scattering::CoatedDiffuse { reflectance, coat } => {
                self.spectrum(&format!("{p}reflectance"), reflectance);
                self.coat(&p, coat);
            }
            Scattering::CoatedConductor { metal, roughness, coat } => {
                self.metal(&format!("{p}conductor_"), metal);
                self.roughness(&format!("{p}conductor_"), roughness);
                self.coat(&p, coat);
            }
            Scattering::Hair { color, eta, beta_m, beta_n, alpha } => {
                match color {
                    HairColor::Absorption(s) => self.spectrum(&format!("{p}sigma_a"), s),
                    HairColor::Reflectance(s) => self.spectrum(&format!("{p}reflectance"), s),
                    HairColor::Melanin { eumelanin, pheomelanin } => {
                        self.float(&format!("{p}eumelanin"), eumelanin, NOT_NEGATIVE);
                        self.float(&format!("{p}pheomelanin"), pheomelanin, NOT_NEGATIVE);
                    }
                }
                self.float(&format!("{p}eta"), eta, POSITIVE);
                self.float(&format!("{p}beta_m"), beta_m, SHARE);
                self.float(&format!("{p}beta_n"), beta_n, SHARE);
                self.float(&format!("{p}alpha"), alpha, ANY);
            }
            Scattering::Subsurface { inside, scale, g, eta, roughness } => {
                match inside {
                    Translucency::Coefficients { sigma_a, sigma_s } => {
                        self.spectrum(&format!("{p}sigma_a"), sigma_a);
                        self.spectrum(&format!("{p}sigma_s"), sigma_s);
                    }
                    Translucency::Reflectance { reflectance, mean_free_path } => {
                        self.spectrum(&format!("{p}reflectance"), reflectance);
                        self.spectrum(&format!("{p}mean_free_path"), mean_free_path);
                    }
                }
                (self.found)(&format!("{p}scale"), Slot::Float(scale, NOT_NEGATIVE));
                (self.found)(&format!("{p}g"), Slot::Float(g, COSINE));
                (self.found)(&format!("{p}eta"), Slot::Float(eta, POSITIVE));
                self.roughness(&p, roughness);
            }
            Scattering::Mix { amount, .. } => self.float(&format!("{p}amount"), amount, SHARE),
            Scattering::MetallicRoughness(m) => {
                self.spectrum(&format!("{p}base_color"), &mut m.base);
                self.float(&format!("{p}metallic"), &mut m.metallic, SHARE);
                self.float(&format!("{p}roughness"), &mut m.roughness, SHARE);
                self.ior(&format!("{p}eta"), &mut m.eta);
                if let Some(t) = &mut m.transmission {
                    self.float(&format!("{p}transmission"), t, SHARE);
                }
                if let Some([factor, roughness]) = &mut m.coat {
                    self.float(&format!("{p}coat"), factor, SHARE);
                    self.float(&format!("{p}coat_roughness"), roughness, SHARE);
                }
            }
            Scattering::Plastic(m) => {
                (self.found)(&format!("{p}eta"), Slot::Float(&mut m.eta, POSITIVE));
                self.spectrum(&format!("{p}reflectance"), &mut m.reflectance);
                if let Some(specular) = &mut m.specular {
                    self.spectrum(&format!("{p}specular"), specular);
                }
            }
            Scattering::Principled(m) => {
                self.spectrum(&format!("{p}base_color"), &mut m.base);
                self.float(&format!("{p}roughness"), &mut m.roughness, SHARE);
                self.float(&format!("{p}metallic"), &mut m.metallic, SHARE);
                self.float(&format!("{p}transmission"), &mut m.transmission, SHARE);
                (self.found)(&format!("{p}eta"), Slot::Float(&mut m.eta, POSITIVE));
            }
            Scattering::Altered { reflection, transmission, .. } => {
                if let Some(factor) = reflection {
                    self.spectrum(&format!("{p}reflection"), factor);
                }
                if let Some(factor) = transmission {
                    self.spectrum(&format!("{p}transmission"), factor);
                }
            }
            Scattering::Sides { .. } | Scattering::Measured(_) | Scattering::Interface => {}
        }
    }
}

impl Slot<'_> {
    fn value(&self) -> Option<Value> {
        match self {
            Slot::Float(v, _) => Some(Value::Float(**v)),
            Slot::Count(v, _) => Some(Value::Integer(u64::from(**v))),
            Slot::Seed(v) => Some(Value::Integer(**v)),
            Slot::Point(p) => Some(Value::Triple([p.x, p.y, p.z])),
            Slot::Direction(d) => Some(Value::Triple([d.x, d.y, d.z])),
            Slot::Camera(t) => Some(Value::Matrix(t.at(0.0).m)),
            Slot::Place(t) => Some(Value::Matrix(t.m)),
            Slot::Strength(scale, unit) => Some(Value::Float(**scale / unit)),
            Slot::Emission(spectrum, scale) => Some(Value::Triple(spectrum.rgb().map(|v| v * **scale))),
            Slot::FloatInput(input, textures, _) => match textures[**input].0 {
                Texture::Constant(v) => Some(Value::Float(v)),
                _ => None,
            },
            Slot::SpectrumInput(input, textures) => match &textures[**input].kind {
                Texture::Constant(s) => Some(Value::Triple(s.rgb())),
                _ => None,
            },
        }
    }

    fn set(self, name: &str, value: &Value) -> Result<(), ParameterError> {
        let kind = |wanted| ParameterError::Kind { name: name.to_owned(), wanted, given: value.to_string() };
        let range = |why| ParameterError::Range { name: name.to_owned(), given: value.to_string(), why };
        let number = |limits: Limits| {
            let v = match value {
                Value::Float(v) => *v,
                Value::Integer(v) => *v as f32,
                _ => return Err(kind("a number")),
            };
            if (limits.allows)(v) { Ok(v) } else { Err(range(limits.why)) }
        };
        let whole = || match value {
            Value::Integer(v) => Ok(*v),
            _ => Err(kind("a whole number, not negative")),
        };
        let triple = |what| match value {
            Value::Triple(v) if v.iter().all(|x| x.is_finite()) => Ok(*v),
            Value::Triple(_) => Err(range(ANY.why)),
            _ => Err(kind(what)),
        };
        // A grey may be one number.
        let color = || {
            let rgb = match value {
                Value::Float(v) => [*v; 3],
                Value::Integer(v) => [*v as f32; 3],
                _ => triple("a colour of three numbers")?,
            };
            if rgb.iter().all(|&v| v >= 0.0 && v.is_finite()) { Ok(rgb) } else { Err(range(NOT_NEGATIVE.why)) }
        };
        let matrix = || match value {
            Value::Matrix(m) if m.iter().flatten().any(|x| !x.is_finite()) => Err(range(ANY.why)),
            Value::Matrix(m) => Transform::from_matrix(*m).ok_or_else(|| range("it cannot be inverted")),
            _ => Err(kind("a matrix of four rows of four numbers")),
        };
        match self {
            Slot::Float(v, limits) => *v = number(limits)?,
            Slot::Count(v, [low, high]) => match u32::try_from(whole()?) {
                Ok(n) if (low..=high).contains(&n) => *v = n,
                _ => return Err(range("it is out of range")),
            },
            Slot::Seed(v) => *v = whole()?,
            Slot::Point(p) => {
                let [x, y, z] = triple("a point of three numbers")?;
                *p = Point3::new(x, y, z);
            }
            Slot::Direction(d) => {
                let [x, y, z] = triple("a direction of three numbers")?;
                let v = Vec3::new(x, y, z);
                if v.length_squared() <= 0.0 {
                    return Err(range("it has no length"));
                }
                *d = v.normalize();
            }
            Slot::Camera(t) => *t = matrix()?.into(),
            Slot::Place(t) => *t = matrix()?,
            Slot::Strength(scale, unit) => *scale = number(NOT_NEGATIVE)? * unit,
            Slot::Emission(spectrum, scale) => {
                *spectrum = Spectrum::rgb_illuminant(ColorSpace::Srgb, color()?);
                *scale = 1.0 / spectrum.photometric();
            }
            Slot::FloatInput(input, textures, limits) => {
                *input = textures.push(FloatTexture(Texture::Constant(number(limits)?)));
            }
            Slot::SpectrumInput(input, textures) => {
                let usage = textures[*input].usage;
                let rgb = color()?;
                let spectrum = match usage {
                    SpectrumUse::Albedo if rgb.iter().any(|&v| v > 1.0) => return Err(range(SHARE.why)),
                    SpectrumUse::Albedo => Spectrum::rgb_albedo(ColorSpace::Srgb, rgb),
                    SpectrumUse::Unbounded => Spectrum::rgb_unbounded(ColorSpace::Srgb, rgb),
                    SpectrumUse::Illuminant => Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb),
                };
                *input = textures.push(SpectrumTexture { usage, kind: Texture::Constant(spectrum) });
            }
        }
        Ok(())
    }
}
