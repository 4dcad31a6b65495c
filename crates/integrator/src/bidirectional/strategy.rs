//! What each strategy finds: light that the camera path runs into, light that is sampled, the two paths connected, the
//! light path connected to the camera.

use super::subpath::Setting;
use super::transmittance::transmittance;
use super::vertex::{Kind, Vertex};
use super::weight::{Connection, weight};
use crate::numbers::{Domain, Numbers};
use crate::record::Record;
use crate::splat::Splat;
use steradian_bsdf::TransportMode;
use steradian_math::{Ray, Vec3};
use steradian_scene::{CameraSample, LightEnd};
use steradian_spectrum::{Lanes, Wavelengths};

/// A find, before and after weighting.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub value: Lanes,
    pub weight: f32,
}

impl Found {
    fn new(value: Lanes, weight: f32) -> Option<Self> {
        (!value.is_black()).then_some(Self { value, weight })
    }
}

/// The densities of a light's end from its neighbour's side, where that sees it in direction `wi` at a distance.
struct Seen {
    is_infinite: bool,
    end: LightEnd,
    wi: Vec3,
    distance2: f32,
}

impl Seen {
    /// From density per solid angle at the neighbour to the measure of the light's end.
    fn at_end(&self, pdf: f32, is_delta: bool) -> f32 {
        if self.is_infinite || is_delta { pdf } else { pdf * self.end.n.abs_dot(self.wi) / self.distance2 }
    }
}

impl<'w> Setting<'w> {
    /// Light that the last vertex of a camera path emits: no vertex from the light. One find for each light.
    pub fn hit(&self, camera: &[Vertex<'w>], w: &Wavelengths, mut found: impl FnMut(Found)) {
        let [.., before, last] = camera else { return };
        let scale = 1.0 / self.hero.average(last.ratios, w);
        match &last.kind {
            Kind::Escaped => {
                let ray = Ray::new(last.p, -last.wo, last.time);
                for &light in self.world.infinite_lights() {
                    let emitted = self.world.environment(light, &ray, w);
                    let end = self.world.infinite_end(light, last.time);
                    let seen = Seen { is_infinite: true, end, wi: ray.d, distance2: 1.0 };
                    let connection = || self.hit_connection(before, &seen);
                    let value = last.beta * emitted * scale;
                    if let Some(f) = self.weighted(value, &[], camera, connection) {
                        found(f);
                    }
                }
            }
            Kind::Surface { surface, .. } if surface.is_emitter() => {
                let emitted = self.world.emitted(surface, w);
                let connection = || match self.world.light_end(surface) {
                    Some(end) => {
                        let distance2 = last.p.distance_squared(before.p);
                        self.hit_connection(before, &Seen { is_infinite: false, end, wi: -last.wo, distance2 })
                    }
                    None => Connection::default(),
                };
                let value = last.beta * emitted * scale;
                if let Some(f) = self.weighted(value, &[], camera, connection) {
                    found(f);
                }
            }
            _ => {}
        }
    }

    fn hit_connection(&self, before: &Vertex<'w>, seen: &Seen) -> Connection {
        let direct = self.world.light_end_pdf(&before.light_context(), &seen.end, seen.wi);
        let [pdf_end, pdf_ray] = self.world.emission_pdf(&seen.end, -seen.wi);
        Connection {
            light_end: [seen.at_end(direct, false), pdf_end],
            camera_reverse: [0.0, self.leads_to(before, pdf_ray, seen)],
            ..Connection::default()
        }
    }

    /// The density with which emission leads from a light's end to its neighbour.
    fn leads_to(&self, to: &Vertex<'w>, pdf_ray: f32, seen: &Seen) -> f32 {
        if seen.is_infinite { to.crossing(pdf_ray, seen.wi) } else { to.area_density(pdf_ray, seen.wi, seen.distance2) }
    }

    /// Light sampled at the last vertex of a camera path: one vertex from the light.
    pub fn sample_light<N: Numbers, R: Record>(
        &self,
        camera: &[Vertex<'w>],
        w: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Option<Found> {
        let (u_light, u, seed) = (numbers.one(Domain::Light), numbers.two(Domain::Light), numbers.one(Domain::Other));
        let [.., before, last] = camera else { return None };
        if !last.is_connectible() {
            return None;
        }
        let sample = self.world.sample_light(&last.light_context(), u_light, u, w)?;
        let scattered = last.scatter(sample.wi, TransportMode::Radiance);
        let value = last.beta * scattered.value * sample.radiance * (1.0 / sample.pdf);
        if value.is_black() {
            return None;
        }
        let (ray, target) = if sample.distance == f32::INFINITY {
            (last.ray_along(sample.wi), None)
        } else {
            (last.ray_to_point(sample.end), Some(sample.end))
        };
        let medium = last.medium_towards(self.world, sample.wi);
        let passed = transmittance(self.world, ray, target, medium, (self.hero, w), seed, record)?;
        let seen = Seen {
            is_infinite: sample.distance == f32::INFINITY,
            end: sample.light_end,
            wi: sample.wi,
            distance2: sample.distance * sample.distance,
        };
        let connection = || {
            let [pdf_end, pdf_ray] = self.world.emission_pdf(&seen.end, -seen.wi);
            Connection {
                light_end: [seen.at_end(sample.pdf, sample.is_delta), pdf_end],
                is_hittable: !sample.is_delta,
                camera_reverse: [
                    self.leads_to(last, pdf_ray, &seen),
                    reverse_density(before, last, scattered.pdf_reverse),
                ],
                light_reverse: [seen.at_end(scattered.pdf, sample.is_delta), 0.0],
            }
        };
        let value = value * passed.t * (1.0 / self.hero.average(last.ratios * passed.r_l, w));
        // The light's vertex is all in the connection; any vertex stands for it.
        self.weighted(value, std::slice::from_ref(last), camera, connection)
    }

    /// The last vertices of two paths connected. `direct` is the density with which light sampling would have found the
    /// light's end from the next vertex.
    pub fn connect<R: Record>(
        &self,
        light: &[Vertex<'w>],
        camera: &[Vertex<'w>],
        direct: f32,
        w: &Wavelengths,
        seed: f32,
        record: &mut R,
    ) -> Option<Found> {
        let ([.., y_before, y], [.., z_before, z]) = (light, camera) else { return None };
        if !y.is_connectible() || !z.is_connectible() {
            return None;
        }
        let between = z.p - y.p;
        let distance2 = between.length_squared();
        let d = between.try_normalize()?;
        let (at_y, at_z) = (y.scatter(d, TransportMode::Importance), z.scatter(-d, TransportMode::Radiance));
        let value = y.beta * at_y.value * at_z.value * z.beta * (1.0 / distance2);
        if value.is_black() {
            return None;
        }
        let medium = z.medium_towards(self.world, -d);
        let ray = z.ray_to(y);
        let target = Some(ray.o + ray.d);
        let passed = transmittance(self.world, ray, target, medium, (self.hero, w), seed, record)?;
        let connection = || Connection {
            light_end: [direct, light[0].pdf],
            is_hittable: self.is_hittable(light),
            camera_reverse: [z.area_density(at_y.pdf, d, distance2), reverse_density(z_before, z, at_z.pdf_reverse)],
            light_reverse: [y.area_density(at_z.pdf, d, distance2), reverse_density(y_before, y, at_y.pdf_reverse)],
        };
        let ratios = y.ratios * z.ratios * passed.r_l;
        let value = value * passed.t * (1.0 / self.hero.average(ratios, w));
        self.weighted(value, light, camera, connection)
    }

    /// The last vertex of a light path connected to the camera, through the lens point of `sample`.
    pub fn receive<R: Record>(
        &self,
        light: &[Vertex<'w>],
        camera: &[Vertex<'w>],
        sample: &CameraSample,
        direct: f32,
        w: &Wavelengths,
        seed: f32,
        record: &mut R,
    ) -> Option<(Splat, f32)> {
        let [.., before, y] = light else { return None };
        if !y.is_connectible() {
            return None;
        }
        let seen = self.world.camera().receive(y.p, sample)?;
        if !self.world.settings().reaches_film(seen.film) {
            return None;
        }
        let at_y = y.scatter(seen.wi, TransportMode::Importance);
        let value = y.beta * at_y.value * seen.importance;
        if value.is_black() {
            return None;
        }
        let medium = y.medium_towards(self.world, seen.wi);
        let ray = y.ray_to_point(seen.end);
        let passed = transmittance(self.world, ray, Some(seen.end), medium, (self.hero, w), seed, record)?;
        let connection = || {
            let ray = Ray::new(seen.end, -seen.wi, y.time);
            let density = self.world.camera().density(&ray, seen.distance);
            Connection {
                light_end: [direct, light[0].pdf],
                is_hittable: self.is_hittable(light),
                camera_reverse: [0.0; 2],
                light_reverse: [y.crossing(density, seen.wi), reverse_density(before, y, at_y.pdf_reverse)],
            }
        };
        let value = value * passed.t * (1.0 / self.hero.average(y.ratios * passed.r_l, w));
        let found = self.weighted(value, light, camera, connection)?;
        Some((Splat { film: seen.film, value: found.value }, found.weight))
    }

    /// The density with which light sampling at the second vertex of a light path would have found the first.
    pub fn direct_density(&self, light: &[Vertex<'w>]) -> f32 {
        let [Vertex { kind: Kind::Light(end), p, .. }, next, ..] = light else { return 0.0 };
        let seen = Seen {
            is_infinite: self.world.is_infinite_light(end.light),
            end: *end,
            wi: next.wo,
            distance2: next.p.distance_squared(*p),
        };
        let pdf = self.world.light_end_pdf(&next.light_context(), end, next.wo);
        seen.at_end(pdf, self.world.is_delta_light(end.light))
    }

    fn is_hittable(&self, light: &[Vertex<'w>]) -> bool {
        matches!(light.first(), Some(Vertex { kind: Kind::Light(end), .. }) if !self.world.is_delta_light(end.light))
    }

    fn weighted(
        &self,
        value: Lanes,
        light: &[Vertex<'w>],
        camera: &[Vertex<'w>],
        connection: impl Fn() -> Connection,
    ) -> Option<Found> {
        if value.is_black() {
            return None;
        }
        let trivial = light.len() + camera.len() == 2;
        Found::new(value, if trivial { 1.0 } else { weight(light, camera, &connection()) })
    }
}

/// The density of the vertex before the last, as made from the other end, from that per solid angle at the last.
fn reverse_density(before: &Vertex<'_>, last: &Vertex<'_>, pdf_solid_angle: f32) -> f32 {
    match &before.kind {
        // Directions are all that an infinite light has; of a point nobody asks.
        Kind::Light(end) if end.n == Default::default() => pdf_solid_angle,
        _ => before.area_density(pdf_solid_angle, last.wo, before.p.distance_squared(last.p)),
    }
}
