//! Building a scene in a few lines.

use super::Rgb;
use steradian_geometry::{BilinearMesh, Sphere, TriangleMesh};
use steradian_image::Filter;
use steradian_math::{Point3, Transform, Vec3};
use steradian_sampling::{SamplerKind, SamplerSettings};
use steradian_scene::{
    AreaLight, Camera, Error, FilmSettings, FloatTexture, Handle, Instance, IntegratorSettings, Ior, Light, Material,
    Metal, Object, Primitive, Projection, RenderSettings, Roughness, Scattering, Scene, Shape, SpectrumTexture,
    Texture, World,
};
use steradian_spectrum::{ColorMode, ColorSpace, Spectrum, SpectrumUse};

/// A scene in the making.
pub struct Builder {
    /// What there is so far.
    pub scene: Scene,
}

impl Builder {
    /// An empty scene of `size` pixels, box-filtered, in RGB, with paths of at most `max_depth` bounces.
    pub fn new(size: [u32; 2], max_depth: u32) -> Self {
        let scene = Scene::new(RenderSettings {
            film: FilmSettings::new(size[0], size[1]),
            filter: Filter::pixel_box(),
            sampler: SamplerSettings { kind: SamplerKind::Independent, resolution: size, ..SamplerSettings::default() },
            integrator: IntegratorSettings { max_depth, ..IntegratorSettings::default() },
            color: ColorMode::Rgb,
            disable_pixel_jitter: false,
            disable_wavelength_jitter: false,
            disable_texture_filtering: true,
            force_diffuse: false,
            layered_as_pbrt: false,
        });
        Self { scene }
    }

    /// The world.
    pub fn build(self) -> Result<World, Error> {
        World::build(self.scene)
    }

    /// A pinhole camera at `eye` that looks at `look`, y up; `fov` degrees along the shorter side.
    pub fn camera(&mut self, eye: [f32; 3], look: [f32; 3], fov: f32) {
        self.scene.camera = Camera {
            projection: Projection::Perspective { fov },
            world_from_camera: view(eye, look).into(),
            ..Camera::default()
        };
    }

    /// A camera of parallel rays along the line from `eye` to `look`; the shorter side of the picture is `2 half` high.
    pub fn parallel_camera(&mut self, eye: [f32; 3], look: [f32; 3], half: f32) {
        let [w, h] = self.scene.settings.film.resolution;
        let (x, y) = if w >= h { (half * w as f32 / h as f32, half) } else { (half, half * h as f32 / w as f32) };
        self.scene.camera = Camera {
            projection: Projection::Orthographic,
            world_from_camera: view(eye, look).into(),
            screen_window: Some([-x, x, -y, y]),
            ..Camera::default()
        };
    }

    /// A material without name or bumps.
    pub fn material(&mut self, scattering: Scattering) -> Handle<Material> {
        self.scene.materials.push(Material {
            name: String::new(),
            scattering,
            displacement: None,
            normal_map: None,
            tilt: None,
        })
    }

    /// A constant reflectance.
    pub fn albedo(&mut self, rgb: Rgb) -> Handle<SpectrumTexture> {
        let s = Spectrum::rgb_albedo(ColorSpace::Srgb, rgb);
        self.scene.spectrum_textures.push(SpectrumTexture { usage: SpectrumUse::Albedo, kind: Texture::Constant(s) })
    }

    /// Lambert's law.
    pub fn diffuse(&mut self, rgb: Rgb) -> Handle<Material> {
        let reflectance = self.albedo(rgb);
        self.material(Scattering::Diffuse { reflectance })
    }

    /// Lambert's law with a checkerboard of two colours, `per_unit` squares along u and v.
    pub fn checkerboard(&mut self, a: Rgb, b: Rgb, per_unit: f32) -> Handle<Material> {
        let (a, b) = (self.albedo(a), self.albedo(b));
        let mapping = steradian_scene::Mapping2::Uv { su: per_unit, sv: per_unit, du: 0.0, dv: 0.0 };
        let kind = Texture::Checkerboard { mapping: steradian_scene::CheckerMapping::Plane(mapping), a, b };
        let reflectance = self.scene.spectrum_textures.push(SpectrumTexture { usage: SpectrumUse::Albedo, kind });
        self.material(Scattering::Diffuse { reflectance })
    }

    fn roughness(&mut self, alpha: f32) -> Roughness {
        let h: Handle<FloatTexture> = self.scene.float_textures.push(FloatTexture(Texture::Constant(alpha)));
        Roughness { u: h, v: h, remap: false }
    }

    /// A metal of the given colour and microfacet width.
    pub fn metal(&mut self, rgb: Rgb, alpha: f32) -> Handle<Material> {
        let colour = self.albedo(rgb);
        let roughness = self.roughness(alpha);
        self.material(Scattering::Conductor { metal: Metal::Reflectance(colour), roughness })
    }

    /// Glass with microfacets of the given width.
    pub fn glass(&mut self, eta: f32, alpha: f32) -> Handle<Material> {
        let roughness = self.roughness(alpha);
        self.material(Scattering::Dielectric { eta: Ior::Constant(eta), roughness })
    }

    /// A quadrilateral as a primitive that is not yet in the scene; it faces the side from which its corners run
    /// counter-clockwise.
    pub fn quad_primitive(&mut self, corners: [[f32; 3]; 4], material: Handle<Material>) -> Primitive {
        let mesh = TriangleMesh {
            positions: corners.map(Point3::from_array).to_vec(),
            indices: vec![[0, 1, 2], [0, 2, 3]],
            uvs: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(steradian_math::Point2::from).to_vec(),
            ..TriangleMesh::default()
        };
        let h = self.scene.triangle_meshes.push(mesh);
        primitive(Shape::Triangles(h), Transform::IDENTITY, material)
    }

    /// Adds single triangles.
    pub fn triangles(&mut self, all: &[[Point3; 3]], material: Handle<Material>) {
        let mesh = TriangleMesh {
            positions: all.iter().flatten().copied().collect(),
            indices: (0..all.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..TriangleMesh::default()
        };
        let h = self.scene.triangle_meshes.push(mesh);
        self.scene.primitives.push(primitive(Shape::Triangles(h), Transform::IDENTITY, material));
    }

    /// Adds a quadrilateral.
    pub fn quad(&mut self, corners: [[f32; 3]; 4], material: Handle<Material>) {
        let p = self.quad_primitive(corners, material);
        self.scene.primitives.push(p);
    }

    /// Adds a parallelogram that shines to both sides with the given radiance. It is one patch, so that it is one light and
    /// a grid of numbers is a grid of its points.
    pub fn lamp(&mut self, corners: [[f32; 3]; 4], radiance: f32) {
        let black = self.diffuse([0.0; 3]);
        let mesh = BilinearMesh {
            positions: corners.map(Point3::from_array).to_vec(),
            indices: vec![[0, 1, 3, 2]],
            ..BilinearMesh::default()
        };
        let h = self.scene.bilinear_meshes.push(mesh);
        let p = primitive(Shape::Bilinear(h), Transform::IDENTITY, black);
        self.scene.primitives.push(Primitive { area_light: Some(shining(radiance)), ..p });
    }

    /// Adds a quadrilateral of one colour that shines by itself.
    pub fn coloured_lamp(&mut self, corners: [[f32; 3]; 4], rgb: Rgb) {
        let black = self.diffuse([0.0; 3]);
        let p = self.quad_primitive(corners, black);
        let radiance = Spectrum::rgb_illuminant(ColorSpace::Srgb, rgb);
        let light = AreaLight { radiance, ..shining(1.0) };
        self.scene.primitives.push(Primitive { area_light: Some(light), ..p });
    }

    /// Adds a sphere.
    pub fn sphere(&mut self, radius: f32, centre: [f32; 3], material: Handle<Material>) {
        let p = sphere(radius, centre, material);
        self.scene.primitives.push(p);
    }

    /// Adds a sphere that shines.
    pub fn ball_lamp(&mut self, radius: f32, centre: [f32; 3], radiance: f32) {
        let black = self.diffuse([0.0; 3]);
        let p = sphere(radius, centre, black);
        self.scene.primitives.push(Primitive { area_light: Some(shining(radiance)), ..p });
    }

    /// The same radiance from everywhere.
    pub fn sky(&mut self, radiance: f32) {
        let (spectrum, scale) = white(radiance);
        self.scene.lights.push(Light::UniformInfinite { radiance: spectrum, scale });
    }

    /// A point of light.
    pub fn point_light(&mut self, p: [f32; 3], intensity: f32) {
        let (spectrum, scale) = white(intensity);
        self.scene.lights.push(Light::Point { position: Point3::from_array(p), intensity: spectrum, scale });
    }

    /// Adds primitives that move by `shift` from time 0 to time 1.
    pub fn moving(&mut self, primitives: Vec<Primitive>, shift: [f32; 3]) {
        let object = Object { name: String::new(), primitives, instances: Vec::new() };
        let object = self.scene.objects.push(object);
        let end = Transform::translate(Vec3::new(shift[0], shift[1], shift[2]));
        let world_from_object = steradian_math::AnimatedTransform::new(Transform::IDENTITY, 0.0, end, 1.0);
        self.scene.instances.push(Instance { object, world_from_object });
    }
}

/// The camera-to-world transform; y up.
fn view(eye: [f32; 3], look: [f32; 3]) -> Transform {
    let up = if eye[0] == look[0] && eye[2] == look[2] { Vec3::new(0.0, 0.0, 1.0) } else { Vec3::new(0.0, 1.0, 0.0) };
    // Views are written in this crate and never degenerate.
    Transform::look_at(Point3::from_array(eye), Point3::from_array(look), up)
        .map_or(Transform::IDENTITY, |t| t.inverse())
}

fn white(radiance: f32) -> (Spectrum, f32) {
    let s = Spectrum::rgb_illuminant(ColorSpace::Srgb, [1.0; 3]);
    let scale = radiance / s.photometric();
    (s, scale)
}

/// Emission of this radiance to both sides.
pub fn shining(radiance: f32) -> AreaLight {
    let (radiance, scale) = white(radiance);
    AreaLight { radiance, scale, two_sided: true, power: None, image: None, group: None, texture: None }
}

fn sphere(radius: f32, centre: [f32; 3], material: Handle<Material>) -> Primitive {
    let shape = Shape::Sphere(Sphere::full(radius).expect("a positive radius"));
    primitive(shape, Transform::translate(Vec3::new(centre[0], centre[1], centre[2])), material)
}

fn primitive(shape: Shape, world_from_object: Transform, material: Handle<Material>) -> Primitive {
    Primitive {
        shape,
        world_from_object,
        reverse_orientation: false,
        material,
        area_light: None,
        alpha: None,
        media: None,
    }
}
