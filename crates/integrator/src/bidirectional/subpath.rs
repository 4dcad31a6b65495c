//! Random walks from the camera and from lights, with the densities of both directions at each vertex.

use super::vertex::{Kind, Vertex, adjoint_factor};
use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::{self, RayKind, Record};
use steradian_bsdf::{Lobe, Lobes, TransportMode};
use steradian_math::{Normal3, Ray};
use steradian_sampling::rng::{Rng, hash_floats};
use steradian_scene::{CameraRay, Handle, Medium, Shading, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// What is the same for all walks of a sample.
pub(crate) struct Setting<'w> {
    pub world: &'w World,
    pub hero: Hero,
    /// The greatest number of scattering events of a whole path.
    pub max_depth: u32,
    pub regularize: bool,
}

/// A density that leads to the next vertex.
#[derive(Clone, Copy, Debug)]
enum Towards {
    /// Per solid angle.
    SolidAngle(f32),
    /// Per area perpendicular to the ray, wherever along it.
    Area(f32),
    /// From the camera.
    Camera,
}

/// A walk in progress.
struct Walk<'a> {
    ray: Ray,
    medium: Option<Handle<Medium>>,
    beta: Lanes,
    ratios: Lanes,
    towards: Towards,
    mode: TransportMode,
    w: &'a mut Wavelengths,
    any_non_specular: bool,
}

/// What a ray in a medium comes to.
#[expect(clippy::large_enum_variant, reason = "lives for a moment, on the stack")]
enum Flown<'w> {
    Through,
    Scattered(Vertex<'w>),
    Ended,
}

impl<'w> Setting<'w> {
    /// Makes at most `most` vertices of a path from the camera. Returns the light of media on its way.
    pub fn trace_from_camera<N: Numbers, R: Record>(
        &self,
        camera_ray: &CameraRay,
        most: usize,
        w: &mut Wavelengths,
        numbers: &mut N,
        path: &mut Vec<Vertex<'w>>,
        record: &mut R,
    ) -> Lanes {
        let ray = camera_ray.ray;
        path.clear();
        let medium = self.world.camera_medium();
        path.push(first(Kind::Camera, &ray, Lanes::ONE, medium));
        record.ray(RayKind::Camera);
        let walk = Walk {
            ray,
            medium,
            beta: Lanes::ONE,
            ratios: Lanes::ONE,
            towards: Towards::Camera,
            mode: TransportMode::Radiance,
            w,
            any_non_specular: false,
        };
        self.walk(walk, Some(camera_ray), most, numbers, path, record)
    }

    /// Makes at most `most` vertices of a path from a light; none if nothing is emitted.
    pub fn trace_from_light<N: Numbers, R: Record>(
        &self,
        time: f32,
        most: usize,
        w: &mut Wavelengths,
        numbers: &mut N,
        path: &mut Vec<Vertex<'w>>,
        record: &mut R,
    ) {
        path.clear();
        let u = numbers.one(Domain::Light);
        let (u_place, u_direction) = (numbers.two(Domain::Light), numbers.two(Domain::Lobe));
        let Some(e) = self.world.sample_emission(u, u_place, u_direction, time, w) else { return };
        let medium = self.world.medium_of_light(&e.end, e.ray.d);
        let mut start = first(Kind::Light(e.end), &e.ray, e.flux * e.pdf_ray, medium);
        start.pdf = e.pdf_end;
        path.push(start);
        record.ray(RayKind::Scattered);
        let walk = Walk {
            ray: e.ray,
            medium,
            beta: e.flux,
            ratios: Lanes::ONE,
            towards: if e.is_infinite { Towards::Area(e.pdf_ray) } else { Towards::SolidAngle(e.pdf_ray) },
            mode: TransportMode::Importance,
            w,
            any_non_specular: false,
        };
        self.walk(walk, None, most, numbers, path, record);
    }

    fn walk<N: Numbers, R: Record>(
        &self,
        mut walk: Walk<'_>,
        camera_ray: Option<&CameraRay>,
        most: usize,
        numbers: &mut N,
        path: &mut Vec<Vertex<'w>>,
        record: &mut R,
    ) -> Lanes {
        let world = self.world;
        let mut glow = Lanes::ZERO;
        let mut differential = camera_ray.and_then(|r| r.differential);
        while path.len() < most {
            // Find the next vertex.
            let hit = record::intersect(world, &walk.ray, record);
            if let Some(medium) = walk.medium {
                let t_max = hit.map_or(f32::INFINITY, |h| h.t);
                match self.fly(&mut walk, medium, t_max, numbers, &mut glow) {
                    Flown::Through => {}
                    Flown::Ended => break,
                    Flown::Scattered(vertex) => {
                        // A medium may be scattered in once more than surfaces are lit: the last vertex is an end.
                        differential = None;
                        if path.len() == self.max_depth as usize + 1 && camera_ray.is_some() {
                            break;
                        }
                        self.push(vertex, &walk, path);
                        self.scatter_in_medium(&mut walk, numbers, path);
                        record.ray(RayKind::Scattered);
                        continue;
                    }
                }
            }
            let Some(hit) = hit else {
                if camera_ray.is_some() {
                    // The density of the direction; from the camera itself nobody asks.
                    let Towards::SolidAngle(pdf) = walk.towards else {
                        path.push(vertex(Kind::Escaped, &walk));
                        break;
                    };
                    path.push(Vertex { pdf, ..vertex(Kind::Escaped, &walk) });
                }
                break;
            };
            let mut surface = world.surface(&walk.ray, &hit);
            let shading = world.shading(&mut surface, &walk.ray, differential.as_ref(), walk.w);
            let Some(Shading { frame, mut bsdf }) = shading else {
                walk.medium = world.medium_beyond(&surface, walk.ray.d, walk.medium);
                walk.ray = surface.continue_ray(&walk.ray);
                continue;
            };
            if self.regularize && walk.any_non_specular {
                bsdf.regularize();
            }
            let mut at = vertex(Kind::Surface { surface, frame, bsdf }, &walk);
            (at.p, at.wo) = (surface.p, surface.wo);
            self.push(at, &walk, path);
            if path.len() == most {
                break;
            }

            // Scatter.
            let wo = frame.to_local(surface.wo);
            let (u_lobe, u) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
            let Some(sample) = bsdf.sample(wo, u_lobe, u, walk.mode) else { break };
            let specular = sample.flags.contains(Lobes::SPECULAR);
            let wi = frame.from_local(sample.wi);
            walk.beta *= sample.weight;
            if walk.mode == TransportMode::Importance {
                walk.beta *= adjoint_factor(surface.n, surface.wo, wi, wo.z, sample.wi.z);
            }
            if walk.beta.is_black() {
                break;
            }
            let (pdf, reverse) = if specular {
                // Both are the same Dirac, but for what refraction does to solid angles.
                let stretch = wo.z.abs() / (sample.wi.z.abs() * sample.eta * sample.eta);
                (sample.pdf, sample.pdf * stretch)
            } else {
                let pdf = if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi, walk.mode) } else { sample.pdf };
                (pdf, bsdf.pdf(sample.wi, wo, walk.mode.flipped()))
            };
            differential =
                differential.and_then(|d| surface.scattered_differential(&walk.ray, &d, &frame, wi, &sample));
            walk.any_non_specular |= !specular;
            walk.towards = Towards::SolidAngle(pdf);
            set_reverse(path, reverse);
            if let Some(last) = path.last_mut() {
                last.is_dirac = specular;
            }
            walk.medium = world.medium_beyond(&surface, wi, walk.medium);
            walk.ray = surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);
        }
        glow
    }

    /// Adds a vertex with the density that led to it.
    fn push(&self, mut vertex: Vertex<'w>, walk: &Walk<'_>, path: &mut Vec<Vertex<'w>>) {
        let Some(last) = path.last() else { return };
        let d = -vertex.wo;
        vertex.pdf = match walk.towards {
            Towards::SolidAngle(pdf) => vertex.area_density(pdf, d, vertex.p.distance_squared(last.p)),
            Towards::Area(pdf) => vertex.crossing(pdf, d),
            Towards::Camera => {
                let ray = Ray { d, ..walk.ray };
                vertex.crossing(self.world.camera().density(&ray, vertex.p.distance(last.p)), d)
            }
        };
        path.push(vertex);
    }

    /// Takes the ray through its medium.
    fn fly<N: Numbers>(
        &self,
        walk: &mut Walk<'_>,
        medium: Handle<Medium>,
        t_max: f32,
        numbers: &mut N,
        glow: &mut Lanes,
    ) -> Flown<'w> {
        let hero = self.hero.lane;
        let length = walk.ray.d.length();
        let d = walk.ray.d * (1.0 / length);
        let ray = self.world.medium_ray(medium, walk.ray.o, d, walk.w);
        let mut rng = Rng::new(hash_floats(&[numbers.one(Domain::Other)]), hash_floats(&[numbers.one(Domain::Other)]));
        let mut flight = ray.fly(t_max * length, hero);
        let mut u = numbers.one(Domain::Other);
        while let Some(c) = flight.next(u) {
            u = rng.f32();
            let (majorant, point) = (c.majorant[hero], c.point);
            // Only paths from the camera see media shine.
            let source = point.sigma_a * point.emission;
            if walk.mode == TransportMode::Radiance && !source.is_black() {
                let density = c.transmittance * (1.0 / majorant);
                let r = self.hero.average(walk.ratios * c.majorant * density, walk.w);
                if r > 0.0 {
                    *glow += walk.beta * density * source * (1.0 / r);
                }
            }
            let (absorb, scatter) = (point.sigma_a[hero] / majorant, point.sigma_s[hero] / majorant);
            let choice = rng.f32();
            if choice < absorb {
                return Flown::Ended;
            }
            if choice >= absorb + scatter {
                let sigma_n = c.sigma_n();
                if sigma_n[hero] == 0.0 {
                    return Flown::Ended;
                }
                let null = c.transmittance * (sigma_n / sigma_n[hero]);
                walk.beta *= null;
                walk.ratios *= null;
                continue;
            }
            let real = c.transmittance * (point.sigma_s / point.sigma_s[hero]);
            walk.beta *= real;
            walk.ratios *= real;
            let mut at = vertex(Kind::Medium(self.world.phase(medium, c.p)), walk);
            (at.p, at.wo) = (c.p, -d);
            return Flown::Scattered(at);
        }
        let passed = flight.passed();
        walk.beta *= passed;
        walk.ratios *= passed;
        Flown::Through
    }

    fn scatter_in_medium<N: Numbers>(&self, walk: &mut Walk<'_>, numbers: &mut N, path: &mut [Vertex<'w>]) {
        let Some(Vertex { kind: Kind::Medium(phase), p, wo, .. }) = path.last().copied() else { return };
        let sample = phase.sample(wo, numbers.two(Domain::Lobe));
        walk.any_non_specular = true;
        walk.towards = Towards::SolidAngle(sample.pdf);
        set_reverse(path, sample.pdf);
        walk.ray = Ray::new(p, sample.wi, walk.ray.time);
    }
}

/// Tells the last vertex but one with which density the last leads back to it.
fn set_reverse(path: &mut [Vertex<'_>], pdf_solid_angle: f32) {
    if let [.., before, last] = path {
        let d = before.p - last.p;
        let distance2 = d.length_squared();
        // Towards an infinite light the density stays one of directions; nobody asks for that of the camera's own vertex.
        before.pdf_reverse = match &before.kind {
            Kind::Light(end) if end.n == Normal3::default() => pdf_solid_angle,
            _ => before.area_density(pdf_solid_angle, last.wo, distance2),
        };
    }
}

fn first<'w>(kind: Kind<'w>, ray: &Ray, beta: Lanes, medium: Option<Handle<Medium>>) -> Vertex<'w> {
    Vertex {
        kind,
        p: ray.o,
        wo: Default::default(),
        beta,
        ratios: Lanes::ONE,
        medium,
        time: ray.time,
        pdf: 1.0,
        pdf_reverse: 0.0,
        is_dirac: false,
    }
}

fn vertex<'w>(kind: Kind<'w>, walk: &Walk<'_>) -> Vertex<'w> {
    Vertex { wo: -walk.ray.d, ratios: walk.ratios, ..first(kind, &walk.ray, walk.beta, walk.medium) }
}
