//! Every light is sampled with the density that it states, and emits what it should.
//!
//! Chi-square tests at a significance of 1e-7 each, with fixed seeds.

mod common;

use common::{empty, grey, white};
use steradian_geometry::{BilinearMesh, Cylinder, Disk, Sphere, TriangleMesh};
use steradian_image::{Image, Lookup, Texels, Wrap};
use steradian_math::{Point3, Ray, Transform, Vec3};
use steradian_scene::{
    AreaLight, EnvironmentMapping, Handle, Light, LightContext, LightSelection, Primitive, Scene, Shape, TextureImage,
    World,
};
use steradian_spectrum::{ColorSpace, Spectrum, Wavelengths};
use steradian_testkit::{ChiSquareTest, TestRng};

const SIGNIFICANCE: f64 = 1e-7;

fn test() -> ChiSquareTest {
    ChiSquareTest { columns: 20, rows: 10, samples: 40_000, tolerance: 1e-6, depth: 4, ..ChiSquareTest::default() }
}

/// A world with one lamp that shines to both sides.
fn lamp(shape: impl FnOnce(&mut Scene) -> Shape, t: Transform) -> World {
    let mut scene = empty();
    let material = grey(&mut scene);
    let shape = shape(&mut scene);
    let (radiance, scale) = white();
    scene.primitives.push(Primitive {
        shape,
        world_from_object: t,
        reverse_orientation: false,
        material,
        area_light: Some(AreaLight {
            radiance,
            scale,
            two_sided: true,
            power: None,
            image: None,
            group: None,
            texture: None,
        }),
        alpha: None,
        media: None,
    });
    World::build(scene).unwrap()
}

/// Samples that see their light, against the density of the directions that meet it.
fn check_lamp(name: &str, world: &World, p: Point3) {
    let context = LightContext::of_point(p, 0.0);
    let w = Wavelengths::rgb();
    let sample = |rng: &mut TestRng| {
        let s = world.sample_light(&context, rng.f32(), rng.f32_2d(), &w)?;
        let ray = Ray { o: p, d: s.end - p, t_max: 1.0 - 1e-4, time: 0.0 };
        (!world.occluded(&ray)).then(|| s.wi.to_array())
    };
    let pdf = |d: [f32; 3]| {
        let wi = Vec3::from_array(d);
        let ray = Ray::new(p, wi, 0.0);
        let Some(hit) = world.intersect(&ray) else { return 0.0 };
        let surface = world.surface(&ray, &hit);
        surface.light.map_or(0.0, |light| world.light_pdf(&context, light, wi, Some(&surface)))
    };
    let result = test().sphere(name, sample, pdf);
    result.assert(SIGNIFICANCE);
    assert!(result.integral > 0.3, "{name} is hardly sampled\n{}", result.report);
}

fn triangle(scene: &mut Scene, p: [[f32; 3]; 3]) -> Shape {
    let mesh = TriangleMesh {
        positions: p.map(Point3::from_array).to_vec(),
        indices: vec![[0, 1, 2]],
        ..TriangleMesh::default()
    };
    Shape::Triangles(scene.triangle_meshes.push(mesh))
}

fn patch(scene: &mut Scene, p: [[f32; 3]; 4]) -> Shape {
    let mesh = BilinearMesh {
        positions: p.map(Point3::from_array).to_vec(),
        normals: Vec::new(),
        uvs: Vec::new(),
        indices: vec![[0, 1, 2, 3]],
        flip: false,
    };
    Shape::Bilinear(scene.bilinear_meshes.push(mesh))
}

fn moved(x: f32, y: f32, z: f32) -> Transform {
    let turned = Transform::rotate(35.0, Vec3::new(0.3, 1.0, -0.4)).unwrap();
    Transform::translate(Vec3::new(x, y, z)).mul(&turned)
}

#[test]
fn quadrics_are_sampled_with_their_density() {
    let p = Point3::new(0.2, -0.1, 0.3);
    let sphere = |_: &mut Scene| Shape::Sphere(Sphere::full(1.0).unwrap());
    check_lamp("sphere", &lamp(sphere, moved(0.5, 1.2, 0.9)), p);
    check_lamp("sphere around the point", &lamp(sphere, moved(0.1, 0.2, 0.1)), p);
    let squeezed = moved(0.3, 1.5, 0.8).mul(&Transform::scale(1.0, 0.5, 1.3).unwrap());
    check_lamp("ellipsoid", &lamp(sphere, squeezed), p);
    let part = |_: &mut Scene| Shape::Sphere(Sphere::new(1.0, -0.4, 0.7, 250.0).unwrap());
    check_lamp("part of a sphere", &lamp(part, moved(0.4, 1.4, 0.5)), p);
    let disk = |_: &mut Scene| Shape::Disk(Disk::new(0.1, 1.1, 0.3, 300.0).unwrap());
    check_lamp("disk", &lamp(disk, moved(0.2, 0.4, 1.1)), p);
    let cylinder = |_: &mut Scene| Shape::Cylinder(Cylinder::new(0.6, -0.7, 0.9, 360.0).unwrap());
    check_lamp("cylinder", &lamp(cylinder, moved(0.9, 0.9, 0.9)), p);
}

#[test]
fn triangles_and_patches_are_sampled_with_their_density() {
    let p = Point3::new(0.1, 0.2, -0.1);
    let near = [[-1.0, -1.0, 0.6], [1.2, -0.8, 0.5], [0.1, 1.4, 0.9]];
    check_lamp("triangle", &lamp(|s| triangle(s, near), Transform::IDENTITY), p);
    let wide = [[-30.0, -20.0, 0.4], [25.0, -28.0, 0.4], [0.0, 40.0, 0.4]];
    check_lamp("wide triangle", &lamp(|s| triangle(s, wide), Transform::IDENTITY), p);
    let rectangle = [[-0.8, -0.7, 0.7], [0.9, -0.7, 0.7], [-0.8, 0.9, 0.7], [0.9, 0.9, 0.7]];
    check_lamp("rectangle", &lamp(|s| patch(s, rectangle), Transform::IDENTITY), p);
    let bent = [[-0.8, -0.7, 0.5], [0.9, -0.7, 1.1], [-0.8, 0.9, 1.2], [0.9, 0.9, 0.4]];
    check_lamp("bent patch", &lamp(|s| patch(s, bent), Transform::IDENTITY), p);
}

/// A picture with a few bright spots.
fn picture(scene: &mut Scene, w: usize, h: usize, wrap: [Wrap; 2]) -> Handle<TextureImage> {
    let mut rng = TestRng::new(5);
    let pixels: Vec<[f32; 3]> = (0..w * h)
        .map(|i| {
            let bright = if i % 11 == 3 { 8.0 } else { 0.5 };
            [rng.f32() * bright, rng.f32() * bright, rng.f32()]
        })
        .collect();
    let texels = Texels::from_image(&Image::from_rgb(w, h, &pixels).unwrap()).unwrap();
    let color_space = ColorSpace::Srgb;
    scene.images.push(TextureImage { name: String::new(), texels, lookup: Lookup::Bilinear, wrap, color_space })
}

fn check_sky(name: &str, world: &World, context: LightContext, p: Point3) {
    let w = Wavelengths::rgb();
    let sample = |rng: &mut TestRng| {
        let s = world.sample_light(&context, rng.f32(), rng.f32_2d(), &w)?;
        let seen = world.environment(0, &Ray::new(p, s.wi, 0.0), &w);
        let same = (0..3).all(|c| (seen.0[c] - s.radiance.0[c]).abs() <= 1e-3 * (1.0 + seen.0[c]));
        // On the border between texels the two may round to different sides; that must not happen often.
        (same || rng.f32() < 0.9).then(|| s.wi.to_array())
    };
    let pdf = |d: [f32; 3]| world.light_pdf(&context, 0, Vec3::from_array(d), None);
    let result = ChiSquareTest { depth: 6, ..test() }.sphere(name, sample, pdf);
    result.assert(SIGNIFICANCE);
    assert!((result.integral - 1.0).abs() < 5e-3, "{}", result.report);
    assert!(result.failed < 1e-3, "{name}: samples do not see what they sampled\n{}", result.report);
}

#[test]
fn skies_are_sampled_with_their_density() {
    let p = Point3::new(0.2, 0.1, -0.4);
    let (radiance, scale) = white();
    let mut scene = empty();
    scene.lights.push(Light::UniformInfinite { radiance, scale });
    let (alone, beside) = (LightContext::of_point(p, 0.0), LightContext::of_point(p, 0.0).beside_lobes());
    check_sky("uniform sky", &World::build(scene).unwrap(), alone, p);
    let world_from_light = moved(3.0, 1.0, 2.0);
    for half_angle in [0.7, 1.5] {
        let mut scene = empty();
        let (radiance, scale) = white();
        let to_light = Vec3::new(0.3, -0.5, 0.4).normalize();
        scene.lights.push(Light::Sun { to_light, half_angle, profile: vec![radiance.clone(), radiance], scale });
        check_sky("sun", &World::build(scene).unwrap(), alone, p);
    }
    for (mapping, size, wrap) in [
        (EnvironmentMapping::EqualArea, [8, 8], [Wrap::Octahedral; 2]),
        (EnvironmentMapping::LatLong, [12, 6], [Wrap::Repeat, Wrap::Clamp]),
        (EnvironmentMapping::LatLongToPoles, [12, 6], [Wrap::Repeat, Wrap::Clamp]),
        (EnvironmentMapping::LatLongToPoles, [12, 2], [Wrap::Repeat, Wrap::Clamp]),
        (EnvironmentMapping::LatLongToPoles, [12, 1], [Wrap::Repeat, Wrap::Clamp]),
    ] {
        let mut scene = empty();
        let image = picture(&mut scene, size[0], size[1], wrap);
        scene.lights.push(Light::ImageInfinite { world_from_light, image, mapping, scale: 0.7 });
        let world = World::build(scene).unwrap();
        check_sky("map", &world, alone, p);
        check_sky("peaks of a map", &world, beside, p);
    }
}

/// A lone texel of 1e5 in a dim map, near a pole and at the seam too: every sample carries nearly the same light, so that no sample is a firefly.
#[test]
fn a_tiny_sun_in_a_map_makes_no_fireflies() {
    let w = Wavelengths::rgb();
    for (x, y) in [(20, 9), (0, 14), (63, 1), (31, 0), (5, 31)] {
        let mut scene = empty();
        let mut pixels = vec![[0.1; 3]; 64 * 32];
        pixels[y * 64 + x] = [1e5; 3];
        let texels = Texels::from_image(&Image::from_rgb(64, 32, &pixels).unwrap()).unwrap();
        let (lookup, wrap, color_space) = (Lookup::Bilinear, [Wrap::Repeat, Wrap::Clamp], ColorSpace::Srgb);
        let image = scene.images.push(TextureImage { name: String::new(), texels, lookup, wrap, color_space });
        let world_from_light = moved(0.0, 0.0, 0.0);
        scene.lights.push(Light::ImageInfinite {
            world_from_light,
            image,
            mapping: EnvironmentMapping::LatLong,
            scale: 1.0,
        });
        let world = World::build(scene).unwrap();
        let mut rng = TestRng::new(7);
        let context = LightContext::of_point(Point3::default(), 0.0);
        let contributions: Vec<f64> = (0..20_000)
            .map(|_| {
                let s = world.sample_light(&context, rng.f32(), rng.f32_2d(), &w).unwrap();
                f64::from(s.radiance.0[1] / s.pdf)
            })
            .collect();
        let mean = contributions.iter().sum::<f64>() / contributions.len() as f64;
        let most = contributions.iter().fold(0.0f64, |a, &b| a.max(b));
        // Close to a pole the sine varies within a cell.
        let pole = !(2..=29).contains(&y);
        assert!(most < mean * if pole { 1.8 } else { 1.2 }, "({x}, {y}): {most} beside a mean of {mean}");
        let deviation = contributions.iter().map(|c| (c / mean - 1.0) * (c / mean - 1.0)).sum::<f64>() / 20_000.0;
        assert!(deviation.sqrt() < if pole { 0.35 } else { 0.1 }, "({x}, {y}): {}", deviation.sqrt());
    }
}

#[test]
fn a_sky_behind_a_portal_is_sampled_with_its_density_and_seen_through_it_only() {
    let mut scene = empty();
    let image = picture(&mut scene, 8, 8, [Wrap::Octahedral; 2]);
    let corners = [[-1.0, -0.8, 1.0], [-1.0, 0.9, 1.0], [1.2, 0.9, 1.0], [1.2, -0.8, 1.0]];
    let portal = corners.map(Point3::from_array);
    let world_from_light = moved(0.0, 0.0, 0.0);
    scene.lights.push(Light::PortalInfinite { world_from_light, image, scale: 1.3, portal });
    let world = World::build(scene).unwrap();
    let w = Wavelengths::rgb();
    let mut rng = TestRng::new(9);
    for p in [Point3::new(0.2, 0.1, 0.3), Point3::new(-1.5, 0.7, 0.6)] {
        check_sky("portal", &world, LightContext::of_point(p, 0.0), p);
        for _ in 0..2000 {
            let d = Vec3::from_array(rng.direction());
            let black = world.environment(0, &Ray::new(p, d, 0.0), &w).is_black();
            // Where the ray meets the plane of the portal.
            let q = p + d * ((1.0 - p.z) / d.z);
            let margin = |v: f32, a: f32, b: f32| (v - a).min(b - v);
            let inside = margin(q.x, -1.0, 1.2).min(margin(q.y, -0.8, 0.9));
            if d.z <= 0.0 || inside < -1e-3 {
                assert!(black, "{d:?} is outside the portal");
            } else if inside > 1e-3 {
                assert!(!black, "{d:?} is inside the portal");
            }
        }
    }
    let behind = LightContext::of_point(Point3::new(0.0, 0.0, 1.5), 0.0);
    assert!(world.sample_light(&behind, 0.5, [0.5; 2], &w).is_none());
}

/// The total intensity in the green lane: the mean over directions of radiance times squared distance, times 4 pi.
fn total_intensity(world: &World) -> f64 {
    let w = Wavelengths::rgb();
    let mut rng = TestRng::new(3);
    let n = 200_000;
    let mut sum = 0.0;
    for _ in 0..n {
        let d = Vec3::from_array(rng.direction());
        let from = Point3::new(1.0, 2.0, 3.0) + d * 2.0;
        if let Some(s) = world.sample_light(&LightContext::of_point(from, 0.0), 0.5, [0.5; 2], &w) {
            assert!(s.is_delta && s.pdf == 1.0 && (s.wi + d).length() < 1e-4);
            sum += f64::from(s.radiance.0[1]) * 4.0;
        }
    }
    4.0 * std::f64::consts::PI * sum / f64::from(n)
}

#[test]
fn point_like_lights_emit_what_their_pictures_say() {
    let world_from_light = moved(1.0, 2.0, 3.0);
    let (intensity, scale) = white();
    let mut scene = empty();
    let image = picture(&mut scene, 8, 8, [Wrap::Octahedral; 2]);
    let mean = f64::from(scene.images[image].mean_intensity());
    scene.lights.push(Light::Goniometric { world_from_light, intensity: intensity.clone(), image, scale: 2.0 * scale });
    let total = total_intensity(&World::build(scene).unwrap());
    // The pictures vary by a factor of about two, so that the mean of 2e5 directions is good to half a percent.
    let expected = 8.0 * std::f64::consts::PI * mean;
    assert!((total / expected - 1.0).abs() < 0.02, "{total} is not {expected}");

    let mut scene = empty();
    let pixels: Vec<[f32; 3]> = (0..6 * 4).map(|i| [1.0, if i % 6 < 2 { 0.5 } else { 2.0 }, 0.0]).collect();
    let texels = Texels::from_image(&Image::from_rgb(6, 4, &pixels).unwrap()).unwrap();
    let (lookup, wrap, color_space) = (Lookup::Bilinear, [Wrap::Clamp; 2], ColorSpace::Srgb);
    let image = scene.images.push(TextureImage { name: String::new(), texels, lookup, wrap, color_space });
    let fov = 70.0;
    scene.lights.push(Light::Projection { world_from_light, image, screen: None, fov, scale });
    let world = World::build(scene).unwrap();
    let tan = (35.0f64.to_radians()).tan();
    // The solid angle of a rectangle: the left third of it is half as bright.
    let corner = |x: f64, y: f64| (x * y / (1.0 + x * x + y * y).sqrt()).atan();
    let (right, top) = (1.5 * tan, tan);
    let left = 2.0 * (corner(right, top) - corner(right / 3.0, top));
    let rest = 4.0 * corner(right, top) - left;
    let total = total_intensity(&world);
    let expected = 0.5 * left + 2.0 * rest;
    assert!((total / expected - 1.0).abs() < 0.03, "{total} is not {expected}");
}

#[test]
fn the_light_tree_finds_every_light_that_a_point_sees() {
    let (intensity, scale) = white();
    let mut scene = empty();
    scene.settings.integrator.light_selection = LightSelection::Tree;
    let image = picture(&mut scene, 8, 8, [Wrap::Octahedral; 2]);
    for i in 0..12 {
        let world_from_light = moved(i as f32, (i * i % 7) as f32, (i * 5 % 3) as f32);
        scene.lights.push(match i % 3 {
            0 => Light::Projection { world_from_light, image, screen: None, fov: 100.0, scale },
            1 => Light::Goniometric { world_from_light, intensity: intensity.clone(), image, scale },
            _ => {
                let (cos_end, cos_start) = (0.2, 0.8);
                Light::Spot { world_from_light, intensity: intensity.clone(), scale, cos_end, cos_start }
            }
        });
    }
    let world = World::build(scene).unwrap();
    let w = Wavelengths::rgb();
    let mut rng = TestRng::new(17);
    for _ in 0..60 {
        let p = Point3::new(12.0 * rng.f32(), 8.0 * rng.f32() - 1.0, 6.0 * rng.f32() - 2.0);
        let context = LightContext::of_point(p, 0.0);
        let mut found = [0u32; 12];
        for _ in 0..4000 {
            if let Some(s) = world.sample_light(&context, rng.f32(), rng.f32_2d(), &w) {
                found[s.light as usize] += 1;
            }
        }
        for light in 0..12 {
            let shines = world.sample_one_light(&context, light, [0.5; 2], &w);
            // The tree gives each light here a thousandth at the least: missing it 4000 times has probability 0.02, but
            // only those that contribute a noticeable share are asked for.
            let Some(s) = shines else { continue };
            let brightest = (0..12)
                .filter_map(|l| world.sample_one_light(&context, l, [0.5; 2], &w))
                .map(|s| s.radiance.max_component())
                .fold(0.0, f32::max);
            if s.radiance.max_component() > 0.1 * brightest {
                assert!(found[light as usize] > 0, "light {light} is never sampled from {p:?}");
            }
        }
    }
}

#[test]
fn lights_are_chosen_by_what_they_shine_not_by_their_size() {
    // A point at the same distance from two alike lights, one a hundred times as bright.
    for selection in [LightSelection::Power, LightSelection::Tree, LightSelection::Exhaustive] {
        let mut scene = empty();
        scene.settings.integrator.light_selection = selection;
        for (x, strength) in [(-1.0, 1.0), (1.0, 100.0)] {
            let intensity = Spectrum::rgb_illuminant(ColorSpace::Srgb, [strength; 3]);
            scene.lights.push(Light::Point { position: Point3::new(x, 0.0, 0.0), intensity, scale: 1.0 });
        }
        let world = World::build(scene).unwrap();
        let context = LightContext::of_point(Point3::new(0.0, 2.0, 0.0), 0.0);
        // The density of a delta light is the probability of its choice.
        let w = Wavelengths::rgb();
        let s = world.sample_light(&context, 0.5, [0.5; 2], &w).expect("a light");
        assert_eq!(s.light, 1, "{selection:?}");
        assert!((s.pdf - 100.0 / 101.0).abs() < 1e-3, "{selection:?}: {}", s.pdf);
    }
}

/// The direct light of a map with a sun of one texel, 1e5 times as bright as the sky, on a surface that faces up: no sample is worth
/// many times the whole. What they differ by is that texels are chosen as wholes, and the sun fades towards its neighbours within them.
#[test]
fn a_sun_of_one_texel_makes_no_fireflies() {
    const SIZE: [usize; 2] = [64, 32];
    let pixels: Vec<[f32; 3]> = (0..SIZE[0] * SIZE[1]).map(|i| [if i == 9 * 64 + 40 { 1e4 } else { 0.1 }; 3]).collect();
    let mut scene = empty();
    let texels = Texels::from_image(&Image::from_rgb(SIZE[0], SIZE[1], &pixels).unwrap()).unwrap();
    let image = scene.images.push(TextureImage {
        name: String::new(),
        texels,
        lookup: Lookup::Bilinear,
        wrap: [Wrap::Repeat, Wrap::Clamp],
        color_space: ColorSpace::Srgb,
    });
    let scale = 1.0 / ColorSpace::Srgb.photometric();
    let (world_from_light, mapping) = (Transform::IDENTITY, EnvironmentMapping::LatLong);
    scene.lights.push(Light::ImageInfinite { world_from_light, image, mapping, scale });
    let world = World::build(scene).unwrap();
    let (w, p) = (Wavelengths::rgb(), Point3::default());
    // By cells of equal angles, many to a texel.
    let (columns, rows) = (SIZE[0] * 16, SIZE[1] * 16);
    let (dt, dp) = (std::f64::consts::PI / rows as f64, std::f64::consts::TAU / columns as f64);
    let mut exact = 0.0;
    for j in 0..rows / 2 {
        let theta = (j as f64 + 0.5) * dt;
        for i in 0..columns {
            let phi = (i as f64 + 0.5) * dp;
            let d = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()].map(|v| v as f32);
            let seen = world.environment(0, &Ray::new(p, Vec3::from_array(d), 0.0), &w).0[1];
            exact += f64::from(seen) * theta.cos() * theta.sin() * dt * dp;
        }
    }
    let (mut rng, n) = (TestRng::new(17), 4096);
    let (mut sum, mut squares, mut largest) = (0.0, 0.0, 0.0f64);
    for _ in 0..n {
        let s = world.sample_light(&LightContext::of_point(p, 0.0), rng.f32(), rng.f32_2d(), &w);
        let v = s.map_or(0.0, |s| f64::from(s.radiance.0[1] * s.wi.z.max(0.0) / s.pdf));
        sum += v;
        squares += v * v;
        largest = largest.max(v);
    }
    let mean = sum / f64::from(n);
    let deviation = (squares / f64::from(n) - mean * mean).max(0.0).sqrt();
    assert!(deviation < 1.25 * exact && largest < 7.0 * exact, "{mean} {deviation} {largest} of {exact}");
    // Five deviations of the mean, and what the cells miss of the sun's edge.
    let tolerance = 5.0 * deviation / f64::from(n).sqrt() + 2e-3 * exact;
    assert!((mean - exact).abs() < tolerance, "{mean} of {exact}");
}
