//! All lights of the world under one numbering: which one to sample, where on it, and with what density.
//!
//! Densities returned here include the probability of picking the light. Delta lights (points, spots, distant lights)
//! report the probability alone.

mod bounds;
mod cone;
mod distant;
mod emission;
mod emitter;
mod environment;
mod far;
mod goniometric;
mod lamp_points;
mod lat_long;
mod moving;
mod point;
mod portal;
mod projection;
mod selection;
mod side_by_side;
mod sky_rows;
mod spot;
mod sun;
mod tree;
mod uniform;

pub use emission::{Emission, LightEnd};
pub use emitter::{Emitter, EmitterShape};
pub(crate) use goniometric::mean_intensity;
pub use lamp_points::LightPoint;
pub(crate) use projection::projected_luminance;
pub use sky_rows::SkyRows;
pub(in crate::world) use tree::PickRows;

use super::texture::{MeshPoint, TextureContext, rgb_lanes};
use super::{Surface, World};
use crate::{Handle, LightGroup, SpectrumInput};
use far::brightness;
use moving::MovingFar;
use selection::Selection;
use steradian_geometry::Reference;
use steradian_math::{Bounds3, Frame, Normal3, PI, Point2, Point3, Ray, Vec3};
use steradian_spectrum::{Lanes, SpectrumUse, Wavelengths};

/// The point that light is sampled for.
#[derive(Clone, Copy, Debug)]
pub struct LightContext {
    reference: Reference,
    /// When: lights may move.
    time: f32,
    /// Whether lights are found by the lobe as well, and both ways weighted against each other.
    beside_lobes: bool,
}

impl LightContext {
    /// A point of a surface with its shading frame.
    #[inline]
    pub fn of_surface(surface: &Surface, frame: &Frame) -> Self {
        Self {
            reference: Reference { p: surface.p, p_error: surface.p_error, n: surface.n, ns: frame.normal() },
            time: surface.time,
            beside_lobes: false,
        }
    }

    /// Any point at a time.
    #[inline]
    pub(in crate::world) fn of_reference(reference: Reference, time: f32) -> Self {
        Self { reference, time, beside_lobes: false }
    }

    /// Its position.
    #[inline]
    pub(in crate::world) fn position(&self) -> Point3 {
        self.reference.p
    }

    /// The same point for a caller that finds lights by its lobe as well, and weights both: directions in which lobes do as well are
    /// then left to them. Densities of light sampling are null there.
    #[inline]
    #[must_use]
    pub fn beside_lobes(self) -> Self {
        Self { beside_lobes: true, ..self }
    }

    /// A point in a medium at a time.
    pub fn of_point(p: Point3, time: f32) -> Self {
        Self { reference: Reference::point(p), time, beside_lobes: false }
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
    /// The light's end of a path that goes this way.
    pub light_end: LightEnd,
    /// Density per solid angle, times the probability of the light; the probability alone for delta lights.
    pub pdf: f32,
    /// Whether the light cannot be hit by chance.
    pub is_delta: bool,
}

/// All lights. Numbers below `emitters.len()` are surfaces, the rest are the others in order.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    pub(crate) emitters: Vec<Emitter>,
    far: Vec<MovingFar>,
    infinite: Vec<u32>,
    selection: Selection,
    /// Around all that have a place.
    lamps: Bounds3,
    /// One point for each lamp, for algorithms that know points only.
    points: Vec<LightPoint>,
    emission: emission::EmissionTables,
}

impl Lights {
    /// Builds the tables for `emitters` and the scene's other lights.
    pub(crate) fn build(world: &World, emitters: Vec<Emitter>, bounds: &Bounds3) -> Self {
        let scene = &world.scene;
        let far: Vec<MovingFar> = scene.lights.iter().map(|light| MovingFar::new(light, &scene.images)).collect();
        let first = emitters.len() as u32;
        let infinite = (0..far.len()).filter(|&i| !far[i].is_delta()).map(|i| first + i as u32).collect();
        let mut lights = Self { emitters, far, infinite, ..Self::default() };
        lights.points = lights.light_points(world);
        let on_shapes = lights.emitters.iter().map(|e| world.emitter_bounds(e));
        let others = lights.far.iter().filter_map(|far| Some(far.bounds(1.0)?.bounds));
        lights.lamps = on_shapes.chain(others).fold(Bounds3::EMPTY, |all, b| all.union(b));
        lights.selection = lights.select(world, scene.settings.integrator.light_selection, bounds);
        lights
    }

    fn len(&self) -> usize {
        self.emitters.len() + self.far.len()
    }

    /// Emitted power in common, photometric units: only to choose among lights.
    fn power(&self, world: &World, id: u32, scene_radius: f32) -> f32 {
        if let Some(e) = self.emitters.get(id as usize) {
            let light = &world.area_lights[e.emission as usize];
            let l = match (e.brightness, light.image) {
                (Some(brightness), _) => brightness,
                (None, None) => brightness(&light.radiance),
                (None, Some(image)) => {
                    let image = &world.scene.images[image];
                    image.mean_luminance() * image.color_space.photometric()
                }
            };
            return l * e.scale * world.emitter_area(e) * PI * if light.two_sided { 2.0 } else { 1.0 };
        }
        self.far[id as usize - self.emitters.len()].power(&world.scene.images, scene_radius)
    }
}

impl World {
    /// Prepares what paths that start at lights need, once everything else is there.
    pub(crate) fn prepare_emission(&mut self) {
        self.lights.emission = emission::EmissionTables::build(self);
    }

    /// The numbers of the lights that shine from infinitely far.
    #[inline]
    pub fn infinite_lights(&self) -> &[u32] {
        &self.lights.infinite
    }

    /// Whether a lamp may be nearer to a point than `radius`.
    #[inline]
    pub fn has_lamps_near(&self, p: Point3, radius: f32) -> bool {
        let (low, high) = (self.lights.lamps.min, self.lights.lamps.max);
        let beside = |k: usize| (low[k] - p[k]).max(p[k] - high[k]).max(0.0);
        Vec3::new(beside(0), beside(1), beside(2)).length_squared() < radius * radius
    }

    /// Whether a light that is not a surface moves.
    pub(in crate::world) fn far_lights_move(scene: &crate::Scene) -> bool {
        let moves = |l: &crate::Light| matches!(l, crate::Light::Moving { world_from_light, .. } if world_from_light.is_animated());
        scene.lights.iter().any(moves)
    }

    /// The group of a light.
    pub fn light_group(&self, light: u32) -> Option<Handle<LightGroup>> {
        match self.lights.emitters.get(light as usize) {
            Some(emitter) => self.area_lights[emitter.emission as usize].group,
            None => *self.scene.groups_of_lights.get((light as usize).checked_sub(self.lights.emitters.len())?)?,
        }
    }

    /// How many lights there are.
    pub fn light_count(&self) -> usize {
        self.lights.len()
    }

    /// Samples the light that arrives at a point: `u2` picks the light and a point on it, `u` gives finer detail where there are many lights.
    ///
    /// `None` when the sample carries no light. Visibility is not tested.
    #[inline]
    pub fn sample_light(&self, context: &LightContext, u: f32, u2: [f32; 2], w: &Wavelengths) -> Option<LightSample> {
        // One number both picks and places, so that points are stratified over all that a lamp is made of; `u` fills the last bits.
        let pick = self.pick_light(context, u2[0])?;
        let x = pick.u + u * (0.5 * f32::EPSILON) / pick.probability;
        self.sample_picked(context, pick.light, pick.probability, [x.min(steradian_math::ONE_MINUS_EPSILON), u2[1]], w)
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
    pub(in crate::world) fn sample_picked(
        &self,
        context: &LightContext,
        light: u32,
        probability: f32,
        u2: [f32; 2],
        w: &Wavelengths,
    ) -> Option<LightSample> {
        let from = &context.reference;
        if let Some(emitter) = self.lights.emitters.get(light as usize) {
            let s = self.sample_emitter(emitter, (from, context.time), u2)?;
            let d = s.p - from.p;
            let distance = d.length();
            let wi = d * (1.0 / distance);
            let on_mesh = match emitter.shape {
                EmitterShape::Triangle(mesh, face) => {
                    Some(MeshPoint { mesh: mesh.index() as u32, face, b: [s.uv.x, s.uv.y] })
                }
                _ => None,
            };
            let mut radiance = self.area_radiance(emitter.emission, emitter.scale, s.n, (s.uv, on_mesh), -wi, w);
            if emitter.alpha.is_some() {
                radiance *= self.emitter_presence(emitter, &s);
            }
            if radiance.is_black() {
                return None;
            }
            let end = steradian_math::offset_ray_origin(s.p, s.p_error, s.n, -wi);
            let light_end = LightEnd::sampled(light, &s, context.time);
            let pdf = s.pdf * probability;
            return Some(LightSample { light, radiance, wi, distance, end, light_end, pdf, is_delta: false });
        }
        let far = &self.lights.far[light as usize - self.lights.emitters.len()];
        let s = far.sample(&self.scene.images, (from.p, context.time), context.beside_lobes, u2, w)?;
        Some(LightSample {
            light,
            radiance: s.radiance,
            wi: s.wi,
            distance: s.distance,
            end: s.end,
            light_end: LightEnd::without_surface(light, s.end, context.time),
            pdf: s.pdf * probability,
            is_delta: far.is_delta(),
        })
    }

    /// The density per solid angle, probability of the light included, with which `sample_light` gives direction `wi`.
    /// `hit` is the point on the light where the direction meets it, for lights that are surfaces.
    #[inline]
    pub fn light_pdf(&self, context: &LightContext, light: u32, wi: Vec3, hit: Option<&Surface>) -> f32 {
        let from = &context.reference;
        let probability = self.pick_probability(context, light);
        if probability == 0.0 {
            return 0.0;
        }
        let pdf = match (self.lights.emitters.get(light as usize), hit) {
            (Some(emitter), Some(hit)) => self.emitter_pdf(emitter, (from, context.time), hit),
            (Some(_), None) => 0.0,
            (None, _) => {
                let far = &self.lights.far[light as usize - self.lights.emitters.len()];
                far.pdf((from.p, context.time), context.beside_lobes, wi)
            }
        };
        pdf * probability
    }

    /// Radiance of an infinite light against a ray that leaves the scene. Seen through a portal it depends on the ray's
    /// origin, too.
    #[inline]
    pub fn environment(&self, light: u32, ray: &Ray, w: &Wavelengths) -> Lanes {
        self.lights.far[light as usize - self.lights.emitters.len()].radiance(&self.scene.images, ray, w)
    }

    /// Radiance that the surface emits back along the ray that hit it.
    #[inline]
    pub fn emitted(&self, surface: &Surface, w: &Wavelengths) -> Lanes {
        match surface.emission {
            None => Lanes::ZERO,
            Some((emission, scale)) => {
                let place = (surface.uv, self.mesh_point(surface));
                self.area_radiance(emission, scale, surface.n, place, surface.wo, w)
            }
        }
    }

    #[inline]
    fn area_radiance(
        &self,
        emission: u32,
        scale: f32,
        n: Normal3,
        (uv, on_mesh): (Point2, Option<MeshPoint>),
        wo: Vec3,
        w: &Wavelengths,
    ) -> Lanes {
        let light = &self.area_lights[emission as usize];
        if !light.two_sided && n.dot(wo) <= 0.0 {
            return Lanes::ZERO;
        }
        if let (Some(texture), Some(m)) = (light.texture, on_mesh) {
            return self.mesh_emission(texture, m, w) * scale;
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

impl World {
    /// What a texture emits at a point of a mesh.
    pub(super) fn mesh_emission(&self, texture: SpectrumInput, m: MeshPoint, w: &Wavelengths) -> Lanes {
        let mesh = &self.scene.triangle_meshes[Handle::from_index(m.mesh as usize)];
        let uv = mesh.uv(m.face as usize, m.b[0], m.b[1]);
        let context = TextureContext { uv, on_mesh: Some(m), ..TextureContext::default() };
        let radiance = self.spectrum_texture(texture, &context, w);
        if self.scene.spectrum_textures[texture].usage == SpectrumUse::Illuminant {
            return radiance;
        }
        // A slide before an even lamp.
        let photometric = steradian_spectrum::ColorSpace::Srgb.photometric();
        radiance * if w.is_rgb() { photometric } else { photometric / steradian_spectrum::CIE_Y }
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
