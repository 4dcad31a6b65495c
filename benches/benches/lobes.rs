//! Lobes: sampling, and evaluation with density.

use divan::Bencher;
use steradian_bsdf::{Bsdf, Coating, Conductor, Dielectric, Diffuse, Layered, Lobe, TransportMode, TrowbridgeReitz};
use steradian_math::Vec3;
use steradian_sampling::Rng;
use steradian_spectrum::Lanes;

fn main() {
    divan::main();
}

const NAMES: [&str; 5] = ["diffuse", "rough conductor", "smooth glass", "rough glass", "coated diffuse"];

fn lobe(name: &str) -> Bsdf<'static> {
    let rough = TrowbridgeReitz::new(0.3, 0.3);
    let grey = Diffuse::new(Lanes::splat(0.5));
    match name {
        "diffuse" => grey.into(),
        "rough conductor" => Conductor::new(rough, Lanes::splat(0.2), Lanes::splat(3.9)).into(),
        "smooth glass" => Dielectric::new(1.5, TrowbridgeReitz::smooth()).into(),
        "rough glass" => Dielectric::new(1.5, rough).into(),
        _ => Bsdf::CoatedDiffuse(Layered::new(Dielectric::new(1.5, rough), grey, Coating::default())),
    }
}

#[divan::bench(args = NAMES)]
fn sample(bencher: Bencher, name: &str) {
    let (bsdf, wo) = (lobe(name), Vec3::new(0.3, -0.2, 0.9).normalize());
    let mut rng = Rng::new(1, 2);
    bencher.bench_local(|| bsdf.sample(wo, rng.f32(), rng.f32_2d(), TransportMode::Radiance).map(|s| s.weight));
}

#[divan::bench(args = NAMES)]
fn eval_and_pdf(bencher: Bencher, name: &str) {
    let (bsdf, wo) = (lobe(name), Vec3::new(0.3, -0.2, 0.9).normalize());
    let mut rng = Rng::new(1, 2);
    bencher.bench_local(|| {
        let wi = Vec3::new(rng.f32() - 0.5, rng.f32() - 0.5, 0.7).normalize();
        bsdf.eval_and_pdf(wo, wi, TransportMode::Radiance)
    });
}
