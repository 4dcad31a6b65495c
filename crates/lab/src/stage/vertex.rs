//! The first point that a camera ray meets, and estimates of the light that it reflects: one sample of a light, of the
//! lobe, or of the hemisphere at a time.

use super::Rgb;
use steradian_bsdf::{Bsdf, Lobe, LobeSample, Lobes, TransportMode};
use steradian_math::{Frame, Point2, Ray, Vec3};
use steradian_sampling::warp::{square_to_uniform_hemisphere, square_to_uniform_hemisphere_pdf};
use steradian_sampling::{Sampler, balance_heuristic, power_heuristic};
use steradian_scene::{CameraSample, LightContext, Surface, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// How two techniques share one integral.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weights {
    /// Each technique counts alone.
    None,
    /// Balance heuristic.
    Balance,
    /// Power heuristic.
    Power,
}

impl Weights {
    fn of(self, pdf: f32, other: f32) -> f32 {
        match self {
            Self::None => 1.0,
            Self::Balance => balance_heuristic(1.0, pdf, 1.0, other),
            Self::Power => power_heuristic(1.0, pdf, 1.0, other),
        }
    }
}

/// Where a ray ended.
pub enum Vertex<'w> {
    /// Nothing there but sky of this radiance.
    Sky(Rgb),
    /// A surface.
    Surface(Box<Point<'w>>),
}

/// A point of a surface with its lobe.
pub struct Point<'w> {
    world: &'w World,
    /// The point.
    pub surface: Surface,
    /// Shading frame.
    pub frame: Frame,
    /// Lobe.
    pub bsdf: Bsdf<'w>,
    /// Towards the viewer, local.
    pub wo: Vec3,
    /// Emitted towards the viewer.
    pub emitted: Rgb,
}

impl<'w> Vertex<'w> {
    /// Follows a ray to the next surface.
    pub fn trace(world: &'w World, ray: &Ray) -> Self {
        let mut w = Wavelengths::rgb();
        let Some(hit) = world.intersect(ray) else { return Self::Sky(sky(world, ray, &w)) };
        let mut surface = world.surface(ray, &hit);
        let emitted = rgb(world.emitted(&surface, &w));
        match world.shading(&mut surface, ray, None, &mut w) {
            Some(s) => Self::Surface(Box::new(Point {
                world,
                wo: s.frame.to_local(surface.wo),
                surface,
                frame: s.frame,
                bsdf: s.bsdf,
                emitted,
            })),
            None => Self::Sky(emitted),
        }
    }

    /// The vertex behind a film position, with lens point and time from the sampler if the world has any use for them.
    pub fn at(world: &'w World, film: Point2, sampler: &mut Sampler) -> Self {
        let lens = if world.camera().has_lens() { sampler.next_2d() } else { [0.5; 2] };
        let time = if world.has_motion() { sampler.next_1d() } else { 0.5 };
        Self::trace(world, &world.camera_ray(&CameraSample { film, lens, time }).ray)
    }

    /// The vertex behind a random place of the pixel at which the sampler stands.
    pub fn of_pixel(world: &'w World, pixel: [u32; 2], sampler: &mut Sampler) -> Self {
        let u = sampler.pixel_2d();
        Self::at(world, Point2::new(pixel[0] as f32 + u[0], pixel[1] as f32 + u[1]), sampler)
    }

    /// Emission or sky.
    pub fn emitted(&self) -> Rgb {
        match self {
            Self::Sky(c) => *c,
            Self::Surface(p) => p.emitted,
        }
    }
}

impl Point<'_> {
    /// One sample of a light: reflected radiance from it. `u` picks the light, `u2` the point on it.
    pub fn light(&self, u: f32, u2: [f32; 2], weights: Weights) -> Rgb {
        let w = Wavelengths::rgb();
        let context = LightContext::of_surface(&self.surface, &self.frame);
        let Some(s) = self.world.sample_light(&context, u, u2, &w) else { return [0.0; 3] };
        let (f, p) = self.bsdf.eval_and_pdf(self.wo, self.frame.to_local(s.wi), TransportMode::Radiance);
        let value = f * s.radiance;
        if value.is_black() || self.world.occluded(&self.surface.shadow_ray(&s)) {
            return [0.0; 3];
        }
        let weight = if s.is_delta { 1.0 } else { weights.of(s.pdf, p) };
        rgb(value * (weight / s.pdf))
    }

    /// One sample of the lobe: reflected emission of what it meets.
    pub fn lobe(&self, u: f32, u2: [f32; 2], weights: Weights) -> Rgb {
        let Some(s) = self.bsdf.sample(self.wo, u, u2, TransportMode::Radiance) else { return [0.0; 3] };
        let specular = s.flags.contains(Lobes::SPECULAR);
        self.towards(self.frame.from_local(s.wi), s.weight, s.pdf, if specular { Weights::None } else { weights })
    }

    /// One direction from the whole hemisphere at random.
    pub fn uniform(&self, u2: [f32; 2]) -> Rgb {
        let local = square_to_uniform_hemisphere(u2);
        let pdf = square_to_uniform_hemisphere_pdf(local);
        let f = self.bsdf.eval_cos(self.wo, local, TransportMode::Radiance);
        if f.is_black() {
            return [0.0; 3];
        }
        self.towards(self.frame.from_local(local), f * (1.0 / pdf), pdf, Weights::None)
    }

    /// The mirror-like approximation: all of the lobe's light in the one direction of ideal reflection or, for a lobe that
    /// transmits, of ideal refraction with the given relative index.
    pub fn ideal(&self, refraction: Option<f32>) -> Rgb {
        let wo = self.wo;
        let wi = match refraction {
            None => Some(Vec3::new(-wo.x, -wo.y, wo.z)),
            Some(eta) => {
                // Snell's law for light that comes from the side of wo, where the index is 1 or eta.
                let ratio = if wo.z > 0.0 { 1.0 / eta } else { eta };
                let cos2 = 1.0 - ratio * ratio * (1.0 - wo.z * wo.z);
                (cos2 > 0.0).then(|| Vec3::new(-wo.x * ratio, -wo.y * ratio, -cos2.sqrt().copysign(wo.z)))
            }
        };
        let Some(wi) = wi else { return [0.0; 3] };
        self.towards(self.frame.from_local(wi), self.bsdf.albedo(wo), 1.0, Weights::None)
    }

    /// A sample of the lobe, to go on with.
    pub fn sample(&self, u: f32, u2: [f32; 2]) -> Option<LobeSample> {
        self.bsdf.sample(self.wo, u, u2, TransportMode::Radiance)
    }

    /// The ray that leaves in a local direction.
    pub fn spawn(&self, local: Vec3) -> Ray {
        self.surface.spawn_ray(self.frame.from_local(local))
    }

    fn towards(&self, d: Vec3, throughput: Lanes, pdf: f32, weights: Weights) -> Rgb {
        let w = Wavelengths::rgb();
        let ray = self.surface.spawn_ray(d);
        let context = LightContext::of_surface(&self.surface, &self.frame);
        let Some(hit) = self.world.intersect(&ray) else {
            let total = self.world.infinite_lights().iter().fold(Lanes::ZERO, |sum, &light| {
                let other = if weights == Weights::None { 0.0 } else { self.world.light_pdf(&context, light, d, None) };
                sum + self.world.environment(light, &ray, &w) * weights.of(pdf, other)
            });
            return rgb(throughput * total);
        };
        let surface = self.world.surface(&ray, &hit);
        let emitted = self.world.emitted(&surface, &w);
        if emitted.is_black() {
            return [0.0; 3];
        }
        let other = match surface.light {
            Some(light) if weights != Weights::None => self.world.light_pdf(&context, light, d, Some(&surface)),
            _ => 0.0,
        };
        rgb(throughput * emitted * weights.of(pdf, other))
    }
}

fn sky(world: &World, ray: &Ray, w: &Wavelengths) -> Rgb {
    rgb(world.infinite_lights().iter().fold(Lanes::ZERO, |sum, &light| sum + world.environment(light, ray, w)))
}

/// The three lanes that mean something in RGB mode.
pub fn rgb(l: Lanes) -> Rgb {
    [l.0[0], l.0[1], l.0[2]]
}

/// The sum of two colours.
pub fn add(a: Rgb, b: Rgb) -> Rgb {
    std::array::from_fn(|i| a[i] + b[i])
}

/// A colour times a number.
pub fn scaled(a: Rgb, s: f32) -> Rgb {
    a.map(|v| v * s)
}
