//! Path tracing of many samples side by side (a wavefront, after Laine, Karras and Aila 2013): the picture is that of [`Path`], bit for bit.
//!
//! All paths of a batch make one bounce, then the next. Rays are traced one by one. Where they arrive on plain surfaces
//! ([`PlainSurfaces`]) or leave the scene, the paths stand in rows, and each step of the bounce is one loop over the rows; all others make
//! their bounce by the function that a path alone would have used.

use crate::camera_sample;
use crate::path::{Path, Walk};
use crate::record::{self, RayKind, Record};
use fearless_simd::{Level, dispatch};
use steradian_bsdf::{RoughConductor, TrowbridgeReitz};
use steradian_geometry::RayRows;
use steradian_math::{INV_PI, Point2, ROW, Ray, Row, Rows3, offset_ray_origin, row_end};
use steradian_sampling::mis::power_weight;
use steradian_sampling::sampler::{SamplePlace, Sampler};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_scene::{
    CameraRay, Hit, LightContext, LightRows, PlainHit, PlainLobe, PlainSurfaces, PointRows, SkyRows, Techniques, World,
};
use steradian_spectrum::{LaneRows, Lanes, Wavelengths};

/// Dimensions that a bounce takes: light (1 + 2), lobe (1 + 2), roulette (1).
const DIMENSIONS: u32 = 7;

/// A path of a batch.
#[derive(Clone, Copy, Debug)]
struct Lane {
    walk: Walk,
    weight: f32,
    wavelengths: Wavelengths,
    place: SamplePlace,
}

/// Paths that are followed together, and the rows that they stand in. Memory to be used again and again.
#[derive(Clone, Debug)]
pub struct Batch {
    path: Path,
    plain: PlainSurfaces,
    level: Level,
    lanes: Vec<Lane>,
    alive: Vec<u32>,
    rays: RayRows,
    hits: Vec<Option<Hit>>,
    plain_hits: Vec<Option<PlainHit>>,
    /// Of paths that meet matte surfaces, and metals.
    rows: [Box<Rows>; 2],
    escaped: Box<Escaped>,
}

/// Paths that leave the scene.
#[derive(Clone, Debug, Default)]
struct Escaped {
    lanes: Vec<u32>,
    d: Rows3,
    sky: SkyRows,
}

/// What stands side by side.
#[derive(Clone, Debug, Default)]
struct Rows {
    /// Which paths.
    lanes: Vec<u32>,
    places: Vec<SamplePlace>,
    contexts: Vec<LightContext>,
    /// Numbers: for the light, the point on it, the direction, roulette.
    numbers: [[Row; 2]; 4],
    points: PointRows,
    lights: LightRows,
    /// Albedo of matte surfaces, real part of the index of metals.
    albedo: LaneRows,
    k: LaneRows,
    alpha: Row,
    beta: LaneRows,
    eta_scale: Row,
    depth: Row<u32>,
    /// Light that arrives if nothing is in the way, and the ray that asks.
    direct: LaneRows,
    lit: Row<u32>,
    shadow_o: Rows3,
    shadow_d: Rows3,
    /// Those of them that are asked, and where in the rows they stand.
    shadow_rays: RayRows,
    asked: Vec<u32>,
    /// The next direction.
    wi: Rows3,
    o: Rows3,
    p_lobe: Row,
    scattered: Row<u32>,
    alive: Row<u32>,
}

impl Batch {
    /// For a world and a sampler that allow it; `None` means one path at a time.
    pub fn new(path: Path, world: &World, sampler: &Sampler) -> Option<Self> {
        let fits = sampler.has_rows() && !world.has_subsurface();
        fits.then(|| Self {
            path,
            plain: world.plain_surfaces(path.regularize),
            level: world.level(),
            lanes: Vec::new(),
            alive: Vec::new(),
            rays: RayRows::default(),
            hits: Vec::new(),
            plain_hits: Vec::new(),
            rows: Default::default(),
            escaped: Default::default(),
        })
    }

    /// Uses another instruction set; the paths are the same, bit for bit.
    pub fn set_level(&mut self, level: Level) {
        self.level = level;
    }

    /// Forgets all paths.
    pub fn clear(&mut self) {
        self.lanes.clear();
    }

    /// Adds paths through film positions, one for each of at most [`ROW`] samples, which stand where their camera rays are chosen.
    pub fn push(
        &mut self,
        world: &World,
        film: &[Row; 2],
        wavelengths: &[Wavelengths],
        places: &[SamplePlace],
        sampler: &mut Sampler,
    ) {
        let lanes = &mut self.lanes;
        let mut add = |i: usize, ray: CameraRay, place| {
            lanes.push(Lane { walk: Walk::new(&ray), weight: ray.weight, wavelengths: wavelengths[i], place });
        };
        let directions = &mut self.rows[0].wi;
        if world.camera_rays(self.level, film, places.len(), directions, |i, ray| add(i, ray, places[i])) {
            return;
        }
        for (i, &place) in places.iter().enumerate() {
            sampler.start(place.pixel, place.sample, place.dimension);
            let film = Point2::new(film[0].0[i], film[1].0[i]);
            let ray = world.camera_ray(&camera_sample(world, film, None, sampler));
            add(i, ray, SamplePlace { dimension: sampler.dimension(), ..place });
        }
    }

    /// The instruction set in use.
    pub fn level(&self) -> Level {
        self.level
    }

    /// How many paths there are.
    pub fn len(&self) -> usize {
        self.lanes.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.lanes.is_empty()
    }

    /// The radiance of path number `i`, weighted as the lens does, and the wavelengths that are left of it.
    pub fn radiance(&self, i: usize) -> (Lanes, &Wavelengths) {
        let lane = &self.lanes[i];
        (lane.walk.radiance * lane.weight, &lane.wavelengths)
    }

    /// Follows all paths to their ends.
    pub fn run<R: Record>(&mut self, world: &World, sampler: &mut Sampler, record: &mut R) {
        self.alive.clear();
        // Nothing comes through where the lens has no weight.
        let through = |&i: &u32| self.lanes[i as usize].weight != 0.0;
        self.alive.extend((0..self.lanes.len() as u32).filter(through));
        self.alive.iter().for_each(|_| record.ray(RayKind::Camera));
        while !self.alive.is_empty() {
            let mut alive = std::mem::take(&mut self.alive);
            let mut kept = 0;
            for first in (0..alive.len()).step_by(ROW) {
                let end = (first + ROW).min(alive.len());
                let survivors = self.bounce(world, &mut alive[first..end], sampler, record);
                alive.copy_within(first..first + survivors, kept);
                kept += survivors;
            }
            alive.truncate(kept);
            self.alive = alive;
        }
    }

    /// One bounce of at most [`ROW`] paths; the survivors come to the front, in their order.
    fn bounce<R: Record>(&mut self, world: &World, paths: &mut [u32], sampler: &mut Sampler, record: &mut R) -> usize {
        let mut alive = 0u64;
        self.rows.iter_mut().for_each(|rows| rows.lanes.clear());
        self.escaped.lanes.clear();
        self.hits.clear();
        self.rays.clear();
        paths.iter().for_each(|&lane| self.rays.push(&self.lanes[lane as usize].walk.ray));
        record::intersect_rows(world, &mut self.rays, &mut self.hits, record);
        let plain_hit = |hit: &Option<Hit>| world.plain_triangle(&self.plain, hit.as_ref()?);
        self.plain_hits.clear();
        self.plain_hits.extend(self.hits.iter().map(plain_hit));
        for (k, &lane) in paths.iter().enumerate() {
            let Lane { walk, wavelengths, place, .. } = &mut self.lanes[lane as usize];
            let Some(hit) = self.hits[k] else {
                self.escaped.place(lane, walk);
                record.path(walk.depth);
                continue;
            };
            if let Some(at) = &self.plain_hits[k]
                && let ray = (&walk.ray, walk.differential.as_ref())
                && let Some(lobe) = world.plain_lobe(&self.plain, (at, &hit), ray, wavelengths)
            {
                if walk.depth == self.path.max_depth {
                    record.path(walk.depth);
                    continue;
                }
                match lobe {
                    PlainLobe::Diffuse(lobe) => {
                        let i = self.rows[0].place(world, at, k, walk);
                        self.rows[0].albedo.set(i, lobe.reflectance);
                    }
                    PlainLobe::Metal(lobe) => {
                        let i = self.rows[1].place(world, at, k, walk);
                        self.rows[1].albedo.set(i, lobe.eta);
                        self.rows[1].k.set(i, lobe.k);
                        self.rows[1].alpha.0[i] = lobe.distribution.alpha()[0];
                    }
                }
                continue;
            }
            sampler.start(place.pixel, place.sample, place.dimension);
            if self.path.bounce(world, &hit, walk, wavelengths, sampler, record).is_continue() {
                alive |= 1 << k;
                place.dimension = sampler.dimension();
            } else {
                record.path(walk.depth);
            }
        }
        if !self.escaped.lanes.is_empty() {
            self.escaped.see(self.path, (world, self.level), &mut self.lanes, record);
        }
        let [matte, metal] = &mut self.rows;
        if !matte.lanes.is_empty() {
            alive |= matte.scatter::<_, false>((world, self.level), paths, &mut self.lanes, sampler, record);
        }
        if !metal.lanes.is_empty() {
            alive |= metal.scatter::<_, true>((world, self.level), paths, &mut self.lanes, sampler, record);
        }
        let mut kept = 0;
        for k in 0..paths.len() {
            if alive >> k & 1 == 1 {
                paths[kept] = paths[k];
                kept += 1;
            }
        }
        kept
    }
}

impl Escaped {
    /// Puts a path that leaves the scene into the next place.
    #[inline]
    fn place(&mut self, lane: u32, walk: &Walk) {
        self.d.set(self.lanes.len(), walk.ray.d);
        self.lanes.push(lane);
    }

    /// Adds the light of infinite lights.
    fn see<R: Record>(&mut self, path: Path, (world, level): (&World, Level), lanes: &mut [Lane], record: &mut R) {
        for &light in world.infinite_lights() {
            let together = world.look_at_sky(level, light, &self.d, self.lanes.len(), &mut self.sky);
            for (i, &lane) in self.lanes.iter().enumerate() {
                let Lane { walk, wavelengths, .. } = &mut lanes[lane as usize];
                if together {
                    let pdf = |c: &LightContext| world.sky_pdf_at(c, light, &self.sky, i);
                    path.add_sky(walk, light, world.sky_at(light, &self.sky, i, wavelengths), pdf, record);
                } else {
                    path.see(world, walk, light, wavelengths, record);
                }
            }
        }
    }
}

impl Rows {
    /// Puts a path that has met a plain surface into the next place. `k` is its number in the bounce.
    #[inline]
    fn place(&mut self, world: &World, at: &PlainHit, k: usize, walk: &Walk) -> usize {
        let i = self.lanes.len();
        self.lanes.push(k as u32);
        world.place_hit(at, walk.ray.d, &mut self.points, i);
        self.beta.set(i, walk.beta);
        self.eta_scale.0[i] = walk.eta_scale;
        self.depth.0[i] = walk.depth + 1;
        i
    }

    /// The metal at a place.
    #[inline(always)]
    fn metal(&self, i: usize) -> RoughConductor {
        let distribution = TrowbridgeReitz::new(self.alpha.0[i], self.alpha.0[i]);
        RoughConductor { distribution, eta: self.albedo.get(i), k: self.k.get(i) }
    }

    /// Makes the bounce of all paths in the rows; the bits of the result name the survivors.
    fn scatter<R: Record, const METAL: bool>(
        &mut self,
        (world, level): (&World, Level),
        paths: &[u32],
        lanes: &mut [Lane],
        sampler: &mut Sampler,
        record: &mut R,
    ) -> u64 {
        let n = self.lanes.len();
        let of = |k: u32| paths[k as usize] as usize;
        self.points.work_out(level, n);
        self.places.clear();
        self.places.extend(self.lanes.iter().map(|&k| lanes[of(k)].place));
        sampler.rows(level, &self.places, &[0, 1, 4, 6], &mut self.numbers);
        self.contexts.clear();
        let time = |i: usize| lanes[of(self.lanes[i])].walk.ray.time;
        self.contexts.extend((0..n).map(|i| self.points.light_context(i, time(i))));
        let [u_light, u_point, ..] = &self.numbers;
        let wavelengths = |i: usize| &lanes[of(self.lanes[i])].wavelengths;
        let points = (self.contexts.as_slice(), &self.points);
        world.sample_lights(level, points, &u_light[0], u_point, wavelengths, &mut self.lights);
        dispatch!(level, _simd => self.connect::<METAL>(n));
        self.shadow_rays.clear();
        self.asked.clear();
        for i in (0..n).filter(|&i| self.lit.0[i] != 0) {
            let (o, time) = (self.shadow_o.point(i), lanes[of(self.lanes[i])].walk.ray.time);
            self.shadow_rays.push(&if self.lights.infinite.0[i] != 0 {
                Ray::new(o, self.lights.wi.vec(i), time)
            } else {
                Ray { o, d: self.shadow_d.vec(i), t_max: Ray::MOST_OF_THE_WAY, time }
            });
            self.asked.push(i as u32);
            record.ray(RayKind::Shadow);
        }
        let occluded = record::occluded_rows(world, &mut self.shadow_rays, record);
        for (k, &i) in self.asked.iter().enumerate() {
            if occluded >> k & 1 == 0 {
                lanes[of(self.lanes[i as usize])].walk.radiance += self.direct.get(i as usize);
            }
        }
        dispatch!(level, _simd => self.reflect::<METAL>(n));
        let mut alive = 0;
        for i in 0..n {
            let Lane { walk, place, .. } = &mut lanes[of(self.lanes[i])];
            walk.depth += 1;
            if self.scattered.0[i] != 0 {
                record.ray(RayKind::Scattered);
            }
            if self.alive.0[i] == 0 {
                record.path(walk.depth);
                continue;
            }
            alive |= 1 << self.lanes[i];
            place.dimension += DIMENSIONS;
            walk.ray = Ray::new(self.o.point(i), self.wi.vec(i), walk.ray.time);
            walk.differential = None;
            walk.beta = self.beta.get(i);
            walk.p_lobe = self.p_lobe.0[i];
            walk.previous = Some(self.contexts[i]);
            walk.any_non_specular = true;
        }
        alive
    }

    /// The light of the sampled lights by way of the lobes, weighted against finding it by the lobe.
    #[inline(always)]
    fn connect<const METAL: bool>(&mut self, n: usize) {
        for i in 0..row_end(n) {
            let (wi, wo) = (self.lights.wi.vec(i), self.points.wo.vec(i));
            let local = self.points.frame(i).to_local(wi);
            let (f, p_lobe) = if METAL {
                self.metal(i).eval_and_pdf(wo, local)
            } else {
                let cos = local.z.abs() * INV_PI;
                let p_lobe = if wo.z * local.z > 0.0 { cos } else { 0.0 };
                (self.albedo.get(i) * p_lobe, p_lobe)
            };
            let value = self.beta.get(i) * f * self.lights.radiance.get(i);
            let p_light = self.lights.pdf.0[i];
            let weight = power_weight(p_light, p_lobe);
            let weight = if self.lights.is_delta.0[i] != 0 { 1.0 } else { weight };
            let [a, b, c, d] = value.0;
            let black = (a == 0.0) & (b == 0.0) & (c == 0.0) & (d == 0.0);
            let lit = (self.lights.lit.0[i] != 0) & !black;
            self.lit.0[i] = u32::from(lit);
            self.direct.set(i, value * (weight / p_light));
            let o = offset_ray_origin(self.points.p.point(i), self.points.p_error.vec(i), self.points.n.normal(i), wi);
            self.shadow_o.set(i, o.to_vec());
            self.shadow_d.set(i, self.lights.end.point(i) - o);
        }
    }

    /// Directions of the lobes, and roulette.
    #[inline(always)]
    fn reflect<const METAL: bool>(&mut self, n: usize) {
        for i in 0..row_end(n) {
            let [.., direction, roulette] = &self.numbers;
            let u = [direction[0].0[i], direction[1].0[i]];
            let wo = self.points.wo.vec(i);
            let (wi, weight, pdf, scattered) = if METAL {
                self.metal(i).sample(wo, u)
            } else {
                let mut wi = square_to_cosine_hemisphere(u);
                let pdf = wi.z * INV_PI;
                wi.z = wi.z.copysign(wo.z);
                (wi, self.albedo.get(i), pdf, (pdf > 0.0) & (wo.z != 0.0))
            };
            let world = self.points.frame(i).from_local(wi);
            let beta = self.beta.get(i) * weight;
            let left = (beta * self.eta_scale.0[i]).max_component() / Techniques::ROULETTE;
            let survival = if self.depth.0[i] > 1 { left.min(1.0) } else { 1.0 };
            let ends = (survival < 1.0) & (roulette[0].0[i] >= survival);
            self.beta.set(i, beta * if survival < 1.0 { 1.0 / survival } else { 1.0 });
            self.p_lobe.0[i] = pdf;
            self.scattered.0[i] = u32::from(scattered);
            self.alive.0[i] = u32::from(scattered & !ends);
            self.wi.set(i, world);
            let (p, p_error, n) = (self.points.p.point(i), self.points.p_error.vec(i), self.points.n.normal(i));
            self.o.set(i, offset_ray_origin(p, p_error, n, world).to_vec());
        }
    }
}
