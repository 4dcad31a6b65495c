//! Samples of lights side by side: those that each path alone would have got, bit for bit.
//!
//! Triangles that shine evenly and environment maps are worked on in rows; other lights are left to the functions for one path.

use super::World;
use super::light::{EmitterShape, LightContext, LightSample, PickRows, SkyRows};
use super::rows::{PointRows, either};
use steradian_bvh::fearless_simd::{Level, dispatch};
use steradian_geometry::{PreparedTriangle, Triangle};
use steradian_math::{ONE_MINUS_EPSILON, Row, Rows3, Vec3, offset_ray_origin, row_end};
use steradian_sampling::warp::square_to_uniform_triangle;
use steradian_spectrum::{LaneRows, Wavelengths};

/// Samples of lights.
#[derive(Clone, Debug, Default)]
pub struct LightRows {
    corners: [Rows3; 3],
    n: Rows3,
    p_error: Rows3,
    inv_area: Row,
    u: [Row; 2],
    probability: Row,
    two_sided: Row<u32>,
    picks: PickRows,
    /// What lies near, where it has been sampled already.
    p: Rows3,
    is_near: Row<u32>,
    near: NearRows,
    sky: SkyRows,
    /// Environment maps, each with its place.
    skies: Vec<(u32, usize)>,
    far: Vec<(usize, LightSample)>,
    /// Whether there is any light.
    pub lit: Row<u32>,
    /// See [`LightSample`].
    pub radiance: LaneRows,
    /// Unit direction to the light.
    pub wi: Rows3,
    /// The end of the shadow ray; without meaning if `infinite`.
    pub end: Rows3,
    /// Density per solid angle times the probability of the light.
    pub pdf: Row,
    /// Whether the light cannot be hit by chance.
    pub is_delta: Row<u32>,
    /// Whether the shadow ray has no end.
    pub infinite: Row<u32>,
}

/// Triangles that are sampled by solid angle.
#[derive(Clone, Debug, Default)]
struct NearRows {
    /// The place of each, and its light.
    places: Vec<(usize, u32)>,
    from: Rows3,
    ns: Rows3,
    corners: [Rows3; 3],
    u: [Row; 2],
    p: Rows3,
    p_error: Rows3,
    pdf: Row,
    usual: Row<u32>,
}

/// Where a light stands.
enum Stand {
    /// In the rows, to be sampled by area.
    Far,
    /// Among those to be sampled by solid angle.
    Near,
    /// Among the environment maps.
    Sky,
    /// Nowhere.
    Alone,
}

/// Points on near lamps, as [`Triangle::sample_solid_angle`] has them in the usual case.
#[inline(always)]
fn illuminate_near(rows: &mut NearRows, end: usize) {
    for i in 0..end {
        let triangle = Triangle { p: [rows.corners[0].point(i), rows.corners[1].point(i), rows.corners[2].point(i)] };
        let u = [rows.u[0].0[i], rows.u[1].0[i]];
        let ([b1, b2], pdf, usual) = triangle.sample_near(rows.from.point(i), rows.ns.normal(i), u);
        let (p, p_error) = triangle.point(b1, b2);
        rows.p.set(i, p.to_vec());
        rows.p_error.set(i, p_error);
        rows.pdf.0[i] = pdf;
        rows.usual.0[i] = u32::from(usual);
    }
}

/// Points on lamps, and their densities, as `PreparedTriangle` and `World::sample_light` have them.
#[inline(always)]
fn illuminate(rows: &mut LightRows, from: &Rows3, end: usize) {
    for i in 0..end {
        let [b0, b1, b2] = square_to_uniform_triangle([rows.u[0].0[i], rows.u[1].0[i]]);
        let [q0, q1, q2] = [rows.corners[0].point(i), rows.corners[1].point(i), rows.corners[2].point(i)];
        let near = rows.is_near.0[i] != 0;
        let p = either(near, rows.p.vec(i), (q0 * b0 + q1 * b1 + q2 * b2).to_vec()).to_point();
        let n = rows.n.normal(i);
        let d = p - from.point(i);
        let density = PreparedTriangle::density(rows.inv_area.0[i], n, d);
        let pdf = if near { rows.pdf.0[i] } else { density };
        let wi = d * (1.0 / d.length());
        let behind = n.dot(-wi) <= 0.0;
        let lit = (pdf > 0.0) & (pdf < f32::INFINITY) & ((rows.two_sided.0[i] != 0) | !behind);
        rows.lit.0[i] &= u32::from(lit);
        rows.wi.set(i, wi);
        rows.end.set(i, offset_ray_origin(p, rows.p_error.vec(i), n, -wi));
        rows.pdf.0[i] = pdf * rows.probability.0[i];
    }
}

impl World {
    /// Samples light for `contexts`, which are the first places of the points: as [`World::sample_light`].
    pub fn sample_lights<'a>(
        &self,
        level: Level,
        (contexts, points): (&[LightContext], &PointRows),
        u: &Row,
        u2: &[Row; 2],
        wavelengths: impl Fn(usize) -> &'a Wavelengths + Copy,
        rows: &mut LightRows,
    ) {
        let n = contexts.len();
        rows.far.clear();
        rows.skies.clear();
        rows.near.places.clear();
        let together = self.pick_lights(level, (&points.p, &points.frame[2]), &u2[0], n, &mut rows.picks);
        for (i, context) in contexts.iter().enumerate() {
            rows.lit.0[i] = 0;
            let pick = if together { rows.picks.pick(i) } else { self.pick_light(context, u2[0].0[i]) };
            let Some(pick) = pick else { continue };
            let x = pick.u + u.0[i] * (0.5 * f32::EPSILON) / pick.probability;
            let u = [x.min(ONE_MINUS_EPSILON), u2[1].0[i]];
            (rows.u[0].0[i], rows.u[1].0[i]) = (u[0], u[1]);
            rows.probability.0[i] = pick.probability;
            rows.is_near.0[i] = 0;
            match self.place_light(context, pick.light, wavelengths(i), rows, i) {
                Stand::Far => {}
                Stand::Near => rows.near.places.push((i, pick.light)),
                Stand::Sky => rows.skies.push((pick.light, i)),
                Stand::Alone => self.sample_alone(context, pick.light, wavelengths(i), rows, i),
            }
        }
        if !rows.near.places.is_empty() {
            self.sample_near_lamps(level, (contexts, points), wavelengths, rows);
        }
        dispatch!(level, _simd => illuminate(rows, &points.p, row_end(n)));
        if !rows.skies.is_empty() {
            self.sample_skies(level, wavelengths, rows);
        }
        for k in 0..rows.far.len() {
            let (i, s) = rows.far[k];
            rows.lit.0[i] = 1;
            rows.radiance.set(i, s.radiance);
            rows.wi.set(i, s.wi);
            rows.end.set(i, s.end.to_vec());
            rows.pdf.0[i] = s.pdf;
            rows.is_delta.0[i] = u32::from(s.is_delta);
            rows.infinite.0[i] = u32::from(s.distance == f32::INFINITY);
        }
    }

    /// Samples the light of a place by the function for one path.
    fn sample_alone(&self, context: &LightContext, light: u32, w: &Wavelengths, rows: &mut LightRows, i: usize) {
        let u = [rows.u[0].0[i], rows.u[1].0[i]];
        let sample = self.sample_picked(context, light, rows.probability.0[i], u, w);
        rows.far.extend(sample.map(|s| (i, s)));
    }

    /// Puts a light into a place, if it is of a kind for rows.
    #[inline]
    fn place_light(
        &self,
        context: &LightContext,
        light: u32,
        w: &Wavelengths,
        rows: &mut LightRows,
        i: usize,
    ) -> Stand {
        let Some(emitter) = self.lights.emitters.get(light as usize) else {
            return if self.has_sky_rows(light) { Stand::Sky } else { Stand::Alone };
        };
        let (EmitterShape::Triangle(..), Some(triangle), None) = (emitter.shape, &emitter.prepared, emitter.instance)
        else {
            return Stand::Alone;
        };
        let emission = &self.area_lights[emitter.emission as usize];
        if emission.image.is_some() || emission.texture.is_some() || emitter.alpha.is_some() {
            return Stand::Alone;
        }
        for (row, p) in rows.corners.iter_mut().zip(triangle.corners()) {
            row.set(i, p);
        }
        rows.n.set(i, triangle.normal());
        rows.p_error.set(i, triangle.p_error());
        rows.inv_area.0[i] = triangle.inv_area();
        rows.two_sided.0[i] = u32::from(emission.two_sided);
        let radiance = emission.radiance.eval(w) * emitter.scale;
        rows.radiance.set(i, radiance);
        rows.lit.0[i] = u32::from(!radiance.is_black());
        rows.is_delta.0[i] = 0;
        rows.infinite.0[i] = 0;
        if triangle.is_far(context.position()) { Stand::Far } else { Stand::Near }
    }

    /// Samples what lies near by solid angle; unusual cases are left to the function for one path.
    fn sample_near_lamps<'a>(
        &self,
        level: Level,
        (contexts, points): (&[LightContext], &PointRows),
        wavelengths: impl Fn(usize) -> &'a Wavelengths,
        rows: &mut LightRows,
    ) {
        let mut near = std::mem::take(&mut rows.near.places);
        for (k, &(i, _)) in near.iter().enumerate() {
            for (to, from) in rows.near.corners.iter_mut().zip(&rows.corners) {
                to.set(k, from.vec(i));
            }
            rows.near.from.set(k, points.p.vec(i));
            rows.near.ns.set(k, points.frame[2].vec(i));
            (rows.near.u[0].0[k], rows.near.u[1].0[k]) = (rows.u[0].0[i], rows.u[1].0[i]);
        }
        let n = near.len();
        dispatch!(level, _simd => illuminate_near(&mut rows.near, row_end(n)));
        for (k, (i, light)) in near.drain(..).enumerate() {
            if rows.near.usual.0[k] == 0 {
                rows.lit.0[i] = 0;
                self.sample_alone(&contexts[i], light, wavelengths(i), rows, i);
                continue;
            }
            rows.is_near.0[i] = 1;
            rows.p.set(i, rows.near.p.vec(k));
            rows.p_error.set(i, rows.near.p_error.vec(k));
            rows.pdf.0[i] = rows.near.pdf.0[k];
        }
        rows.near.places = near;
    }

    /// Samples environment maps.
    fn sample_skies<'a>(&self, level: Level, wavelengths: impl Fn(usize) -> &'a Wavelengths, rows: &mut LightRows) {
        for &light in self.infinite_lights() {
            let sky = &mut rows.sky;
            sky.places.clear();
            for &(_, i) in rows.skies.iter().filter(|s| s.0 == light) {
                let k = sky.places.len();
                (sky.u[0].0[k], sky.u[1].0[k]) = (rows.u[0].0[i], rows.u[1].0[i]);
                sky.places.push(i);
            }
            if sky.places.is_empty() {
                continue;
            }
            self.sample_sky(level, light, sky);
            for (k, &i) in sky.places.iter().enumerate() {
                let radiance = self.sky_at(light, sky, k, wavelengths(i));
                if sky.lit.0[k] == 0 || radiance.is_black() {
                    continue;
                }
                rows.lit.0[i] = 1;
                rows.radiance.set(i, radiance);
                rows.wi.set(i, sky.wi.vec(k));
                rows.end.set(i, Vec3::default());
                rows.pdf.0[i] = sky.pdf.0[k] * rows.probability.0[i];
                rows.is_delta.0[i] = 0;
                rows.infinite.0[i] = 1;
            }
        }
    }
}
