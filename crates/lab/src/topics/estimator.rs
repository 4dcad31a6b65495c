//! The sample mean as a random variable: its mean, its variance, its dependence on seeds, and which estimators of an
//! integral are unbiased.

use super::prelude::*;

const TOPIC: Topic = Topic::Estimator;
/// X has density 2x on the unit interval.
const MEAN: f64 = 2.0 / 3.0;
const VARIANCE: f64 = 1.0 / 18.0;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "The sample mean and its variance",
        "This sample mean is itself a new random variable. Ideally, its expected value actually is the expected value of the \
         original one. How much does the answer vary?",
        "X has density p(x) = 2x on [0, 1], so that E[X] = 2/3 and V[X] = 1/18. The sample mean of N draws is taken thousands of \
         times over. Then the integral of x² from 1 to 3 is estimated with and without the factors that an estimator needs.",
    );
    let slope = sample_mean(&mut e, setting);
    integral(&mut e, setting);
    sums(&mut e, setting);
    let distinct = seeds(&mut e, setting)?;
    e.result = format!(
        "The sample mean has the mean of X and the variance V/N: its standard deviation falls with slope {slope} over log N. \
         f(X)/p(X) estimates the integral without bias for every density that is positive where f is. {distinct} of the repeats gave \
         different answers; the same seed gives the same bits."
    );
    Ok(e)
}

fn draw(rng: &mut Rng) -> f64 {
    (1.0 - rng.f64()).sqrt()
}

fn sample_mean(e: &mut Experiment, setting: &Setting) -> Slope {
    let repeats = setting.effort.pick(4_000, 20_000, 200_000);
    let mut rng = Rng::new(setting.seed_for(TOPIC, 1), 1);
    let mut points = Vec::new();
    let mut predicted = Vec::new();
    let mut table = Table::new(
        "variance",
        format!("The sample mean of N draws, {repeats} times over."),
        &["N", "mean of the means", "variance of the means", "V/N", "share of 95 % intervals that cover the truth"],
    );
    let mut histogram = Figure::new(
        "histogram",
        "The sample mean gathers around E[X] and becomes normal. Dashed: the normal density of variance V/N.",
        Axis::linear("sample mean").from_to(0.0, 1.0),
        Axis::linear("density"),
    );
    let mut spreads = VarianceEstimator::default();
    for n in [1u32, 4, 16, 64, 256] {
        let mut covered = 0u32;
        let means: Vec<f64> = (0..repeats)
            .map(|_| {
                let sample: VarianceEstimator = (0..n).map(|_| draw(&mut rng)).collect();
                covered += u32::from(mean_interval(&sample, 0.95).contains(MEAN));
                if n == 16 {
                    spreads.add(sample.variance());
                }
                sample.mean()
            })
            .collect();
        let all: VarianceEstimator = means.iter().copied().collect();
        let (variance, error) = variance_with_error(&means);
        let theory = VARIANCE / f64::from(n);
        e.claim(Claim::equal(TOPIC, format!("E[sample mean of {n}] = E[X]"), MEAN, all.mean(), all.standard_error()));
        e.claim(Claim::equal(TOPIC, format!("V[sample mean of {n}] = V[X]/{n}"), theory, variance, error));
        points.push(ErrorAt::of(f64::from(n), means.iter().map(|m| m - MEAN)));
        predicted.push((f64::from(n), theory.sqrt()));
        let share = f64::from(covered) / f64::from(repeats);
        table.row([
            n.to_string(),
            format!("{:.5}", all.mean()),
            format!("{variance:.3e}"),
            format!("{theory:.3e}"),
            if n > 1 { format!("{:.2} %", 100.0 * share) } else { "none: one draw has no variance".into() },
        ]);
        if n == 256 {
            // The mean of 256 is not quite normal; a hundredth of the rate is left for that.
            let deviation = (0.95 * 0.05 / f64::from(repeats)).sqrt();
            e.claim(Claim::close(
                TOPIC,
                "95 % confidence intervals cover E[X] 95 % of the time",
                0.95,
                share,
                deviation,
                0.005,
            ));
        }
        if [1, 4, 16].contains(&n) {
            histogram = histogram.with(format!("N = {n}"), Mark::LineDots, bins(&means));
        }
    }
    for n in [4.0, 16.0] {
        let sigma = (VARIANCE / n).sqrt();
        let curve =
            (0..=100).map(|i| f64::from(i) / 100.0).map(|x| (x, normal_pdf((x - MEAN) / sigma) / sigma)).collect();
        histogram = histogram.with(format!("normal, N = {n}"), Mark::Dashed, curve);
    }
    let slope = slope(&points).expect("five points");
    e.claim(Claim::equal(TOPIC, "slope of log standard deviation over log N", -0.5, slope.value, slope.standard_error));
    e.figure(histogram);
    e.figure(
        Figure::new(
            "deviation",
            format!("Standard deviation of the sample mean. Measured slope {slope}."),
            Axis::log("draws N"),
            Axis::log("standard deviation"),
        )
        .with("measured", Mark::Dots, curve(&points))
        .with("sqrt(V/N)", Mark::Dashed, predicted),
    );
    e.table(table);
    e.erratum(
        "“Sample variance” is the title over V[(1/N) Σ X_i] = V[X]/N",
        format!(
            "That is the variance of the sample mean. The sample variance, Σ (X_i − mean)²/(N − 1), estimates V[X] itself and does not fall \
             with N: over {repeats} repeats of N = 16 its mean is {:.5}, V[X] is {VARIANCE:.5}, and the sample mean's variance {:.5}.",
            spreads.mean(),
            VARIANCE / 16.0
        ),
    );
    e.claim(Claim::equal(
        TOPIC,
        "mean of the sample variance of 16 = V[X]",
        VARIANCE,
        spreads.mean(),
        spreads.standard_error(),
    ));
    e.answer(10, "By the sample mean, (1/N) Σ X_i.");
    e.answer(12, format!("By V[X]/N: with V[X] = 1/18, the measured variances follow 1/(18 N) from N = 1 to 256 (slope of the deviation {slope})."));
    e.answer(13, "N, the number of draws. The density of X can be chosen too: that is importance sampling.");
    e.answer(14, format!("It falls with 1/√N: measured exponent {slope}. Half the noise costs four times the draws."));
    slope
}

fn bins(means: &[f64]) -> Vec<(f64, f64)> {
    const BINS: usize = 50;
    let mut counts = [0u32; BINS];
    for m in means {
        counts[((m * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let scale = BINS as f64 / means.len() as f64;
    counts.iter().enumerate().map(|(i, &c)| ((i as f64 + 0.5) / BINS as f64, f64::from(c) * scale)).collect()
}

fn integral(e: &mut Experiment, setting: &Setting) {
    let draws = setting.effort.pick(20_000, 200_000, 2_000_000);
    let (a, w) = (1.0, 2.0);
    let f = |x: f64| x * x;
    let truth = 26.0 / 3.0;
    let mut rng = Rng::new(setting.seed_for(TOPIC, 2), 2);
    let bare: VarianceEstimator = (0..draws).map(|_| f(a + w * rng.f64())).collect();
    e.claim(Claim::equal(
        TOPIC,
        "the mean of f(X_i), X_i uniform on [1, 3], estimates F/w and not F",
        truth / w,
        bare.mean(),
        bare.standard_error(),
    ));
    e.claim(Claim::equal(
        TOPIC,
        "w times the mean of f(X_i) estimates F",
        truth,
        w * bare.mean(),
        w * bare.standard_error(),
    ));
    // Densities on [1, 3] by inversion: one that follows f, and one step down or up in the middle.
    type Density = (&'static str, fn(f64) -> (f64, f64));
    let densities: [Density; 3] = [
        ("p large where f is small", |u| if u < 0.8 { (1.0 + u / 0.8, 0.8) } else { (2.0 + (u - 0.8) / 0.2, 0.2) }),
        ("p large where f is large", |u| if u < 0.2 { (1.0 + u / 0.2, 0.2) } else { (2.0 + (u - 0.2) / 0.8, 0.8) }),
        ("p rising linearly", |u| {
            let x = (1.0 + 8.0 * u).sqrt();
            (x, x / 4.0)
        }),
    ];
    let mut table = Table::new(
        "unbiased",
        "Estimates of the integral of x² from 1 to 3, which is 26/3 = 8.6667.",
        &["estimator", "mean", "standard error", "variance of one draw"],
    );
    for (name, estimator, factor) in [("mean of f(X), the slide", &bare, 1.0), ("w · mean of f(X)", &bare, w)] {
        table.row([
            name.to_string(),
            format!("{:.4}", factor * estimator.mean()),
            format!("{:.4}", factor * estimator.standard_error()),
            format!("{:.3}", factor * factor * estimator.variance()),
        ]);
    }
    for (name, warp) in densities {
        let estimator = monte_carlo(draws, || Some(warp(rng.f64())), |&x| f(x));
        e.claim(Claim::equal(
            TOPIC,
            format!("E[f(X)/p(X)] = F for {name}"),
            truth,
            estimator.mean(),
            estimator.standard_error(),
        ));
        table.row([
            format!("mean of f(X)/p(X), {name}"),
            format!("{:.4}", estimator.mean()),
            format!("{:.4}", estimator.standard_error()),
            format!("{:.3}", estimator.variance()),
        ]);
    }
    e.table(table);
    e.answer(
        15,
        format!("E[f(X)]: for f = x² and X uniform on [1, 3] the mean of {draws} draws is {:.4}.", bare.mean()),
    );
    e.answer(
        16,
        format!(
            "F/w, the mean height of f: 13/3 = 4.3333, measured {:.4}. It takes the factor w to make F of it.",
            bare.mean()
        ),
    );
    e.answer(
        19,
        "Yes: E[f(X)/p(X)] = ∫ (f/p) p dx = F wherever p > 0. Measured for three densities, each within its interval.",
    );
    e.erratum(
        "“Stochastic sampling as integration (cont'd)”: E[(1/N) Σ f(X_i)] = ∫ f(x) dx",
        format!(
            "With X uniform on [a, b] the expectation is (1/w) ∫ f(x) dx, w = b − a: the slide derives the factor 1/w and drops it one \
             line later. For x² on [1, 3]: F = 8.6667, the mean of f(X_i) measured {:.4} = F/2; w times it {:.4}.",
            bare.mean(),
            w * bare.mean()
        ),
    );
}

fn sums(e: &mut Experiment, setting: &Setting) {
    let draws = setting.effort.pick(20_000, 200_000, 2_000_000);
    let mut rng = Rng::new(setting.seed_for(TOPIC, 3), 3);
    let xs: Vec<f64> = (0..draws).map(|_| rng.f64()).collect();
    let others: Vec<f64> = (0..draws).map(|_| rng.f64()).collect();
    // Y = X²: as dependent as can be.
    let sums: Vec<f64> = xs.iter().map(|x| x + x * x).collect();
    let independent: Vec<f64> = xs.iter().zip(&others).map(|(x, y)| x + y * y).collect();
    let of = |v: &[f64]| v.iter().copied().collect::<VarianceEstimator>();
    let s = of(&sums);
    e.claim(Claim::equal(
        TOPIC,
        "E[X + Y] = E[X] + E[Y] also for Y = X²",
        0.5 + 1.0 / 3.0,
        s.mean(),
        s.standard_error(),
    ));
    let v_sum = 1.0 / 12.0 + 4.0 / 45.0;
    let (v, v_error) = variance_with_error(&independent);
    e.claim(Claim::equal(TOPIC, "V[X + Y] = V[X] + V[Y] for independent Y", v_sum, v, v_error));
    let (dependent, d_error) = variance_with_error(&sums);
    e.claim(Claim::equal(
        TOPIC,
        "V[X + Y] = V[X] + V[Y] + 2 Cov(X, Y) for Y = X²",
        v_sum + 1.0 / 6.0,
        dependent,
        d_error,
    ));
    e.erratum(
        "“Sample mean”: E[X + Y] = E[X] + E[Y] where X and Y are independent",
        format!(
            "Expectation is linear without any independence. With Y = X², which X determines: predicted 0.8333, measured {:.4}. \
             Only the variance needs it (or zero covariance): V[X] + V[Y] = {v_sum:.4}, V[X + X²] measured {dependent:.4}.",
            s.mean()
        ),
    );
}

fn seeds(e: &mut Experiment, setting: &Setting) -> Result<String, Error> {
    let repeats = setting.effort.pick(500u64, 2_000, 10_000);
    let run = |seed: u64| {
        let mut rng = Rng::new(seed, 4);
        (0..256).map(|_| draw(&mut rng)).sum::<f64>() / 256.0
    };
    let seed = setting.seed_for(TOPIC, 4);
    let mut answers: Vec<u64> = (0..repeats).map(|i| run(seed.wrapping_add(i)).to_bits()).collect();
    let again: Vec<u64> = (0..repeats).map(|i| run(seed.wrapping_add(i)).to_bits()).collect();
    let changed = answers.iter().zip(&again).filter(|(a, b)| a != b).count();
    answers.sort_unstable();
    answers.dedup();
    let distinct = answers.len();
    e.claim(Claim::within(TOPIC, "runs with the same seed that differ in any bit", 0.0, changed as f64, [0.0, 0.0]));
    // Two sums of 256 numbers agree to the last bit with a probability of about 1e-14; a few pairs in ten thousand squared.
    e.claim(Claim::at_least(
        TOPIC,
        "share of seeds whose answer differs from all others",
        0.999,
        distinct as f64 / repeats as f64,
    ));
    // The same for path-traced pictures.
    let world = stage::penumbra_world([24, 18], SamplerKind::Independent)?;
    let picture = |seed: u64| stage::render_path(&world, 4, seed, setting.threads);
    let (a, b, c) = (picture(seed), picture(seed), picture(seed ^ 1));
    let differ =
        |p: &[[f32; 3]], q: &[[f32; 3]]| p.iter().zip(q).filter(|(x, y)| x != y).count() as f64 / p.len() as f64;
    e.claim(Claim::within(
        TOPIC,
        "path-traced pixels that differ between two runs with one seed",
        0.0,
        differ(&a, &b),
        [0.0, 0.0],
    ));
    let noisy = differ(&a, &c);
    e.claim(Claim::at_least(TOPIC, "share of path-traced pixels that differ between two seeds", 0.5, noisy));
    e.answer(
        11,
        format!("No: {distinct} of {repeats} repeats with different seeds gave different answers. With the same seed the answer is the same to the last bit, because the numbers are pseudo-random."),
    );
    e.answer(
        6,
        format!("No. Another seed changed {:.0} % of the pixels of a picture with 4 paths each; the same seed changed none, on any number of threads. All pictures scatter around the same expected one.", 100.0 * noisy),
    );
    Ok(format!("{distinct} of {repeats}"))
}
