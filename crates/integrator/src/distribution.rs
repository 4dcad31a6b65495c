//! Distribution ray tracing by brute force (Cook, Porter and Carpenter 1984): a grid of lens points and moments for each
//! subpixel, a grid of points on every light and a grid of directions over the lobe at every hit, and so on from there.
//!
//! Unbiased with jittered grids: what lobe rays run into counts only where light rays could not have found it, which is
//! the rule of path tracing without multiple importance sampling. The number of rays grows exponentially with depth;
//! [`steradian_scene::Distribution::predicted_rays`] tells it beforehand.

use crate::numbers::{Domain, Numbers};
use crate::record::{self, RayKind, Record};
use steradian_bsdf::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{ONE_MINUS_EPSILON, Point2, Ray, RayDifferential, Vec3};
use steradian_scene::{CameraRay, CameraSample, Distribution as Parameters, LightContext, Shading, Surface, World};
use steradian_spectrum::{Lanes, Wavelengths};

const MODE: TransportMode = TransportMode::Radiance;

/// Distribution ray tracing.
#[derive(Clone, Copy, Debug)]
pub struct Distribution {
    /// The greatest number of bounces.
    pub max_depth: u32,
    /// The sizes of the grids.
    pub parameters: Parameters,
    /// Whether lobe rays of the last bounce can find light that light rays cannot.
    pub unsampled_lights: bool,
}

/// A ray of the tree.
struct Branch {
    ray: Ray,
    differential: Option<RayDifferential>,
    beta: Lanes,
    depth: u32,
    /// Whether lights count that the previous hit has sampled.
    sees_lights: bool,
}

/// Where a tree of rays is gathered.
struct Gather<'a, N, R> {
    world: &'a World,
    numbers: &'a mut N,
    record: &'a mut R,
    radiance: Lanes,
    waiting: Vec<Branch>,
}

/// A point of cell `i` of `n`.
#[inline]
fn place(i: u32, n: u32, u: f32) -> f32 {
    ((i as f32 + u) / n as f32).min(ONE_MINUS_EPSILON)
}

impl Distribution {
    /// The position in the pixel of sample `index`: the subpixels row by row, over and over.
    pub fn subpixel(&self, index: u32, u: [f32; 2]) -> [f32; 2] {
        let k = self.parameters.subpixels;
        self.cell(index % (k * k), k, u)
    }

    fn cell(&self, i: u32, n: u32, u: [f32; 2]) -> [f32; 2] {
        let u = if self.parameters.jitter { u } else { [0.5; 2] };
        [place(i % n, n, u[0]), place(i / n, n, u[1])]
    }

    /// The radiance at a film position: the mean over all lens points and moments.
    pub fn film_radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        film: Point2,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        let (lens, motion) = (world.camera().has_lens(), world.has_motion());
        let a = if lens { self.parameters.aperture } else { 1 };
        let moments = if motion { self.parameters.time } else { 1 };
        let mut sum = Lanes::ZERO;
        for i in 0..a * a {
            let lens = if lens { self.cell(i, a, numbers.two(Domain::Lens)) } else { [0.5; 2] };
            for j in 0..moments {
                let u = if motion && self.parameters.jitter { numbers.one(Domain::Time) } else { 0.5 };
                let time = if motion { place(j, moments, u) } else { 0.5 };
                let ray = world.camera_ray(&CameraSample { film, lens, time });
                if ray.weight > 0.0 {
                    sum += self.radiance(world, &ray, wavelengths, numbers, record) * ray.weight;
                }
            }
        }
        sum * (1.0 / (a * a * moments) as f32)
    }

    /// The radiance that arrives along a camera ray.
    pub fn radiance<N: Numbers, R: Record>(
        &self,
        world: &World,
        camera_ray: &CameraRay,
        wavelengths: &mut Wavelengths,
        numbers: &mut N,
        record: &mut R,
    ) -> Lanes {
        record.ray(RayKind::Camera);
        let mut gather = Gather { world, numbers, record, radiance: Lanes::ZERO, waiting: Vec::new() };
        gather.waiting.push(Branch {
            ray: camera_ray.ray,
            differential: camera_ray.differential,
            beta: Lanes::ONE,
            depth: 0,
            sees_lights: true,
        });
        while let Some(branch) = gather.waiting.pop() {
            self.follow(branch, &mut gather, wavelengths);
        }
        gather.radiance
    }

    fn follow<N: Numbers, R: Record>(&self, mut branch: Branch, g: &mut Gather<'_, N, R>, w: &mut Wavelengths) {
        let world = g.world;
        let (surface, shading) = loop {
            let Some(hit) = record::intersect(world, &branch.ray, g.record) else {
                if branch.sees_lights {
                    for &light in world.infinite_lights() {
                        g.radiance += branch.beta * world.environment(light, &branch.ray, w);
                    }
                }
                return;
            };
            let mut surface = world.surface(&branch.ray, &hit);
            if surface.is_emitter() && (branch.sees_lights || surface.light.is_none()) {
                g.radiance += branch.beta * world.emitted(&surface, w);
            }
            if branch.depth == self.max_depth {
                return;
            }
            match world.shading(&mut surface, &branch.ray, branch.differential.as_ref(), w) {
                Some(shading) => break (surface, shading),
                None => branch.ray = surface.continue_ray(&branch.ray),
            }
        };
        branch.depth += 1;
        let wo = shading.frame.to_local(-branch.ray.d);
        if shading.bsdf.flags().is_non_specular() {
            let lit = self.lit(g, &surface, &shading, wo, w);
            g.radiance += branch.beta * lit;
        }
        self.scatter(&branch, g, &surface, &shading, wo);
    }

    /// The light of all lights, by a grid of points on each.
    fn lit<N: Numbers, R: Record>(
        &self,
        g: &mut Gather<'_, N, R>,
        surface: &Surface,
        shading: &Shading,
        wo: Vec3,
        w: &Wavelengths,
    ) -> Lanes {
        let Shading { frame, bsdf } = shading;
        let context = LightContext::of_surface(surface, frame);
        let mut sum = Lanes::ZERO;
        for light in 0..g.world.light_count() as u32 {
            let s = if g.world.is_delta_light(light) { 1 } else { self.parameters.light };
            let mut of_light = Lanes::ZERO;
            for i in 0..s * s {
                let u = self.cell(i, s, g.numbers.two(Domain::Light));
                let Some(sample) = g.world.sample_one_light(&context, light, u, w) else { continue };
                let value = bsdf.eval_cos(wo, frame.to_local(sample.wi), MODE) * sample.radiance;
                if value.is_black() {
                    continue;
                }
                g.record.ray(RayKind::Shadow);
                if !record::occluded(g.world, &surface.shadow_ray(&sample), g.record) {
                    of_light += value * (1.0 / sample.pdf);
                }
            }
            sum += of_light * (1.0 / (s * s) as f32);
        }
        sum
    }

    /// Sends rays over the lobe.
    fn scatter<N: Numbers, R: Record>(
        &self,
        branch: &Branch,
        g: &mut Gather<'_, N, R>,
        surface: &Surface,
        shading: &Shading,
        wo: Vec3,
    ) {
        let bsdf = &shading.bsdf;
        let (spread, dirac) = (bsdf.flags().is_non_specular(), bsdf.flags().is_specular());
        let last = branch.depth == self.max_depth;
        if last && !dirac && !self.unsampled_lights {
            return;
        }
        let r = self.parameters.lobe;
        if !spread && r > 1 {
            for part in [Part::Reflection, Part::Transmission] {
                if let Some(sample) = bsdf.sample_part(wo, 0.0, [0.5; 2], MODE, part) {
                    // Each direction has its share of the light: what it has over the probability, times that.
                    let share = sample.weight * sample.pdf;
                    self.send(branch, g, surface, shading, sample, share);
                }
            }
            return;
        }
        for i in 0..r * r {
            let (u_lobe, u) = (g.numbers.one(Domain::Lobe), g.numbers.two(Domain::Lobe));
            let u_lobe = if self.parameters.jitter { u_lobe } else { self.scrambled(i, r) };
            if let Some(sample) = bsdf.sample(wo, u_lobe, self.cell(i, r, u), MODE) {
                self.send(branch, g, surface, shading, sample, sample.weight * (1.0 / (r * r) as f32));
            }
        }
    }

    /// A fixed choice among lobes for each cell: the cells along a stride that meets them all.
    fn scrambled(&self, i: u32, r: u32) -> f32 {
        let n = r * r;
        // For n = r * r, r + 1 has no divisor in common with n.
        place((i * (r + 1)) % n, n, 0.5)
    }

    fn send<N: Numbers, R: Record>(
        &self,
        branch: &Branch,
        g: &mut Gather<'_, N, R>,
        surface: &Surface,
        shading: &Shading,
        sample: LobeSample,
        weight: Lanes,
    ) {
        let beta = branch.beta * weight;
        if beta.is_black() {
            return;
        }
        g.record.ray(RayKind::Scattered);
        let wi = shading.frame.from_local(sample.wi);
        let differential = branch
            .differential
            .and_then(|d| surface.scattered_differential(&branch.ray, &d, &shading.frame, wi, &sample));
        g.waiting.push(Branch {
            ray: surface.spawn_ray(wi),
            differential,
            beta,
            depth: branch.depth,
            sees_lights: sample.flags.contains(Lobes::SPECULAR),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fixed_choices_cover_all_cells() {
        for r in 1..20u32 {
            let d = Distribution {
                max_depth: 1,
                parameters: Parameters { lobe: r, jitter: false, ..Parameters::default() },
                unsampled_lights: false,
            };
            let mut seen = vec![false; (r * r) as usize];
            for i in 0..r * r {
                seen[(d.scrambled(i, r) * (r * r) as f32) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s), "{r}");
        }
    }
}
