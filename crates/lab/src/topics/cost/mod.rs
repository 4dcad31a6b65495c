//! The cost of brute force: the lecture's model against counted intersection tests, its extrapolation, and what path tracing
//! spends for the same error.

mod soup;

use super::prelude::*;
use crate::BruteForce;
use crate::stage::Builder;
use soup::{Search, Soup};
use steradian_scene::{IntegratorKind, Whitted, World};

const TOPIC: Topic = Topic::Cost;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "The cost of brute force",
        "Asymptotic number of intersection tests ≈ O(n k² m a² (ℓ s² + r² (ℓ s² + r² (…)))): very expensive! For a fixed number of rays \
         per pixel, does MCPT trace more total rays than Whitted?",
        "A closed room of n triangles with ℓ lamps, traced exactly as the slide has it, with every test of a ray against a triangle \
         counted: once against every triangle, once through one fixed tree. Then the model is evaluated for the slide's numbers, and path \
         tracing is given the rays that it needs for the same error.",
    );
    let model = model(&mut e, setting);
    if let Some(parameters) = setting.brute_force {
        chosen(&mut e, setting, parameters);
    }
    let tree = trees(&mut e, setting)?;
    let gain = same_error(&mut e, setting);
    let slide = extrapolate(&mut e, &gain, tree.at_a_million);
    whitted(&mut e, setting)?;
    e.result = format!(
        "Against every triangle the counted tests are the model's{}. {} {} {slide}",
        if model == 0.0 { ", to the last one".into() } else { format!(" to {model:.1e}") },
        tree.line,
        gain.line
    );
    Ok(e)
}

fn room(n: usize, lamps: usize, setting: &Setting) -> Soup {
    // A box of triangles with finite corners always has a tree.
    Soup::new(n, lamps, setting.seed_for(TOPIC, 1)).expect("finite triangles")
}

const BASE: BruteForce = BruteForce { m: 4, k: 1, a: 1, s: 1, r: 1, d: 1, n: 120, l: 2 };

/// Counted tests against the formula, parameter by parameter.
fn model(e: &mut Experiment, setting: &Setting) -> f64 {
    let soup = room(BASE.n as usize, BASE.l as usize, setting);
    let counted: Vec<Counted> =
        CASES.into_iter().map(|(name, change)| Counted::of(name, &soup, change(BASE), setting)).collect();
    tables(e, &counted);
    let worst = counted.iter().fold(0.0f64, |m, c| m.max((c.linear / c.predicted - 1.0).abs()));
    e.claim(Claim::within(
        TOPIC,
        "every triangle: worst relative deviation of the counted tests from n m² k² a² T(d), 13 settings",
        0.0,
        worst,
        [0.0, 1e-3],
    ));
    // A handful of rays says little about the mean.
    let per_ray: Vec<f64> = counted.iter().filter(|c| c.rays >= 400.0).map(|c| c.tree / c.rays).collect();
    let mean = per_ray.iter().sum::<f64>() / per_ray.len() as f64;
    let spread = per_ray.iter().fold(1.0f64, |m, v| m.max(v / mean).max(mean / v));
    e.claim(Claim::within(
        TOPIC,
        "tree: tests per ray of all settings with 400 rays and more lie within this factor of their mean (shadow rays stop at the first hit)",
        1.0,
        spread,
        [1.0, 8.0],
    ));
    // The first two of the cases.
    let (base, doubled) = (counted[0].linear, counted[1].linear);
    let ratio = doubled / base;
    e.claim(Claim::within(TOPIC, "tests with twice the m, over those with m: the square", 4.0, ratio, [3.996, 4.004]));
    e.erratum(
        "“Naively improving Whitted ray tracing”: m × m pixels, and O(n k² m a² (…)) tests",
        format!(
            "With m × m pixels the factor is m², and the worked number indeed puts 10⁶ = 1000² for it. Counted: {base} tests at m = 4, \
             {doubled} at m = 8, ratio {ratio:.3}."
        ),
    );
    worst
}

type Change = fn(BruteForce) -> BruteForce;

/// One parameter after the other, then several.
const CASES: [(&str, Change); 13] = [
    ("base", |p| p),
    ("m = 8", |p| BruteForce { m: 8, ..p }),
    ("k = 2", |p| BruteForce { k: 2, ..p }),
    ("k = 3", |p| BruteForce { k: 3, ..p }),
    ("a = 2", |p| BruteForce { a: 2, ..p }),
    ("a = 3", |p| BruteForce { a: 3, ..p }),
    ("s = 2", |p| BruteForce { s: 2, ..p }),
    ("s = 4", |p| BruteForce { s: 4, ..p }),
    ("d = 3", |p| BruteForce { d: 3, ..p }),
    ("r = 2, d = 2", |p| BruteForce { r: 2, d: 2, ..p }),
    ("r = 2, d = 4", |p| BruteForce { r: 2, d: 4, ..p }),
    ("r = 3, d = 3", |p| BruteForce { r: 3, d: 3, ..p }),
    ("k = a = s = r = d = 2", |p| BruteForce { k: 2, a: 2, s: 2, r: 2, d: 2, ..p }),
];

/// Brute force with one set of parameters, against every triangle and through the tree.
struct Counted {
    name: String,
    predicted: f64,
    rays: f64,
    linear: f64,
    tree: f64,
}

impl Counted {
    fn of(name: &str, soup: &Soup, p: BruteForce, setting: &Setting) -> Self {
        let (_, linear) = soup.brute_force(Search::Linear, &p, setting.seed);
        let (_, tree) = soup.brute_force(Search::Tree, &p, setting.seed);
        Self {
            name: name.into(),
            predicted: p.tests(),
            rays: tree.rays as f64,
            linear: linear.tests as f64,
            tree: tree.tests as f64,
        }
    }

    fn row(&self) -> [String; 6] {
        [
            self.name.clone(),
            self.rays.to_string(),
            self.linear.to_string(),
            format!("{:.0}", self.predicted),
            self.tree.to_string(),
            format!("{:.2}", self.tree / self.rays),
        ]
    }
}

const COUNTED: [&str; 6] =
    ["parameters", "rays", "tests, every triangle", "n · m² k² a² T(d)", "tests, tree", "tests per ray, tree"];

fn tables(e: &mut Experiment, counted: &[Counted]) {
    let mut table = Table::new(
        "counted",
        format!(
            "Intersection tests in a room of {} triangles with {} lamps, {} × {} pixels unless stated.",
            BASE.n, BASE.l, BASE.m, BASE.m
        ),
        &COUNTED,
    );
    counted.iter().for_each(|c| table.row(c.row()));
    e.table(table);
    let points = |f: &dyn Fn(&Counted) -> f64| {
        let mut points: Vec<_> = counted.iter().map(|c| (c.predicted, f(c))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points
    };
    e.figure(
        Figure::new(
            "model",
            "Counted tests over the model's: every triangle lies on the line, the tree runs parallel to it.",
            Axis::log("model: n m² k² a² T(d)"),
            Axis::log("counted tests"),
        )
        .with("every triangle", Mark::Dots, points(&|c| c.linear))
        .with("tree", Mark::Dots, points(&|c| c.tree))
        .with("model", Mark::Dashed, points(&|c| c.predicted)),
    );
}

/// The reader's own parameters.
fn chosen(e: &mut Experiment, setting: &Setting, p: BruteForce) {
    let soup = room(p.n as usize, p.l as usize, setting);
    let counted = Counted::of(&p.to_string(), &soup, p, setting);
    let mut table = Table::new("chosen", "The parameters that were asked for.", &COUNTED);
    table.row(counted.row());
    e.table(table);
    e.claim(Claim::close(
        TOPIC,
        format!("{p}: counted tests against every triangle: n m² k² a² T(d)"),
        counted.predicted,
        counted.linear,
        0.0,
        1e-3 * counted.predicted,
    ));
}

/// What the renderer's tree costs.
struct Tree {
    /// Tests of boxes and triangles per ray among a million triangles, by the measured power law.
    at_a_million: f64,
    line: String,
}

/// Tests per ray over the number of triangles, counted by the renderer in its own tree.
fn trees(e: &mut Experiment, setting: &Setting) -> Result<Tree, Error> {
    let counts: &[usize] = setting.effort.pick(
        &[100, 1_000, 10_000],
        &[100, 1_000, 10_000, 100_000],
        &[100, 1_000, 10_000, 100_000, 1_000_000],
    );
    let size = setting.effort.pick([24, 24], [48, 48], [96, 96]);
    let (mut boxes, mut triangles, mut both) = (Vec::new(), Vec::new(), Vec::new());
    for &n in counts {
        let mut b = Builder::new(size, 3);
        b.camera([0.0, 0.0, -0.98], [0.0, -0.2, 1.0], 70.0);
        let grey = b.diffuse([0.5; 3]);
        b.triangles(&soup::clutter(n, setting.seed_for(TOPIC, 1)), grey);
        b.lamp([[-0.3, 0.95, -0.3], [-0.3, 0.95, 0.3], [0.3, 0.95, 0.3], [0.3, 0.95, -0.3]], 5.0);
        let [rays, b, p] = stage::count_tests(&b.build()?, 2, setting.seed_for(TOPIC, 3), setting.threads);
        let per_ray = |v: u64| v as f64 / rays as f64;
        boxes.push((n as f64, per_ray(b)));
        triangles.push((n as f64, per_ray(p)));
        both.push((n as f64, per_ray(b + p)));
    }
    let s = plain_slope(&both);
    e.claim(Claim::within(
        TOPIC,
        "tree: slope of log tests per ray (boxes and triangles) over log n, against 1 for every triangle",
        0.0,
        s,
        [0.0, 0.4],
    ));
    let last = both[both.len() - 1];
    e.claim(Claim::at_least(
        TOPIC,
        format!("tests per ray of every triangle over those of the tree, n = {}", last.0),
        50.0,
        last.0 / last.1,
    ));
    let line = format!(
        "The renderer's tree replaces n = {:.0} by {:.0} tests of boxes and triangles per ray.",
        last.0, last.1
    );
    let all = both.iter().map(|p| (p.0, p.0)).collect();
    e.figure(
        Figure::new(
            "trees",
            format!("Tests per ray over the number of triangles, counted by the renderer. Slope of their sum: {s:.2}."),
            Axis::log("triangles n"),
            Axis::log("tests per ray"),
        )
        .with("boxes", Mark::LineDots, boxes)
        .with("triangles", Mark::LineDots, triangles)
        .with("both", Mark::LineDots, both)
        .with("every triangle", Mark::Dashed, all),
    );
    Ok(Tree { at_a_million: last.1 * (1e6 / last.0).powf(s), line })
}

struct Gain {
    /// Rays of brute force over rays of path tracing for the same error.
    ratio: f64,
    /// Paths for the same error over `k² a² s²`, at most.
    paths: f64,
    line: String,
}

/// Where brute force and path tracing are compared.
const SAME: BruteForce = BruteForce { m: 1, k: 1, a: 1, s: 1, r: 1, d: 3, n: 300, l: 4 };

fn same_error(e: &mut Experiment, setting: &Setting) -> Gain {
    let soup = room(SAME.n as usize, SAME.l as usize, setting);
    let d = SAME.d;
    let m = setting.effort.pick(8, 16, 24);
    let mse = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64;
    let parts = setting.effort.pick(8usize, 32, 64);
    let pictures = parallel::map(setting.threads, parts, |i| {
        soup.path_trace(Search::Tree, m, d, 128, setting.seed_for(TOPIC, 100 + i as u64))
    });
    let truth: Vec<f64> =
        (0..pictures[0].0.len()).map(|i| pictures.iter().map(|p| p.0[i]).sum::<f64>() / parts as f64).collect();
    // The variance of one path, from independent pictures, and its rays.
    let paths = 32;
    let trial = parallel::map(setting.threads, 8, |i| {
        soup.path_trace(Search::Tree, m, d, paths, setting.seed_for(TOPIC, 500 + i as u64))
    });
    let error_of_path = trial.iter().map(|t| mse(&t.0, &truth)).sum::<f64>() / 8.0 * f64::from(paths);
    let rays_of_path = trial[0].1.rays as f64 / f64::from(m * m * paths);
    let mut table = Table::new(
        "same-error",
        format!(
            "{} lamps, d = {d}: rays per pixel of brute force, and of path tracing for the same mean squared error.",
            SAME.l
        ),
        &["k, a", "s = r", "rays per pixel, brute force", "mean squared error", "rays per pixel, paths", "ratio"],
    );
    let mut ratios = Vec::new();
    let mut points = Vec::new();
    let mut most = 0.0f64;
    for (k, s) in [(1u32, 1u32), (1, 2), (2, 2), (1, 3), (2, 3)] {
        let p = BruteForce { m, k, a: 1, s, r: s, d, ..SAME };
        let repeats = setting.effort.pick(2usize, 4, 8);
        let runs = parallel::map(setting.threads, repeats, |i| {
            soup.brute_force(Search::Tree, &p, setting.seed_for(TOPIC, 900 + i as u64))
        });
        let error = runs.iter().map(|r| mse(&r.0, &truth)).sum::<f64>() / repeats as f64;
        let rays = runs[0].1.rays as f64 / f64::from(m * m);
        let path_rays = rays_of_path * error_of_path / error;
        let ratio = rays / path_rays;
        ratios.push(ratio);
        most = most.max(error_of_path / error / f64::from(k * k * s * s));
        points.push((rays, error));
        table.row([
            format!("{k}, 1"),
            s.to_string(),
            format!("{rays:.0}"),
            format!("{error:.2e}"),
            format!("{path_rays:.0}"),
            format!("{ratio:.2}"),
        ]);
    }
    e.table(table);
    let line = points.iter().map(|p| (p.0, error_of_path * rays_of_path / p.0)).collect();
    e.figure(
        Figure::new(
            "same-error",
            "Squared error over the rays traced for each pixel.",
            Axis::log("rays per pixel"),
            Axis::log("mean squared error"),
        )
        .with("brute force", Mark::Dots, points)
        .with("path tracing", Mark::Line, line),
    );
    e.claim(Claim::at_least(
        TOPIC,
        "rays of brute force (k = 2, s = r = 3, d = 3) over rays of path tracing for the same error",
        1.5,
        ratios[4],
    ));
    Gain {
        ratio: ratios[4],
        paths: most,
        line: format!(
            "With k = 2, s = r = 3 and three bounces, brute force traces {:.1} times the rays that path tracing needs for the same error.",
            ratios[4]
        ),
    }
}

/// The slide's numbers; a ray takes `tests` tests in the tree.
fn extrapolate(e: &mut Experiment, gain: &Gain, tests: f64) -> String {
    let slide = BruteForce { m: 1_000, k: 8, a: 8, s: 8, r: 8, d: 8, n: 1_000_000, l: 4 };
    let n = f64::from(slide.n);
    // One level of the bracket: n k² m² a² r² l s².
    let one_level = n * 64.0 * 1e6 * 64.0 * 64.0 * f64::from(slide.l) * 64.0;
    let full = slide.tests();
    e.claim(Claim::within(
        TOPIC,
        "the slide's 64·10¹⁸ is n k² m² a² r² ℓ s², with 2²⁰ taken for 10⁶",
        64e18,
        one_level,
        [0.95 * 64e18, 1.08 * 64e18],
    ));
    e.claim(Claim::at_least(TOPIC, "tests with all eight bounces, over the slide's number", 1e9, full / 64e18));
    let paths = gain.paths * 64.0 * 64.0 * 64.0;
    let mut table = Table::new(
        "extrapolation",
        format!(
            "m = 1000, k = a = s = r = 8, n = 10⁶, ℓ = 4. The tree takes {tests:.0} tests per ray, by the power law measured above. For the \
             same error the settings above took at most {:.1} k² a² s² paths per pixel: {paths:.1e} here, of 2 d rays each. A thousand \
             paths make a clean picture already.",
            gain.paths
        ),
        &[
            "d",
            "rays per camera ray T(d)",
            "rays of the picture",
            "tests, every triangle",
            "tests, tree",
            "tests, paths for the same error",
            "tests, 1000 paths",
        ],
    );
    let mut points = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
    for d in 1..=8 {
        let p = BruteForce { d, ..slide };
        let rays = p.rays();
        let path = 1e6 * 2.0 * f64::from(d) * tests;
        let row = [rays * n, rays * tests, path * paths, path * 1_000.0];
        for (line, tests) in points.iter_mut().zip(row) {
            line.push((f64::from(d), tests));
        }
        let first = [d.to_string(), format!("{:.3e}", p.rays_per_camera_ray()), format!("{rays:.3e}")];
        table.row(first.into_iter().chain(row.map(|v| format!("{v:.1e}"))));
    }
    e.table(table);
    let [linear, tree, same, thousand] = points;
    let last = |line: &[(f64, f64)]| line[line.len() - 1].1;
    let line = format!(
        "For the slide's numbers the full recursion takes {full:.1e} tests against every triangle and {:.1e} in a tree, path tracing {:.1e} \
         for the same error and {:.1e} for a clean picture.",
        last(&tree),
        last(&same),
        last(&thousand)
    );
    e.figure(
        Figure::new(
            "extrapolation",
            "The slide's picture: tests over the number of bounces.",
            Axis::linear("bounces d"),
            Axis::log("intersection tests"),
        )
        .with("brute force, every triangle", Mark::LineDots, linear)
        .with("brute force, tree", Mark::LineDots, tree)
        .with("path tracing, same error, tree", Mark::LineDots, same)
        .with("path tracing, 1000 paths, tree", Mark::LineDots, thousand),
    );
    e.erratum(
        "“Naively improving Whitted ray tracing”: 64·10¹⁸ for d = 8",
        format!("That is one level of the bracket, n k² m² a² r² ℓ s² = {one_level:.2e}; d = 8 does not enter. The recursion gives n m² k² a² T(8) = {full:.2e}, {:.0e} times as much. (Where brute force could be tried, its rays came to {:.1} times those of path tracing for the same error.)", full / 64e18, gain.ratio),
    );
    line
}

/// Whitted's tree and the path, counted by the renderer itself.
fn whitted(e: &mut Experiment, setting: &Setting) -> Result<(), Error> {
    let size = setting.effort.pick([24, 18], [64, 48], [160, 120]);
    let spp = 4;
    let world = |glass: bool, kind: IntegratorKind| -> Result<World, Error> {
        let mut b = Builder::new(size, 8);
        b.scene.settings.integrator.kind = kind;
        b.camera([0.0, 1.2, -4.0], [0.0, 0.55, 0.0], 36.0);
        let grey = b.diffuse([0.6; 3]);
        b.quad([[-6.0, 0.0, -6.0], [-6.0, 0.0, 6.0], [6.0, 0.0, 6.0], [6.0, 0.0, -6.0]], grey);
        b.quad([[-6.0, 0.0, 3.0], [-6.0, 6.0, 3.0], [6.0, 6.0, 3.0], [6.0, 0.0, 3.0]], grey);
        let ball = if glass { b.glass(1.5, 0.0) } else { grey };
        for x in [-1.15f32, 0.0, 1.15] {
            b.sphere(0.52, [x, 0.55, 0.0], ball);
        }
        for (x, y) in [(-2.0, 3.0), (0.0, 3.5), (2.0, 3.0), (0.0, 2.5)] {
            b.point_light([x, y, -2.0], 4.0);
        }
        Ok(b.build()?)
    };
    let count = |glass: bool, kind: IntegratorKind| -> Result<f64, Error> {
        let (_, rays) = stage::render_counted(
            &world(glass, kind)?,
            SamplerKind::Independent,
            spp,
            setting.seed_for(TOPIC, 2),
            setting.threads,
        );
        Ok(rays.total() as f64 / rays.camera as f64)
    };
    let tree = IntegratorKind::Whitted(Whitted::default());
    let (w_glass, w_grey) = (count(true, tree)?, count(false, tree)?);
    let (p_glass, p_grey) = (count(true, IntegratorKind::Path)?, count(false, IntegratorKind::Path)?);
    let mut table = Table::new(
        "whitted",
        "Rays for each camera ray, counted by the renderer: four point lights, up to 8 bounces.",
        &["scene", "Whitted", "path tracing"],
    );
    table.row(["three balls of glass".into(), format!("{w_glass:.2}"), format!("{p_glass:.2}")]);
    table.row(["three grey balls".into(), format!("{w_grey:.2}"), format!("{p_grey:.2}")]);
    e.table(table);
    e.claim(Claim::at_least(
        TOPIC,
        "balls of glass, four lights: rays per camera ray, Whitted over path tracing",
        1.0,
        w_glass / p_glass,
    ));
    e.claim(Claim::at_most(
        TOPIC,
        "grey balls, four lights: rays per camera ray of Whitted: one and one for each light",
        5.0,
        w_grey,
    ));
    e.answer(
        5,
        format!(
            "For a fixed number of camera rays, not where Whitted's tree branches: with glass and four lights, {w_glass:.2} rays per camera \
             ray against {p_glass:.2} of a path, which sends one shadow ray and one ray on from each hit. Where nothing is a mirror, \
             Whitted stops at the first hit ({w_grey:.2}) and the path, which goes on to look for indirect light, traces {p_grey:.2}. And a \
             path's picture needs more camera rays for its noise."
        ),
    );
    Ok(())
}
