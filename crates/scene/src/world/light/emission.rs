//! Light on its way out: rays that leave lights in proportion to what they carry, and the densities of that (Veach 1997,
//! 8.3; PBRT 4th ed., 12.1 and 16.1 of the 3rd).
//!
//! A ray has two densities. With a place (surfaces, points): that of the place per area, one for a point, and of the
//! direction per solid angle. Infinitely far: that of the direction per solid angle, one for a distant light, and of the ray
//! per area perpendicular to it. So in both cases the first is that of the light's end of a path, the second leads to
//! the next vertex.

use super::emitter::{Emitter, EmitterShape};
use crate::world::texture::MeshPoint;
use crate::world::{Surface, World};
use crate::{Handle, Medium};
use steradian_geometry::{Reference, ShapeSample};
use steradian_math::{Frame, INV_PI, Normal3, ONE_MINUS_EPSILON, Point3, Ray, Vec3, offset_ray_origin};
use steradian_sampling::AliasTable;
use steradian_sampling::warp::{square_to_cosine_hemisphere, square_to_uniform_disk_concentric};
use steradian_spectrum::{Lanes, Wavelengths};

/// The light's end of a path: what its densities are asked for by.
#[derive(Clone, Copy, Debug)]
pub struct LightEnd {
    /// Which light.
    pub light: u32,
    /// Where; meaningless if infinitely far.
    pub p: Point3,
    /// Unit normal on the side that counts as outside; null unless the light is a surface.
    pub n: Normal3,
    /// When.
    pub time: f32,
    /// Parametric coordinates on a patch.
    coordinates: [f32; 2],
}

impl LightEnd {
    /// A sampled point of a surface. Its coordinates on a patch are not known.
    pub(super) fn sampled(light: u32, s: &ShapeSample, time: f32) -> Self {
        Self { light, p: s.p, n: s.n, time, coordinates: [0.5; 2] }
    }

    /// A light that is no surface.
    pub(super) fn without_surface(light: u32, p: Point3, time: f32) -> Self {
        Self { light, p, n: Normal3::default(), time, coordinates: [0.5; 2] }
    }
}

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Where it starts.
    pub end: LightEnd,
    /// The ray, of unit direction; of a light that is infinitely far, from outside everything.
    pub ray: Ray,
    /// Radiance and cosine over the densities: the flux that the ray stands for.
    pub flux: Lanes,
    /// Density of the light's end; the probability of choosing the light included.
    pub pdf_end: f32,
    /// Density of the ray given its end.
    pub pdf_ray: f32,
    /// Whether the light is infinitely far.
    pub is_infinite: bool,
}

/// What a light that is not a surface emits.
#[derive(Clone, Copy, Debug)]
pub(super) struct FarEmission {
    pub o: Point3,
    pub d: Vec3,
    /// Intensity, or radiance; irradiance of a distant light.
    pub value: Lanes,
    pub pdf_end: f32,
    pub pdf_ray: f32,
}

/// The ball that everything finite lies in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    pub centre: Point3,
    pub radius: f32,
}

impl Ball {
    /// The origin of a ray in direction `d` through a uniform point of the disk across the ball.
    pub fn origin(&self, d: Vec3, u: [f32; 2]) -> Point3 {
        let [x, y] = square_to_uniform_disk_concentric(u).map(|v| v * self.radius);
        let frame = Frame::from_z(d);
        self.centre + frame.x * x + frame.y * y - d * self.radius
    }

    /// The density of that per area of the disk.
    pub fn pdf(&self) -> f32 {
        INV_PI / (self.radius * self.radius)
    }
}

/// What emission needs besides the lights themselves; empty unless the integrator asks for emission.
#[derive(Clone, Debug, Default)]
pub(super) struct EmissionTables {
    by_power: Option<AliasTable>,
    /// The medium around each light, front and back; empty if there are no media.
    media: Vec<[Option<Handle<Medium>>; 2]>,
    ball: Option<Ball>,
}

impl EmissionTables {
    /// Tables over all lights of a world that is otherwise complete.
    pub fn build(world: &World) -> Self {
        let (centre, radius) = world.bounds.bounding_sphere();
        let ball = (radius > 0.0 && radius.is_finite()).then_some(Ball { centre, radius });
        let lights = &world.lights;
        let weights: Vec<f32> = (0..lights.len() as u32)
            .map(|id| {
                // Nothing gets through endless space that is full of something.
                let lost = world.is_infinite_light(id) && (ball.is_none() || world.outer_medium().is_some());
                if lost { 0.0 } else { lights.power(world, id, radius.max(0.0)).max(0.0) }
            })
            .collect();
        let any = weights.iter().any(|&w| w > 0.0);
        let media = if world.has_media() {
            (0..lights.len() as u32).map(|id| world.media_around_light(id)).collect()
        } else {
            Vec::new()
        };
        Self { by_power: AliasTable::new(&weights).filter(|_| any), media, ball }
    }
}

impl World {
    /// Whether a light is infinitely far; distant lights are.
    #[inline]
    pub fn is_infinite_light(&self, light: u32) -> bool {
        let far = (light as usize).checked_sub(self.lights.emitters.len());
        far.is_some_and(|i| self.lights.far[i].is_infinite())
    }

    /// A ray from a light chosen by power: one number picks the light, two pairs the place and the direction. `None` where
    /// nothing is emitted.
    ///
    /// Only worlds whose integrator starts paths at lights can answer.
    pub fn sample_emission(
        &self,
        u: f32,
        u_place: [f32; 2],
        u_direction: [f32; 2],
        time: f32,
        w: &Wavelengths,
    ) -> Option<Emission> {
        let picked = self.lights.emission.by_power.as_ref()?.sample(u);
        self.sample_emission_of(picked.index as u32, picked.probability, u_place, u_direction, time, w)
    }

    /// As [`World::sample_emission`], of one light that was picked with the given probability.
    pub fn sample_emission_of(
        &self,
        light: u32,
        probability: f32,
        u_place: [f32; 2],
        u_direction: [f32; 2],
        time: f32,
        w: &Wavelengths,
    ) -> Option<Emission> {
        if let Some(emitter) = self.lights.emitters.get(light as usize) {
            return self.emit_from_surface(light, emitter, probability, u_place, u_direction, time, w);
        }
        let far = &self.lights.far[light as usize - self.lights.emitters.len()];
        let ball = self.lights.emission.ball.unwrap_or(Ball { centre: Point3::default(), radius: 1.0 });
        let e = far.emit(&self.scene.images, (&ball, time), u_place, u_direction, w)?;
        let density = e.pdf_end * e.pdf_ray;
        let flux = e.value * (1.0 / (density * probability));
        let valid = density > 0.0 && flux.is_finite() && !flux.is_black();
        valid.then(|| Emission {
            end: LightEnd::without_surface(light, e.o, time),
            ray: Ray::new(e.o, e.d, time),
            flux,
            pdf_end: e.pdf_end * probability,
            pdf_ray: e.pdf_ray,
            is_infinite: far.is_infinite(),
        })
    }

    #[expect(clippy::too_many_arguments, reason = "random numbers and what they are for")]
    fn emit_from_surface(
        &self,
        light: u32,
        emitter: &Emitter,
        probability: f32,
        u_place: [f32; 2],
        [mut ux, uy]: [f32; 2],
        time: f32,
        w: &Wavelengths,
    ) -> Option<Emission> {
        let s = self.sample_emitter_area(emitter, time, u_place)?;
        let coordinates = match emitter.shape {
            EmitterShape::Patch(mesh, face) => {
                let own = self.scene.bilinear_meshes[mesh].patch(face as usize).sample_area(u_place)?;
                [own.uv.x, own.uv.y]
            }
            _ => [0.0; 2],
        };
        let two_sided = self.area_lights[emitter.emission as usize].two_sided;
        let mut side = 1.0;
        if two_sided {
            side = if ux < 0.5 { 1.0 } else { -1.0 };
            ux = (2.0 * ux - if ux < 0.5 { 0.0 } else { 1.0 }).min(ONE_MINUS_EPSILON);
        }
        let local = square_to_cosine_hemisphere([ux, uy]);
        let d = Frame::from_z(s.n).from_local(Vec3::new(local.x, local.y, local.z * side));
        let pdf_ray = local.z * INV_PI * if two_sided { 0.5 } else { 1.0 };
        let on_mesh = match emitter.shape {
            EmitterShape::Triangle(mesh, face) if self.area_lights[emitter.emission as usize].texture.is_some() => {
                let own = self.scene.triangle_meshes[mesh].triangle(face as usize).sample_area(u_place)?;
                Some(MeshPoint { mesh: mesh.index() as u32, face, b: [own.uv.x, own.uv.y] })
            }
            _ => None,
        };
        let mut radiance = self.area_radiance(emitter.emission, emitter.scale, s.n, (s.uv, on_mesh), d, w);
        if emitter.alpha.is_some() {
            radiance *= self.emitter_presence(emitter, &s);
        }
        let flux = radiance * (local.z / (s.pdf * pdf_ray * probability));
        let per_area = match emitter.shape {
            EmitterShape::Patch(..) => self.emitter_pdf_area(emitter, time, s.n),
            _ => s.pdf,
        };
        let valid = pdf_ray > 0.0 && flux.is_finite() && !flux.is_black();
        valid.then(|| Emission {
            end: LightEnd { light, p: s.p, n: s.n, time, coordinates },
            ray: Ray::new(offset_ray_origin(s.p, s.p_error, s.n, d), d, time),
            flux,
            pdf_end: per_area * probability,
            pdf_ray,
            is_infinite: false,
        })
    }

    /// The light's end that a surface which was hit by chance is. `None` if [`World::sample_emission`] could not have
    /// started there.
    pub fn light_end(&self, surface: &Surface) -> Option<LightEnd> {
        let light = surface.light?;
        let Surface { coordinates, time, .. } = *surface;
        Some(LightEnd { light, p: surface.p, n: surface.n, time, coordinates })
    }

    /// The light's end of a path that leaves the scene to an infinite light.
    pub fn infinite_end(&self, light: u32, time: f32) -> LightEnd {
        LightEnd::without_surface(light, Point3::default(), time)
    }

    /// The densities of [`World::sample_emission`] for a ray from a light's end in the unit direction `d`: of the end, and of
    /// the ray given the end. Points of a bent patch count as uniform, here and in [`Emission::pdf_end`], though not all
    /// are quite as likely: for weights it matters only that everybody takes the same.
    pub fn emission_pdf(&self, end: &LightEnd, d: Vec3) -> [f32; 2] {
        let Some(table) = &self.lights.emission.by_power else { return [0.0; 2] };
        let probability = table.probability(end.light as usize);
        if probability == 0.0 {
            return [0.0; 2];
        }
        let Some(emitter) = self.lights.emitters.get(end.light as usize) else {
            let far = &self.lights.far[end.light as usize - self.lights.emitters.len()];
            let Some(ball) = &self.lights.emission.ball else { return [0.0; 2] };
            let [pdf_end, pdf_ray] = far.emission_pdf(ball, d, end.time);
            return [pdf_end * probability, pdf_ray];
        };
        let per_area = self.emitter_pdf_area(emitter, end.time, end.n);
        let cos = end.n.dot(d);
        let pdf_ray = match self.area_lights[emitter.emission as usize].two_sided {
            true => 0.5 * INV_PI * cos.abs(),
            false => INV_PI * cos.max(0.0),
        };
        [if per_area.is_finite() { per_area * probability } else { 0.0 }, pdf_ray]
    }

    /// The density with which [`World::sample_light`](Self::sample_light) for the point `context` gives a light's end in
    /// the direction `wi`: as [`World::light_pdf`](Self::light_pdf), for an end that no ray has hit.
    pub fn light_end_pdf(&self, context: &super::LightContext, end: &LightEnd, wi: Vec3) -> f32 {
        let from: &Reference = &context.reference;
        let probability = self.pick_probability(context, end.light);
        let Some(emitter) = self.lights.emitters.get(end.light as usize) else {
            let far = &self.lights.far[end.light as usize - self.lights.emitters.len()];
            return if far.is_delta() { probability } else { probability * far.pdf((from.p, context.time), false, wi) };
        };
        probability * self.emitter_pdf_at(emitter, (from, context.time), end.p, end.n, end.coordinates)
    }

    /// The medium that a ray in direction `d` from a light's end sets out in.
    pub fn medium_of_light(&self, end: &LightEnd, d: Vec3) -> Option<Handle<Medium>> {
        let [front, back] = *self.lights.emission.media.get(end.light as usize)?;
        if self.is_moving_point(end.light) {
            return self.medium_around(&Ray::new(end.p, d, end.time));
        }
        if end.n.dot(d) < 0.0 { back } else { front }
    }

    /// Whether the light is a point that moves, perhaps out of one medium and into another. A lamp that moves has on its sides what it
    /// sets out with.
    fn is_moving_point(&self, light: u32) -> bool {
        let far = (light as usize).checked_sub(self.lights.emitters.len());
        far.is_some_and(|i| self.lights.far[i].is_animated() && !self.lights.far[i].is_infinite())
    }

    fn media_around_light(&self, light: u32) -> [Option<Handle<Medium>>; 2] {
        if self.is_infinite_light(light) {
            return [self.outer_medium(); 2];
        }
        let time = self.scene.camera.shutter[0];
        match self.lights.emitters.get(light as usize) {
            Some(emitter) => match self.sample_emitter_area(emitter, time, [0.4, 0.4]) {
                Some(s) => [s.n.to_vec(), -s.n.to_vec()].map(|d| {
                    let o = offset_ray_origin(s.p, s.p_error, s.n, d);
                    self.medium_around(&Ray::new(o, d, time))
                }),
                None => [None; 2],
            },
            None => {
                let far = &self.lights.far[light as usize - self.lights.emitters.len()];
                let p = far.position(time).unwrap_or_default();
                [self.medium_around(&Ray::new(p, Vec3::new(0.48, 0.6, 0.64), time)); 2]
            }
        }
    }
}

/// The density on world directions of a density on a light's own directions, where `light_from_world` is not rigid.
pub(super) fn stretch(light_from_world: &steradian_math::Transform, d: Vec3) -> f32 {
    let l = light_from_world.vector(d).length();
    light_from_world.determinant3().abs() / (l * l * l)
}

/// The emission of a light that shines from infinitely far in directions `-to_light`, through the ball.
pub(super) fn from_infinity(ball: &Ball, to_light: Vec3, value: Lanes, pdf: f32, u: [f32; 2]) -> FarEmission {
    FarEmission { o: ball.origin(-to_light, u), d: -to_light, value, pdf_end: pdf, pdf_ray: ball.pdf() }
}

/// The emission of a point.
pub(super) fn from_point(o: Point3, d: Vec3, value: Lanes, pdf_ray: f32) -> FarEmission {
    FarEmission { o, d, value, pdf_end: 1.0, pdf_ray }
}
