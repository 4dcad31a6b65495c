//! Filters: samples follow their stated density, weights average to one, and the integral is the integral.

use steradian_image::{Filter, FilterKind};
use steradian_math::{Point2, Vec2};

/// SplitMix64 (Steele, Lea, Flood 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / (1 << 24) as f32
    }
}

fn filters() -> Vec<Filter> {
    let make = |kind, x, y| Filter::new(kind, Vec2::new(x, y)).unwrap();
    vec![
        make(FilterKind::Box, 0.5, 0.5),
        make(FilterKind::Box, 1.0, 2.5),
        make(FilterKind::Triangle, 2.0, 1.0),
        make(FilterKind::Gaussian { sigma: 0.5 }, 1.5, 1.5),
        make(FilterKind::Gaussian { sigma: 2.0 }, 1.0, 3.0),
        make(FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, 2.0, 2.0),
        make(FilterKind::Mitchell { b: 0.0, c: 0.5 }, 1.5, 3.0),
        make(FilterKind::Sinc { tau: 3.0 }, 4.0, 4.0),
        make(FilterKind::Sinc { tau: 2.0 }, 2.0, 1.0),
    ]
}

/// Integral over the filter's rectangle by the midpoint rule.
fn integrate(filter: &Filter, n: usize, f: impl Fn(Point2) -> f64) -> f64 {
    let r = filter.radius();
    let mut sum = 0.0;
    for y in 0..n {
        for x in 0..n {
            let at = |i: usize, r: f32| ((i as f32 + 0.5) / n as f32 * 2.0 - 1.0) * r;
            sum += f(Point2::new(at(x, r.x), at(y, r.y)));
        }
    }
    sum * f64::from(4.0 * r.x * r.y) / (n * n) as f64
}

#[test]
fn integrals() {
    for filter in filters() {
        let sum = integrate(&filter, 1500, |p| f64::from(filter.eval(p)));
        assert!(
            (sum / f64::from(filter.integral()) - 1.0).abs() < 2e-4,
            "{:?}: {sum} {}",
            filter.kind(),
            filter.integral()
        );
        let mass = integrate(&filter, 1500, |p| f64::from(filter.pdf(p)));
        assert!((mass - 1.0).abs() < 2e-3, "{:?}: {mass}", filter.kind());
    }
}

#[test]
fn closed_forms() {
    let g = Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::new(1.5, 1.5)).unwrap();
    // (erf(3 / sqrt 2) - 3 N(3) 2)^2 with the normal density N in units of sigma: 0.9973002 - 6 * 0.00443185.
    assert!((g.integral() - 0.970_709_1 * 0.970_709_1).abs() < 1e-5, "{}", g.integral());
    let m = Filter::new(FilterKind::Mitchell { b: 1.0 / 3.0, c: 1.0 / 3.0 }, Vec2::new(2.0, 2.0)).unwrap();
    assert!((m.eval(Point2::new(0.0, 0.0)) - (8.0 / 9.0) * (8.0 / 9.0)).abs() < 1e-6);
    assert!(m.eval(Point2::new(1.3, 0.0)) < 0.0);
    let s = Filter::new(FilterKind::Sinc { tau: 3.0 }, Vec2::new(4.0, 4.0)).unwrap();
    assert!(s.eval(Point2::new(1.0, 0.0)).abs() < 1e-6 && (s.eval(Point2::new(0.0, 0.0)) - 1.0).abs() < 1e-6);
    let t = Filter::new(FilterKind::Triangle, Vec2::new(2.0, 2.0)).unwrap();
    assert_eq!((t.eval(Point2::new(0.5, 1.0)), t.eval(Point2::new(2.5, 0.0))), (1.5, 0.0));
}

/// Chi-square of samples against the density over 20 x 20 cells. The limit is a normal deviate of 6, a false alarm in 1e9.
#[test]
fn samples_follow_the_density() {
    const CELLS: usize = 20;
    const SAMPLES: usize = 400_000;
    for (k, filter) in filters().iter().enumerate() {
        let r = filter.radius();
        let mut random = Random(1 + k as u64);
        let mut counts = [0.0_f64; CELLS * CELLS];
        for _ in 0..SAMPLES {
            let s = filter.sample(Point2::new(random.next(), random.next()));
            assert!(s.offset.x.abs() <= r.x && s.offset.y.abs() <= r.y && s.weight.is_finite());
            let cell = |v: f32, r: f32| (((v / r + 1.0) * 0.5 * CELLS as f32) as usize).min(CELLS - 1);
            counts[cell(s.offset.y, r.y) * CELLS + cell(s.offset.x, r.x)] += 1.0;
        }
        let (mut chi2, mut cells, mut rest) = (0.0, 0, (0.0, 0.0));
        for (i, &seen) in counts.iter().enumerate() {
            const SUB: usize = 24;
            let mut mass = 0.0;
            for j in 0..SUB * SUB {
                let at = |c: usize, s: usize, r: f32| {
                    ((c as f32 + (s as f32 + 0.5) / SUB as f32) / CELLS as f32 * 2.0 - 1.0) * r
                };
                mass += f64::from(filter.pdf(Point2::new(at(i % CELLS, j % SUB, r.x), at(i / CELLS, j / SUB, r.y))));
            }
            let want = mass / (SUB * SUB) as f64 * f64::from(4.0 * r.x * r.y) / (CELLS * CELLS) as f64 * SAMPLES as f64;
            if want < 10.0 {
                rest = (rest.0 + seen, rest.1 + want);
            } else {
                chi2 += (seen - want) * (seen - want) / want;
                cells += 1;
            }
        }
        if rest.1 > 10.0 {
            chi2 += (rest.0 - rest.1) * (rest.0 - rest.1) / rest.1;
            cells += 1;
        }
        // Wilson and Hilferty's normal deviate.
        let dof = f64::from(cells - 1);
        let z = ((chi2 / dof).cbrt() - (1.0 - 2.0 / (9.0 * dof))) / (2.0 / (9.0 * dof)).sqrt();
        assert!(z < 6.0, "{:?}: chi2 {chi2} of {dof}, z {z}", filter.kind());
    }
}

/// The mean weight is 1, and weighted samples reproduce moments of the filter, within 6 standard errors (a false alarm in 5e8).
#[test]
fn weights_average_to_one_and_reproduce_moments() {
    const SAMPLES: usize = 400_000;
    for (k, filter) in filters().iter().enumerate() {
        type Moment = fn(f64, f64) -> f64;
        let moments: [(&str, Moment); 3] =
            [("1", |_, _| 1.0), ("x", |x, _| x), ("x^2 + cos y", |x, y| x * x + y.cos())];
        for (name, f) in moments {
            let want = integrate(filter, 1000, |p| f64::from(filter.eval(p)) * f(p.x.into(), p.y.into()))
                / f64::from(filter.integral());
            let mut random = Random(77 + k as u64);
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..SAMPLES {
                let s = filter.sample(Point2::new(random.next(), random.next()));
                let v = f64::from(s.weight) * f(s.offset.x.into(), s.offset.y.into());
                sum += v;
                squares += v * v;
            }
            let n = SAMPLES as f64;
            let mean = sum / n;
            let error = ((squares / n - mean * mean).max(0.0) / n).sqrt();
            assert!(
                (mean - want).abs() < 6.0 * error + 3e-4,
                "{:?} {name}: {mean} for {want} +- {error}",
                filter.kind()
            );
        }
    }
}

#[test]
fn weights_of_positive_filters_hardly_vary() {
    let filter = Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::new(1.5, 1.5)).unwrap();
    let mut random = Random(5);
    let n = 100_000;
    let variance: f64 = (0..n)
        .map(|_| f64::from(filter.sample(Point2::new(random.next(), random.next())).weight) - 1.0)
        .map(|d| d * d)
        .sum::<f64>()
        / f64::from(n);
    assert!(variance < 5e-4, "{variance}");
}

#[test]
fn senseless_filters_are_errors_and_extreme_ones_work() {
    let bad = [
        (FilterKind::Box, 0.0, 1.0),
        (FilterKind::Box, f32::NAN, 1.0),
        (FilterKind::Gaussian { sigma: 0.0 }, 1.0, 1.0),
        (FilterKind::Sinc { tau: -1.0 }, 1.0, 1.0),
        (FilterKind::Mitchell { b: f32::INFINITY, c: 0.0 }, 1.0, 1.0),
        (FilterKind::Triangle, 1e-30, 1e-30),
    ];
    for (kind, x, y) in bad {
        assert!(Filter::new(kind, Vec2::new(x, y)).is_err(), "{kind:?}");
    }
    let wide = Filter::new(FilterKind::Sinc { tau: 3.0 }, Vec2::new(1000.0, 1000.0)).unwrap();
    assert!(wide.sample(Point2::new(0.3, 0.999_999_94)).weight.is_finite());
}
