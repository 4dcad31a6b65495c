//! Directions drawn with more or less regard for the lobe: uniformly, by the cosine, by the lobe itself.

use steradian_bsdf::{Bsdf, Lobe, LobeSample, Lobes, TransportMode};
use steradian_math::{INV_2PI, INV_PI, Vec3};
use steradian_sampling::warp::{square_to_cosine_hemisphere, square_to_uniform_hemisphere};
use steradian_scene::LobeSampling;

const MODE: TransportMode = TransportMode::Radiance;

/// The probability with which a lobe that is partly Dirac is asked for its Dirac part.
const DIRAC_SHARE: f32 = 0.5;

/// Which hemispheres a lobe reaches, and with what probability the part that is not Dirac is chosen.
struct Reach {
    same: bool,
    other: bool,
    share: f32,
}

impl Reach {
    fn of(bsdf: &Bsdf) -> Self {
        let flags = bsdf.flags();
        let share = if flags.is_specular() { 1.0 - DIRAC_SHARE } else { 1.0 };
        Self { same: flags.is_reflective(), other: flags.is_transmissive(), share }
    }

    /// Density of the hemispheres' choice for a direction.
    fn side(&self, wo: Vec3, wi: Vec3) -> f32 {
        let reached = if wo.z * wi.z > 0.0 { self.same } else { self.other };
        match (reached, self.same && self.other) {
            (false, _) => 0.0,
            (true, false) => 1.0,
            (true, true) => 0.5,
        }
    }
}

/// Takes a direction. As [`Lobe::sample`], but that the density is always the true one for comparison with other techniques.
#[inline]
pub fn sample(how: LobeSampling, bsdf: &Bsdf, wo: Vec3, u_lobe: f32, u: [f32; 2]) -> Option<LobeSample> {
    if how == LobeSampling::Lobe || !bsdf.flags().is_non_specular() {
        let mut sample = bsdf.sample(wo, u_lobe, u, MODE)?;
        if sample.pdf_is_proportional {
            sample.pdf = bsdf.pdf(wo, sample.wi, MODE);
        }
        return Some(sample);
    }
    let reach = Reach::of(bsdf);
    let mut u_lobe = u_lobe;
    if bsdf.flags().is_specular() {
        if u_lobe < DIRAC_SHARE {
            let sample = bsdf.sample(wo, u_lobe / DIRAC_SHARE, u, MODE)?;
            let weight = sample.weight * (1.0 / DIRAC_SHARE);
            return sample.flags.contains(Lobes::SPECULAR).then_some(LobeSample { weight, ..sample });
        }
        u_lobe = (u_lobe - DIRAC_SHARE) / reach.share;
    }
    let up = match how {
        LobeSampling::Uniform => square_to_uniform_hemisphere(u),
        LobeSampling::Cosine | LobeSampling::Lobe => square_to_cosine_hemisphere(u),
    };
    let same = reach.same && (!reach.other || u_lobe < 0.5);
    let wi = if same == (wo.z > 0.0) { up } else { -up };
    let (f, p) = eval_and_pdf(how, bsdf, wo, wi);
    if p <= 0.0 || f.is_black() {
        return None;
    }
    Some(LobeSample {
        wi,
        weight: f * (1.0 / p),
        pdf: p,
        flags: Lobes::GLOSSY | if same { Lobes::REFLECTION } else { Lobes::TRANSMISSION },
        eta: if same { 1.0 } else { relative_index(bsdf, wo) },
        pdf_is_proportional: false,
    })
}

/// `f |cos wi|`, and the density with which [`sample`] takes `wi`.
#[inline]
pub fn eval_and_pdf(how: LobeSampling, bsdf: &Bsdf, wo: Vec3, wi: Vec3) -> (steradian_spectrum::Lanes, f32) {
    if how == LobeSampling::Lobe {
        return bsdf.eval_and_pdf(wo, wi, MODE);
    }
    let reach = Reach::of(bsdf);
    let hemisphere = if how == LobeSampling::Uniform { INV_2PI } else { wi.z.abs() * INV_PI };
    (bsdf.eval_cos(wo, wi, MODE), hemisphere * reach.side(wo, wi) * reach.share)
}

/// The index on the far side relative to the near one: Russian roulette is told what refraction does to radiance.
fn relative_index(bsdf: &Bsdf, wo: Vec3) -> f32 {
    match bsdf {
        Bsdf::Dielectric(d) if wo.z > 0.0 => d.eta,
        Bsdf::Dielectric(d) => 1.0 / d.eta,
        _ => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_bsdf::{Coating, Dielectric, Diffuse, DiffuseTransmission, Layered, TrowbridgeReitz};
    use steradian_spectrum::Lanes;
    use steradian_testkit::TestRng;

    fn lobes() -> Vec<Bsdf<'static>> {
        let rough = TrowbridgeReitz::new(0.4, 0.3);
        let smooth = Dielectric::new(1.5, TrowbridgeReitz::smooth());
        let base = Diffuse::new(Lanes::splat(0.6));
        vec![
            base.into(),
            DiffuseTransmission::new(Lanes::splat(0.3), Lanes::splat(0.5)).into(),
            Dielectric::new(1.5, rough).into(),
            smooth.into(),
            Bsdf::CoatedDiffuse(Layered::new(smooth, base, Coating::default())),
        ]
    }

    /// The mean weight is the albedo, however directions are drawn. False alarms: 1e-8 for each of 30 comparisons.
    #[test]
    fn every_way_of_drawing_gives_the_same_albedo() {
        const N: u32 = 40_000;
        let mut rng = TestRng::new(11);
        for (i, bsdf) in lobes().iter().enumerate() {
            let views =
                [[0.6, 0.0, 0.8], [0.3, 0.4, -0.75], [0.9, -0.3, 0.2]].map(|[x, y, z]| Vec3::new(x, y, z).normalize());
            for wo in views {
                let mut mean_of = |how| {
                    let (mut sum, mut squares) = (0.0f64, 0.0f64);
                    for _ in 0..N {
                        let [a, b, c] = std::array::from_fn(|_| rng.f64() as f32).map(|u: f32| u.min(0.999_999_9));
                        let w = sample(how, bsdf, wo, a, [b, c]).map_or(0.0, |s| f64::from(s.weight.0[0]));
                        sum += w;
                        squares += w * w;
                    }
                    let mean = sum / f64::from(N);
                    (mean, (squares / f64::from(N) - mean * mean).max(0.0) / f64::from(N))
                };
                let (lobe, v_lobe) = mean_of(LobeSampling::Lobe);
                for how in [LobeSampling::Uniform, LobeSampling::Cosine] {
                    let (mean, v) = mean_of(how);
                    let limit = 5.8 * (v + v_lobe).sqrt() + 1e-5;
                    assert!((mean - lobe).abs() < limit, "lobe {i} by {how:?}: {mean} is not {lobe} +- {limit}");
                }
            }
        }
    }

    /// What `sample` says of its density is what `eval_and_pdf` says.
    #[test]
    fn the_two_densities_agree() {
        let mut rng = TestRng::new(5);
        for bsdf in lobes() {
            for how in [LobeSampling::Uniform, LobeSampling::Cosine, LobeSampling::Lobe] {
                for _ in 0..200 {
                    let wo = Vec3::new(0.3, -0.5, rng.f64() as f32 - 0.5).normalize();
                    let u = std::array::from_fn(|_| rng.f64() as f32 * 0.999);
                    let Some(s) = sample(how, &bsdf, wo, rng.f64() as f32 * 0.999, u) else { continue };
                    if s.flags.contains(Lobes::SPECULAR) {
                        continue;
                    }
                    let (_, p) = eval_and_pdf(how, &bsdf, wo, s.wi);
                    assert!((p - s.pdf).abs() <= 1e-3 * p.abs() + 1e-6, "{} by {how:?}: {p} {}", bsdf.name(), s.pdf);
                }
            }
        }
    }
}
