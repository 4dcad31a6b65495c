//! Subsurface scattering that depends on distance alone (Jensen et al. 2001; King et al. 2013): where light that goes in at a
//! point comes out again, and how it then leaves the surface.

use crate::diffusion::DiffusionTable;
use crate::direction::same_hemisphere;
use crate::fresnel::{fresnel_dielectric, fresnel_moment_1};
use crate::lobe::{Lobe, LobeSample, Lobes, Part, TransportMode};
use steradian_math::{INV_PI, TAU, Vec3, sin_cos, sqr};
use steradian_sampling::warp::square_to_cosine_hemisphere;
use steradian_spectrum::Lanes;

/// Fraction of the profile that probes reach for; what lies beyond is lost.
const REACH: f32 = 0.999;
/// Probability of probing along each axis of the local frame.
const AXES: [f32; 3] = [0.25, 0.25, 0.5];

/// The translucent stuff below a surface point, at the wavelengths of a path.
///
/// Offsets are from the point of entry, in its local frame with `+z` the shading normal.
#[derive(Clone, Copy, Debug)]
pub struct Subsurface<'w> {
    table: &'w DiffusionTable,
    sigma_t: Lanes,
    albedo: Lanes,
    eta: f32,
}

/// A segment along which to look for the surface, as offsets from the point of entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Where it starts.
    pub start: Vec3,
    /// Where it ends.
    pub end: Vec3,
}

impl<'w> Subsurface<'w> {
    /// With absorption and scattering coefficients per unit length. The table must be of the same `eta`.
    #[inline]
    pub fn new(table: &'w DiffusionTable, sigma_a: Lanes, sigma_s: Lanes, eta: f32) -> Self {
        let sigma_t = sigma_a + sigma_s;
        Self { table, sigma_t, albedo: sigma_s.safe_div(sigma_t), eta }
    }

    /// With the colour of a thick slab in `[0, 1]` and the mean free path.
    pub fn of_reflectance(table: &'w DiffusionTable, reflectance: Lanes, mean_free_path: Lanes, eta: f32) -> Self {
        let albedo = reflectance.map(|r| table.albedo_of_reflectance(r));
        // Without a mean free path everything comes out where it went in; a short one comes close.
        let sigma_t = mean_free_path.map(|m| 1.0 / m.max(1e-6));
        Self { table, sigma_t, albedo, eta }
    }

    /// `S` and its density per area of the plane across the probe, at distance `r`.
    #[inline]
    fn profile(&self, r: f32) -> (Lanes, Lanes) {
        let (mut s, mut pdf) = (Lanes::ZERO, Lanes::ZERO);
        for i in 0..Lanes::COUNT {
            let (value, total) = self.table.eval(self.albedo[i], r * self.sigma_t[i]);
            let value = value * sqr(self.sigma_t[i]);
            s[i] = value;
            pdf[i] = if total > 0.0 { value / total } else { 0.0 };
        }
        (s, pdf)
    }

    /// The light that comes out at distance `r`, per area and per light that goes in.
    #[inline]
    pub fn eval(&self, r: f32) -> Lanes {
        self.profile(r).0
    }

    /// Density per surface area of coming out at offset `d` where the surface's normal is `n`, by lane: that of finding
    /// the point by probes made for each lane.
    #[inline]
    pub fn pdf(&self, d: Vec3, n: Vec3) -> Lanes {
        (0..3).fold(Lanes::ZERO, |sum, axis| {
            let (a, b) = (d[(axis + 1) % 3], d[(axis + 2) % 3]);
            let share = AXES[axis] * n[axis].abs();
            if share == 0.0 { sum } else { sum + self.profile((sqr(a) + sqr(b)).sqrt()).1 * share }
        })
    }

    /// A probe whose distance from the point of entry follows the profile of `lane`. `None` if nothing comes out, or the
    /// distance is beyond reach.
    pub fn sample_probe(&self, lane: usize, u_axis: f32, u: [f32; 2]) -> Option<Probe> {
        let (albedo, sigma_t) = (self.albedo[lane], self.sigma_t[lane]);
        if sigma_t <= 0.0 {
            return None;
        }
        let r = self.table.sample_radius(albedo, u[0])? / sigma_t;
        let reach = self.table.sample_radius(albedo, REACH)? / sigma_t;
        if r >= reach {
            return None;
        }
        let axis = if u_axis < AXES[0] { 0 } else { 1 + usize::from(u_axis >= AXES[0] + AXES[1]) };
        let half = (sqr(reach) - sqr(r)).max(0.0).sqrt();
        let (sin, cos) = sin_cos(TAU * u[1]);
        let turned = |along: f32| {
            let mut v = [0.0; 3];
            (v[axis], v[(axis + 1) % 3], v[(axis + 2) % 3]) = (along, r * cos, r * sin);
            Vec3::from_array(v)
        };
        Some(Probe { start: turned(-half), end: turned(half) })
    }

    /// How light leaves the surface.
    #[inline]
    pub fn exit(&self) -> SubsurfaceExit {
        SubsurfaceExit::new(self.eta)
    }
}

/// Light that comes from below the surface, evenly but for Fresnel's loss: `f = (1 - F(wi)) / (c pi)`, where `c` makes its
/// albedo one.
///
/// It is half of a scattering event, so it is not reciprocal; in `Radiance` mode it has the factor `eta^2` that undoes the
/// one of going in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SubsurfaceExit {
    eta: f32,
    scale: f32,
}

impl SubsurfaceExit {
    /// For an index inside relative to outside.
    #[inline]
    pub fn new(eta: f32) -> Self {
        let c = 1.0 - 2.0 * fresnel_moment_1(1.0 / eta);
        Self { eta, scale: 1.0 / c.max(1e-3) }
    }

    #[inline]
    fn weight(&self, wi: Vec3, mode: TransportMode) -> Lanes {
        let scale = match mode {
            TransportMode::Radiance => self.scale * sqr(self.eta),
            TransportMode::Importance => self.scale,
        };
        Lanes::splat(scale * (1.0 - fresnel_dielectric(wi.z.abs(), self.eta)))
    }
}

impl Lobe for SubsurfaceExit {
    #[inline]
    fn flags(&self) -> Lobes {
        Lobes::REFLECTION | Lobes::DIFFUSE
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3, mode: TransportMode) -> Lanes {
        if same_hemisphere(wo, wi) { self.weight(wi, mode) * INV_PI } else { Lanes::ZERO }
    }

    #[inline]
    fn pdf_part(&self, wo: Vec3, wi: Vec3, _mode: TransportMode, part: Part) -> f32 {
        if part != Part::Transmission && same_hemisphere(wo, wi) { wi.z.abs() * INV_PI } else { 0.0 }
    }

    #[inline]
    fn sample_part(&self, wo: Vec3, _: f32, u: [f32; 2], mode: TransportMode, part: Part) -> Option<LobeSample> {
        if part == Part::Transmission {
            return None;
        }
        let mut wi = square_to_cosine_hemisphere(u);
        let pdf = wi.z * INV_PI;
        wi.z = wi.z.copysign(wo.z);
        (pdf > 0.0 && wo.z != 0.0).then(|| LobeSample {
            wi,
            weight: self.weight(wi, mode),
            pdf,
            flags: Lobes::REFLECTION | Lobes::DIFFUSE,
            eta: 1.0,
            pdf_is_proportional: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_below_comes_out_once() {
        for eta in [1.0f32, 1.1, 1.33, 1.5] {
            let exit = SubsurfaceExit::new(eta);
            let n = 2000;
            let albedo: f32 = (0..n)
                .map(|i| {
                    let cos = ((i as f32 + 0.5) / n as f32).sqrt();
                    exit.weight(Vec3::spherical((1.0 - cos * cos).sqrt(), cos, 0.3), TransportMode::Importance)[0]
                })
                .sum::<f32>()
                / n as f32;
            // As good as the fit to Fresnel's moment.
            assert!((albedo - 1.0).abs() < 0.012, "eta {eta}: {albedo}");
        }
    }

    #[test]
    fn probes_on_a_plane_find_what_the_density_says() {
        // On a plane only probes along z meet the surface, at a point whose density is half that of the profile.
        let table = DiffusionTable::new(0.0, 1.33);
        let s = Subsurface::new(&table, Lanes::splat(0.1), Lanes([1.0, 2.0, 4.0, 0.0]), 1.33);
        let n = 4000;
        let (mut found, mut inside) = (0, 0);
        for i in 0..n {
            let u = (i as f32 + 0.5) / n as f32;
            let Some(p) = s.sample_probe(1, 0.7, [u, 0.3]) else { continue };
            assert_eq!((p.start.x, p.start.y, p.start.z), (p.end.x, p.end.y, -p.end.z));
            found += 1;
            inside += usize::from((sqr(p.start.x) + sqr(p.start.y)).sqrt() < 0.5);
        }
        assert!((f64::from(found) / f64::from(n) - 0.999).abs() < 1e-3);
        let up = Vec3::new(0.0, 0.0, 1.0);
        let expected: f32 = (0..n)
            .map(|i| {
                let r = 0.5 * (i as f32 + 0.5) / n as f32;
                s.pdf(Vec3::new(r, 0.0, 0.0), up)[1] * 2.0 * TAU * r * 0.5 / n as f32
            })
            .sum();
        assert!((inside as f32 / n as f32 - expected).abs() < 3e-3, "{inside} of {n}, {expected}");
        assert!(s.sample_probe(3, 0.7, [0.5, 0.3]).is_none() && s.eval(0.1)[3] == 0.0);
    }
}
