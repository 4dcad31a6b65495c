//! Where light that goes in at a point of a translucent object comes out of it again (King et al. 2013).
//!
//! A lane is taken at random and a probe segment whose distance from the point follows that lane's profile; of the places
//! where the segment meets the object one is chosen. Densities of all lanes are averaged, which is multiple importance
//! sampling by the balance heuristic over the lanes.

use crate::numbers::{Domain, Numbers};
use crate::record::{self, RayKind, Record};
use steradian_bsdf::{Bsdf, Subsurface};
use steradian_math::{Frame, Ray};
use steradian_sampling::Rng;
use steradian_scene::{Surface, World};
use steradian_spectrum::{Lanes, Wavelengths};

/// A point where light comes out.
pub struct Exit {
    /// The point; the path counts as coming along its normal.
    pub surface: Surface,
    /// The frame of its shading normal.
    pub frame: Frame,
    /// How light leaves.
    pub bsdf: Bsdf<'static>,
    /// Throughput from going in to coming out, over density.
    pub weight: Lanes,
}

/// Takes a place for light that went in at `surface` with shading frame `frame`. `None` if it is lost.
pub fn exit<N: Numbers, R: Record>(
    world: &World,
    (surface, frame): (&Surface, &Frame),
    inside: &Subsurface<'_>,
    wavelengths: &Wavelengths,
    numbers: &mut N,
    record: &mut R,
) -> Option<Exit> {
    let (u_lane, u_axis) = (numbers.one(Domain::Other), numbers.one(Domain::Other));
    let (u_disk, u_choice) = (numbers.two(Domain::Other), numbers.one(Domain::Other));
    // Lanes that carry nothing must not be taken.
    let lanes = if wavelengths.is_rgb() {
        0..3
    } else if wavelengths.secondary_terminated() {
        wavelengths.hero_lane()..wavelengths.hero_lane() + 1
    } else {
        0..Lanes::COUNT
    };
    let lane = lanes.start + ((u_lane * lanes.len() as f32) as usize).min(lanes.len() - 1);
    let probe = inside.sample_probe(lane, u_axis, u_disk)?;

    // Of all places on the segment keep one, each with the same probability.
    let material = world.material(surface);
    let end = surface.p + frame.from_local(probe.end);
    let along = (end - (surface.p + frame.from_local(probe.start))).try_normalize()?;
    let start = surface.p + frame.from_local(probe.start);
    let mut ray = Ray { o: start, d: along, t_max: (end - start).dot(along), time: surface.time };
    let mut rng = Rng::new(u64::from(u_choice.to_bits()), 0);
    let (mut found, mut chosen) = (0u32, None);
    while ray.t_max > 0.0 {
        record.ray(RayKind::Scattered);
        let Some(hit) = record::intersect(world, &ray, record) else { break };
        let here = world.surface(&ray, &hit);
        if world.material(&here) == material {
            found += 1;
            if rng.below(found) == 0 {
                chosen = Some(here);
            }
        }
        let next = here.spawn_ray(along);
        ray = Ray { t_max: (end - next.o).dot(along), ..next };
    }

    let mut out = chosen?;
    let d = frame.to_local(out.p - surface.p);
    let n = frame.to_local(out.n);
    let pdf = inside.pdf(d, n);
    let mean = lanes.clone().map(|i| pdf[i]).sum::<f32>() / lanes.len() as f32;
    if mean <= 0.0 || !mean.is_finite() {
        return None;
    }
    let weight = inside.eval(d.length()) * (found as f32 / mean);
    let frame = Frame::from_xz(out.shading.dpdu, out.shading.n);
    out.wo = frame.z;
    (!weight.is_black()).then(|| Exit { surface: out, frame, bsdf: inside.exit().into(), weight })
}
