//! Quadrature rules against random, stratified and low-discrepancy points in one to eight dimensions, and uneven
//! sampling with weights.

use super::prelude::*;
use steradian_sampling::estimator::Quadrature;
use steradian_sampling::rng::unit_f32;
use steradian_sampling::sequence::{nested_uniform_scramble, sobol_bits};

const TOPIC: Topic = Topic::Quadrature;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Quadrature and Monte Carlo",
        "Evaluating an integral by samples at even spacing is called quadrature. How many samples do we need if we have integrals \
         over d dimensions, and we sample N times in each dimension?",
        "The integral of a product of d smooth functions, e^x/(e − 1) in each variable, which is 1 in every dimension, and of the \
         indicator of a ball, by the midpoint rule, Simpson's rule, random points, one random point in each of n^d cells, and \
         Owen-scrambled Sobol' points. The slope of the error over the number of evaluations is fitted for each.",
    );
    let crossing = every_dimension(&mut e, setting);
    counts(&mut e);
    rough(&mut e, setting);
    let gain = uneven(&mut e);
    shifted(&mut e);
    e.result = format!(
        "The midpoint rule converges with slope −2/d, Simpson's with −4/d, random points with −1/2 in every dimension: {crossing}. \
         Even spacing needs N^d evaluations. Nodes that are dense where a peaked f is large, each weighted by its spacing, have \
         {gain:.0} times less error than as many evenly spaced ones."
    );
    Ok(e)
}

/// The slide's sum as it stands, on an interval that does not begin at 0.
fn shifted(e: &mut Experiment) {
    let (a, b, n) = (1.0, 3.0, 1_000);
    let dx = (b - a) / f64::from(n);
    let sum = |start: f64| (1..=n).map(|i| start + f64::from(i) * dx).map(|x| x * x * dx).sum::<f64>();
    let (as_written, moved) = (sum(0.0), sum(a));
    let exact = (b * b * b - a * a * a) / 3.0;
    e.claim(Claim::within(
        TOPIC,
        "∫ x² over [1, 3] by 1000 terms f(a + i Δx) Δx",
        exact,
        moved,
        // The right ends of the cells: half a cell of the difference of the ends, and no more.
        [exact, exact + 0.5 * dx * (b * b - a * a) + dx * dx],
    ));
    e.erratum(
        "“Approximating integrals”: F = ∫ from a to b ≈ Σ f(i Δx) Δx",
        format!(
            "The nodes are a + i Δx. For x² on [1, 3] with N = {n}, the sum as written measures {as_written:.4}, the integral from 0 to 2; from a \
             on it is {moved:.4} for F = {exact:.4}."
        ),
    );
}

/// Integral 1 over the unit cube.
fn smooth<const D: usize>(x: &[f64; D]) -> f64 {
    x.iter().map(|v| v.exp()).product::<f64>() / (std::f64::consts::E - 1.0).powi(D as i32)
}

/// Errors in one dimension after the other; says what the slopes are in the last.
fn every_dimension(e: &mut Experiment, setting: &Setting) -> String {
    let dimensions = setting.effort.pick::<&[u32]>(&[1, 2, 4, 8], &[1, 2, 3, 4, 5, 6, 7, 8], &[1, 2, 3, 4, 5, 6, 7, 8]);
    let all = parallel::map(setting.threads, dimensions.len(), |i| match dimensions[i] {
        1 => Errors::measure::<1>(setting),
        2 => Errors::measure::<2>(setting),
        3 => Errors::measure::<3>(setting),
        4 => Errors::measure::<4>(setting),
        5 => Errors::measure::<5>(setting),
        6 => Errors::measure::<6>(setting),
        7 => Errors::measure::<7>(setting),
        _ => Errors::measure::<8>(setting),
    });
    for errors in &all {
        errors.claims(e);
        errors.figure(e);
    }
    let last = &all[all.len() - 1];
    format!(
        "in {} dimensions midpoint {:.2}, random {}",
        last.dimensions,
        plain_slope(&last.midpoint),
        fitted(&last.random)
    )
}

/// Errors over evaluations in some number of dimensions.
struct Errors {
    dimensions: usize,
    midpoint: Vec<(f64, f64)>,
    simpson: Vec<(f64, f64)>,
    random: Vec<ErrorAt>,
    jittered: Vec<ErrorAt>,
    sobol: Vec<ErrorAt>,
}

fn fitted(points: &[ErrorAt]) -> Slope {
    slope(points).expect("two points")
}

/// Counts along an axis, spread evenly over the logarithm.
fn sides(budget: f64, d: f64) -> Vec<u32> {
    let most = budget.powf(1.0 / d).floor().max(3.0) as u32;
    let mut sides: Vec<u32> = (0..6).map(|i| (f64::from(most).powf(f64::from(i + 1) / 6.0)).round() as u32).collect();
    sides.retain(|&n| n >= 2);
    sides.dedup();
    if sides.len() < 2 { vec![2, most.max(3)] } else { sides }
}

impl Errors {
    fn measure<const D: usize>(setting: &Setting) -> Self {
        let d = D as f64;
        let budget = setting.effort.pick(4_000.0, 20_000.0, 100_000.0f64);
        let repeats = setting.effort.pick(64, 128, 256);
        let seed = setting.seed_for(TOPIC, D as u64);
        let sides = sides(budget, d);
        let evaluations = |n: u32| f64::from(n).powf(d);
        let rule = |rule: Quadrature, n: u32| (evaluations(n), (rule.integrate(n, smooth::<D>) - 1.0).abs());
        let simpson = sides.iter().map(|&n| n.next_multiple_of(2)).filter(|&n| evaluations(n + 1) <= 4.0 * budget);
        let random = |&n: &u32| {
            let count = evaluations(n) as u64;
            let mut rng = Rng::new(seed, u64::from(n));
            let mut draw = || mean_of(count, || smooth(&std::array::from_fn::<_, D, _>(|_| rng.f64()))) - 1.0;
            ErrorAt::of(count as f64, (0..repeats).map(|_| draw()))
        };
        let jittered = |&n: &u32| {
            let mut rng = Rng::new(seed, 1_000 + u64::from(n));
            ErrorAt::of(evaluations(n), (0..repeats).map(|_| jitter::<D>(n, &mut rng) - 1.0))
        };
        let sobol = |k: u32| {
            let mut rng = Rng::new(seed, 2_000 + u64::from(k));
            ErrorAt::of(f64::from(1u32 << k), (0..repeats).map(|_| scrambled_sobol::<D>(1 << k, &mut rng) - 1.0))
        };
        Self {
            dimensions: D,
            midpoint: sides.iter().map(|&n| rule(Quadrature::Midpoint, n)).collect(),
            // Below this there is only rounding.
            simpson: simpson.map(|n| rule(Quadrature::Simpson, n)).filter(|p| p.1 > 1e-13).collect(),
            random: sides.iter().map(random).collect(),
            jittered: sides.iter().map(jittered).collect(),
            sobol: (4..=budget.log2() as u32).step_by(2).map(sobol).collect(),
        }
    }

    fn claims(&self, e: &mut Experiment) {
        let (dimensions, d) = (self.dimensions, self.dimensions as f64);
        // The rules reach their order from the third cell on; a few per cent are left for the fewest cells.
        let mut rule = |name: &str, order: f64, points: &[(f64, f64)], left: f64| {
            let (predicted, measured) = (-order / d, plain_slope(points));
            let claim = format!("{name} in {dimensions} dimensions: slope −{order}/d");
            e.claim(Claim::within(TOPIC, claim, predicted, measured, band(predicted, left)));
        };
        rule("midpoint rule", 2.0, &self.midpoint, 0.06);
        if self.simpson.len() > 2 {
            // Over the cells n^d, not the nodes (n + 1)^d, which bend the line where there are few.
            rule("Simpson's rule", 4.0, &self.simpson, 0.1);
        }
        let (mc, strat, qmc) = (fitted(&self.random), fitted(&self.jittered), fitted(&self.sobol));
        e.claim(Claim::equal(
            TOPIC,
            format!("random points in {dimensions} dimensions: slope −1/2"),
            -0.5,
            mc.value,
            mc.standard_error,
        ));
        let predicted = -0.5 - 1.0 / d;
        e.claim(Claim::close(
            TOPIC,
            format!("one random point in each of n^{dimensions} cells: slope −1/2 − 1/d"),
            predicted,
            strat.value,
            strat.standard_error,
            0.05 * predicted.abs() + 0.02,
        ));
        if dimensions <= 4 {
            // Up to powers of the logarithm, which are slow to fade: -3/2 is the limit.
            let scatter = z_limit() * qmc.standard_error;
            e.claim(Claim::within(
                TOPIC,
                format!("Owen-scrambled Sobol' points in {dimensions} dimensions: slope towards −3/2"),
                -1.5,
                qmc.value,
                [-1.5 - 0.1 - scatter, -0.9 + scatter],
            ));
        }
    }

    fn figure(&self, e: &mut Experiment) {
        let (random, last) = (&self.random, self.random.len() - 1);
        let (start, end) = ((random[0].n, random[0].rms()), random[last].n);
        e.figure(
            Figure::new(
                &format!("dimensions-{}", self.dimensions),
                format!(
                    "{} dimension{}: slopes: midpoint {:.2}, random {}, stratified {}, Sobol' {}.",
                    self.dimensions,
                    if self.dimensions > 1 { "s" } else { "" },
                    plain_slope(&self.midpoint),
                    fitted(random),
                    fitted(&self.jittered),
                    fitted(&self.sobol)
                ),
                Axis::log("evaluations"),
                Axis::log("error (rms where random)"),
            )
            .with("midpoint rule", Mark::LineDots, self.midpoint.clone())
            .with("Simpson's rule", Mark::LineDots, self.simpson.clone())
            .with("random", Mark::LineDots, curve(random))
            .with("stratified", Mark::LineDots, curve(&self.jittered))
            .with("scrambled Sobol'", Mark::LineDots, curve(&self.sobol))
            .with("slope −1/2", Mark::Dashed, vec![start, (end, start.1 * (end / start.0).powf(-0.5))]),
        );
    }
}

fn band(v: f64, relative: f64) -> [f64; 2] {
    let half = relative * v.abs() + 0.01;
    [v - half, v + half]
}

fn mean_of(count: u64, mut f: impl FnMut() -> f64) -> f64 {
    (0..count).map(|_| f()).sum::<f64>() / count as f64
}

fn jitter<const D: usize>(n: u32, rng: &mut Rng) -> f64 {
    let mut cell = [0u32; D];
    let (mut sum, mut count) = (0.0, 0u64);
    loop {
        sum += smooth(&cell.map(|c| (f64::from(c) + rng.f64()) / f64::from(n)));
        count += 1;
        let Some(place) = cell.iter().position(|&c| c + 1 < n) else { return sum / count as f64 };
        cell[place] += 1;
        cell[..place].fill(0);
    }
}

fn scrambled_sobol<const D: usize>(count: u32, rng: &mut Rng) -> f64 {
    let seeds: [u32; D] = std::array::from_fn(|_| rng.u32());
    (0..count)
        .map(|i| {
            smooth(&std::array::from_fn::<_, D, _>(|k| {
                f64::from(nested_uniform_scramble(sobol_bits(u64::from(i), k), seeds[k])) / 4_294_967_296.0
            }))
        })
        .sum::<f64>()
        / f64::from(count)
}

/// N^d by counting.
fn counts(e: &mut Experiment) {
    let counted = |d: u32| {
        let calls = std::cell::Cell::new(0u64);
        let tick = || calls.set(calls.get() + 1);
        match d {
            1 => Quadrature::Midpoint.integrate(10, |_: &[f64; 1]| {
                tick();
                1.0
            }),
            2 => Quadrature::Midpoint.integrate(10, |_: &[f64; 2]| {
                tick();
                1.0
            }),
            3 => Quadrature::Midpoint.integrate(10, |_: &[f64; 3]| {
                tick();
                1.0
            }),
            _ => Quadrature::Midpoint.integrate(10, |_: &[f64; 6]| {
                tick();
                1.0
            }),
        };
        calls.get()
    };
    let mut table = Table::new(
        "counts",
        "Evaluations of the integrand by a rule with N = 10 nodes in each dimension.",
        &["d", "counted", "N^d"],
    );
    for d in [1, 2, 3, 6] {
        let (n, predicted) = (counted(d), 10u64.pow(d));
        table.row([d.to_string(), n.to_string(), predicted.to_string()]);
        let p = predicted as f64;
        e.claim(Claim::within(
            TOPIC,
            format!("evaluations of the product rule with N = 10, d = {d}: N^d"),
            p,
            n as f64,
            [p, p],
        ));
    }
    e.table(table);
    e.answer(
        7,
        format!(
            "N^d. Counted with N = 10: {} in 2, {} in 3, {} in 6 dimensions. A path with 8 bounces has more than 20.",
            counted(2),
            counted(3),
            counted(6)
        ),
    );
}

/// The indicator of a ball: what an edge does to a rule.
fn rough(e: &mut Experiment, setting: &Setting) {
    let repeats = setting.effort.pick(200, 1_000, 3_000);
    let inside = |p: &[f64; 2]| f64::from(p[0] * p[0] + p[1] * p[1] < 1.0);
    let truth = std::f64::consts::FRAC_PI_4;
    let sides = [4u32, 8, 16, 32, 64];
    // The grid is shifted at random, so that its error is a root mean square as well.
    let shifted = |n: u32, rng: &mut Rng| {
        let (dx, dy) = (rng.f64(), rng.f64());
        let at = |i: u32, shift: f64| (f64::from(i) + shift) / f64::from(n);
        let sum: f64 = (0..n * n).map(|i| inside(&[at(i % n, dx), at(i / n, dy)])).sum();
        sum / f64::from(n * n)
    };
    let cells = |n: u32, rng: &mut Rng| {
        let sum: f64 = (0..n * n)
            .map(|i| {
                inside(&[(f64::from(i % n) + rng.f64()) / f64::from(n), (f64::from(i / n) + rng.f64()) / f64::from(n)])
            })
            .sum();
        sum / f64::from(n * n)
    };
    let free =
        |n: u32, rng: &mut Rng| (0..n * n).map(|_| inside(&[rng.f64(), rng.f64()])).sum::<f64>() / f64::from(n * n);
    let sobol = |n: u32, rng: &mut Rng| {
        let (a, b) = (rng.u32(), rng.u32());
        let at = |i: u32, k: usize, seed: u32| {
            f64::from(unit_f32(nested_uniform_scramble(sobol_bits(u64::from(i), k), seed)))
        };
        (0..n * n).map(|i| inside(&[at(i, 0, a), at(i, 1, b)])).sum::<f64>() / f64::from(n * n)
    };
    let mut rng = Rng::new(setting.seed_for(TOPIC, 100), 1);
    let mut errors = |f: &dyn Fn(u32, &mut Rng) -> f64| -> Vec<ErrorAt> {
        sides.iter().map(|&n| ErrorAt::of(f64::from(n * n), (0..repeats).map(|_| f(n, &mut rng) - truth))).collect()
    };
    let all = [
        ("random", errors(&free)),
        ("regular grid, shifted", errors(&shifted)),
        ("stratified", errors(&cells)),
        ("scrambled Sobol'", errors(&sobol)),
    ];
    let mut figure = Figure::new(
        "ball",
        "The area of a quarter disc: the integrand jumps, and the orders of the smooth case are lost to all but random points.",
        Axis::log("evaluations"),
        Axis::log("rms error"),
    );
    for (name, points) in &all {
        figure = figure.with(*name, Mark::LineDots, curve(points));
        let s = slope(points).expect("five points");
        match *name {
            "random" => {
                e.claim(Claim::equal(TOPIC, "quarter disc, random points: slope −1/2", -0.5, s.value, s.standard_error))
            }
            "stratified" => e.claim(Claim::close(
                TOPIC,
                "quarter disc, stratified: slope −3/4, because only the cells along the edge have any variance",
                -0.75,
                s.value,
                s.standard_error,
                0.03,
            )),
            _ => {}
        }
    }
    e.figure(figure);
}

/// Uneven nodes with weights against even ones, on a peak.
fn uneven(e: &mut Experiment) -> f64 {
    // A Cauchy peak of half-width 0.02 at 0.3: its integral is an arc tangent.
    let (centre, width) = (0.3, 0.02);
    let f = |x: f64| 1.0 / (1.0 + ((x - centre) / width) * ((x - centre) / width));
    let primitive = |x: f64| width * ((x - centre) / width).atan();
    let truth = primitive(1.0) - primitive(0.0);
    // Node density: half even, half along a wider peak of the same kind.
    let wide = 3.0 * width;
    let area = |x: f64| wide * ((x - centre) / wide).atan();
    let total = area(1.0) - area(0.0);
    let density = |x: f64| 0.5 + 0.5 / (1.0 + ((x - centre) / wide) * ((x - centre) / wide)) / total;
    let cumulative = |x: f64| 0.5 * x + 0.5 * (area(x) - area(0.0)) / total;
    let node = |u: f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if cumulative(middle) < u { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    let mut even = Vec::new();
    let mut weighted = Vec::new();
    let mut worst_weight = 0.0f64;
    for n in [8u32, 16, 32] {
        let h = 1.0 / f64::from(n);
        let plain: f64 = (0..n).map(|i| f((f64::from(i) + 0.5) * h) * h).sum();
        let mut sum = 0.0;
        for i in 0..n {
            let (a, b) = (node(f64::from(i) * h), node(f64::from(i + 1) * h));
            let x = node((f64::from(i) + 0.5) * h);
            sum += f(x) * (b - a);
            worst_weight = worst_weight.max(((b - a) * density(x) * f64::from(n) - 1.0).abs());
        }
        even.push((f64::from(n), (plain - truth).abs()));
        weighted.push((f64::from(n), (sum - truth).abs()));
    }
    let rms = |v: &[(f64, f64)]| (v.iter().map(|p| p.1 * p.1).sum::<f64>() / v.len() as f64).sqrt();
    let gain = rms(&even) / rms(&weighted);
    e.claim(Claim::at_least(
        TOPIC,
        "error of even over uneven, weighted nodes on a peak (rms over 8 to 32 nodes)",
        2.0,
        gain,
    ));
    let (a, b) = (node(0.5 + 0.5 / 32.0) - node(0.5 - 0.5 / 32.0), node(1.0) - node(1.0 - 1.0 / 32.0));
    e.claim(Claim::at_most(
        TOPIC,
        "weight of a node at the peak over that of one at the end: closer nodes count less",
        1.0,
        a / b,
    ));
    e.figure(
        Figure::new(
            "uneven",
            "A peak integrated with even nodes and with nodes that are dense where f is large, each weighted by its spacing Δx_i.",
            Axis::log("nodes"),
            Axis::log("error"),
        )
        .with("even", Mark::LineDots, even)
        .with("uneven, weighted", Mark::LineDots, weighted),
    );
    e.answer(8, format!("Those where f is large (and varies): on a peak, uneven nodes had {gain:.0} times less error than as many even ones."));
    e.answer(9, format!("Smaller: the weight is the spacing Δx_i, about 1/(N p(x_i)). At the peak a node weighs {:.3} of what one at the end does; Δx_i N p(x_i) stays within {worst_weight:.2} of 1.", a / b));
    gain
}
