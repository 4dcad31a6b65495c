//! Fixed pieces of work for counting instructions: `kernels NAME` does one of them, `kernels` names them. `.ci/instructions` counts.
#![allow(clippy::print_stdout)]

use std::hint::black_box;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use benches::{CORNELL, blob, coherent_rays, incoherent_rays};
use steradian_bsdf::{Conductor, Diffuse, Lobe, TransportMode, TrowbridgeReitz};
use steradian_geometry::{Accel, InputTriangle};
use steradian_math::Vec3;
use steradian_render::{Plan, Quiet, render};
use steradian_sampling::Rng;
use steradian_sampling::sampler::{Sampler, SamplerKind, SamplerSettings};
use steradian_scene::World;
use steradian_spectrum::{ColorMode, Lanes};

/// A name, and the work.
type Kernel = (&'static str, fn());

const KERNELS: [Kernel; 8] = [
    ("build", build),
    ("closest", closest),
    ("any", any),
    ("padded-sobol", || sampler(SamplerKind::PaddedSobol)),
    ("zsobol", || sampler(SamplerKind::ZSobol)),
    ("pmj02bn", || sampler(SamplerKind::Pmj02bn)),
    ("lobes", lobes),
    ("cornell", cornell),
];

fn tree() -> Accel {
    let triangles: Vec<_> =
        blob(20_000).into_iter().zip(0..).map(|(p, id)| InputTriangle { p, id, filtered: false }).collect();
    Accel::build(&triangles, &[]).expect("finite triangles")
}

fn build() {
    black_box(tree());
}

fn closest() {
    let tree = tree();
    for rays in [coherent_rays(1 << 15), incoherent_rays(1 << 15)] {
        black_box(rays.iter().filter(|r| tree.closest(r, |_, _| None, |_, _, _, _| true).is_some()).count());
    }
}

fn any() {
    let tree = tree();
    let rays = incoherent_rays(1 << 16);
    black_box(rays.iter().filter(|r| tree.any(r, |_, _| false, |_, _, _, _| true)).count());
}

fn sampler(kind: SamplerKind) {
    let settings = SamplerSettings { kind, spp: 16, resolution: [64, 64], ..SamplerSettings::default() };
    let mut sampler = Sampler::new(&settings);
    for pixel in 0..64 * 64 {
        for sample in 0..16 {
            sampler.start([pixel % 64, pixel / 64], sample, 0);
            for _ in 0..8 {
                black_box((sampler.next_1d(), sampler.next_2d()));
            }
        }
    }
}

fn lobes() {
    let grey = Diffuse::new(Lanes::splat(0.5));
    let metal = Conductor::new(TrowbridgeReitz::new(0.3, 0.3), Lanes::splat(0.2), Lanes::splat(3.9));
    let wo = Vec3::new(0.3, -0.2, 0.9).normalize();
    let mut rng = Rng::new(1, 2);
    for _ in 0..200_000 {
        let (u, v) = (rng.f32(), rng.f32_2d());
        black_box(grey.sample(wo, u, v, TransportMode::Radiance));
        if let Some(s) = black_box(metal.sample(wo, u, v, TransportMode::Radiance)) {
            black_box(metal.eval_and_pdf(wo, s.wi, TransportMode::Radiance));
        }
    }
}

fn cornell() {
    let mut scene = steradian::load_text("cornell.pbrt", CORNELL).expect("a sound scene");
    scene.settings.color = ColorMode::Rgb;
    let world = World::build(scene).expect("a sound scene");
    let plan = Plan { spp: 1, threads: 1, time_limit: None };
    black_box(render(&world, &plan, &Quiet, &AtomicBool::new(false)).spp);
}

fn main() -> ExitCode {
    let Some(wanted) = std::env::args().nth(1) else {
        KERNELS.iter().for_each(|(name, _)| println!("{name}"));
        return ExitCode::SUCCESS;
    };
    match KERNELS.iter().find(|(name, _)| *name == wanted) {
        Some((_, work)) => {
            work();
            ExitCode::SUCCESS
        }
        None => {
            println!("no kernel is called {wanted}");
            ExitCode::from(2)
        }
    }
}
