//! Lights that move while the shutter is open: against the mean of pictures of single moments, whose lights stand still.

use crate::bidirectional::{foggy, rough_room, with};
use crate::furnace::run;
use crate::progressive::{halves, sppm};
use crate::scenes::*;
use steradian_geometry::{BilinearMesh, Disk, Sphere};
use steradian_image::{Image, Lookup, Texels, Wrap};
use steradian_math::{AnimatedTransform, Point3, Transform, Vec3};
use steradian_render::Rendered;
use steradian_scene::{
    Bidirectional, EnvironmentMapping, Handle, Instance, IntegratorKind, Light, LightSelection, Object, Primitive,
    Scene, Shape, TextureImage, World,
};
use steradian_spectrum::{ColorMode, ColorSpace};
use steradian_testkit::{bonferroni, student_t_two_sided};

const BDPT: IntegratorKind = IntegratorKind::Bdpt(Bidirectional { strategy: None, unweighted: false });
/// Comparisons of this module, of six means each, and the rate of false alarms of all of them together.
const COMPARISONS: u32 = 64;
const FALSE_ALARMS: f64 = 1e-6;

/// A picture with bright and dark parts.
fn picture(s: &mut Scene, w: usize, h: usize, wrap: [Wrap; 2]) -> Handle<TextureImage> {
    let pixels: Vec<[f32; 3]> = (0..w * h)
        .map(|i| match i % 5 {
            0 => [2.0, 1.5, 0.3],
            1 => [0.2, 0.9, 1.1],
            _ => [0.1; 3],
        })
        .collect();
    let image = Image::from_rgb(w, h, &pixels).expect("a picture");
    let texels = Texels::from_image(&image).expect("texels");
    let color_space = ColorSpace::Srgb;
    s.images.push(TextureImage { name: String::new(), texels, lookup: Lookup::Bilinear, wrap, color_space })
}

/// What shines, around the origin and along z, put somewhere by a transform.
type Shine = fn(&mut Scene, &Transform) -> Light;

fn point(_: &mut Scene, t: &Transform) -> Light {
    let (intensity, scale) = white_light(1.5);
    Light::Point { position: t.point(Point3::new(0.1, 0.0, 0.1)), intensity, scale }
}

fn spot(_: &mut Scene, t: &Transform) -> Light {
    let (intensity, scale) = white_light(4.0);
    Light::Spot { world_from_light: *t, intensity, scale, cos_end: 0.6, cos_start: 0.8 }
}

fn cone(_: &mut Scene, t: &Transform) -> Light {
    let (intensity, scale) = white_light(4.0);
    Light::Cone { world_from_light: *t, intensity, scale, end: 0.9, start: 0.3, slide: None }
}

fn goniometric(s: &mut Scene, t: &Transform) -> Light {
    let image = picture(s, 4, 4, [Wrap::Octahedral; 2]);
    let (intensity, scale) = white_light(3.0);
    Light::Goniometric { world_from_light: *t, intensity, image, scale }
}

fn projection(s: &mut Scene, t: &Transform) -> Light {
    let image = picture(s, 6, 4, [Wrap::Clamp; 2]);
    Light::Projection { world_from_light: *t, image, screen: None, fov: 70.0, scale: 0.03 }
}

fn distant(_: &mut Scene, t: &Transform) -> Light {
    let (radiance, scale) = white_light(1.0);
    // From the open front of the room.
    Light::Distant { to_light: -t.vector(Vec3::new(0.3, 0.9, 0.1)).normalize(), radiance, scale }
}

fn map(s: &mut Scene, t: &Transform) -> Light {
    let image = picture(s, 6, 6, [Wrap::Octahedral; 2]);
    Light::ImageInfinite { world_from_light: *t, image, mapping: EnvironmentMapping::EqualArea, scale: 0.01 }
}

/// From above the room's middle down to its right wall, turning a good deal; perhaps stretched unevenly.
fn motion(stretched: bool) -> AnimatedTransform {
    let down = Transform::rotate(90.0, Vec3::new(1.0, 0.0, 0.0)).expect("an axis");
    let turned = Transform::rotate(60.0, Vec3::new(0.2, 0.1, 1.0)).expect("an axis").mul(&down);
    let stretch = if stretched { Transform::scale(1.0, 1.6, 0.7).expect("a scale") } else { Transform::IDENTITY };
    let start = Transform::translate(Vec3::new(-0.4, 1.7, -0.2)).mul(&down);
    let end = Transform::translate(Vec3::new(0.5, 1.2, -0.5)).mul(&turned).mul(&stretch);
    AnimatedTransform::new(start, 0.0, end, 1.0)
}

fn dark_room(color: ColorMode) -> Scene {
    let mut s = rough_room(8, color);
    s.settings.integrator.max_depth = 3;
    s.lights.clear();
    s.primitives.iter_mut().for_each(|p| p.area_light = None);
    s
}

/// Means over seeds or moments, with the variance of the mean and its degrees of freedom.
struct Means(Vec<(f64, f64)>, usize);

/// The spread is that of neighbours, which moments that follow each other are.
fn means(renders: impl Iterator<Item = Rendered>) -> Means {
    let all: Vec<Vec<f64>> = renders.map(|r| halves(&r)).collect();
    let n = all.len() as f64;
    let of = |i: usize| {
        let mean = all.iter().map(|v| v[i]).sum::<f64>() / n;
        (mean, all.chunks(2).map(|v| (v[0][i] - v[1][i]).powi(2)).sum::<f64>() / (n * n))
    };
    Means((0..all[0].len()).map(of).collect(), all.len() / 2)
}

fn same(a: &Means, b: &Means, bias: f64, what: &str) {
    for (i, ((ma, va), (mb, vb))) in a.0.iter().zip(&b.0).enumerate() {
        let error = (va + vb).sqrt();
        let t = ((ma - mb).abs() - bias * mb).max(0.0) / error;
        let p = student_t_two_sided(t, a.1.min(b.1) as f64);
        assert!(p > bonferroni(FALSE_ALARMS, COMPARISONS * 6), "{what}, mean {i}: {ma} is not {mb}, p = {p:e}");
        assert!(error < 0.12 * mb, "{what}, mean {i}: the noise hides everything: {error} of {mb}");
    }
}

/// Pictures of moments, one in each of equal parts of the time.
fn moments(kind: IntegratorKind, scene: impl Fn(&Transform) -> Scene, motion: &AnimatedTransform) -> Means {
    const MOMENTS: u32 = 96;
    means((0..MOMENTS).map(|i| {
        let time = (i as f32 + steradian_sampling::rng::hash_f32(&[7, u64::from(i)])) / MOMENTS as f32;
        let mut s = with(&scene(&motion.at(time)), kind);
        s.settings.sampler.seed = u64::from(i);
        run(s, 64)
    }))
}

/// Each integrator with its samples and, relative to the light, its bias.
fn agree(moving: &Scene, integrators: &[(IntegratorKind, u32, f64)], frozen: &Means, what: &str) {
    for &(kind, spp, bias) in integrators {
        let found = means((0..24).map(|seed| {
            let mut s = with(moving, kind);
            s.settings.sampler.seed = 100 + seed;
            run(s, spp)
        }));
        same(&found, frozen, bias, &format!("{what}, {kind:?}"));
    }
}

#[test]
fn lights_that_are_no_surfaces_move() {
    let all: [(Shine, bool, &str); 7] = [
        (point, true, "point"),
        (spot, true, "spot"),
        (cone, false, "cone"),
        (goniometric, true, "goniometric"),
        (projection, true, "projection"),
        (distant, false, "distant"),
        (map, false, "map"),
    ];
    for (i, (shine, stretched, what)) in all.into_iter().enumerate() {
        let color = if i % 2 == 0 { ColorMode::Rgb } else { ColorMode::Spectral };
        let motion = motion(stretched);
        let frozen = moments(
            BDPT,
            |t| {
                let mut s = dark_room(color);
                let light = shine(&mut s, t);
                s.lights.push(light);
                s
            },
            &motion,
        );
        let mut s = dark_room(color);
        let light = Box::new(shine(&mut s, &Transform::IDENTITY));
        s.lights.push(Light::Moving { light, world_from_light: motion });
        let lamps = [LightSelection::Tree, LightSelection::Power, LightSelection::Uniform];
        s.settings.integrator.light_selection = lamps[i % 3];
        // Both take what light emits, in the same way.
        let other = if i % 2 == 0 { (sppm(0.04, 1000), 12, 0.02) } else { (IntegratorKind::LightPath, 128, 0.0) };
        agree(&s, &[(IntegratorKind::Path, 96, 0.0), (BDPT, 48, 0.0), other], &frozen, what);
    }
}

#[test]
fn lights_move_in_fog() {
    let fog = || {
        let mut s = foggy(0.3, [0.2; 3], [0.9, 0.7, 0.5], false);
        s.lights.clear();
        s.primitives.iter_mut().for_each(|p| p.area_light = None);
        s
    };
    // From the fog to the outside.
    let [inside, away] = [[0.2, 0.3, -0.2], [1.2, 0.9, -1.0]]
        .map(|p| Transform::translate(Vec3::from_array(p)).mul(&Transform::scale(1.0, 2.0, 0.5).expect("a scale")));
    let motion = AnimatedTransform::new(inside, 0.0, away, 1.0);
    let frozen = moments(
        IntegratorKind::VolPath,
        |t| {
            let mut s = fog();
            let light = point(&mut s, t);
            s.lights.push(light);
            s
        },
        &motion,
    );
    let mut s = fog();
    let light = Box::new(point(&mut s, &Transform::IDENTITY));
    s.lights.push(Light::Moving { light, world_from_light: motion });
    let all = [(IntegratorKind::VolPath, 96, 0.0), (BDPT, 48, 0.0), (IntegratorKind::LightPath, 128, 0.0)];
    agree(&s, &all, &frozen, "fog");
}

/// A ball, a disk and a bent patch, that shine to their fronts.
fn lamps(s: &mut Scene) -> Vec<Primitive> {
    let black = diffuse(s, [0.0; 3]);
    let bent = [[-0.2, -0.2, 0.05], [0.2, -0.2, 0.0], [-0.2, 0.2, 0.0], [0.2, 0.2, 0.1]];
    let patch = BilinearMesh {
        positions: bent.map(Point3::from_array).to_vec(),
        indices: vec![[0, 1, 2, 3]],
        ..BilinearMesh::default()
    };
    let patch = Shape::Bilinear(s.bilinear_meshes.push(patch));
    let mesh = quad(s, [[-0.3, -0.1, 0.0], [-0.3, 0.1, 0.0], [-0.25, 0.1, 0.0], [-0.25, -0.1, 0.0]], black).shape;
    let ball = Shape::Sphere(Sphere::full(0.1).expect("a radius"));
    let disk = Shape::Disk(Disk::new(0.0, 0.2, 0.05, 360.0).expect("a disk"));
    let at = |x: f32, y: f32| Transform::translate(Vec3::new(x, y, 0.1));
    let places = [(ball, at(0.0, 0.3)), (disk, at(0.3, 0.0)), (patch, at(-0.2, -0.2)), (mesh, at(0.0, 0.0))];
    let lamp = |(shape, t)| Primitive { area_light: Some(area_light(6.0, false)), ..primitive(shape, t, black) };
    places.into_iter().map(lamp).collect()
}

#[test]
fn lamps_move_with_their_shapes() {
    for (stretched, color) in [(false, ColorMode::Spectral), (true, ColorMode::Rgb)] {
        let motion = motion(stretched);
        // The same object also stands still elsewhere.
        let still = Transform::translate(Vec3::new(0.3, 0.8, 0.7));
        let frozen = moments(
            BDPT,
            |t| {
                let mut s = dark_room(color);
                for p in lamps(&mut s) {
                    for place in [t, &still] {
                        s.primitives
                            .push(Primitive { world_from_object: place.mul(&p.world_from_object), ..p.clone() });
                    }
                }
                s
            },
            &motion,
        );
        let mut s = dark_room(color);
        let primitives = lamps(&mut s);
        let object = s.objects.push(Object { name: String::new(), primitives, instances: Vec::new() });
        s.instances.push(Instance { object, world_from_object: motion });
        s.instances.push(Instance { object, world_from_object: still.into() });
        let world = World::build(s.clone()).expect("a scene");
        assert!(!world.has_unsampled_lights() && world.light_count() == 10);
        let all = [
            (IntegratorKind::Path, 96, 0.0),
            (BDPT, 48, 0.0),
            (IntegratorKind::LightPath, 128, 0.0),
            (sppm(0.04, 1000), 12, 0.02),
        ];
        agree(&s, &all, &frozen, &format!("lamps, stretched: {stretched}"));
    }
}
