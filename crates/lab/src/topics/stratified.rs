//! Stratified sampling: sixteen samples of a pixel, the variance that they have, and the pictures of the slides.

use super::prelude::*;
use steradian_sampling::estimator::stratified_2d;
use steradian_sampling::sequence::jittered_2d;

const TOPIC: Topic = Topic::Stratified;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Stratified sampling",
        "Another source of variance is “bad luck”: samples may clump. Break the domain up into bins of equal probability, then choose \
         a sample from each bin.",
        "16 samples of a pixel at random and jittered; the variance of the mean of functions whose variance can be worked out; then \
         pictures of penumbrae at the ray counts of the slides.",
    );
    patterns(&mut e, setting);
    let ratio = variances(&mut e, setting);
    let (r25, equal) = pictures(&mut e, setting)?;
    e.result = format!(
        "On f = x, 16 jittered samples have 1/16 of the variance of 16 random ones (measured ratio {ratio:.4}). In pictures of penumbrae, 25 \
         stratified rays per pixel have {r25:.2} of the squared error of 25 random ones, the error of {equal:.0} random rays."
    );
    Ok(e)
}

fn patterns(e: &mut Experiment, setting: &Setting) {
    let mut rng = Rng::new(setting.seed_for(TOPIC, 1), 1);
    let random = (0..16).map(|_| (rng.f64(), rng.f64())).collect();
    let seed = setting.seed_for(TOPIC, 2);
    let jittered = (0..16).map(|i| jittered_2d(i, 4, 4, seed)).map(|[x, y]| (f64::from(x), f64::from(y))).collect();
    let pair = |id: &str, caption: &str| {
        Figure::new(id, caption, Axis::linear("x").from_to(0.0, 1.0), Axis::linear("y").from_to(0.0, 1.0))
    };
    // The lines between cells in one stroke, along the frame from one to the next.
    let columns = [(0.25, 0.0), (0.25, 1.0), (0.5, 1.0), (0.5, 0.0), (0.75, 0.0), (0.75, 1.0), (1.0, 1.0)];
    let rows = [(1.0, 0.75), (0.0, 0.75), (0.0, 0.5), (1.0, 0.5), (1.0, 0.25), (0.0, 0.25)];
    let grid = pair("pattern-jittered", "16 samples, one in each of 4 × 4 cells.")
        .with("samples", Mark::Dots, jittered)
        .with("cells", Mark::Dashed, [&columns[..], &rows].concat());
    e.figure(pair("pattern-random", "16 samples at random: clumps and gaps.").with("samples", Mark::Dots, random));
    e.figure(grid);
}

fn variances(e: &mut Experiment, setting: &Setting) -> f64 {
    let repeats = setting.effort.pick(4_000, 20_000, 200_000);
    let mut rng = Rng::new(setting.seed_for(TOPIC, 3), 1);
    // Function, variance of one random sample, mean variance within a cell of the 4 x 4 grid.
    type Case = (&'static str, fn([f64; 2]) -> f64, f64, f64);
    let edge_cell = 1.0 / 16.0;
    let cases: [Case; 3] = [
        ("f = x", |p| p[0], 1.0 / 12.0, 1.0 / 12.0 / 16.0),
        // The constant has none, wherever the samples are.
        ("f = x + y", |p| p[0] + p[1], 1.0 / 6.0, 1.0 / 6.0 / 16.0),
        // A vertical edge in the middle of the second column: 4 of 16 cells hold it, with variance 1/4 each.
        ("edge at x = 3/8", |p| f64::from(p[0] < 0.375), 0.375 * 0.625, 4.0 * 0.25 * edge_cell),
    ];
    let mut table = Table::new(
        "ratio",
        "Variance of the mean of 16 samples.",
        &["function", "random", "jittered", "ratio", "predicted ratio"],
    );
    let mut first = f64::NAN;
    for (name, f, v_random, v_cell) in cases {
        let random: Vec<f64> =
            (0..repeats).map(|_| (0..16).map(|_| f([rng.f64(), rng.f64()])).sum::<f64>() / 16.0).collect();
        let jittered: Vec<f64> = (0..repeats).map(|_| stratified_2d(4, 4, 1, &mut rng, f).value).collect();
        let ((vr, er), (vj, ej)) = (variance_with_error(&random), variance_with_error(&jittered));
        e.claim(Claim::equal(TOPIC, format!("{name}: variance of 16 random samples"), v_random / 16.0, vr, er));
        e.claim(Claim::equal(TOPIC, format!("{name}: variance of 16 jittered samples"), v_cell / 16.0, vj, ej));
        let measured = vj / vr;
        let error = measured * (er / vr).hypot(ej / vj);
        e.claim(Claim::equal(
            TOPIC,
            format!("{name}: variance ratio, jittered over random"),
            v_cell / v_random,
            measured,
            error,
        ));
        table.row([
            name.into(),
            format!("{vr:.3e}"),
            format!("{vj:.3e}"),
            format!("{measured:.4}"),
            format!("{:.4}", v_cell / v_random),
        ]);
        if first.is_nan() {
            first = measured;
        }
    }
    e.table(table);
    first
}

fn pictures(e: &mut Experiment, setting: &Setting) -> Result<(f64, f64), Error> {
    let size = setting.effort.pick([32, 24], [100, 75], [160, 120]);
    let world = stage::penumbra_world(size, SamplerKind::Independent)?;
    let seed = setting.seed_for(TOPIC, 4);
    let render = |kind, spp, seed| stage::render_counted(&world, kind, spp, seed, setting.threads).0;
    let truth = render(SamplerKind::PaddedSobol, setting.effort.pick(1_024, 1_024, 4_096), seed ^ 99);
    let mut shown = Vec::new();
    let mut mse = Vec::new();
    for (spp, kind, word) in [
        (25, SamplerKind::Independent, "without"),
        (25, SamplerKind::Stratified, "with"),
        (64, SamplerKind::Independent, "without"),
        (400, SamplerKind::Stratified, "with"),
    ] {
        let picture = render(kind, spp, seed);
        let at = stage::error_at(f64::from(spp), &picture, &truth, false);
        let error = at.mean_square;
        shown.push(paint::colour(
            &format!("rays-{spp}-{word}"),
            format!("{spp} rays per pixel {word} stratification: mse {error:.1e}"),
            size[0] as usize,
            &picture,
        ));
        mse.push(at);
    }
    e.pictures(shown);
    e.slider("rays-25-without", "rays-25-with", "25 rays per pixel each.");
    let ratio = mse[1].mean_square / mse[0].mean_square;
    e.claim(Claim::at_most(
        TOPIC,
        "picture: squared error of 25 stratified rays over that of 25 random ones",
        0.8,
        ratio,
    ));
    e.claim(Claim::ratio(
        TOPIC,
        "picture: squared error of 64 random rays over that of 25",
        25.0 / 64.0,
        &mse[2],
        &mse[0],
        0.05,
    ));
    e.claim(Claim::at_most(
        TOPIC,
        "picture: squared error of 400 stratified rays over that of 25, less than 1/16",
        1.0 / 16.0,
        mse[3].mean_square / mse[1].mean_square,
    ));
    let mut figure = Figure::new(
        "penumbra",
        "Squared error of the picture over rays per pixel. Stratification gains more the more cells there are.",
        Axis::log("rays per pixel"),
        Axis::log("mean squared error"),
    );
    let counts: &[u32] = setting.effort.pick(&[4, 16, 64], &[4, 16, 64, 144], &[4, 16, 64, 144, 400, 900]);
    for (name, kind) in [
        ("random", SamplerKind::Independent),
        ("stratified", SamplerKind::Stratified),
        ("scrambled Sobol'", SamplerKind::PaddedSobol),
    ] {
        let points = counts
            .iter()
            .map(|&n| stage::error_at(f64::from(n), &render(kind, n, seed ^ 3), &truth, false))
            .collect::<Vec<_>>();
        if name == "random" {
            e.claim(Claim::falls(TOPIC, "picture, random: slope of the squared error over rays", -1.0, &points));
        } else {
            e.claim(Claim::falls_faster(
                TOPIC,
                format!("picture, {name}: slope of the squared error over rays, steeper than −1"),
                -1.05,
                &points,
            ));
        }
        figure = figure.with(name, Mark::LineDots, squares(&points));
    }
    e.figure(figure);
    Ok((ratio, 25.0 / ratio))
}
