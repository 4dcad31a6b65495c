//! Lamps as points: what ray tracing before 1984 made of them (Whitted 1980).
//!
//! Convention. Each primitive that shines becomes one point at the centre of its area, and its light falls off with the
//! squared distance and nothing else. A flat lamp keeps the cosine on its own side: `I = L A cos`. Any other shape shines
//! alike to all sides with its mean projected area, which is a quarter of its surface for every convex body: `I = L A / 4`.
//! A lamp casts no shadow of its own, so that a point inside it is seen. A lamp with a picture has the colour of the
//! picture's middle. Environments have no point.

use super::moving::MovingFar;
use super::{LightContext, LightEnd, LightSample, Lights};
use crate::LightCensus;
use crate::world::{Hit, World};
use steradian_math::{Normal3, Point2, Point3, Ray, Vec3};
use steradian_spectrum::Wavelengths;

/// A lamp as a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightPoint {
    /// Where it is, before it moves.
    pub p: Point3,
    /// The normal, if the lamp is flat.
    pub n: Option<Normal3>,
    /// Area times the factor of the emission, summed over the elements.
    strength: f32,
    /// Which area light.
    emission: u32,
    /// The instance in whose space it is given; the world's if none.
    instance: Option<u32>,
}

impl Lights {
    /// The points of all lamps, in the order of the area lights.
    pub(super) fn light_points(&self, world: &World) -> Vec<LightPoint> {
        let mut points = Vec::new();
        for elements in self.emitters.chunk_by(|a, b| a.emission == b.emission) {
            let (mut area, mut strength, mut centre) = (0.0f64, 0.0f32, [0.0f64; 3]);
            let (mut axis, mut flat) = (None, true);
            for e in elements {
                let a = world.emitter_area(e);
                let c = world.emitter_centre(e);
                area += f64::from(a);
                strength += a * e.scale;
                for i in 0..3 {
                    centre[i] += f64::from(a) * f64::from(c[i]);
                }
                let (n, cos) = world.shape_normals(e);
                flat &= cos == 1.0 && axis.is_none_or(|first: Vec3| first.dot(n) > 1.0 - 1e-4);
                axis = axis.or(Some(n));
            }
            if area > 0.0 {
                let [x, y, z] = centre.map(|c| (c / area) as f32);
                let n = axis.filter(|_| flat).map(Vec3::to_normal);
                points.push(LightPoint {
                    p: Point3::new(x, y, z),
                    n,
                    strength,
                    emission: elements[0].emission,
                    instance: elements[0].instance,
                });
            }
        }
        points
    }
}

impl World {
    /// The lamps as points; see the module's convention.
    pub fn light_points(&self) -> &[LightPoint] {
        &self.lights.points
    }

    /// The numbers of the lights that are points, spots or distant lights.
    pub fn delta_lights(&self) -> impl Iterator<Item = u32> + '_ {
        let first = self.lights.emitters.len();
        let delta = self.lights.far.iter().enumerate().filter(|(_, far)| far.is_delta());
        delta.map(move |(i, _)| (first + i) as u32)
    }

    /// Whether the light is a point, a spot or a distant light.
    #[inline]
    pub fn is_delta_light(&self, light: u32) -> bool {
        let far = (light as usize).checked_sub(self.lights.emitters.len());
        far.is_some_and(|i| self.lights.far.get(i).is_some_and(MovingFar::is_delta))
    }

    /// What the settings of an integrator must know of the lights.
    pub fn light_census(&self) -> LightCensus {
        let delta = self.delta_lights().count();
        LightCensus {
            extended: self.light_count() - delta,
            delta,
            lamps: self.lights.points.len(),
            lens: self.camera.has_lens(),
            motion: self.has_motion,
            receiver: self.camera.is_receiver(),
            unsampled: self.has_unsampled_lights(),
            subsurface: self.has_subsurface(),
            glowing_media: self.scene().media.iter().any(|m| m.volume.glows()),
            media: self.has_media(),
        }
    }

    /// Whether something shines that light sampling cannot find: curves.
    pub fn has_unsampled_lights(&self) -> bool {
        self.groups.iter().any(|g| g.primitives.iter().any(|p| p.unsampled_emission.is_some()))
    }

    /// The irradiance that a lamp's point gives a surface that faces it. `None` if it is dark from there.
    pub fn sample_light_point(
        &self,
        context: &LightContext,
        point: &LightPoint,
        w: &Wavelengths,
    ) -> Option<LightSample> {
        let (p, own_n) = match point.instance {
            None => (point.p, point.n),
            Some(i) => {
                let t = self.instances[i as usize].world_from_object.at(context.time);
                (t.point(point.p), point.n.map(|n| t.normal(n).normalize()))
            }
        };
        let d = p - context.reference.p;
        let distance = d.length();
        let wi = d.try_normalize()?;
        let light = &self.area_lights[point.emission as usize];
        let (facing, n) = match own_n {
            // The side that shines faces the surface; both sides may.
            Some(n) => {
                let cos = -n.dot(wi);
                (if light.two_sided { cos.abs() } else { cos.max(0.0) }, n)
            }
            None => (0.25, (-wi).to_normal()),
        };
        let middle = Point2::new(0.5, 0.5);
        // The side is settled above: ask for the one that shines.
        let side = if n.dot(-wi) < 0.0 { wi } else { -wi };
        let emitted = self.area_radiance(point.emission, 1.0, n, (middle, None), side, w);
        let radiance = emitted * (point.strength * facing / (distance * distance));
        (!radiance.is_black()).then_some(LightSample {
            light: point.emission,
            radiance,
            wi,
            distance,
            end: p,
            light_end: LightEnd::without_surface(point.emission, p, context.time),
            pdf: 1.0,
            is_delta: true,
        })
    }

    /// Whether what a shadow ray met is the lamp itself: it casts no shadow of its own.
    pub fn is_light_point(&self, ray: &Ray, hit: &Hit, point: &LightPoint) -> bool {
        self.surface(ray, hit).emission.is_some_and(|(e, _)| e == point.emission)
    }
}
