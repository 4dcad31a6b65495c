//! The contract, checked for all samplers and randomisations from one table.

use super::*;

const KINDS: [SamplerKind; 7] = [
    SamplerKind::Independent,
    SamplerKind::Stratified,
    SamplerKind::Halton,
    SamplerKind::Sobol,
    SamplerKind::PaddedSobol,
    SamplerKind::ZSobol,
    SamplerKind::Pmj02bn,
];
const RANDOMIZATIONS: [Randomization; 4] =
    [Randomization::None, Randomization::PermuteDigits, Randomization::FastOwen, Randomization::Owen];

fn all_settings() -> impl Iterator<Item = SamplerSettings> {
    KINDS.into_iter().flat_map(|kind| {
        RANDOMIZATIONS.into_iter().map(move |randomization| SamplerSettings {
            kind,
            randomization,
            seed: 17,
            spp: 16,
            resolution: [37, 21],
            ..Default::default()
        })
    })
}

/// What an integrator might ask for: a pixel position, then a mix of pairs and single numbers.
fn draw(sampler: &mut Sampler, pixel: [u32; 2], index: u32) -> Vec<f32> {
    sampler.start(pixel, index, 0);
    let mut values = sampler.pixel_2d().to_vec();
    for _ in 0..5 {
        values.push(sampler.next_1d());
        values.extend(sampler.next_2d());
    }
    values
}

#[test]
fn samples_are_replayed_out_of_order() {
    for settings in all_settings() {
        let mut sampler = Sampler::new(&settings);
        let wanted: Vec<_> = (0..200u32).map(|k| ([k % 37, k % 21], k / 7)).collect();
        let forward: Vec<_> = wanted.iter().map(|&(p, i)| draw(&mut sampler, p, i)).collect();
        let mut other = Sampler::new(&settings);
        for k in (0..wanted.len()).rev() {
            assert_eq!(draw(&mut other, wanted[k].0, wanted[k].1), forward[k], "{settings:?} sample {k}");
        }
    }
}

#[test]
fn a_later_dimension_can_be_reached_directly() {
    for settings in all_settings() {
        let mut a = Sampler::new(&settings);
        a.start([3, 4], 5, 0);
        a.pixel_2d();
        let mut b = a.clone();
        a.start([3, 4], 5, 2);
        b.start([3, 4], 5, 2);
        b.next_1d();
        let expected = b.next_2d();
        a.start([3, 4], 5, 3);
        assert_eq!(a.next_2d(), expected, "{settings:?}");
    }
}

#[test]
fn numbers_lie_in_the_unit_interval_at_the_extremes() {
    for mut settings in all_settings() {
        for (resolution, spp) in [([1, 1], 1), ([0, 0], 0), ([65_536, 3], 1 << 20), ([u32::MAX; 2], u32::MAX)] {
            settings.resolution = resolution;
            settings.spp = spp;
            let mut sampler = Sampler::new(&settings);
            for pixel in [[0, 0], [1, 0], [65_535, 2], [u32::MAX, u32::MAX]] {
                for index in [0, 1, 12_345, u32::MAX] {
                    let values = draw(&mut sampler, pixel, index);
                    assert!(
                        values.iter().all(|v| (0.0..1.0).contains(v)),
                        "{settings:?} {pixel:?} {index}: {values:?}"
                    );
                    sampler.start(pixel, index, u32::MAX);
                    assert!((0.0..1.0).contains(&sampler.next_1d()));
                    sampler.start(pixel, index, u32::MAX - 1);
                    let [x, y] = sampler.next_2d();
                    assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                }
            }
        }
    }
}

#[test]
fn pairs_of_progressive_points_are_nets_in_every_pixel_and_dimension() {
    for (kind, randomization) in [SamplerKind::PaddedSobol, SamplerKind::Pmj02bn]
        .into_iter()
        .flat_map(|kind| RANDOMIZATIONS.map(|randomization| (kind, randomization)))
    {
        let settings = SamplerSettings { kind, randomization, seed: 5, resolution: [1000, 700], ..Default::default() };
        let mut sampler = Sampler::new(&settings);
        for (pixel, dimension) in [([0, 0], 0), ([12, 7], 4), ([999, 3], 31)] {
            for (block, log2) in [0u32, 3].into_iter().flat_map(|block| [0u32, 3, 6, 9].map(|log2| (block, log2))) {
                for log_x in 0..=log2 {
                    let (nx, ny) = (1usize << log_x, 1usize << (log2 - log_x));
                    let mut seen = vec![false; nx * ny];
                    for i in 0..1u32 << log2 {
                        sampler.start(pixel, (block << log2) + i, dimension);
                        let [x, y] = sampler.next_2d();
                        let cell = (y * ny as f32) as usize * nx + (x * nx as f32) as usize;
                        assert!(!seen[cell], "{kind:?}, {randomization:?}, {nx} x {ny}");
                        seen[cell] = true;
                    }
                }
            }
        }
    }
}

#[test]
fn single_numbers_are_stratified() {
    for kind in [SamplerKind::Stratified, SamplerKind::PaddedSobol, SamplerKind::ZSobol, SamplerKind::Pmj02bn] {
        let mut sampler = Sampler::new(&SamplerSettings { kind, spp: 16, resolution: [8, 8], ..Default::default() });
        let mut seen = [false; 16];
        for i in 0..16 {
            sampler.start([3, 2], i, 7);
            let cell = (sampler.next_1d() * 16.0) as usize;
            assert!(!seen[cell], "{kind:?}");
            seen[cell] = true;
        }
    }
}

#[test]
fn image_samplers_stratify_the_pixel() {
    // With no more pixels than the tile, Sobol' puts 2^2k samples of a pixel into 2^k by 2^k cells.
    let mut sampler =
        Sampler::new(&SamplerSettings { kind: SamplerKind::Sobol, resolution: [64, 64], ..Default::default() });
    for pixel in [[0, 0], [5, 60], [63, 63]] {
        let mut seen = [false; 64];
        for i in 0..64 {
            sampler.start(pixel, i, 0);
            let [x, y] = sampler.pixel_2d();
            let cell = (y * 8.0) as usize * 8 + (x * 8.0) as usize;
            assert!(!seen[cell]);
            seen[cell] = true;
        }
    }
    // Halton: 36 samples fill 4 columns (base 2) times 9 rows (base 3).
    let mut sampler =
        Sampler::new(&SamplerSettings { kind: SamplerKind::Halton, resolution: [64, 64], ..Default::default() });
    let mut seen = [false; 36];
    for i in 0..36 {
        sampler.start([11, 42], i, 0);
        let [x, y] = sampler.pixel_2d();
        let cell = ((y * 9.0 + 1e-4) as usize) * 4 + (x * 4.0 + 1e-4) as usize;
        assert!(!seen[cell]);
        seen[cell] = true;
    }
}

#[test]
fn means_and_correlations_of_dimensions_are_those_of_uniform_numbers() {
    for settings in all_settings().filter(|s| s.randomization != Randomization::None) {
        let mut sampler = Sampler::new(&settings);
        let n = 37 * 21 * 16;
        let (mut sum, mut products) = ([0.0f64; 8], [0.0f64; 7]);
        for k in 0..n {
            sampler.start([k % 37, k / 37 % 21], k / (37 * 21), 2);
            let mut row = [0.0f64; 8];
            for pair in row.chunks_mut(2) {
                let v = sampler.next_2d();
                pair[0] = f64::from(v[0]) - 0.5;
                pair[1] = f64::from(v[1]) - 0.5;
            }
            for d in 0..8 {
                sum[d] += row[d];
            }
            for d in 0..7 {
                products[d] += row[d] * row[d + 1];
            }
        }
        // Seven standard deviations of independent numbers; low-discrepancy points do better. False alarm below 1e-9.
        let bound = 7.0 * (f64::from(n) / 12.0).sqrt();
        assert!(sum.iter().all(|s| s.abs() < bound), "{settings:?}: sums {sum:?} exceed {bound}");
        let bound = 7.0 * (f64::from(n) / 144.0).sqrt();
        assert!(products.iter().all(|s| s.abs() < bound), "{settings:?}: products {products:?} exceed {bound}");
    }
}

#[test]
fn seeds_change_every_randomised_sampler() {
    for settings in all_settings().filter(|s| s.randomization != Randomization::None) {
        let values = draw(&mut Sampler::new(&settings), [1, 2], 3);
        let others = draw(&mut Sampler::new(&SamplerSettings { seed: 18, ..settings }), [1, 2], 3);
        assert_ne!(values[2..], others[2..], "{settings:?}");
    }
}

#[test]
fn prefixes_do_not_depend_on_the_plan_where_that_is_promised() {
    for settings in all_settings() {
        for strata in [[0, 0], [4, 4]] {
            let settings = SamplerSettings { strata, ..settings };
            let mut short = Sampler::new(&settings);
            let mut long = Sampler::new(&SamplerSettings { spp: 1024, ..settings });
            if short.prefix_independent_of_spp() {
                for index in [0, 3, 15] {
                    assert_eq!(draw(&mut short, [2, 9], index), draw(&mut long, [2, 9], index));
                }
            }
        }
    }
}
