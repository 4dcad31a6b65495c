//! Depth of field: the diameter of the blur disc against the thin-lens formula, and a x a fixed centres of projection
//! against random points of the lens.

use super::prelude::*;
use crate::stage::{Builder, Vertex};
use steradian_math::Point2;
use steradian_scene::{CameraSample, World};

const TOPIC: Topic = Topic::DepthOfField;
const FOV: f32 = 40.0;
const FOCUS: f32 = 4.0;
const LENS: f32 = 0.22;

/// Runs the topic.
pub fn run(setting: &Setting) -> Result<Experiment, Error> {
    let mut e = Experiment::new(
        TOPIC,
        "Depth of field",
        "Objects close to the in-focus plane are sharp, and the rest is blurry. Treat the aperture as multiple centres of projection: for \
         each pixel, trace multiple viewing rays for each and average the results.",
        "A tiny bright ball is put at several distances from a lens focused at 4; the second moment of its image tells the diameter of \
         the disc that it is smeared over. Then three balls are seen through a pinhole, through the same a × a points of the lens for \
         every pixel, and through random ones.",
    );
    let worst = discs(&mut e, setting)?;
    let (fixed, random) = pictures(&mut e, setting)?;
    e.result = format!(
        "The blur disc has the diameter A |z − F|/z · (pixels per unit in the plane of focus) within {:.1} % at every distance. With the \
         same 3 × 3 centres for all pixels the error is made of copies (neighbouring pixels correlate: {fixed:.2}); with random lens points it \
         is noise ({random:.2}).",
        100.0 * worst
    );
    Ok(e)
}

fn discs(e: &mut Experiment, setting: &Setting) -> Result<f64, Error> {
    let samples = setting.effort.pick(400_000u32, 2_000_000, 20_000_000);
    let size = [200u32, 200];
    let ball = 0.03f64;
    let pixels_per_unit = |z: f64| 0.5 * f64::from(size[1]) / (z * (f64::from(FOV) / 2.0).to_radians().tan());
    let mut measured = Vec::new();
    let mut table = Table::new(
        "discs",
        "Diameter of the image of a small ball, in pixels.",
        &["distance", "thin lens", "measured", "± (95 %)"],
    );
    let mut worst = 0.0f64;
    for (i, z) in [2.0f64, 2.6, 3.2, 5.2, 7.0, 10.0].into_iter().enumerate() {
        let mut b = Builder::new(size, 1);
        b.camera([0.0; 3], [0.0, 0.0, 1.0], FOV);
        b.scene.camera.lens_radius = LENS;
        b.scene.camera.focal_distance = FOCUS;
        b.ball_lamp(ball as f32, [0.0, 0.0, z as f32], 1.0);
        let world = b.build()?;
        let predicted = 2.0 * f64::from(LENS) * (z - f64::from(FOCUS)).abs() / z * pixels_per_unit(f64::from(FOCUS));
        let own = ball * pixels_per_unit(z);
        // Film positions from a window around the disc.
        let half = 0.5 * predicted + 2.0 * own + 2.0;
        let parts = parallel::map(setting.threads, 16, |part| {
            let mut rng = Rng::new(setting.seed_for(TOPIC, 10 + i as u64), part as u64);
            let mut square = VarianceEstimator::default();
            for _ in 0..samples / 16 {
                let (x, y) = ((2.0 * rng.f64() - 1.0) * half, (2.0 * rng.f64() - 1.0) * half);
                let film = Point2::new(100.0 + x as f32, 100.0 + y as f32);
                let ray = world.camera_ray(&CameraSample { film, lens: rng.f32_2d(), time: 0.5 }).ray;
                if world.intersect(&ray).is_some() {
                    square.add(x * x + y * y);
                }
            }
            square
        });
        let mut square = VarianceEstimator::default();
        parts.iter().for_each(|p| square.merge(p));
        // A disc of radius R has E[r²] = R²/2; the ball's own image adds to it.
        let diameter = 2.0 * (2.0 * square.mean() - own * own).max(0.0).sqrt();
        let error = 4.0 * square.standard_error() / diameter;
        // The ball is not a point: its image changes over the lens by its size over its distance.
        e.claim(Claim::close(
            TOPIC,
            format!("blur disc at distance {z}: A |z − F|/z, in pixels"),
            predicted,
            diameter,
            error,
            0.01 * predicted,
        ));
        worst = worst.max((diameter / predicted - 1.0).abs());
        measured.push((z, diameter));
        table.row([
            format!("{z}"),
            format!("{predicted:.3}"),
            format!("{diameter:.3}"),
            format!("{:.3}", 1.96 * error),
        ]);
    }
    let theory = (0..=170)
        .map(|i| 1.8 + f64::from(i) * 0.05)
        .map(|z| (z, 2.0 * f64::from(LENS) * (z - f64::from(FOCUS)).abs() / z * pixels_per_unit(f64::from(FOCUS))))
        .collect();
    e.figure(
        Figure::new(
            "disc",
            "Diameter of the blur disc over distance; the lens is focused at 4.",
            Axis::linear("distance z"),
            Axis::linear("diameter (pixels)"),
        )
        .with("measured", Mark::Dots, measured)
        .with("A |z − F|/z", Mark::Line, theory),
    );
    e.table(table);
    Ok(worst)
}

fn three_balls(size: [u32; 2], lens: f32) -> Result<World, Error> {
    let mut b = Builder::new(size, 1);
    b.camera([0.0, 1.1, -4.2], [0.0, 0.5, 0.0], 32.0);
    b.scene.camera.lens_radius = lens;
    b.scene.camera.focal_distance = 4.3;
    let floor = b.checkerboard([0.75; 3], [0.25, 0.28, 0.32], 24.0);
    b.quad([[-12.0, 0.0, -6.0], [-12.0, 0.0, 18.0], [12.0, 0.0, 18.0], [12.0, 0.0, -6.0]], floor);
    for (x, z, rgb) in [(-0.75, -1.7, [0.75, 0.25, 0.15]), (0.0, 0.0, [0.2, 0.5, 0.25]), (1.35, 3.0, [0.2, 0.3, 0.7])] {
        let m = b.diffuse(rgb);
        b.sphere(0.45, [x, 0.45, z], m);
    }
    b.sky(0.55);
    Ok(b.build()?)
}

/// Correlation of the error of horizontal neighbours.
fn neighbours(error: &[f64], width: usize) -> f64 {
    let mean = error.iter().sum::<f64>() / error.len() as f64;
    let variance: f64 = error.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / error.len() as f64;
    let rows = error.chunks(width);
    let (sum, count) =
        rows.flat_map(|r| r.windows(2)).fold((0.0, 0.0), |(s, n), w| (s + (w[0] - mean) * (w[1] - mean), n + 1.0));
    sum / count / variance
}

/// The light of one ray: the floor's colour under a sky that is not shadowed, so that the lens alone makes noise.
fn shade(world: &World, film: Point2, lens: [f32; 2]) -> [f32; 3] {
    let v = Vertex::trace(world, &world.camera_ray(&CameraSample { film, lens, time: 0.5 }).ray);
    match &v {
        Vertex::Sky(c) => *c,
        Vertex::Surface(p) => {
            let a = p.bsdf.albedo(p.wo);
            // A light from above left that casts no shadow.
            let facing =
                0.35 + 0.65 * (0.5 + 0.5 * (0.6 * p.frame.z.y - 0.5 * p.frame.z.x - 0.6 * p.frame.z.z)).clamp(0.0, 1.0);
            [a.0[0] * facing, a.0[1] * facing, a.0[2] * facing]
        }
    }
}

fn pictures(e: &mut Experiment, setting: &Setting) -> Result<(f64, f64), Error> {
    let size = setting.effort.pick([48, 36], [160, 120], [320, 240]);
    let width = size[0] as usize;
    let (pinhole, lens) = (three_balls(size, 0.0)?, three_balls(size, 0.16)?);
    let seed = setting.seed_for(TOPIC, 2);
    let grid = |world: &World, k: u32, a: u32| {
        // k x k fixed places of the pixel, a x a fixed points of the lens.
        stage::per_pixel(world, setting.threads, &stage::sampler(world, SamplerKind::Independent, 1, 0), |pixel, _| {
            let mut sum = [0.0f32; 3];
            for i in 0..k * k {
                let p = steradian_sampling::sequence::regular_2d(i, k, k);
                let film = Point2::new(pixel[0] as f32 + p[0], pixel[1] as f32 + p[1]);
                for j in 0..a * a {
                    sum = stage::add(sum, shade(world, film, steradian_sampling::sequence::regular_2d(j, a, a)));
                }
            }
            stage::scaled(sum, 1.0 / (k * k * a * a) as f32)
        })
    };
    let random = |kind: SamplerKind, n: u32, seed: u64| {
        stage::average(&lens, setting.threads, kind, n, seed, |pixel, s| {
            let u = s.pixel_2d();
            shade(&lens, Point2::new(pixel[0] as f32 + u[0], pixel[1] as f32 + u[1]), s.next_2d())
        })
    };
    let truth = random(SamplerKind::PaddedSobol, setting.effort.pick(1_024, 1_024, 4_096), seed ^ 9);
    let sharp = grid(&pinhole, 3, 1);
    let fixed = grid(&lens, 1, 3);
    let free = random(SamplerKind::Independent, 9, seed);
    let stratified = random(SamplerKind::Stratified, 9, seed);
    let error = |p: &[[f32; 3]]| -> Vec<f64> {
        p.iter().zip(&truth).map(|(a, b)| paint::luminance(*a) - paint::luminance(*b)).collect()
    };
    let (c_fixed, c_free) = (neighbours(&error(&fixed), width), neighbours(&error(&free), width));
    e.pictures(vec![
        paint::colour("pinhole", "pinhole", width, &sharp),
        paint::colour(
            "fixed",
            format!("the same 3 × 3 centres of projection for every pixel: mse {:.1e}", stage::mse(&fixed, &truth)),
            width,
            &fixed,
        ),
        paint::colour("random", format!("9 random lens points: mse {:.1e}", stage::mse(&free, &truth)), width, &free),
        paint::colour(
            "stratified",
            format!("9 stratified lens points: mse {:.1e}", stage::mse(&stratified, &truth)),
            width,
            &stratified,
        ),
        paint::colour("reference", "reference", width, &truth),
    ]);
    e.slider(
        "fixed",
        "stratified",
        "Nine fixed centres of projection and nine stratified lens points, 9 rays per pixel each.",
    );
    let pairs = truth.len() as f64;
    // Pixels are independent; the correlation of n pairs scatters by 1/√n, a little more as the noise is not the same everywhere.
    e.claim(Claim::equal(
        TOPIC,
        "random lens points: correlation of the error of neighbouring pixels",
        0.0,
        c_free,
        2.0 / pairs.sqrt(),
    ));
    e.claim(Claim::at_least(
        TOPIC,
        "fixed centres of projection: correlation of the error of neighbouring pixels",
        0.2,
        c_fixed,
    ));
    e.claim(Claim::at_most(
        TOPIC,
        "squared error of 9 stratified lens points over that of 9 random ones",
        0.9,
        stage::mse(&stratified, &truth) / stage::mse(&free, &truth),
    ));
    Ok((c_fixed, c_free))
}
