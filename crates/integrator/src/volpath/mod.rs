//! Path tracing through participating media: null-scattering path integral (Miller et al. 2019) with next-event
//! estimation, ratio tracking and multiple importance sampling over techniques and wavelengths (PBRT 4th ed., 14.2).
//!
//! `beta` is the throughput over the density of the hero's lane. `r_u` and `r_l` are, for each lane, the densities of the
//! whole path by unidirectional sampling and with the last direction from light sampling, over the same density.

mod even;
mod walk;

use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::{self, Bounce, RayKind, Record, Vertex};
use crate::subsurface;
use even::EvenFlight;
use steradian_bsdf::{Lobe, Lobes, TransportMode};
use steradian_math::{Normal3, Point3, Ray};
use steradian_sampling::rng::{Rng, hash_floats};
use steradian_scene::{CameraRay, Handle, LightContext, Medium, MediumPoint, MediumRay, Shading, World};
use steradian_spectrum::{Lanes, Wavelengths};
use walk::{Vertices, Walk};

/// Path tracing through media up to a number of bounces.
#[derive(Clone, Copy, Debug)]
pub struct VolPath {
    /// The greatest number of scattering events, in media and on surfaces.
    pub max_depth: u32,
    /// Roughen lobes after the first non-specular bounce; biased.
    pub regularize: bool,
    /// Whether the camera sees through lamps and past the sky.
    pub hide_lights: bool,
    /// Whether panes only dim what goes straight through them, as Mitsuba has it: passing one is no bounce.
    pub through_panes: bool,
}

/// What became of a ray in a medium.
enum Flown {
    /// It got to the other end.
    Through,
    /// It was scattered and goes on from there.
    Scattered,
    /// It was absorbed.
    Ended,
}

impl VolPath {
    /// The radiance that arrives along a camera ray.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        if world.needs_one_wavelength() {
            wavelengths.terminate_secondary();
        }
        let mut differential = camera_ray.differential;
        let mut walk = Walk::new(camera_ray.ray, world.camera_medium(), Hero::choose(wavelengths, numbers));
        record.ray(RayKind::Camera);

        loop {
            // Find where the ray ends, and whether it gets there.
            let hit = record::intersect(world, &walk.ray, record);
            if let Some(medium) = walk.medium {
                let t_max = hit.map_or(f32::INFINITY, |h| h.t);
                match self.fly(world, &mut walk, medium, t_max, wavelengths, numbers, record) {
                    Flown::Through => {}
                    Flown::Scattered => {
                        differential = None;
                        continue;
                    }
                    Flown::Ended => break,
                }
            }
            let hides = self.hide_lights && walk.depth == 0;
            let Some(hit) = hit else {
                if hides {
                    break;
                }
                for &light in world.infinite_lights() {
                    let emitted = world.environment(light, &walk.ray, wavelengths);
                    walk.add_emission(world, emitted, Some(light), None, wavelengths, record);
                }
                break;
            };
            let mut surface = world.surface(&walk.ray, &hit);
            if hides && surface.light.is_some() {
                walk.medium = world.medium_beyond(&surface, walk.ray.d, walk.medium);
                walk.ray = surface.continue_ray(&walk.ray);
                continue;
            }

            // Add emission of the surface, weighted against light sampling at the previous vertex.
            if surface.is_emitter() {
                let emitted = world.emitted(&surface, wavelengths);
                walk.add_emission(world, emitted, surface.light, Some(&surface), wavelengths, record);
            }

            // Evaluate the material; a surface without one may change the medium, and no more.
            let Some(Shading { frame, mut bsdf }) =
                world.shading(&mut surface, &walk.ray, differential.as_ref(), wavelengths)
            else {
                walk.medium = world.medium_beyond(&surface, walk.ray.d, walk.medium);
                walk.ray = surface.continue_ray(&walk.ray);
                continue;
            };
            let wo = frame.to_local(surface.wo);

            // Light that is not turned is lamps' as much as chance's: the vertex before stays the last.
            let mut u_pane = None;
            if self.through_panes
                && let Some(straight) = bsdf.straight(wo)
            {
                let u = numbers.one(Domain::Lobe);
                if u >= 1.0 - straight.chance {
                    walk.pass_pane(&straight);
                    walk.medium = world.medium_beyond(&surface, walk.ray.d, walk.medium);
                    walk.ray = surface.continue_ray(&walk.ray);
                    continue;
                }
                u_pane = Some(u);
            }
            if walk.depth == self.max_depth {
                break;
            }
            if self.regularize && walk.any_non_specular {
                bsdf.regularize();
            }
            if R::DETAILED {
                record.vertex(Vertex::on(world, walk.depth, (&surface, &frame), &bsdf, walk.beta));
            }
            walk.depth += 1;

            // Sample a light.
            let context = LightContext::of_surface(&surface, &frame).beside_lobes();
            let vertex = Vertices::Surface { surface: &surface, frame: &frame, bsdf: &bsdf };
            walk.sample_light(world, &context, &vertex, self.through_panes, wavelengths, numbers, record);

            // Sample the lobe for the next direction.
            let u_lobe = u_pane.unwrap_or_else(|| numbers.one(Domain::Lobe));
            let u_direction = numbers.two(Domain::Lobe);
            let Some(sample) = bsdf.sample(wo, u_lobe, u_direction, TransportMode::Radiance) else { break };
            walk.beta *= sample.weight;
            let mut specular = sample.flags.contains(Lobes::SPECULAR);
            let mut transmission = sample.flags.contains(Lobes::TRANSMISSION);
            walk.p_scatter =
                if sample.pdf_is_proportional { bsdf.pdf(wo, sample.wi, TransportMode::Radiance) } else { sample.pdf };
            walk.r_l = walk.r_u;
            walk.previous = if specular { None } else { Some(context) };
            walk.any_non_specular |= !specular;
            if transmission {
                walk.eta_scale *= sample.eta * sample.eta;
            }
            let (mut wi, mut weight) = (frame.from_local(sample.wi), sample.weight);
            differential =
                differential.and_then(|d| surface.scattered_differential(&walk.ray, &d, &frame, wi, &sample));
            let medium = walk.medium;
            walk.medium = world.medium_beyond(&surface, wi, medium);
            walk.ray = surface.spawn_ray(wi);
            record.ray(RayKind::Scattered);

            // What goes into something translucent comes out elsewhere, and goes on from there. The density is already the
            // mean over the lanes, so that their ratios stay as they are.
            if transmission
                && world.has_subsurface()
                && let Some(inside) = world.subsurface(&surface, wavelengths)
            {
                let Some(exit) = subsurface::exit(world, (&surface, &frame), &inside, wavelengths, numbers, record)
                else {
                    break;
                };
                if R::DETAILED {
                    let pdf = walk.p_scatter;
                    record.bounce(Bounce { direction: wi, pdf, weight, specular, transmission, survival: 1.0 });
                    record.vertex(Vertex::on(
                        world,
                        walk.depth,
                        (&exit.surface, &exit.frame),
                        &exit.bsdf,
                        walk.beta * exit.weight,
                    ));
                }
                walk.beta *= exit.weight;
                walk.medium = medium;
                let context = LightContext::of_surface(&exit.surface, &exit.frame).beside_lobes();
                let vertex = Vertices::Surface { surface: &exit.surface, frame: &exit.frame, bsdf: &exit.bsdf };
                walk.sample_light(world, &context, &vertex, self.through_panes, wavelengths, numbers, record);
                let wo = exit.frame.to_local(exit.surface.wo);
                let (u_lobe, u_direction) = (numbers.one(Domain::Lobe), numbers.two(Domain::Lobe));
                let Some(out) = exit.bsdf.sample(wo, u_lobe, u_direction, TransportMode::Radiance) else { break };
                walk.beta *= out.weight;
                // Coming out undoes the scaling of radiance by going in.
                walk.eta_scale /= sample.eta * sample.eta;
                (walk.p_scatter, walk.previous, walk.any_non_specular) = (out.pdf, Some(context), true);
                (specular, transmission, weight, differential) = (false, false, out.weight, None);
                wi = exit.frame.from_local(out.wi);
                walk.medium = world.medium_beyond(&exit.surface, wi, medium);
                walk.ray = exit.surface.spawn_ray(wi);
                record.ray(RayKind::Scattered);
            }

            // End the path by Russian roulette where little is left; refraction's scaling of radiance is not a loss.
            let u_roulette = numbers.one(Domain::Other);
            let survival = walk.survival(wavelengths);
            if R::DETAILED {
                record.bounce(Bounce { direction: wi, pdf: walk.p_scatter, weight, specular, transmission, survival });
            }
            if survival < 1.0 {
                if u_roulette >= survival {
                    break;
                }
                walk.beta *= 1.0 / survival;
            }
        }
        record.path(walk.depth);
        walk.radiance
    }

    /// Takes the ray through its medium: at each collision emission is added, and chance says whether the path is
    /// absorbed, scattered, or goes on as if nothing had been there.
    #[expect(clippy::too_many_arguments, reason = "the state of the path is one of them")]
    fn fly<N: Numbers, R: Record>(
        &self,
        world: &World,
        walk: &mut Walk,
        medium: Handle<Medium>,
        t_max: f32,
        wavelengths: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Flown {
        let hero = walk.hero.lane;
        let length = walk.ray.d.length();
        let d = walk.ray.d * (1.0 / length);
        let ray = world.medium_ray(medium, walk.ray.o, d, wavelengths);
        let mut rng = Rng::new(hash_floats(&[numbers.one(Domain::Other)]), hash_floats(&[numbers.one(Domain::Other)]));
        let mut u = numbers.one(Domain::Other);
        if let Some(point) = ray.everywhere()
            && (point.sigma_a * point.emission).is_black()
        {
            let Some(p) = self.fly_evenly(world, walk, (&ray, &point), t_max * length, u, wavelengths, &mut rng) else {
                return Flown::Through;
            };
            if rng.f32() >= point.sigma_s[hero] / (point.sigma_a + point.sigma_s)[hero] || walk.depth == self.max_depth
            {
                return Flown::Ended;
            }
            self.scatter(world, walk, medium, p, wavelengths, numbers, record);
            return Flown::Scattered;
        }
        let by_weight = ray.absorbs_by_weight();
        let mut flight = ray.fly(t_max * length, hero);
        while let Some(c) = flight.next(u) {
            u = rng.f32();
            let (majorant, point) = (c.majorant[hero], c.point);
            walk.add_medium_emission(&c, wavelengths, record);

            // Choose the kind of collision by the hero's coefficients.
            let extinct = point.sigma_a + point.sigma_s;
            let (absorb, scatter) = if by_weight {
                (0.0, extinct[hero] / majorant)
            } else {
                (point.sigma_a[hero] / majorant, point.sigma_s[hero] / majorant)
            };
            let choice = rng.f32();
            if choice < absorb {
                return Flown::Ended;
            }
            if choice >= absorb + scatter {
                let sigma_n = c.sigma_n();
                if sigma_n[hero] == 0.0 {
                    // Rounding chose what cannot be.
                    return Flown::Ended;
                }
                let null = c.transmittance * (sigma_n / sigma_n[hero]);
                walk.beta *= null;
                walk.r_u *= null;
                walk.r_l *= c.transmittance * (c.majorant / sigma_n[hero]);
                continue;
            }
            if walk.depth == self.max_depth {
                return Flown::Ended;
            }
            if by_weight {
                walk.beta *= c.transmittance * (point.sigma_s / extinct[hero]);
                walk.r_u *= c.transmittance * (extinct / extinct[hero]);
                if walk.beta.is_black() {
                    return Flown::Ended;
                }
            } else {
                let real = c.transmittance * (point.sigma_s / point.sigma_s[hero]);
                walk.beta *= real;
                walk.r_u *= real;
            }
            self.scatter(world, walk, medium, c.p, wavelengths, numbers, record);
            return Flown::Scattered;
        }
        let passed = flight.passed();
        walk.beta *= passed;
        walk.r_u *= passed;
        // Light sampling would not have left it to chance where the transmittance is known.
        walk.r_l *= ray.transmittance(t_max * length).map_or(passed, |t| Lanes::splat(1.0 / t[hero]));
        Flown::Through
    }

    /// Takes the ray through a medium that is the same everywhere and does not shine: where it collides, with the weight of scattering there
    /// if chance then says scattering, or `None` where it gets to its end.
    #[expect(clippy::too_many_arguments, reason = "the state of the path is one of them")]
    fn fly_evenly(
        &self,
        world: &World,
        walk: &mut Walk,
        (ray, point): (&MediumRay<'_>, &MediumPoint),
        length: f32,
        u: f32,
        wavelengths: &Wavelengths,
        rng: &mut Rng,
    ) -> Option<Point3> {
        let hero = walk.hero.lane;
        let sigma = point.sigma_a + point.sigma_s;
        let flight = EvenFlight::new(sigma, length);
        let caught = flight.caught(sigma[hero]);
        if u >= caught {
            let through = flight.transmittance(length);
            walk.beta *= through * (1.0 / through[hero]);
            walk.r_u *= through * (1.0 / through[hero]);
            // Light sampling would not have left it to chance.
            walk.r_l *= 1.0 / through[hero];
            return None;
        }
        // A lamp for which light is likely to be sampled from here.
        let from = ray.position(0.5 * flight.reach());
        let lamp = world.has_lamps_near(from, 1.5 * flight.reach()).then(|| {
            let context = LightContext::of_point(from, walk.ray.time);
            world.sample_light(&context, rng.f32(), rng.f32_2d(), wavelengths)
        });
        let flight = match lamp.flatten() {
            Some(l) if l.distance.is_finite() => flight.with_lamp(|t| ray.position(t), from + l.wi * l.distance),
            _ => flight,
        };
        let t = flight.sample(u / caught, hero);
        let density = flight.density(t);
        let albedo = point.sigma_s.safe_div(sigma);
        walk.beta *= flight.transmittance(t) * point.sigma_s * (1.0 / (density[hero] * albedo[hero]));
        walk.r_u *= density * albedo * (1.0 / (density[hero] * albedo[hero]));
        Some(ray.position(t))
    }

    /// Scatters at a point of a medium: samples a light, then the phase function for the next direction.
    #[expect(clippy::too_many_arguments, reason = "the state of the path is one of them")]
    fn scatter<N: Numbers, R: Record>(
        &self,
        world: &World,
        walk: &mut Walk,
        medium: Handle<Medium>,
        p: Point3,
        wavelengths: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) {
        let phase = world.phase(medium, p);
        if R::DETAILED {
            record.vertex(Vertex {
                depth: walk.depth,
                p,
                n: Normal3::default(),
                material: world.medium_name(medium).to_owned(),
                lobe: phase.name().to_owned(),
                throughput: walk.beta,
            });
        }
        walk.depth += 1;
        let d = walk.ray.d.normalize();
        let context = LightContext::of_point(p, walk.ray.time);
        walk.ray.d = d;
        let vertex = Vertices::Medium { p, phase };
        walk.sample_light(world, &context, &vertex, self.through_panes, wavelengths, numbers, record);
        let sample = phase.sample(-d, numbers.two(Domain::Lobe));
        walk.p_scatter = sample.pdf;
        walk.r_l = walk.r_u;
        walk.previous = Some(context);
        walk.any_non_specular = true;
        walk.ray = Ray::new(p, sample.wi, walk.ray.time);
        record.ray(RayKind::Scattered);
        if R::DETAILED {
            record.bounce(Bounce {
                direction: sample.wi,
                pdf: sample.pdf,
                weight: Lanes::ONE,
                specular: false,
                transmission: true,
                survival: 1.0,
            });
        }
    }
}
