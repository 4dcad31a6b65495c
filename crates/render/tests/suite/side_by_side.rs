//! Paths that are followed side by side are those that are followed alone, bit for bit.

use crate::bidirectional::rough_room;
use crate::scenes::*;
use crate::techniques::room;
use steradian_geometry::TriangleMesh;
use steradian_image::{Filter, FilterKind};
use steradian_integrator::Scratch;
use steradian_integrator::record::Counters;
use steradian_math::{Normal3, Point3, Transform, Vec2, Vec3};
use steradian_render::PixelSampler;
use steradian_sampling::{Sampler, SamplerKind};
use steradian_scene::{
    Instance, Light, LightSelection, Object, Primitive, Roughness, Scattering, Scene, Shape, Texture, World,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};

const SIZE: u32 = 12;

fn quads(s: &mut Scene, rgb: [f32; 3], radiance: f32, places: impl Iterator<Item = [f32; 3]>) {
    let m = diffuse(s, rgb);
    for [x, y, z] in places {
        let q = quad(s, [[x, y, z], [x + 0.1, y, z], [x + 0.1, y, z + 0.1], [x, y, z + 0.1]], m);
        let area_light = (radiance > 0.0).then(|| area_light(radiance, x > 0.0));
        s.primitives.push(Primitive { area_light, ..q });
    }
}

/// A smooth, bumpy floor with normals of its own, some of them null, turned inside out where `reverse` says.
fn hills(s: &mut Scene, reverse: bool) {
    let n = 8u32;
    let at = |i: u32, j: u32| {
        let (x, z) = (i as f32 / n as f32 * 2.0 - 1.0, j as f32 / n as f32 * 2.0 - 1.0);
        Point3::new(x, 0.2 + 0.1 * (x * 3.0 + z * z * 5.0), z)
    };
    let normal = |i: u32, j: u32| {
        let k = (i * 7 + j * 3) % 5;
        if k == 0 { Normal3::default() } else { Normal3::new(0.2 * k as f32 - 0.5, 1.0, 0.1) }
    };
    let grid = || (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j)));
    let quad = |i: u32, j: u32| {
        let v = |i: u32, j: u32| j * (n + 1) + i;
        [[v(i, j), v(i + 1, j), v(i + 1, j + 1)], [v(i, j), v(i + 1, j + 1), v(i, j + 1)]]
    };
    let mesh = s.triangle_meshes.push(TriangleMesh {
        positions: grid().map(|(i, j)| at(i, j)).collect(),
        normals: grid().map(|(i, j)| normal(i, j)).collect(),
        indices: (0..n).flat_map(|j| (0..n).flat_map(move |i| quad(i, j))).collect(),
        ..TriangleMesh::default()
    });
    let m = diffuse(s, [0.6, 0.5, 0.3]);
    let p = primitive(Shape::Triangles(mesh), Transform::IDENTITY, m);
    s.primitives.push(Primitive { reverse_orientation: reverse, ..p });
}

/// Scenes of many kinds, by name.
fn scenes(color: ColorMode, sampler: SamplerKind) -> Vec<(&'static str, Scene)> {
    let base = |selection| cornell(SIZE, 16, color, sampler, selection);
    let box_ = || base(LightSelection::Tree);
    let mut all = vec![
        ("matte", box_()),
        ("by power", base(LightSelection::Power)),
        ("uniform", base(LightSelection::Uniform)),
        ("glossy", room(SIZE, 16, sampler)),
    ];
    let mut s = rough_room(SIZE, color);
    s.settings.sampler = box_().settings.sampler;
    all.push(("rough", s));
    let mut s = box_();
    environment(&mut s, 0.3);
    let (intensity, scale) = white_light(2.0);
    s.lights.push(Light::Point { intensity, scale, position: Point3::new(0.5, 1.5, 0.0) });
    all.push(("sky and a point", s));
    let mut s = box_();
    quads(&mut s, [0.5; 3], 3.0, (0..40).map(|i| [-0.9 + 0.04 * i as f32, 0.5 + 0.02 * i as f32, 0.2]));
    all.push(("many lights", s));
    let mut s = box_();
    hills(&mut s, false);
    hills(&mut s, true);
    quads(&mut s, [0.0; 3], 0.0, (0..9).map(|i| [-0.9 + 0.2 * i as f32, 0.7, -0.3]));
    all.push(("hills and black", s));
    let mut s = box_();
    let colors = s.spectrum_textures.push(steradian_scene::SpectrumTexture {
        usage: SpectrumUse::Albedo,
        kind: Texture::Bilerp {
            mapping: steradian_scene::Mapping2::Uv { su: 1.0, sv: 1.0, du: 0.0, dv: 0.0 },
            corners: [[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.1, 0.1, 0.9], [0.5, 0.5, 0.5]]
                .map(|rgb| Spectrum::rgb_albedo(ColorSpace::Srgb, rgb)),
        },
    });
    let painted = material(&mut s, Scattering::Diffuse { reflectance: colors });
    s.primitives[0].material = painted;
    all.push(("painted", s));
    let mut s = box_();
    let lamp = s.primitives[5].clone();
    let m = diffuse(&mut s, [0.2, 0.7, 0.4]);
    let tile = quad(&mut s, [[0.0; 3], [0.3, 0.0, 0.0], [0.3, 0.0, 0.3], [0.0, 0.0, 0.3]], m);
    let object = s.objects.push(Object { name: "tile".into(), primitives: vec![tile], instances: Vec::new() });
    for i in 0..5 {
        let place = Transform::translate(Vec3::new(-0.8 + 0.3 * i as f32, 0.3 + 0.2 * i as f32, 0.5));
        s.instances.push(Instance { object, world_from_object: place.into() });
    }
    s.primitives.push(Primitive { world_from_object: Transform::translate(Vec3::new(0.0, -0.4, 0.2)), ..lamp });
    all.push(("instances", s));
    let mut s = box_();
    s.camera.lens_radius = 0.1;
    s.camera.focal_distance = 3.0;
    s.settings.filter = Filter::new(FilterKind::Gaussian { sigma: 0.5 }, Vec2::new(1.5, 1.5)).expect("a filter");
    let rough = float(&mut s, 0.2);
    let roughness = Roughness { u: rough, v: rough, remap: false };
    let eta = steradian_scene::Ior::Spectrum(steradian_spectrum::named::spectrum("glass-SF11").expect("glass"));
    let glass = material(&mut s, Scattering::Dielectric { eta, roughness });
    s.primitives.last_mut().expect("a ball").material = glass;
    s.settings.integrator.regularize = true;
    all.push(("a lens, dispersion, regularised", s));
    all
}

/// Every sample of every pixel, in both ways.
fn check(name: &str, scene: Scene, batch_of: usize, spp: u32, level: Option<fearless_simd::Level>) {
    let world = World::build(scene).expect("a scene");
    let sampler = PixelSampler::new(&world);
    let mut numbers = Sampler::new(&world.settings().sampler);
    let Some(mut batch) = sampler.batch(&numbers) else { panic!("{name} has no batches") };
    level.into_iter().for_each(|level| batch.set_level(level));
    let pixels: Vec<[u32; 2]> = (0..SIZE * SIZE).map(|i| [i % SIZE, i / SIZE]).collect();
    let (mut counts, mut counts_alone) = (Counters::default(), Counters::default());
    let mut scratch = Scratch::default();
    for pixels in pixels.chunks(batch_of) {
        let mut together = Vec::new();
        sampler.sample_many(&mut batch, &mut numbers, pixels, 0..spp, &mut counts, &mut together);
        let mut k = 0;
        for &pixel in pixels {
            for index in 0..spp {
                let alone = sampler.sample(&mut numbers, pixel, index, &mut counts_alone, &mut scratch).rgb;
                let (a, b) = (alone.map(f32::to_bits), together[k].map(f32::to_bits));
                assert_eq!(a, b, "{name}: sample {index} of {pixel:?}, {alone:?} alone, {:?} together", together[k]);
                k += 1;
            }
        }
    }
    assert_eq!(counts, counts_alone, "{name}");
}

#[test]
fn paths_side_by_side_are_paths_alone() {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        for sampler in [SamplerKind::ZSobol, SamplerKind::PaddedSobol] {
            for (name, scene) in scenes(color, sampler) {
                check(name, scene, 5, 16, None);
            }
        }
    }
}

#[test]
fn depth_batch_size_and_number_of_samples_do_not_show() {
    for max_depth in [0, 1, 2, 40] {
        for (name, mut scene) in scenes(ColorMode::Rgb, SamplerKind::ZSobol) {
            scene.settings.integrator.max_depth = max_depth;
            scene.settings.sampler.spp = [1, 3, 8, 32][max_depth as usize % 4];
            check(name, scene, 1 + 13 * max_depth as usize, 1 + max_depth.min(2), None);
        }
    }
}

#[test]
fn instruction_sets_do_not_show() {
    for level in [fearless_simd::Level::baseline(), fearless_simd::Level::new()] {
        for (name, scene) in scenes(ColorMode::Spectral, SamplerKind::ZSobol) {
            check(name, scene, 16, 4, Some(level));
        }
    }
}
