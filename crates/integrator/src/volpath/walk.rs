//! The state of a path through media, and the light that it gathers: emission, and light sampled at its vertices.

use crate::hero::Hero;
use crate::numbers::{Domain, Numbers};
use crate::record::{self, Contribution, RayKind, Record, Technique};
use crate::transmitted::Transmitted;
use steradian_bsdf::{Bsdf, Lobe, PhaseMix, Straight, TransportMode};
use steradian_math::{Frame, Point3, Ray};
use steradian_scene::{Collision, Handle, LightContext, LightSample, Medium, Surface, Techniques, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// Where a path is and what it has gathered.
pub(super) struct Walk {
    pub ray: Ray,
    /// The medium that the ray runs through.
    pub medium: Option<Handle<Medium>>,
    pub radiance: Lanes,
    pub beta: Lanes,
    pub r_u: Lanes,
    /// `r_l` before the density of the light is known: that of the last direction is `p_scatter`.
    pub r_l: Lanes,
    pub p_scatter: f32,
    /// The vertex that light sampling competes for; `None` at the camera and after a specular bounce.
    pub previous: Option<LightContext>,
    pub depth: u32,
    pub eta_scale: f32,
    pub any_non_specular: bool,
    pub hero: Hero,
}

/// A vertex that light is sampled for.
pub(super) enum Vertices<'a> {
    Surface { surface: &'a Surface, frame: &'a Frame, bsdf: &'a Bsdf<'a> },
    Medium { p: Point3, phase: PhaseMix<'a> },
}

impl Walk {
    /// A path that starts at the camera.
    pub fn new(ray: Ray, medium: Option<Handle<Medium>>, hero: Hero) -> Self {
        Self {
            ray,
            medium,
            radiance: Lanes::ZERO,
            beta: Lanes::ONE,
            r_u: Lanes::ONE,
            r_l: Lanes::ONE,
            p_scatter: 0.0,
            previous: None,
            depth: 0,
            eta_scale: 1.0,
            any_non_specular: false,
            hero,
        }
    }

    /// The probability with which Russian roulette is to let the path live: what is left of it, after the first bounce.
    #[inline]
    pub fn survival(&self, w: &Wavelengths) -> f32 {
        let left = self.beta * (self.eta_scale / self.hero.average(self.r_u, w));
        if self.depth > 1 { (left.max_component() / Techniques::ROULETTE).min(1.0) } else { 1.0 }
    }

    /// Goes straight on through a pane, by chance; light sampling would not have left that to it.
    #[inline]
    pub fn pass_pane(&mut self, straight: &Straight) {
        let per_chance = 1.0 / straight.chance;
        self.beta *= straight.transmittance * per_chance;
        self.r_l *= per_chance;
    }

    /// Adds emission of the medium at a collision; light sampling does not look for it.
    #[inline]
    pub fn add_medium_emission<R: Record>(&mut self, c: &Collision, w: &Wavelengths, record: &mut R) {
        let source = c.point.sigma_a * c.point.emission;
        if source.is_black() {
            return;
        }
        let density = c.transmittance * (1.0 / c.majorant[self.hero.lane]);
        let r_e = self.hero.average(self.r_u * c.majorant * density, w);
        if r_e > 0.0 {
            let value = self.beta * density * source * (1.0 / r_e);
            self.radiance += value;
            if R::LIGHT {
                record.contribution(Contribution::only_way(self.depth, None, self.ray.d, Some(c.p), value));
            }
        }
    }

    /// Adds light that the ray has run into.
    #[inline]
    pub fn add_emission<R: Record>(
        &mut self,
        world: &World,
        emitted: Lanes,
        light: Option<u32>,
        hit: Option<&Surface>,
        w: &Wavelengths,
        record: &mut R,
    ) {
        if emitted.is_black() {
            return;
        }
        let d = self.ray.d;
        let p_light = match (&self.previous, light) {
            (Some(c), Some(light)) => world.light_pdf(c, light, d, hit),
            _ => 0.0,
        };
        let ratio = if p_light > 0.0 { p_light / self.p_scatter } else { 0.0 };
        let both = self.hero.average(self.r_u + self.r_l * ratio, w);
        if both <= 0.0 {
            return;
        }
        let value = self.beta * emitted * (1.0 / both);
        self.radiance += value;
        if R::LIGHT {
            record.contribution(Contribution {
                depth: self.depth,
                technique: Technique::Hit,
                light,
                direction: d,
                end: hit.map(|s| s.p),
                pdf: self.p_scatter,
                other_pdf: p_light,
                weight: self.hero.average(self.r_u, w) / both,
                value,
                occluded: false,
            });
        }
    }

    /// Adds light from a sampled point of a light, also from behind panes.
    #[expect(clippy::too_many_arguments, reason = "the state of the path is one of them")]
    pub fn sample_light<N: Numbers, R: Record>(
        &mut self,
        world: &World,
        context: &LightContext,
        vertex: &Vertices<'_>,
        through_panes: bool,
        w: &Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) {
        let (u_light, u_point, seed) =
            (numbers.one(Domain::Light), numbers.two(Domain::Light), numbers.one(Domain::Other));
        if let Vertices::Surface { bsdf, .. } = vertex
            && !bsdf.flags().is_non_specular()
        {
            return;
        }
        let Some(sample) = world.sample_light(context, u_light, u_point, w) else { return };
        let wi = sample.wi;
        let (f, p_scatter) = match vertex {
            Vertices::Surface { frame, bsdf, surface } => {
                bsdf.eval_and_pdf(frame.to_local(surface.wo), frame.to_local(wi), TransportMode::Radiance)
            }
            Vertices::Medium { phase, .. } => {
                let p = phase.eval(-self.ray.d, wi);
                (Lanes::splat(p), p)
            }
        };
        let value = self.beta * f * sample.radiance;
        if value.is_black() {
            return;
        }
        record.ray(RayKind::Shadow);
        let (from, p, medium) = match vertex {
            Vertices::Surface { surface, .. } => {
                (surface.shadow_ray(&sample), surface.p, world.medium_beyond(surface, wi, self.medium))
            }
            Vertices::Medium { p, .. } => (ray_to_light(*p, &sample, self.ray.time), *p, self.medium),
        };
        let shadow = self.transmittance(world, from, medium, (&sample, through_panes), w, seed, record);
        let Transmitted { t, r_l, r_u } = shadow.unwrap_or_default();
        // The densities of the two techniques, the lights' first.
        let r_u = if sample.is_delta { Lanes::ZERO } else { r_u * (p_scatter / sample.pdf) };
        let both = self.hero.average(self.r_u * (r_l + r_u), w) * sample.pdf;
        let value = if both > 0.0 { value * t * (1.0 / both) } else { Lanes::ZERO };
        self.radiance += value;
        if R::LIGHT {
            record.contribution(Contribution {
                depth: self.depth,
                technique: Technique::LightSampling,
                light: Some(sample.light),
                direction: wi,
                end: sample.distance.is_finite().then(|| p + wi * sample.distance),
                pdf: sample.pdf,
                other_pdf: if sample.is_delta { 0.0 } else { p_scatter },
                weight: if sample.is_delta { 1.0 } else { sample.pdf / (sample.pdf + p_scatter) },
                value,
                occluded: shadow.is_none(),
            });
        }
    }

    /// The transmittance to a light, or an estimate of it; `None` if a surface is in the way.
    #[expect(clippy::too_many_arguments, reason = "the state of the path is one of them")]
    fn transmittance<R: Record>(
        &self,
        world: &World,
        mut ray: Ray,
        mut medium: Option<Handle<Medium>>,
        (sample, through_panes): (&LightSample, bool),
        w: &Wavelengths,
        seed: f32,
        record: &mut R,
    ) -> Option<Transmitted> {
        let mut out = Transmitted::ALL;
        let mut rng = Transmitted::rng(&ray, seed);
        let left = |o: &Transmitted| o.t * (1.0 / self.hero.average(o.r_l + o.r_u, w));
        loop {
            let hit = record::intersect(world, &ray, record);
            if let Some(h) = hit.filter(|h| !world.is_interface(h)) {
                if !through_panes {
                    return None;
                }
                let straight = world.straight(&ray, &h, w).filter(|s| s.chance > 0.0)?;
                out.t *= straight.transmittance;
                out.r_u *= straight.chance;
            }
            if let Some(m) = medium {
                let length = ray.d.length();
                let t_max = hit.map_or(ray.whole_way(), |h| h.t) * length;
                let along = world.medium_ray(m, ray.o, ray.d * (1.0 / length), w);
                out.pass(along, t_max, self.hero.lane, &mut rng, left)?;
            }
            let Some(hit) = hit else { return Some(out) };
            let surface = world.surface(&ray, &hit);
            medium = world.medium_beyond(&surface, ray.d, medium);
            ray = surface.shadow_ray(sample);
            if ray.d.dot(sample.wi) <= 0.0 {
                // The light lies in this very surface.
                return Some(out);
            }
        }
    }
}

/// The ray from a point in space to a sampled light; it ends just before the light.
fn ray_to_light(p: Point3, sample: &LightSample, time: f32) -> Ray {
    if sample.distance == f32::INFINITY {
        return Ray::new(p, sample.wi, time);
    }
    Ray::between(p, sample.end, time)
}
