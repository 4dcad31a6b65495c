//! Paths that are followed side by side are those that are followed alone, bit for bit.

use crate::bidirectional::rough_room;
use crate::scenes::*;
use crate::techniques::room;
use steradian_geometry::TriangleMesh;
use steradian_image::{Encoding, Filter, FilterKind, Lookup, Storage, Texels, Wrap};
use steradian_integrator::Scratch;
use steradian_integrator::record::Counters;
use steradian_math::{Normal3, Point3, Transform, Vec2, Vec3};
use steradian_render::PixelSampler;
use steradian_sampling::{Sampler, SamplerKind};
use steradian_scene::{
    EnvironmentMapping, FloatTexture, Handle, ImageMap, Instance, Light, LightSelection, Mapping2, Metal, Object,
    Primitive, Roughness, Scattering, Scene, Shape, SpectrumTexture, Texture, TextureImage, World,
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

fn turned(degrees: f32) -> Transform {
    Transform::rotate(degrees, Vec3::new(1.0, 0.0, 0.0)).expect("an axis")
}

/// A picture of 6 x 5 texels with black ones, some channels of them alpha.
fn picture(s: &mut Scene, channels: usize, storage: fn(Vec<u8>) -> Storage, lookup: Lookup) -> Handle<TextureImage> {
    let codes = (0..30 * channels).map(|i| if i / channels % 7 == 3 { 0 } else { (i * 37 % 251) as u8 }).collect();
    s.images.push(TextureImage {
        name: "a picture".into(),
        texels: Texels::new(6, 5, channels, storage(codes), Encoding::Srgb).expect("texels"),
        lookup,
        wrap: [Wrap::Repeat, Wrap::Mirror],
        color_space: [ColorSpace::Srgb, ColorSpace::Rec2020][channels % 2],
    })
}

fn floats(codes: Vec<u8>) -> Storage {
    Storage::F32(codes.into_iter().map(|c| f32::from(c) / 200.0).collect())
}

/// Walls under pictures, one of them metal whose roughness is a picture, looked up in one way or another.
fn papered(mut s: Scene, lookups: [Lookup; 2]) -> Scene {
    let mappings = [
        Mapping2::Uv { su: 3.0, sv: 2.0, du: 0.1, dv: 0.4 },
        Mapping2::Spherical { texture_from_world: turned(35.0) },
        Mapping2::Affine { set: 0, rows: [[2.0, 0.5, 0.0], [-0.5, 1.0, 0.3]] },
    ];
    for (i, mapping) in mappings.into_iter().enumerate() {
        let storage = [Storage::U8, floats][i % 2];
        let image = picture(&mut s, [3, 4, 1][i], storage, lookups[i % 2]);
        let map = ImageMap { mapping, image, scale: 1.1, invert: i == 2 };
        let rough = s.float_textures.push(FloatTexture(Texture::Image(map.clone())));
        let kind = Texture::Image(map);
        let painted = s.spectrum_textures.push(SpectrumTexture { usage: SpectrumUse::Albedo, kind });
        let roughness = Roughness { u: rough, v: rough, remap: i % 2 == 0 };
        let metal = Scattering::Conductor { metal: Metal::Reflectance(painted), roughness };
        let both = [Scattering::Diffuse { reflectance: painted }, metal];
        let [matte, metal] = both.map(|scattering| material(&mut s, scattering));
        s.primitives[i].material = matte;
        if i < 2 {
            s.primitives[3 + i].material = metal;
        }
    }
    s
}

/// A box without its lid and its lamp under a sky.
fn under_a_sky(mut s: Scene, mapping: EnvironmentMapping, storage: fn(Vec<u8>) -> Storage, channels: usize) -> Scene {
    let image = picture(&mut s, channels, storage, Lookup::Bilinear);
    let world_from_light = turned(-70.0);
    s.lights.push(Light::ImageInfinite { world_from_light, image, mapping, scale: 0.01 });
    s.primitives.remove(5);
    s.primitives.remove(1);
    s
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
    let half = float(&mut s, 0.5);
    s.primitives[5].alpha = Some(half);
    assert!(s.primitives[5].area_light.is_some());
    all.push(("half a lamp", s));
    let mut s = box_();
    hills(&mut s, false);
    hills(&mut s, true);
    quads(&mut s, [0.0; 3], 0.0, (0..9).map(|i| [-0.9 + 0.2 * i as f32, 0.7, -0.3]));
    all.push(("hills and black", s));
    let mut s = box_();
    let colors = s.spectrum_textures.push(SpectrumTexture {
        usage: SpectrumUse::Albedo,
        kind: Texture::Bilerp {
            mapping: Mapping2::Uv { su: 1.0, sv: 1.0, du: 0.0, dv: 0.0 },
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
    for regularize in [false, true] {
        let mut s = box_();
        s.settings.integrator.regularize = regularize;
        let color = spectrum(&mut s, Spectrum::rgb_albedo(ColorSpace::Srgb, [0.9, 0.7, 0.3]));
        let named = |name| steradian_spectrum::named::spectrum(name).expect("a metal");
        let (eta, k) = (spectrum(&mut s, named("metal-Cu-eta")), spectrum(&mut s, named("metal-Cu-k")));
        for (i, alpha) in [(0, 0.3), (1, 0.0), (2, 0.02), (4, 0.8)] {
            let rough = float(&mut s, alpha);
            let metal = if i == 2 { Metal::Ior { eta, k } } else { Metal::Reflectance(color) };
            let roughness = Roughness { u: rough, v: rough, remap: i == 0 };
            s.primitives[i].material = material(&mut s, Scattering::Conductor { metal, roughness });
        }
        all.push((if regularize { "metals, regularised" } else { "metals" }, s));
    }
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
    all.push(("papered", papered(box_(), [Lookup::Point, Lookup::Bilinear])));
    all.push(("papered, filtered", papered(box_(), [Lookup::Trilinear, Lookup::Ewa { max_anisotropy: 8.0 }])));
    use EnvironmentMapping::{EqualArea, LatLong};
    all.push(("under a sky", under_a_sky(box_(), EqualArea, floats, 3)));
    all.push(("under a globe", under_a_sky(box_(), LatLong, Storage::U8, 1)));
    let mut s = under_a_sky(papered(box_(), [Lookup::Bilinear; 2]), LatLong, floats, 3);
    quads(&mut s, [0.5; 3], 3.0, (0..3).map(|i| [-0.9 + 0.4 * i as f32, 0.5, 0.2]));
    let ball = s.primitives.len() - 5;
    let lamp = s.primitives[ball].clone();
    s.primitives.insert(1, lamp.clone());
    s.primitives.insert(5, lamp);
    all.push(("two skies and lamps", under_a_sky(s, EqualArea, Storage::U8, 4)));
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
        for sampler in [SamplerKind::ZSobol, SamplerKind::PaddedSobol, SamplerKind::Pmj02bn] {
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
    let best = fearless_simd::Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let between = best.as_avx2().map(fearless_simd::Level::Avx2);
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    let between = None;
    for level in [Some(fearless_simd::Level::baseline()), between, Some(best)].into_iter().flatten() {
        for (name, scene) in scenes(ColorMode::Spectral, SamplerKind::ZSobol) {
            check(name, scene, 16, 4, Some(level));
        }
    }
}
