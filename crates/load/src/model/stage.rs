//! What a model stands on, what it is seen by, and what shines on it, where its file says nothing.

use super::{Found, ModelOptions, Up, bytes_of, framing, studio};
use crate::files::FileAccess;
use steradian_geometry::TriangleMesh;
use steradian_image::{Lookup, Texels, Wrap, read_texels};
use steradian_math::{Bounds3, Point3, Transform, Vec3, radians, sin_cos, smoothstep};
use steradian_scene::{
    EnvironmentMapping, FloatTexture, Light, Material, Primitive, Scattering, Scene, Shape, SpectrumTexture, Texture,
    TextureImage,
};
use steradian_spectrum::{ColorSpace, Spectrum, SpectrumUse};

/// Completes a scene: environment, ground and camera, as far as they are missing.
pub(super) fn set(
    scene: &mut Scene,
    found: Found,
    up: Up,
    files: &dyn FileAccess,
    options: &ModelOptions,
) -> Result<(), String> {
    if options.camera.is_some() && !found.has_camera {
        return Err("the file has no cameras, so that --camera chooses none".into());
    }
    let world_from_stage = match up {
        Up::Y => Some(Transform::IDENTITY),
        Up::Z => Transform::rotate(90.0, Vec3::new(1.0, 0.0, 0.0)),
    }
    .unwrap_or(Transform::IDENTITY);
    let points = framing::points(scene);
    // Surfaces that glow light a scene that somebody composed; on a model alone they are its lamps and screens.
    let is_lit = found.has_lights || found.glows && found.has_camera;
    if let Some(map) = &options.environment {
        let texels = read_map(&bytes_of(&map.file, files)?, &map.file.display().to_string())?;
        // The middle of the picture is at +x, where Blender has it.
        let turn = Transform::rotate(map.rotation + 180.0, Vec3::new(0.0, 1.0, 0.0)).unwrap_or(Transform::IDENTITY);
        let world = world_from_stage.mul(&turn);
        push_map(scene, texels, &map.file.display().to_string(), &world, map.strength);
    } else if !is_lit {
        let texels = studio::picture().map_err(|e| e.to_string())?;
        // The studio is built around the camera, wherever that goes.
        let turn = Transform::rotate(options.turn, Vec3::new(0.0, 1.0, 0.0)).unwrap_or(Transform::IDENTITY);
        push_map(scene, texels, "studio", &world_from_stage.mul(&turn), 1.0);
        if options.ground && !found.has_camera && !points.is_empty() {
            let stage_from_world = world_from_stage.inverse();
            let b = framing::boxed(points.iter().map(|&p| stage_from_world.point(p)));
            push_ground(scene, &b, &world_from_stage);
        }
    }
    if let Some(size) = options.size {
        let film = &mut scene.settings.film;
        film.resolution = size;
        film.pixel_bounds = [0, size[0], 0, size[1]];
        scene.settings.sampler.resolution = size;
    }
    if !found.has_camera {
        let [w, h] = scene.settings.film.resolution;
        let aspect = w as f32 / h as f32;
        let around =
            if points.is_empty() { vec![Point3::new(-1.0, -1.0, -1.0), Point3::new(1.0, 1.0, 1.0)] } else { points };
        let camera = framing::frame(&around, &world_from_stage, options.turn, aspect);
        scene.camera = camera.ok_or("no camera can see all of the model: its coordinates are too large")?;
    }
    Ok(())
}

fn read_map(bytes: &[u8], name: &str) -> Result<Texels, String> {
    let texels = read_texels(bytes, name, None).map_err(|e| e.to_string())?;
    match texels.not_finite() {
        None => Ok(texels),
        Some(what) => Err(format!("{name}: an environment cannot have {what}")),
    }
}

/// Adds an environment; `world` has its y axis up. The middle of the picture is at -x, and columns run clockwise as seen from
/// above.
fn push_map(scene: &mut Scene, texels: Texels, name: &str, world: &Transform, strength: f32) {
    // The light's z axis is the pole, and its azimuth runs the other way.
    let turned = [[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let world_from_light = Transform::from_matrix(turned).map_or(*world, |t| world.mul(&t));
    let color_space = texels
        .chromaticities
        .and_then(|c| ColorSpace::from_chromaticities([c.red, c.green, c.blue], c.white))
        .unwrap_or(ColorSpace::Srgb);
    let image = scene.images.push(TextureImage {
        name: name.into(),
        texels,
        lookup: Lookup::Bilinear,
        wrap: [Wrap::Repeat, Wrap::Clamp],
        color_space,
    });
    let scale = strength / color_space.photometric();
    scene.lights.push(Light::ImageInfinite { world_from_light, image, mapping: EnvironmentMapping::LatLong, scale });
}

/// A disk below the model that thins out before it ends. `b` is the model's box in the stage.
fn push_ground(scene: &mut Scene, b: &Bounds3, world_from_stage: &Transform) {
    const SPOKES: u32 = 96;
    const RINGS: u32 = 24;
    let size = b.diagonal().length();
    let flat = Vec3::new(b.diagonal().x, 0.0, b.diagonal().z).length().max(0.3 * size);
    let (inner, outer) = (1.6 * flat, 9.0 * flat.max(0.5 * size));
    // Just below, for models that lie in a plane.
    let y = b.min.y - 2e-4 * size;
    let middle = b.centroid();
    let mut mesh = TriangleMesh::default();
    let mut put = |x: f32, z: f32, alpha: f32| {
        mesh.positions.push(world_from_stage.point(Point3::new(middle.x + x, y, middle.z + z)));
        mesh.colors.push([1.0, 1.0, 1.0, alpha]);
    };
    put(0.0, 0.0, 1.0);
    for r in 0..=RINGS {
        let t = r as f32 / RINGS as f32;
        let radius = inner + (outer - inner) * t * t;
        let alpha = 1.0 - smoothstep(radius, inner, outer);
        for s in 0..SPOKES {
            let (sin, cos) = sin_cos(radians(360.0 * s as f32 / SPOKES as f32));
            put(radius * cos, radius * sin, alpha);
        }
    }
    let at = |r: u32, s: u32| 1 + r * SPOKES + s % SPOKES;
    for s in 0..SPOKES {
        mesh.indices.push([0, at(0, s + 1), at(0, s)]);
        for r in 0..RINGS {
            mesh.indices.push([at(r, s), at(r, s + 1), at(r + 1, s)]);
            mesh.indices.push([at(r, s + 1), at(r + 1, s + 1), at(r + 1, s)]);
        }
    }
    let reflectance = scene.spectrum_textures.push(SpectrumTexture {
        usage: SpectrumUse::Albedo,
        kind: Texture::Constant(Spectrum::constant(studio::GROUND, SpectrumUse::Albedo)),
    });
    let scattering = Scattering::Diffuse { reflectance };
    let material = scene.materials.push(Material {
        name: "ground".into(),
        scattering,
        displacement: None,
        normal_map: None,
        tilt: None,
    });
    let alpha = scene.float_textures.push(FloatTexture(Texture::Vertex));
    let mesh = scene.triangle_meshes.push(mesh);
    scene.primitives.push(Primitive {
        shape: Shape::Triangles(mesh),
        world_from_object: Transform::IDENTITY,
        reverse_orientation: false,
        material,
        area_light: None,
        alpha: Some(alpha),
        media: None,
    });
}
