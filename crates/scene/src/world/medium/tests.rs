//! Free flight against what it must be distributed as, fields against their bounds.

use super::majorant::{MajorantGrid, Segment};
use super::*;
use crate::{
    Coefficients, Field, Fields, FilmSettings, GridTexture, IntegratorKind, IntegratorSettings, RenderSettings,
    SparseGrid, VoxelGrid,
};
use steradian_testkit::{ChiSquareTest, TestRng, z_test};

/// False alarms of each test of this file.
const ALARM: f64 = 1e-7;

fn world(volume: Volume, world_from_medium: Transform) -> World {
    let mut scene = Scene::new(RenderSettings {
        film: FilmSettings::new(1, 1),
        filter: steradian_image::Filter::pixel_box(),
        sampler: steradian_sampling::SamplerSettings::default(),
        integrator: IntegratorSettings { kind: IntegratorKind::VolPath, ..IntegratorSettings::default() },
        color: steradian_spectrum::ColorMode::Spectral,
        disable_pixel_jitter: false,
        disable_wavelength_jitter: false,
        disable_texture_filtering: false,
        force_diffuse: false,
        layered_as_pbrt: false,
    });
    let medium =
        Medium { name: "m".into(), phase: Phase::HenyeyGreenstein { g: 0.0 }, scale: 1.0, world_from_medium, volume };
    scene.camera.medium = Some(scene.media.push(medium));
    World::build(scene).expect("a sound scene")
}

fn grey(sigma_a: f32, sigma_s: f32) -> Coefficients {
    let constant = |v| Spectrum::constant(v, SpectrumUse::Unbounded);
    Coefficients { sigma_a: constant(sigma_a), sigma_s: constant(sigma_s) }
}

/// A grid with holes and peaks in the box from -1 to 1.
fn lumpy() -> (VoxelGrid<f32>, Bounds3) {
    let size = [5, 4, 3];
    let values = (0..60u32).map(|i| if i % 3 == 0 { 0.0 } else { (i * 7 % 11) as f32 * 0.2 }).collect();
    (VoxelGrid { size, values }, Bounds3::new(Point3::splat(-1.0), Point3::splat(1.0)))
}

fn lumpy_world() -> World {
    let (density, bounds) = lumpy();
    let volume = Volume::Grid { coefficients: grey(0.6, 1.4), bounds, density, glow: None };
    world(volume, Transform::rotate(33.0, Vec3::new(1.0, 2.0, 3.0)).expect("an axis"))
}

/// Extinction and albedo on grids of different sizes and places, in a part of both.
fn fields_world() -> World {
    let turned = Transform::rotate(20.0, Vec3::new(1.0, 0.0, 2.0)).expect("an axis");
    let place = Transform::scale(0.5, 0.4, 0.3).expect("no zero").mul(&Transform::translate(Vec3::splat(1.0)));
    let grid = |size: [u32; 3], channels: usize, texture_from_world, values: Vec<f32>| {
        Field::Grid(GridTexture {
            texture_from_world,
            size,
            channels,
            values,
            wrap: steradian_image::Wrap::Clamp,
            nearest: false,
        })
    };
    let bounds = Bounds3::new(Point3::new(-0.9, -0.8, -1.1), Point3::splat(0.7));
    let sigma_t = grid([5, 4, 3], 1, place.mul(&turned), lumpy().0.values.iter().map(|v| 1.5 * v).collect());
    let albedo = grid([2, 1, 2], 3, place, (0..12).map(|i| i as f32 / 11.0).collect());
    world(Volume::Fields(Fields { bounds, sigma_t, albedo }), Transform::IDENTITY)
}

fn ray(w: &World) -> MediumRay<'_> {
    let d = Vec3::new(0.3, -0.2, 1.0).normalize();
    let medium = w.camera_medium().expect("the camera is inside");
    w.medium_ray(medium, Point3::new(-0.4, 0.3, -1.8), d, &Wavelengths::fixed())
}

/// The first distance at which delta tracking finds a real collision.
fn free_flight(ray: MediumRay<'_>, t_max: f32, rng: &mut TestRng) -> Option<f32> {
    let mut flight = ray.fly(t_max, 0);
    while let Some(c) = flight.next(rng.f32()) {
        let real = (c.point.sigma_a + c.point.sigma_s)[0];
        assert!(real <= c.majorant[0] * 1.000_01, "{real} above the bound {}", c.majorant[0]);
        if rng.f32() * c.majorant[0] < real {
            return Some(c.t);
        }
    }
    None
}

/// The extinction along the ray: nothing outside the box.
fn extinction(ray: &MediumRay<'_>, t: f32) -> f32 {
    let inside = match &ray.medium.volume {
        Volume::Grid { bounds, .. } | Volume::Fields(Fields { bounds, .. }) => bounds.contains(ray.local.at(t)),
        _ => true,
    };
    let p = ray.at(t);
    if inside { (p.sigma_a + p.sigma_s)[0] } else { 0.0 }
}

/// The extinction along the ray, tabulated with its integral by the midpoint rule.
fn optical_depths(ray: MediumRay<'_>, t_max: f32, steps: usize) -> Vec<f64> {
    let h = t_max / steps as f32;
    let mut sum = 0.0;
    let mut out = vec![0.0];
    for i in 0..steps {
        sum += f64::from(extinction(&ray, (i as f32 + 0.5) * h) * h);
        out.push(sum);
    }
    out
}

#[test]
fn distances_are_distributed_as_extinction_demands() {
    for w in [lumpy_world(), fields_world()] {
        check_distances(ray(&w));
    }
}

fn check_distances(ray: MediumRay<'_>) {
    const T_MAX: f32 = 4.0;
    let depths = optical_depths(ray, T_MAX, 4000);
    let density = |x: f32| {
        let i = ((x * 4000.0) as usize).min(3999);
        f64::from(extinction(&ray, x * T_MAX)) * f64::from(T_MAX) * (-0.5 * (depths[i] + depths[i + 1])).exp()
    };
    let test = ChiSquareTest { columns: 64, rows: 1, samples: 60_000, tolerance: 1e-5, ..ChiSquareTest::default() };
    let sample = |rng: &mut TestRng| Some([free_flight(ray, T_MAX, rng)? / T_MAX, rng.f32()]);
    test.square("free flight", sample, |p| density(p[0]) as f32).assert(ALARM);
}

#[test]
fn extinction_and_albedo_are_looked_up_each_on_its_own() {
    let fields = |values: [f32; 2]| {
        Field::Grid(GridTexture {
            texture_from_world: Transform::IDENTITY,
            size: [2, 1, 1],
            channels: 1,
            values: values.to_vec(),
            wrap: steradian_image::Wrap::Clamp,
            nearest: false,
        })
    };
    let bounds = Bounds3::new(Point3::default(), Point3::splat(1.0));
    let (sigma_t, albedo) = (fields([4.0, 0.0]), fields([0.0, 0.5]));
    let w = world(Volume::Fields(Fields { bounds, sigma_t, albedo }), Transform::IDENTITY);
    let medium = w.camera_medium().expect("the camera is inside");
    let d = Vec3::new(1.0, 0.0, 0.0);
    // Half-way between the cells' centres: twice a quarter, where the product of both is nothing in either cell.
    let p = w.medium_ray(medium, Point3::new(0.25, 0.5, 0.5), d, &Wavelengths::fixed()).at(0.25);
    assert!((p.sigma_s[0] - 0.5).abs() < 1e-6 && (p.sigma_a[0] - 1.5).abs() < 1e-6, "{p:?}");
}

#[test]
fn what_gets_through_is_beer_and_lambert() {
    let mut rng = TestRng::new(5);
    let fog = world(Volume::Homogeneous { coefficients: grey(0.5, 0.8), emission: None }, Transform::IDENTITY);
    let lumps = lumpy_world();
    for (w, expected) in
        [(&fog, (-1.3f64 * 1.7).exp()), (&lumps, (-optical_depths(ray(&lumps), 1.7, 4000)[4000]).exp())]
    {
        const N: usize = 40_000;
        let through = (0..N).filter(|_| free_flight(ray(w), 1.7, &mut rng).is_none()).count() as f64 / N as f64;
        let p = z_test(through, expected * (1.0 - expected) / N as f64, expected);
        assert!(p > ALARM, "{through} of {expected}");
    }
}

#[test]
fn the_other_lanes_are_weighted_by_the_ratio_of_their_densities() {
    // The mean of the ratio at the end is the other lanes' own transmittance over nothing: E[p_i / p_h; through] = T_i.
    let sigma = Spectrum::rgb_unbounded(steradian_spectrum::ColorSpace::Srgb, [0.2, 0.9, 1.6]);
    let coefficients = Coefficients { sigma_a: Spectrum::constant(0.0, SpectrumUse::Unbounded), sigma_s: sigma };
    let w = world(Volume::Homogeneous { coefficients, emission: None }, Transform::IDENTITY);
    let ray = ray(&w);
    let sigma = ray.at(0.0).sigma_s;
    let mut rng = TestRng::new(9);
    const N: usize = 40_000;
    for hero in 0..4 {
        let (mut sum, mut square) = ([0.0f64; 4], [0.0f64; 4]);
        for _ in 0..N {
            let mut flight = ray.fly(0.8, hero);
            if flight.next(rng.f32()).is_none() {
                for (i, r) in flight.passed().0.into_iter().enumerate() {
                    sum[i] += f64::from(r);
                    square[i] += f64::from(r * r);
                }
            }
        }
        for i in 0..4 {
            let mean = sum[i] / N as f64;
            let p = z_test(mean, (square[i] / N as f64 - mean * mean) / N as f64, (-0.8 * f64::from(sigma[i])).exp());
            assert!(p > ALARM, "lane {i}, hero {hero}: {mean}");
        }
    }
}

#[test]
fn a_walk_covers_the_box_without_gaps() {
    let bounds = Bounds3::new(Point3::new(-1.0, 0.0, 2.0), Point3::new(3.0, 0.5, 7.0));
    let grid = MajorantGrid::new(bounds, 16, |b| b.min.x + 10.0 * b.min.y + 100.0 * b.min.z);
    let mut rng = TestRng::new(3);
    for i in 0..2000 {
        let mut component = || rng.f32() * 2.0 - 1.0;
        // One ray in four runs along an axis, of either sign of zero.
        let d = match i % 4 {
            0 => Vec3::new(0.0, -0.0, 1.0),
            _ => Vec3::new(component(), component(), component()).normalize(),
        };
        let inside = bounds.min + Vec3::new(4.0 * rng.f32(), 0.5 * rng.f32(), 5.0 * rng.f32());
        let ray = Ray::new(inside - d * (3.0 * rng.f32()), d, 0.0);
        let Some((t0, t1)) = bounds.intersect(ray.o, ray.d, 6.0) else { continue };
        let segments: Vec<Segment> = grid.along(&ray, 6.0).collect();
        assert!(segments.len() <= 48);
        // The box is left a few roundings early, or late.
        assert_eq!(segments[0].t0, t0);
        assert!((segments[segments.len() - 1].t1 - t1).abs() < 1e-5 * (1.0 + t1));
        assert!(segments.windows(2).all(|s| s[0].t1 == s[1].t0));
        for s in segments.iter().filter(|s| s.t1 - s.t0 > 1e-4) {
            // The bound is that of the cell in which the middle lies.
            let q = bounds.offset(ray.at(0.5 * (s.t0 + s.t1)));
            let cell = |v: f32| (v * 16.0).floor().clamp(0.0, 15.0) / 16.0;
            let expected = cell(q.x) + 10.0 * cell(q.y) + 100.0 * cell(q.z);
            assert!((s.majorant - expected).abs() < 1e-3, "{s:?} {expected} {q:?}");
        }
    }
}

#[test]
fn bounds_hold_for_every_kind_of_field() {
    let (density, _) = lumpy();
    let mut rng = TestRng::new(11);
    let cloud = Cloud {
        coefficients: grey(1.0, 1.0),
        bounds: Bounds3::new(Point3::splat(0.0), Point3::splat(1.0)),
        density: 2.0,
        wispiness: 1.5,
        frequency: 5.0,
    };
    let sparse = SparseGrid::new(&crate::SparseLayout {
        index_from_local: [[9.0, 0.0, 1.0], [0.0, 8.0, 0.0], [0.0, 2.0, 7.0]],
        origin: [0.1, 0.0, -0.3],
        bounds: Bounds3::new(Point3::splat(0.0), Point3::splat(1.0)),
        index_bounds: [[-3; 3], [12; 3]],
        background: 0.0,
    });
    let mut sparse = sparse.expect("a small box");
    let values: [f32; 512] = std::array::from_fn(|i| (i * 37 % 101) as f32);
    sparse.set_brick([0, 0, 0], &values);
    sparse.set_tile([1, 0, 0], [1, 1, 0], 33.0);
    let mut met = 0;
    for _ in 0..3000 {
        let low = Point3::new(rng.f32(), rng.f32(), rng.f32());
        let high = low + Vec3::splat(1.0 / 16.0);
        let cell = Bounds3::new(low, high);
        let p = low + Vec3::new(rng.f32(), rng.f32(), rng.f32()) * (1.0 / 16.0);
        assert!(density.sample(p.to_vec()) <= density.max_in(&cell) + 1e-6);
        let (value, bound) = (sparse.sample(p), sparse.max_in(&cell));
        assert!(value <= bound + 1e-4, "{value} {bound}");
        met += usize::from(value > 0.0);
        assert!((0.0..=1.0).contains(&cloud.density_at(p)));
    }
    assert!(met > 1000);
}

#[test]
fn a_grid_is_interpolated_between_centres_and_ends_at_its_box() {
    let grid = VoxelGrid { size: [2, 1, 1], values: vec![1.0, 3.0] };
    let at = |x: f32| grid.sample(Vec3::new(x, 0.5, 0.5));
    assert_eq!((at(0.25), at(0.5), at(0.75)), (1.0, 2.0, 3.0));
    // Half a cell beyond the outermost centre, half of its value is left.
    assert_eq!((at(0.0), at(1.0), at(-0.25), at(2.0)), (0.5, 1.5, 0.0, 0.0));
}

#[test]
fn impossible_media_are_named() {
    let (density, bounds) = lumpy();
    let with = |change: &dyn Fn(&mut VoxelGrid<f32>)| {
        let mut density = density.clone();
        change(&mut density);
        let volume = Volume::Grid { coefficients: grey(1.0, 1.0), bounds, density, glow: None };
        Medium {
            name: String::new(),
            phase: Phase::HenyeyGreenstein { g: 0.0 },
            scale: 1.0,
            world_from_medium: Transform::IDENTITY,
            volume,
        }
        .validate()
    };
    use crate::MediumError::{GridSize, GridValue};
    assert_eq!(with(&|_| {}), Ok(()));
    assert_eq!(with(&|d| d.values[7] = -1.0), Err(GridValue { grid: "density", index: 7, value: -1.0 }));
    let nan = with(&|d| d.values[9] = f32::NAN);
    assert!(matches!(nan, Err(GridValue { index: 9, .. })), "{nan:?}");
    let long = with(&|d| d.size = [u32::MAX; 3]);
    assert_eq!(long, Err(GridSize { grid: "density", size: [u32::MAX; 3], expected: u64::MAX, found: 60 }));
}
