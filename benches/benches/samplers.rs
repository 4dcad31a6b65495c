//! Random numbers: a path's worth of dimensions from each sampler.

use divan::Bencher;
use divan::counter::ItemsCount;
use steradian_sampling::{Sampler, SamplerKind, SamplerSettings};

fn main() {
    divan::main();
}

const KINDS: [SamplerKind; 7] = [
    SamplerKind::Independent,
    SamplerKind::Stratified,
    SamplerKind::Halton,
    SamplerKind::Sobol,
    SamplerKind::PaddedSobol,
    SamplerKind::ZSobol,
    SamplerKind::Pmj02bn,
];

/// Bounces of a path, with one 1D and one 2D number each.
const BOUNCES: usize = 16;

#[divan::bench(args = KINDS)]
fn path(bencher: Bencher, kind: SamplerKind) {
    let settings = SamplerSettings { kind, spp: 64, resolution: [512, 512], ..SamplerSettings::default() };
    let mut sampler = Sampler::new(&settings);
    let mut index = 0u32;
    bencher.counter(ItemsCount::new(2 * BOUNCES)).bench_local(|| {
        index = index.wrapping_add(1);
        sampler.start([index % 512, (index / 512) % 512], index % 64, 0);
        let mut sum = sampler.pixel_2d()[0];
        for _ in 0..BOUNCES {
            sum += sampler.next_1d() + sampler.next_2d()[1];
        }
        sum
    });
}
