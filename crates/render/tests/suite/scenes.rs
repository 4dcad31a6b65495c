//! Small scenes made by hand, for tests.

use steradian_geometry::{Sphere, TriangleMesh};
use steradian_image::Filter;
use steradian_math::{Point3, Transform, Vec3};
use steradian_sampling::{SamplerKind, SamplerSettings};
use steradian_scene::{
    AreaLight, Camera, FilmSettings, FloatTexture, Handle, IntegratorSettings, Light, LightSelection, Material,
    Primitive, Projection, RenderSettings, Scattering, Scene, Shape, SpectrumTexture, Texture,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};

/// An empty scene of `size` x `size` pixels.
pub fn empty(size: u32, spp: u32, max_depth: u32, color: ColorMode, sampler: SamplerKind) -> Scene {
    Scene::new(RenderSettings {
        film: FilmSettings::new(size, size),
        filter: Filter::pixel_box(),
        sampler: SamplerSettings { kind: sampler, spp, resolution: [size, size], ..SamplerSettings::default() },
        integrator: IntegratorSettings { max_depth, ..IntegratorSettings::default() },
        color,
        disable_pixel_jitter: false,
        disable_wavelength_jitter: false,
        disable_texture_filtering: false,
        force_diffuse: false,
        layered_as_pbrt: false,
    })
}

pub fn float(scene: &mut Scene, v: f32) -> Handle<FloatTexture> {
    scene.float_textures.push(FloatTexture(Texture::Constant(v)))
}

pub fn spectrum(scene: &mut Scene, s: Spectrum) -> Handle<SpectrumTexture> {
    scene.spectrum_textures.push(SpectrumTexture { usage: s.usage(), kind: Texture::Constant(s) })
}

pub fn material(scene: &mut Scene, scattering: Scattering) -> Handle<Material> {
    scene.materials.push(Material { name: String::new(), scattering, displacement: None, normal_map: None, tilt: None })
}

pub fn diffuse(scene: &mut Scene, rgb: [f32; 3]) -> Handle<Material> {
    let s = if rgb[0] == rgb[1] && rgb[1] == rgb[2] {
        Spectrum::constant(rgb[0], SpectrumUse::Albedo)
    } else {
        Spectrum::rgb_albedo(ColorSpace::Srgb, rgb)
    };
    let reflectance = spectrum(scene, s);
    material(scene, Scattering::Diffuse { reflectance })
}

/// A constant radiance of luminance `scale`.
pub fn white_light(scale: f32) -> (Spectrum, f32) {
    let s = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
    let scale = scale / s.photometric();
    (s, scale)
}

pub fn primitive(shape: Shape, t: Transform, material: Handle<Material>) -> Primitive {
    Primitive {
        shape,
        world_from_object: t,
        reverse_orientation: false,
        material,
        area_light: None,
        alpha: None,
        media: None,
    }
}

pub fn sphere(radius: f32, centre: Vec3, material: Handle<Material>) -> Primitive {
    primitive(Shape::Sphere(Sphere::full(radius).expect("radius")), Transform::translate(centre), material)
}

pub fn quad(scene: &mut Scene, p: [[f32; 3]; 4], material: Handle<Material>) -> Primitive {
    let mesh = TriangleMesh {
        positions: p.map(Point3::from_array).to_vec(),
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..TriangleMesh::default()
    };
    let h = scene.triangle_meshes.push(mesh);
    primitive(Shape::Triangles(h), Transform::IDENTITY, material)
}

pub fn area_light(scale: f32, two_sided: bool) -> AreaLight {
    let (radiance, scale) = white_light(scale);
    AreaLight { radiance, scale, two_sided, power: None, image: None, texture: None, group: None }
}

pub fn environment(scene: &mut Scene, scale: f32) {
    let (radiance, scale) = white_light(scale);
    scene.lights.push(Light::UniformInfinite { radiance, scale });
}

/// A camera at `eye` looking at `look`, y up.
pub fn camera(eye: [f32; 3], look: [f32; 3], fov: f32) -> Camera {
    let t = Transform::look_at(Point3::from_array(eye), Point3::from_array(look), Vec3::new(0.0, 1.0, 0.0));
    Camera {
        projection: Projection::Perspective { fov },
        world_from_camera: t.expect("a view").inverse().into(),
        ..Camera::default()
    }
}

/// A box with coloured walls, a lamp under its ceiling and two spheres.
pub fn cornell(size: u32, spp: u32, color: ColorMode, sampler: SamplerKind, selection: LightSelection) -> Scene {
    let mut s = empty(size, spp, 5, color, sampler);
    s.settings.integrator.light_selection = selection;
    s.camera = camera([0.0, 1.0, -3.4], [0.0, 1.0, 0.0], 39.0);
    let white = diffuse(&mut s, [0.73; 3]);
    let red = diffuse(&mut s, [0.63, 0.065, 0.05]);
    let green = diffuse(&mut s, [0.14, 0.45, 0.09]);
    let walls = [
        ([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]], white),
        ([[-1.0, 2.0, -1.0], [1.0, 2.0, -1.0], [1.0, 2.0, 1.0], [-1.0, 2.0, 1.0]], white),
        ([[-1.0, 0.0, 1.0], [-1.0, 2.0, 1.0], [1.0, 2.0, 1.0], [1.0, 0.0, 1.0]], white),
        ([[-1.0, 0.0, -1.0], [-1.0, 2.0, -1.0], [-1.0, 2.0, 1.0], [-1.0, 0.0, 1.0]], red),
        ([[1.0, 0.0, -1.0], [1.0, 0.0, 1.0], [1.0, 2.0, 1.0], [1.0, 2.0, -1.0]], green),
    ];
    for (p, m) in walls {
        let q = quad(&mut s, p, m);
        s.primitives.push(q);
    }
    let lamp = quad(&mut s, [[-0.3, 1.98, -0.3], [0.3, 1.98, -0.3], [0.3, 1.98, 0.3], [-0.3, 1.98, 0.3]], white);
    s.primitives.push(Primitive { area_light: Some(area_light(12.0, false)), ..lamp });
    let ball = sphere(0.4, Vec3::new(-0.4, 0.4, 0.3), white);
    s.primitives.push(ball);
    let glass = material(&mut s, Scattering::ThinDielectric { eta: steradian_scene::Ior::Constant(1.5) });
    s.primitives.push(sphere(0.35, Vec3::new(0.45, 0.35, -0.2), glass));
    s
}
