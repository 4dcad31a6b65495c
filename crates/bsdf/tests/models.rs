//! Lobes against closed forms: what the models mean, not only that they are consistent.

use steradian_bsdf::{
    Bsdf, Coating, Dielectric, Diffuse, HenyeyGreenstein, Layered, Lobe, PhaseFunction, PhaseMix, Rayleigh,
    TabulatedPhase, TransportMode, TrowbridgeReitz, fresnel_dielectric,
};
use steradian_math::{PI, Vec3};
use steradian_spectrum::Lanes;
use steradian_testkit::{ChiSquareTest, TestRng, z_test};

/// False-alarm rate of every single statistical test here.
const SIGNIFICANCE: f64 = 1e-8;

fn direction(cos: f32, phi: f32) -> Vec3 {
    Vec3::spherical((1.0 - cos * cos).sqrt(), cos, phi)
}

/// Diffuse reflectance of the inside of a smooth interface, `2 int F(cos) cos dcos`, by the midpoint rule.
fn internal_reflectance(eta: f32) -> f64 {
    let n = 20_000;
    (0..n)
        .map(|i| {
            let cos = (i as f32 + 0.5) / n as f32;
            2.0 * f64::from(fresnel_dielectric(-cos, eta) * cos) / f64::from(n)
        })
        .sum()
}

#[test]
fn smooth_paint_has_the_closed_form_of_interreflection() {
    // Light goes in by Fresnel, is diffused, and each time it comes from below a part is sent back:
    // f = T(wo) T(wi) R / (pi eta^2 (1 - R F)).
    let (eta, r) = (1.5f32, Lanes([0.2, 0.5, 0.8, 0.95]));
    let f_inside = internal_reflectance(eta);
    for (wo, wi) in [(direction(0.9, 0.0), direction(0.4, 2.0)), (direction(0.3, 1.0), direction(0.8, -1.0))] {
        let n = 200;
        let (mut sum, mut squares) = ([0.0f64; 4], [0.0f64; 4]);
        for seed in 0..n {
            let coating = Coating { thickness: 1e-9, max_depth: 1000, walks: 200, seed, ..Coating::default() };
            let paint = Layered::new(Dielectric::new(eta, TrowbridgeReitz::smooth()), Diffuse::new(r), coating);
            let f = paint.eval(wo, wi, TransportMode::Radiance);
            for i in 0..4 {
                sum[i] += f64::from(f[i]);
                squares[i] += f64::from(f[i]) * f64::from(f[i]);
            }
        }
        for i in 0..4 {
            let t = f64::from((1.0 - fresnel_dielectric(wo.z, eta)) * (1.0 - fresnel_dielectric(wi.z, eta)));
            let albedo = f64::from(r[i]);
            let expected = t * albedo / (f64::from(PI * eta * eta) * (1.0 - albedo * f_inside));
            let mean = sum[i] / n as f64;
            let variance = (squares[i] / n as f64 - mean * mean) / n as f64;
            let p = z_test(mean, variance, expected);
            assert!(p > SIGNIFICANCE, "lane {i}: {mean} and {expected}, p-value {p:e}");
            assert!((mean / expected - 1.0).abs() < 0.01, "lane {i}: {mean} and {expected}");
        }
    }
}

#[test]
fn an_absorbing_slab_attenuates_by_its_length() {
    // Without a change of index the coat is invisible, and light crosses the slab twice.
    let coating = Coating { thickness: 0.3, walks: 4, ..Coating::default() };
    let r = Lanes([0.2, 0.5, 0.8, 1.0]);
    let slab = Layered::new(Dielectric::new(1.0, TrowbridgeReitz::smooth()), Diffuse::new(r), coating);
    let (wo, wi) = (direction(0.7, 0.0), direction(0.5, 2.0));
    let f = slab.eval(wo, wi, TransportMode::Radiance);
    for i in 0..4 {
        let expected = r[i] / PI * steradian_math::exp(-0.3 / 0.7 - 0.3 / 0.5);
        assert!((f[i] / expected - 1.0).abs() < 1e-4, "{} and {expected}", f[i]);
    }
}

#[test]
fn a_thin_scattering_slab_over_black_scatters_once() {
    // For small optical thickness t: f = albedo p t / (cos_o cos_i) * ... -> albedo p (1 - e^{-t(1/co + 1/ci)}) / (co + ci).
    let (thickness, g) = (0.01f32, 0.3);
    let coating =
        Coating { thickness, albedo: Lanes::splat(0.8), g, walks: 200_000, max_depth: 2, ..Coating::default() };
    let slab = Layered::new(Dielectric::new(1.0, TrowbridgeReitz::smooth()), Diffuse::new(Lanes::ZERO), coating);
    let (wo, wi) = (direction(0.7, 0.0), direction(0.5, 2.0));
    let f = slab.eval(wo, wi, TransportMode::Radiance)[0];
    let extinction = 1.0 - steradian_math::exp(-thickness * (1.0 / wo.z + 1.0 / wi.z));
    let expected = 0.8 * HenyeyGreenstein::new(g).eval(wo, wi) * extinction / (wo.z + wi.z);
    // About 3000 of the walks scatter: six standard deviations of relative error are 0.11. The second order adds under 0.02.
    assert!((f / expected - 1.0).abs() < 0.13, "{f} and {expected}");
}

#[test]
fn glass_reflects_as_often_as_fresnel_says() {
    let glass = Dielectric::new(1.5, TrowbridgeReitz::smooth());
    for wo in [direction(0.9, 0.3), direction(0.2, 1.0), direction(-0.9, 0.0), direction(-0.3, 0.0)] {
        let f = fresnel_dielectric(wo.z, 1.5);
        for k in 0..1000 {
            let u = (k as f32 + 0.5) / 1000.0;
            let Some(s) = glass.sample(wo, u, [0.3, 0.6], TransportMode::Radiance) else {
                panic!("total reflection is a reflection as well")
            };
            assert_eq!(s.flags.is_reflective(), u < f);
            let factor = if s.flags.is_reflective() { 1.0 } else { 1.0 / (s.eta * s.eta) };
            assert!((s.weight[0] - factor).abs() < 1e-5);
        }
    }
}

#[test]
fn regularised_lobes_are_not_dirac() {
    let mut glass: Bsdf = Dielectric::new(1.5, TrowbridgeReitz::smooth()).into();
    assert!(!glass.flags().is_non_specular());
    glass.regularize();
    assert!(glass.flags().is_non_specular() && !glass.flags().is_specular());
}

#[test]
fn lobes_stay_small() {
    // They live on the stack of every path vertex.
    assert!(size_of::<Bsdf>() <= 192, "{} bytes", size_of::<Bsdf>());
}

#[test]
fn henyey_greenstein_is_normalised_and_has_its_mean_cosine() {
    let wo = direction(0.4, 0.8);
    for g in [-0.7f32, -0.2, 0.0, 0.0005, 0.3, 0.85] {
        let phase = HenyeyGreenstein::new(g);
        let test = ChiSquareTest { columns: 48, rows: 48, ..ChiSquareTest::default() };
        let result = test.sphere(
            &format!("g = {g}"),
            |rng| Some(phase.sample(wo, rng.f32_2d()).wi.to_array()),
            |w| phase.pdf(wo, Vec3::from_array(w)),
        );
        result.assert(SIGNIFICANCE);
        assert!((result.integral - 1.0).abs() < 1e-3, "g = {g}: {}", result.integral);
        let mut rng = TestRng::new(1);
        let (n, mut sum) = (100_000, 0.0f64);
        for _ in 0..n {
            let s = phase.sample(wo, rng.f32_2d());
            assert!((s.pdf / phase.eval(wo, s.wi) - 1.0).abs() < 2e-3);
            sum -= f64::from(wo.dot(s.wi));
        }
        // The cosine's variance is at most one third for every g.
        let p = z_test(sum / f64::from(n), (1.0 / 3.0) / f64::from(n), f64::from(g));
        assert!(p > SIGNIFICANCE, "g = {g}: mean cosine {}", sum / f64::from(n));
    }
    assert_eq!(HenyeyGreenstein::new(2.0).g(), 0.99);
}

/// Forward and backward peaks with a hole in between.
fn table() -> TabulatedPhase {
    TabulatedPhase::new(&[1.0, 0.5, 0.0, 0.0, 0.25, 3.0, 7.0]).expect("a phase function")
}

#[test]
fn phase_functions_and_their_mixtures_are_normalised_and_sampled_as_they_say() {
    let wo = direction(0.45, -0.4);
    let hg = PhaseFunction::HenyeyGreenstein(HenyeyGreenstein::new(0.7));
    let all = [hg, PhaseFunction::Rayleigh(Rayleigh), PhaseFunction::Tabulated(table())];
    let mixtures = [
        PhaseMix::new(&all[1..2], [1.0, 0.0, 0.0, 0.0]),
        PhaseMix::new(&all[2..], [1.0, 0.0, 0.0, 0.0]),
        PhaseMix::new(&all[..2], [0.3, 0.7, 0.0, 0.0]),
        PhaseMix::new(&all, [0.2, 0.3, 0.5, 0.0]),
        PhaseMix::new(&all, [0.0, 1.0, 0.0, 0.0]),
    ];
    for (i, phase) in mixtures.iter().enumerate() {
        let test = ChiSquareTest { columns: 48, rows: 48, ..ChiSquareTest::default() };
        let result = test.sphere(
            &format!("mixture {i}, {}", phase.name()),
            |rng| Some(phase.sample(wo, rng.f32_2d()).wi.to_array()),
            |w| phase.pdf(wo, Vec3::from_array(w)),
        );
        result.assert(SIGNIFICANCE);
        assert!((result.integral - 1.0).abs() < 1e-3, "mixture {i}: {}", result.integral);
        let mut rng = TestRng::new(2);
        for _ in 0..10_000 {
            let s = phase.sample(wo, rng.f32_2d());
            let value = phase.eval(wo, s.wi);
            assert!((s.pdf - value).abs() <= 1e-3 * value + 1e-5, "mixture {i}: {} {value}", s.pdf);
            assert_eq!(value, phase.eval(s.wi, wo), "what is seen backwards is the same");
        }
    }
}

#[test]
fn phase_functions_are_what_their_names_say() {
    let wo = direction(1.0, 0.0);
    // Rayleigh's is twice as strong straight on and straight back as to the side.
    let to = |cos: f32| Rayleigh.eval(wo, direction(cos, 0.3));
    assert!((to(1.0) / to(0.0) - 2.0).abs() < 1e-5);
    // The last value of a table is straight on, the first straight back; their scale does not matter.
    let t = table();
    let (on, back) = (t.eval(wo, -wo), t.eval(wo, wo));
    assert!((on / back - 7.0).abs() < 1e-4);
    assert_eq!(t.eval(wo, direction(0.0, 0.0)), 0.0);
    let scaled = TabulatedPhase::new(&[4.0, 2.0, 0.0, 0.0, 1.0, 12.0, 28.0]).expect("a phase function");
    assert!((scaled.eval(wo, -wo) / on - 1.0).abs() < 1e-6);
    let mut rng = TestRng::new(3);
    let (n, mut sum) = (200_000, 0.0f64);
    for _ in 0..n {
        sum -= f64::from(wo.dot(t.sample(wo, rng.f32_2d()).wi));
    }
    // Seven standard errors, the variance of a cosine being at most one.
    assert!((sum / f64::from(n) - f64::from(t.mean_cosine())).abs() < 7.0 / f64::from(n).sqrt());
    for bad in [&[1.0f32][..], &[0.0, 0.0], &[1.0, -1.0], &[1.0, f32::NAN], &[f32::INFINITY, 1.0]] {
        assert!(TabulatedPhase::new(bad).is_none(), "{bad:?}");
    }
}
