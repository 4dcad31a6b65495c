//! All lights of the world under one numbering: which one to sample, where on it, and with what density.
//!
//! Densities returned here include the probability of picking the light. Delta lights (points, spots, distant lights)
//! report the probability alone.

mod bounds;
mod emitter;
mod environment;
mod point;

pub use emitter::{Emitter, EmitterShape};
pub use point::LightPoint;

use super::texture::rgb_lanes;
use super::{Surface, World};
use crate::{Light, LightSelection};
use bounds::{LightBounds, LightTree};
use environment::Environment;
use steradian_geometry::Reference;
use steradian_math::{Bounds3, Frame, INV_4PI, Normal3, PI, Point2, Point3, Vec3, smoothstep};
use steradian_sampling::AliasTable;
use steradian_sampling::warp::square_to_uniform_sphere;
use steradian_spectrum::{Lanes, SpectrumUse, Wavelengths};

/// The point that light is sampled for.
#[derive(Clone, Copy, Debug)]
pub struct LightContext {
    reference: Reference,
}

impl LightContext {
    /// A point of a surface with its shading frame.
    #[inline]
    pub fn of_surface(surface: &Surface, frame: &Frame) -> Self {
        Self { reference: Reference { p: surface.p, p_error: surface.p_error, n: surface.n, ns: frame.normal() } }
    }

    /// A point in a medium.
    pub fn of_point(p: Point3) -> Self {
        Self { reference: Reference::point(p) }
    }
}

/// A sampled point on a light, as seen from a [`LightContext`].
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Which light.
    pub light: u32,
    /// Radiance towards the point (for delta lights: irradiance on a surface that faces it).
    pub radiance: Lanes,
    /// Unit direction to the light.
    pub wi: Vec3,
    /// Distance to the light; infinite where it has none.
    pub distance: f32,
    /// The end of the shadow ray, off the light's surface; meaningless if the distance is infinite.
    pub end: Point3,
    /// Density per solid angle, times the probability of the light; the probability alone for delta lights.
    pub pdf: f32,
    /// Whether the light cannot be hit by chance.
    pub is_delta: bool,
}

/// A light that is not a surface, ready to be sampled.
#[derive(Clone, Debug)]
enum Far {
    Delta(Light),
    Uniform(steradian_spectrum::Spectrum, f32),
    Map(Environment),
}

/// All lights. Numbers below `emitters.len()` are surfaces, the rest are the others in order.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    pub(crate) emitters: Vec<Emitter>,
    far: Vec<Far>,
    infinite: Vec<u32>,
    /// Infinite and distant lights: those without a place in the tree.
    placeless: Vec<u32>,
    selection: Selection,
    /// One point for each lamp, for algorithms that know points only.
    points: Vec<LightPoint>,
}

#[derive(Clone, Debug, Default)]
enum Selection {
    #[default]
    None,
    Uniform(u32),
    Power(AliasTable),
    /// Lights without a place alike, the rest by the tree.
    Tree {
        tree: LightTree,
        probability_placeless: f32,
    },
}

impl Lights {
    /// Builds the tables for `emitters` and the scene's other lights.
    pub(crate) fn build(world: &World, emitters: Vec<Emitter>, bounds: &Bounds3) -> Self {
        let scene = &world.scene;
        let far: Vec<Far> = scene
            .lights
            .iter()
            .map(|light| match light {
                Light::Point { .. } | Light::Spot { .. } | Light::Distant { .. } => Far::Delta(light.clone()),
                Light::UniformInfinite { radiance, scale } => Far::Uniform(radiance.clone(), *scale),
                Light::ImageInfinite { world_from_light, image, mapping, scale } => Far::Map(Environment::new(
                    *image,
                    &scene.images[*image].texels,
                    *mapping,
                    *world_from_light,
                    *scale,
                )),
            })
            .collect();
        let first = emitters.len() as u32;
        let infinite = (0..far.len()).filter(|&i| !matches!(far[i], Far::Delta(_))).map(|i| first + i as u32).collect();
        let mut lights =
            Self { emitters, far, infinite, placeless: Vec::new(), selection: Selection::None, points: Vec::new() };
        lights.points = lights.light_points(world);
        lights.placeless = (0..lights.far.len())
            .filter(|&i| !matches!(lights.far[i], Far::Delta(Light::Point { .. } | Light::Spot { .. })))
            .map(|i| first + i as u32)
            .collect();
        lights.selection = lights.select(world, scene.settings.integrator.light_selection, bounds);
        lights
    }

    fn len(&self) -> usize {
        self.emitters.len() + self.far.len()
    }

    fn select(&self, world: &World, how: LightSelection, bounds: &Bounds3) -> Selection {
        let n = self.len();
        if n == 0 {
            return Selection::None;
        }
        let radius = bounds.bounding_sphere().1;
        match how {
            LightSelection::Uniform => Selection::Uniform(n as u32),
            LightSelection::Power => {
                let weights: Vec<f32> = (0..n as u32).map(|i| self.power(world, i, radius)).collect();
                AliasTable::new(&weights).map_or(Selection::Uniform(n as u32), Selection::Power)
            }
            LightSelection::Tree => {
                let mut items = Vec::new();
                for (i, e) in self.emitters.iter().enumerate() {
                    let (axis, cos) = world.emitter_normals(&e.shape);
                    let two_sided = world.area_lights[e.emission as usize].two_sided;
                    let power = self.power(world, i as u32, radius);
                    items.push((
                        i as u32,
                        LightBounds::new(world.emitter_bounds(&e.shape), axis, cos, 0.0, power, two_sided),
                    ));
                }
                for (i, far) in self.far.iter().enumerate() {
                    let id = (self.emitters.len() + i) as u32;
                    let Far::Delta(light) = far else { continue };
                    match light {
                        Light::Point { position, .. } => {
                            items.push((id, LightBounds::point(*position, self.power(world, id, radius))));
                        }
                        Light::Spot { world_from_light, cos_end, cos_start, .. } => {
                            let p = world_from_light.point(Point3::default());
                            let axis = world_from_light.vector(Vec3::new(0.0, 0.0, 1.0)).normalize();
                            let (te, ts) = (steradian_math::safe_acos(*cos_end), steradian_math::safe_acos(*cos_start));
                            let spread = steradian_math::cos(te - ts);
                            // As bright as the point light whose cone this is.
                            let power = self.spot_intensity(light) * 4.0 * PI;
                            items.push((
                                id,
                                LightBounds::new(Bounds3::new(p, p), axis, *cos_start, spread, power, false),
                            ));
                        }
                        _ => {}
                    }
                }
                let tree = LightTree::build(items, n);
                let groups = self.placeless.len() + usize::from(!tree.is_empty());
                Selection::Tree { tree, probability_placeless: if groups == 0 { 0.0 } else { 1.0 / groups as f32 } }
            }
        }
    }

    fn spot_intensity(&self, light: &Light) -> f32 {
        match light {
            Light::Spot { intensity, scale, .. } => brightness(intensity) * scale,
            _ => 0.0,
        }
    }

    /// Emitted power in common, photometric units: only to choose among lights.
    fn power(&self, world: &World, id: u32, scene_radius: f32) -> f32 {
        let disk = PI * scene_radius * scene_radius;
        if let Some(e) = self.emitters.get(id as usize) {
            let light = &world.area_lights[e.emission as usize];
            let l = match light.image {
                None => brightness(&light.radiance),
                Some(image) => {
                    let image = &world.scene.images[image];
                    image.mean_luminance() * image.color_space.photometric()
                }
            };
            return l * e.scale * world.emitter_area(&e.shape) * PI * if light.two_sided { 2.0 } else { 1.0 };
        }
        match &self.far[id as usize - self.emitters.len()] {
            Far::Uniform(radiance, scale) => brightness(radiance) * scale * 4.0 * PI * disk,
            Far::Map(map) => {
                let space = world.scene.images[map.image].color_space;
                map.mean_brightness() * space.photometric() * map.scale * 4.0 * PI * disk
            }
            Far::Delta(Light::Point { intensity, scale, .. }) => brightness(intensity) * scale * 4.0 * PI,
            Far::Delta(light @ Light::Spot { cos_end, cos_start, .. }) => {
                self.spot_intensity(light) * 2.0 * PI * ((1.0 - cos_start) + (cos_start - cos_end) / 2.0)
            }
            Far::Delta(Light::Distant { radiance, scale, .. }) => brightness(radiance) * scale * disk,
            Far::Delta(_) => 0.0,
        }
    }
}

/// A measure of strength that is positive for every spectrum that is not black.
fn brightness(s: &steradian_spectrum::Spectrum) -> f32 {
    s.photometric().max(1e-3 * s.max_value())
}

impl World {
    /// The numbers of the lights that shine from infinitely far.
    #[inline]
    pub fn infinite_lights(&self) -> &[u32] {
        &self.lights.infinite
    }

    /// How many lights there are.
    pub fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// Picks a light: its number and the probability of that choice.
    #[inline]
    fn pick_light(&self, from: &Reference, u: f32) -> Option<(u32, f32)> {
        let lights = &self.lights;
        match &lights.selection {
            Selection::None => None,
            Selection::Uniform(n) => Some((((u * *n as f32) as u32).min(n - 1), 1.0 / *n as f32)),
            Selection::Power(table) => {
                let s = table.sample(u);
                Some((s.index as u32, s.probability))
            }
            Selection::Tree { tree, probability_placeless } => {
                let p = *probability_placeless;
                let placeless = &self.lights.placeless;
                let below = p * placeless.len() as f32;
                if u < below {
                    let i = ((u / p) as usize).min(placeless.len() - 1);
                    return Some((placeless[i], p));
                }
                if tree.is_empty() {
                    return placeless.last().map(|&id| (id, p));
                }
                let share = 1.0 - below;
                let u = ((u - below) / share).min(steradian_math::ONE_MINUS_EPSILON);
                tree.sample(from.p, from.ns, u).map(|(id, pmf)| (id, pmf * share))
            }
        }
    }

    #[inline]
    fn pick_probability(&self, from: &Reference, light: u32) -> f32 {
        match &self.lights.selection {
            Selection::None => 0.0,
            Selection::Uniform(n) => 1.0 / *n as f32,
            Selection::Power(table) => table.probability(light as usize),
            Selection::Tree { tree, probability_placeless } => {
                if self.lights.placeless.contains(&light) {
                    *probability_placeless
                } else {
                    let share = 1.0 - probability_placeless * self.lights.placeless.len() as f32;
                    tree.probability(from.p, from.ns, light) * share
                }
            }
        }
    }

    /// Samples the light that arrives at a point: one number picks the light, two a point on it.
    ///
    /// `None` when the sample carries no light. Visibility is not tested.
    #[inline]
    pub fn sample_light(&self, context: &LightContext, u: f32, u2: [f32; 2], w: &Wavelengths) -> Option<LightSample> {
        let (light, probability) = self.pick_light(&context.reference, u)?;
        self.sample_picked(context, light, probability, u2, w)
    }

    /// Samples one light: as [`World::sample_light`], for a caller that goes through the lights by number.
    pub fn sample_one_light(
        &self,
        context: &LightContext,
        light: u32,
        u2: [f32; 2],
        w: &Wavelengths,
    ) -> Option<LightSample> {
        self.sample_picked(context, light, 1.0, u2, w)
    }

    #[inline(always)]
    fn sample_picked(
        &self,
        context: &LightContext,
        light: u32,
        probability: f32,
        u2: [f32; 2],
        w: &Wavelengths,
    ) -> Option<LightSample> {
        let from = &context.reference;
        if let Some(emitter) = self.lights.emitters.get(light as usize) {
            let s = self.sample_emitter(&emitter.shape, from, u2)?;
            let d = s.p - from.p;
            let distance = d.length();
            let wi = d * (1.0 / distance);
            let radiance = self.area_radiance(emitter.emission, emitter.scale, s.n, s.uv, -wi, w);
            if radiance.is_black() {
                return None;
            }
            let end = steradian_math::offset_ray_origin(s.p, s.p_error, s.n, -wi);
            return Some(LightSample { light, radiance, wi, distance, end, pdf: s.pdf * probability, is_delta: false });
        }
        let far = &self.lights.far[light as usize - self.lights.emitters.len()];
        let infinite = |radiance: Lanes, wi: Vec3, pdf: f32, is_delta: bool| {
            (!radiance.is_black()).then_some(LightSample {
                light,
                radiance,
                wi,
                distance: f32::INFINITY,
                end: Point3::default(),
                pdf: pdf * probability,
                is_delta,
            })
        };
        match far {
            Far::Uniform(radiance, scale) => {
                infinite(radiance.eval(w) * *scale, square_to_uniform_sphere(u2), INV_4PI, false)
            }
            Far::Map(map) => {
                let (wi, pdf) = map.sample(u2)?;
                infinite(self.map_radiance(map, wi, w), wi, pdf, false)
            }
            Far::Delta(light_data) => {
                let at = |p: Point3, intensity: Lanes| {
                    let d = p - from.p;
                    let distance = d.length();
                    let radiance = intensity * (1.0 / (distance * distance));
                    (distance > 0.0 && !radiance.is_black()).then(|| LightSample {
                        light,
                        radiance,
                        wi: d * (1.0 / distance),
                        distance,
                        end: p,
                        pdf: probability,
                        is_delta: true,
                    })
                };
                match light_data {
                    Light::Point { position, intensity, scale } => at(*position, intensity.eval(w) * *scale),
                    Light::Spot { world_from_light, intensity, scale, cos_end, cos_start } => {
                        let p = world_from_light.point(Point3::default());
                        let axis = world_from_light.inverse().vector(from.p - p).normalize().z;
                        at(p, intensity.eval(w) * (*scale * smoothstep(axis, *cos_end, *cos_start)))
                    }
                    Light::Distant { to_light, radiance, scale } => {
                        infinite(radiance.eval(w) * *scale, *to_light, 1.0, true)
                    }
                    Light::UniformInfinite { .. } | Light::ImageInfinite { .. } => None,
                }
            }
        }
    }

    /// The density per solid angle, probability of the light included, with which `sample_light` gives direction `wi`.
    /// `hit` is the point on the light where the direction meets it, for lights that are surfaces.
    #[inline]
    pub fn light_pdf(&self, context: &LightContext, light: u32, wi: Vec3, hit: Option<&Surface>) -> f32 {
        let from = &context.reference;
        let probability = self.pick_probability(from, light);
        if probability == 0.0 {
            return 0.0;
        }
        let pdf = match (self.lights.emitters.get(light as usize), hit) {
            (Some(emitter), Some(hit)) => self.emitter_pdf(&emitter.shape, from, hit),
            (Some(_), None) => 0.0,
            (None, _) => match &self.lights.far[light as usize - self.lights.emitters.len()] {
                Far::Uniform(..) => INV_4PI,
                Far::Map(map) => map.pdf(wi),
                Far::Delta(_) => 0.0,
            },
        };
        pdf * probability
    }

    /// Radiance of an infinite light from direction `d` (pointing to it).
    pub fn environment(&self, light: u32, d: Vec3, w: &Wavelengths) -> Lanes {
        match &self.lights.far[light as usize - self.lights.emitters.len()] {
            Far::Uniform(radiance, scale) => radiance.eval(w) * *scale,
            Far::Map(map) => self.map_radiance(map, d, w),
            Far::Delta(_) => Lanes::ZERO,
        }
    }

    fn map_radiance(&self, map: &Environment, d: Vec3, w: &Wavelengths) -> Lanes {
        let image = &self.scene.images[map.image];
        let rgb = map.rgb(&image.texels, d).map(|v| v.max(0.0));
        rgb_lanes(rgb, image.color_space, SpectrumUse::Illuminant, w) * map.scale
    }

    /// Radiance that the surface emits back along the ray that hit it.
    #[inline]
    pub fn emitted(&self, surface: &Surface, w: &Wavelengths) -> Lanes {
        match surface.emission {
            None => Lanes::ZERO,
            Some((emission, scale)) => self.area_radiance(emission, scale, surface.n, surface.uv, surface.wo, w),
        }
    }

    #[inline]
    fn area_radiance(&self, emission: u32, scale: f32, n: Normal3, uv: Point2, wo: Vec3, w: &Wavelengths) -> Lanes {
        let light = &self.area_lights[emission as usize];
        if !light.two_sided && n.dot(wo) <= 0.0 {
            return Lanes::ZERO;
        }
        match light.image {
            None => light.radiance.eval(w) * scale,
            Some(image) => {
                let image = &self.scene.images[image];
                let rgb = bilinear_texel(&image.texels, uv).map(|v| v.max(0.0));
                rgb_lanes(rgb, image.color_space, SpectrumUse::Illuminant, w) * scale
            }
        }
    }
}

/// The picture at `uv`, v pointing up, interpolated between texels; the edge goes on beyond it.
fn bilinear_texel(t: &steradian_image::Texels, uv: Point2) -> [f32; 3] {
    let split = |u: f32, n: usize| {
        let x = u * n as f32 - 0.5;
        let x0 = x.floor();
        let cell = |x: f32| x.clamp(0.0, (n - 1) as f32) as usize;
        (cell(x0), cell(x0 + 1.0), x - x0)
    };
    let (x0, x1, fx) = split(uv.x, t.width());
    let (y0, y1, fy) = split(1.0 - uv.y, t.height());
    std::array::from_fn(|c| {
        let c = if t.channels() < 3 { 0 } else { c };
        let row = |y| (1.0 - fx) * t.texel(x0, y, c) + fx * t.texel(x1, y, c);
        (1.0 - fy) * row(y0) + fy * row(y1)
    })
}
