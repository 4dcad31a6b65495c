//! What gets through from one vertex to another: surfaces that only separate media are passed, others block.

use crate::hero::Hero;
use crate::record::{self, RayKind, Record};
use crate::transmitted::Transmitted;
use steradian_math::{Point3, Ray};
use steradian_scene::{Handle, Medium, World};
use steradian_spectrum::Wavelengths;

/// What gets along `ray`, which ends at the parameter 1 or never, or an estimate of it. `None` if something is in the way.
/// `target` is where the ray leads, to go on there behind each boundary; `seed` makes estimates random.
pub(crate) fn transmittance<R: Record>(
    world: &World,
    mut ray: Ray,
    target: Option<Point3>,
    mut medium: Option<Handle<Medium>>,
    (hero, w): (Hero, &Wavelengths),
    seed: f32,
    record: &mut R,
) -> Option<Transmitted> {
    record.ray(RayKind::Shadow);
    if !world.has_media() && !world.has_interfaces() {
        return (!record::occluded(world, &ray, record)).then_some(Transmitted::ALL);
    }
    let mut out = Transmitted::ALL;
    let mut rng = Transmitted::rng(&ray, seed);
    let left = |o: &Transmitted| o.t * (1.0 / hero.average(o.r_l, w));
    loop {
        let hit = record::intersect(world, &ray, record);
        if hit.is_some_and(|h| !world.is_interface(&h)) {
            return None;
        }
        if let Some(m) = medium {
            let length = ray.d.length();
            let t_max = hit.map_or(ray.whole_way(), |h| h.t) * length;
            let along = world.medium_ray(m, ray.o, ray.d * (1.0 / length), w);
            out.pass(along, t_max, hero.lane, &mut rng, left)?;
        }
        let Some(hit) = hit else { return Some(out) };
        let surface = world.surface(&ray, &hit);
        medium = world.medium_beyond(&surface, ray.d, medium);
        let next = surface.continue_ray(&ray);
        ray = match target {
            Some(p) if (p - next.o).dot(ray.d) <= 0.0 => return Some(out),
            Some(p) => Ray::between(next.o, p, next.time),
            None => next,
        };
    }
}
