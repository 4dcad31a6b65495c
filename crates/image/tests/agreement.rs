//! The agreement decision on synthetic renderings whose truth is known: silent when it should be, and loud when it should be.

use steradian_image::{
    Image, Precision,
    agreement::{Estimate, Report, Settings, agreement},
};

/// SplitMix64 with the sum of twelve uniform numbers as a normal deviate.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

const W: usize = 64;
const H: usize = 48;

/// The expected colour at a pixel.
fn truth(i: usize) -> [f64; 3] {
    let (x, y) = ((i % W) as f64 / W as f64, (i / W) as f64 / H as f64);
    let light = if x + y > 1.0 { 1.0 } else { 0.2 };
    [0.1 + light * x, 0.1 + light * 0.8, 0.05 + 0.5 * y]
}

/// A rendering of `spp` samples in `batches` independent batches: noise in proportion to the square root of brightness, shared in
/// part by the channels, with its variance as a renderer would estimate it.
fn render(
    random: &mut Random,
    width: usize,
    height: usize,
    spp: f64,
    batches: usize,
    expected: impl Fn(usize) -> [f64; 3],
) -> Image {
    let n = width * height;
    let mut mean = vec![[0.0_f32; 3]; n];
    let mut variance: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; n]);
    for i in 0..n {
        let e = expected(i);
        let mut values = Vec::new();
        for _ in 0..batches {
            let shared = random.normal();
            let own: [f64; 3] = std::array::from_fn(|_| random.normal());
            values.push(
                [0, 1, 2]
                    .map(|c| e[c] + (0.4 * e[c].abs() * batches as f64 / spp).sqrt() * (0.8 * shared + 0.6 * own[c])),
            );
        }
        for c in 0..3 {
            let m = values.iter().map(|v| v[c]).sum::<f64>() / batches as f64;
            let v = values.iter().map(|v| (v[c] - m) * (v[c] - m)).sum::<f64>() / (batches as f64 - 1.0).max(1.0);
            mean[i][c] = m as f32;
            variance[c][i] = (v / batches as f64) as f32;
        }
    }
    let mut image = Image::from_rgb(width, height, &mean).unwrap();
    for (name, v) in ["Variance.R", "Variance.G", "Variance.B"].into_iter().zip(variance) {
        image.add(name, v, Precision::Float).unwrap();
    }
    image.metadata.set("refBatches", steradian_image::Attribute::Int(batches as i32));
    image
}

fn plain(image: &Image) -> Estimate {
    Estimate::of_unknown_noise(image).unwrap()
}

/// The four ways in which noise can be known, at equal sample counts.
fn judge(reference: &Image, candidate: &Image) -> [(&'static str, Report); 4] {
    let known = |i: &Image| Estimate::from_image(i).unwrap();
    let settings = Settings::default();
    let scaled = Settings { candidate_to_reference_variance: Some(1.0), ..Settings::default() };
    [
        ("both variances", agreement(&known(reference), &known(candidate), &settings)),
        ("the reference's variance, scaled", agreement(&known(reference), &plain(candidate), &scaled)),
        ("the reference's variance alone", agreement(&known(reference), &plain(candidate), &settings)),
        ("none", agreement(&plain(reference), &plain(candidate), &settings)),
    ]
}

fn failures(r: &Report) -> Vec<&'static str> {
    r.families.iter().filter(|f| !f.agrees).map(|f| f.name).collect()
}

/// 40 pairs, four decisions each, at alpha = 1e-4: a false alarm anywhere has a probability below 1.6e-2 by the rule's own bound, and
/// much less in fact, since the tolerances excuse small deviations. The seeds are fixed, so the outcome is too.
#[test]
fn two_renderings_of_one_scene_agree() {
    for seed in 0..40 {
        let mut random = Random(1000 + seed);
        let a = render(&mut random, W, H, 1024.0, 16, truth);
        let b = render(&mut random, W, H, 1024.0, 16, truth);
        for (how, report) in judge(&a, &b) {
            assert!(report.agree, "seed {seed}, {how}: {:?}", report.families);
            assert!(report.bias.iter().all(|b| b.abs() < 0.01) && report.detectable_bias < 0.015, "{report:?}");
        }
    }
}

#[test]
fn sizes_that_blocks_do_not_divide_agree_too() {
    for (w, h) in [(61, 37), (17, 5), (3, 3), (1, 200), (2, 1)] {
        let mut random = Random(7);
        let expected = |_| [0.5, 0.4, 0.3];
        let (a, b) = (render(&mut random, w, h, 4096.0, 16, expected), render(&mut random, w, h, 4096.0, 16, expected));
        for (how, report) in judge(&a, &b) {
            assert!(report.agree, "{w} x {h}, {how}: {:?}", report.families);
        }
    }
}

/// Errors that must be seen, whichever way the noise is known.
#[test]
fn errors_are_found() {
    type Scene = fn(usize) -> [f64; 3];
    let errors: [(&str, Scene); 4] = [
        ("2 % brighter", |i| truth(i).map(|v| 1.02 * v)),
        ("blue 3 % weaker", |i| [truth(i)[0], truth(i)[1], 0.97 * truth(i)[2]]),
        ("one block wrong", |i| if i % W / 8 == 3 && i / W / 8 == 2 { truth(i).map(|v| 1.15 * v) } else { truth(i) }),
        ("moved by one pixel", |i| if i % W == 0 { truth(i) } else { truth(i - 1) }),
    ];
    for (name, wrong) in errors {
        let mut random = Random(99);
        let (a, b) = (render(&mut random, W, H, 4096.0, 16, truth), render(&mut random, W, H, 4096.0, 16, wrong));
        for (how, report) in judge(&a, &b) {
            assert!(!report.agree, "{name} was not seen with {how}");
        }
    }
}

fn chequered(i: usize, amount: f64) -> [f64; 3] {
    truth(i).map(|v| v * if (i % W + i / W).is_multiple_of(2) { 1.0 + amount } else { 1.0 - amount })
}

#[test]
fn each_family_finds_what_it_is_for() {
    let found = |wrong: fn(usize) -> [f64; 3]| {
        let mut random = Random(5);
        let a = render(&mut random, W, H, 4096.0, 16, truth);
        let b = render(&mut random, W, H, 4096.0, 16, wrong);
        failures(&agreement(
            &Estimate::from_image(&a).unwrap(),
            &Estimate::from_image(&b).unwrap(),
            &Settings::default(),
        ))
    };
    assert!(found(|i| truth(i).map(|v| 1.02 * v)).contains(&"global"));
    assert_eq!(
        found(|i| if i % W / 8 == 3 && i / W / 8 == 2 { truth(i).map(|v| 1.06 * v) } else { truth(i) }),
        ["block"]
    );
    // A chequerboard of pixels cancels in every block. A weak one only shows in all pixels together.
    assert_eq!(found(|i| chequered(i, 0.08)), ["dispersion"]);
    assert!(found(|i| chequered(i, 0.25)).contains(&"pixel"));
    let weak_everywhere =
        |i: usize| truth(i).map(|v| v * if (i % W / 4 + i / W / 4).is_multiple_of(2) { 1.017 } else { 0.983 });
    assert!(found(weak_everywhere).contains(&"pattern"));
}

#[test]
fn a_few_fireflies_do_not_decide() {
    let mut random = Random(11);
    let a = render(&mut random, W, H, 1024.0, 16, truth);
    let mut b = render(&mut random, W, H, 1024.0, 16, truth);
    for i in [100, 1500, 2900] {
        for c in ["R", "G", "B"] {
            b.channel_mut(c).unwrap()[i] += 0.4;
        }
    }
    let report = agreement(&Estimate::from_image(&a).unwrap(), &plain(&b), &Settings::default());
    assert!(report.families.iter().any(|f| f.name == "pixel" && f.agrees && f.failed > 0), "{:?}", report.families);
}

#[test]
fn noisier_than_claimed_is_found() {
    let mut random = Random(13);
    let a = render(&mut random, W, H, 64.0, 16, truth);
    let b = render(&mut random, W, H, 64.0, 16, truth);
    let claimed = b.planes("Variance").unwrap().map(|p| p.iter().map(|v| v * 0.2).collect::<Vec<_>>());
    let candidate = Estimate::with_variance(&b, claimed.each_ref().map(Vec::as_slice), 15.0).unwrap();
    let report = agreement(&Estimate::from_image(&a).unwrap(), &candidate, &Settings::default());
    assert!(failures(&report).contains(&"dispersion"), "{report:?}");
}

#[test]
fn seeds_serve_as_noise() {
    let mut random = Random(17);
    let a = render(&mut random, W, H, 2048.0, 16, truth);
    let reference = Estimate::from_image(&a).unwrap();
    for count in [2, 4, 8] {
        let seeds: Vec<Image> = (0..count).map(|_| render(&mut random, W, H, 512.0, 2, truth)).collect();
        let report =
            agreement(&reference, &Estimate::from_seeds(&seeds, Some(&reference)).unwrap(), &Settings::default());
        assert!(report.agree, "{count} seeds: {report:?}");
        let wrong: Vec<Image> =
            (0..count).map(|_| render(&mut random, W, H, 2048.0, 2, |i| truth(i).map(|v| 1.03 * v))).collect();
        let report =
            agreement(&reference, &Estimate::from_seeds(&wrong, Some(&reference)).unwrap(), &Settings::default());
        assert!(!report.agree, "{count} seeds");
    }
}

#[test]
fn identical_images_agree_and_unlike_shapes_do_not() {
    let mut random = Random(3);
    let a = render(&mut random, 20, 20, 64.0, 4, |_| [0.5; 3]);
    for (how, report) in judge(&a, &a) {
        assert!(report.agree, "{how}");
    }
    let black = Image::from_rgb(8, 8, &[[0.0; 3]; 64]).unwrap();
    assert!(agreement(&plain(&black), &plain(&black), &Settings::default()).agree);
    assert!(agreement(&plain(&a), &plain(&black), &Settings::default()).reason.is_some());
    let mut nan = black.clone();
    nan.channel_mut("G").unwrap()[5] = f32::NAN;
    let report = agreement(&plain(&black), &plain(&nan), &Settings::default());
    assert!(!report.agree && report.reason.unwrap().contains("candidate"));
    let mut grey = black.clone();
    for c in ["R", "G", "B"] {
        grey.channel_mut(c).unwrap().fill(0.1);
    }
    assert!(!agreement(&plain(&black), &plain(&grey), &Settings::default()).agree, "black is not grey");
}
