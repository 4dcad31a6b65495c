//! From scene to world: instances flattened, meshes put in place, trees and tables built.

use super::displacement::displace_meshes;
use super::group::{Group, MeshUses, place_meshes};
use super::light::{Emitter, EmitterShape, Lights};
use super::medium::{build_media, needs_one_wavelength};
use super::texture::MeshPoint;
use super::{World, WorldInstance};
use crate::{
    AreaLight, CheckerMapping, Error, Instance, Material, Primitive, Roughness, Scattering, Scene, Shape,
    SpectrumInput, Texture,
};
use steradian_bsdf::TrowbridgeReitz;
use steradian_geometry::PreparedTriangle;
use steradian_image::{Lookup, Pyramid, Scratch};
use steradian_math::{AnimatedTransform, Bounds3, PI};

/// Objects may contain instances this deep.
const MAX_NESTING: usize = 32;
/// And there may be this many in all.
const MAX_INSTANCES: usize = 1 << 28;

/// An instance of an object that holds no instances itself.
struct Flat {
    object: usize,
    world_from_object: AnimatedTransform,
}

fn compose(outer: &AnimatedTransform, inner: &AnimatedTransform) -> AnimatedTransform {
    if !inner.is_animated() && !outer.is_animated() {
        return outer.start.mul(&inner.start).into();
    }
    // The keyframes of whichever moves; both have those of the shutter in practice.
    let (t0, t1) =
        if outer.is_animated() { (outer.start_time, outer.end_time) } else { (inner.start_time, inner.end_time) };
    AnimatedTransform::new(outer.at(t0).mul(&inner.at(t0)), t0, outer.at(t1).mul(&inner.at(t1)), t1)
}

fn flatten(
    scene: &Scene,
    instances: &[Instance],
    outer: &AnimatedTransform,
    depth: usize,
    out: &mut Vec<Flat>,
) -> Result<(), Error> {
    for i in instances {
        let object = &scene.objects[i.object];
        if depth >= MAX_NESTING {
            return Err(Error::Nesting { object: object.name.clone(), limit: MAX_NESTING });
        }
        if out.len() >= MAX_INSTANCES {
            return Err(Error::TooManyInstances { limit: MAX_INSTANCES });
        }
        let world_from_object = compose(outer, &i.world_from_object);
        flatten(scene, &object.instances, &world_from_object, depth + 1, out)?;
        if !object.primitives.is_empty() {
            out.push(Flat { object: i.object.index(), world_from_object });
        }
    }
    Ok(())
}

/// A light of an object of which no instance moves becomes a primitive of the world, for each instance.
fn lift_lights(scene: &mut Scene, flat: &[Flat]) {
    let moving: Vec<bool> = (0..scene.objects.len())
        .map(|o| flat.iter().any(|f| f.object == o && f.world_from_object.is_animated()))
        .collect();
    let mut lifted = Vec::new();
    for f in flat.iter().filter(|f| !moving[f.object]) {
        let object = &scene.objects.as_slice()[f.object];
        for p in object.primitives.iter().filter(|p| p.area_light.is_some()) {
            let t = f.world_from_object.start.mul(&p.world_from_object);
            lifted.push(Primitive { world_from_object: t, ..p.clone() });
        }
    }
    for handle in scene.objects.handles() {
        if !moving[handle.index()] {
            scene.objects[handle].primitives.retain(|p| p.area_light.is_none());
        }
    }
    scene.primitives.append(&mut lifted);
}

impl World {
    /// Builds everything that rendering needs.
    ///
    /// # Errors
    /// If a mesh does not fit together, or there is too much of something; a loader's checks make that impossible for
    /// files.
    pub fn build(scene: Scene) -> Result<World, Error> {
        Self::build_in(scene, None)
    }

    /// As [`World::build`], with large pictures in a scratch file. The world is the same in every look-up.
    ///
    /// # Errors
    /// As [`World::build`], and if the file cannot be written.
    pub fn build_in(mut scene: Scene, scratch: Option<&Scratch>) -> Result<World, Error> {
        if let Some(scratch) = scratch {
            for handle in scene.images.handles() {
                let image = &mut scene.images[handle];
                image.texels = image.texels.clone().into_scratch(scratch).map_err(scratch_error)?;
            }
        }
        let pyramids = pyramids(&scene, scratch)?;
        let (mut scene, pyramids) = displace_meshes(scene, pyramids)?;
        let mut flat = Vec::new();
        let identity = steradian_math::Transform::IDENTITY.into();
        let instances = std::mem::take(&mut scene.instances);
        flatten(&scene, &instances, &identity, 0, &mut flat)?;
        lift_lights(&mut scene, &flat);

        let mut primitives = std::mem::take(&mut scene.primitives);
        let mut objects: Vec<Vec<Primitive>> =
            scene.objects.handles().map(|h| std::mem::take(&mut scene.objects[h].primitives)).collect();
        let uses = MeshUses::count(&scene, primitives.iter().chain(objects.iter().flatten()));
        place_meshes(&mut scene, &mut primitives, &uses)?;
        for object in &mut objects {
            place_meshes(&mut scene, object, &uses)?;
        }

        // The world is group 0, so objects come after it: group = object + 1.
        let mut groups = Vec::with_capacity(objects.len() + 1);
        for object in &objects {
            groups.push(Group::build(&scene, object, &[])?);
        }
        let instances: Vec<WorldInstance> = flat
            .iter()
            .map(|f| WorldInstance {
                group: f.object as u32 + 1,
                world_from_object: f.world_from_object,
                first_light: 0,
            })
            .collect();
        let bounds: Vec<(u32, Bounds3)> = flat
            .iter()
            .enumerate()
            .map(|(i, f)| (i as u32, f.world_from_object.motion_bounds(&groups[f.object].accel.bounds())))
            .collect();
        groups.insert(0, Group::build(&scene, &primitives, &bounds)?);
        let bounds = groups[0].accel.bounds();

        let media = build_media(&scene, primitives.iter().chain(objects.iter().flatten()))?;
        let settings = &scene.settings;
        let camera = super::CameraModel::new(&scene.camera, settings.film.resolution, !settings.disable_pixel_jitter);
        let has_motion = camera.is_animated()
            || instances.iter().any(|i| i.world_from_object.is_animated())
            || World::far_lights_move(&scene);
        let uses_footprints = uses_footprints(&scene);
        for record in groups.iter_mut().flat_map(|g| &mut g.primitives) {
            let material = &scene.materials[record.material];
            let looks_at = scene.scattering_looks_at(&material.scattering);
            // Where it scatters is all that matters, not how neighbouring rays do.
            let alone = !uses_footprints || looks_at.is_some() && !is_mirror(&scene, material);
            record.isotropic = is_isotropic(material) && alone;
            let filtered = !record.isotropic || looks_at.is_none_or(|l| l.footprint);
            record.footprint = uses_footprints && filtered;
        }
        let has_interfaces = primitives
            .iter()
            .chain(objects.iter().flatten())
            .any(|p| matches!(scene.materials[p.material].scattering, Scattering::Interface));
        let diffusion = super::subsurface::DiffusionTables::build(&scene);
        let plastics = super::plastic::PlasticTables::build(&scene);
        let mut world = World {
            groups,
            instances,
            pyramids,
            camera,
            diffusion,
            plastics,
            has_motion,
            uses_footprints,
            has_interfaces,
            area_lights: Vec::new(),
            lights: Lights::default(),
            needs_one_wavelength: needs_one_wavelength(&scene, &media),
            media,
            bounds,
            scene,
        };
        let mut emitters = world.emitters(None, &primitives);
        for i in 0..world.instances.len() {
            let object = &objects[world.instances[i].group as usize - 1];
            if object.iter().any(|p| p.area_light.is_some()) {
                world.instances[i].first_light = emitters.len() as u32;
                emitters.append(&mut world.emitters(Some(i as u32), object));
            }
        }
        world.lights = Lights::build(&world, emitters, &bounds);
        if world.settings().integrator.kind.starts_at_lights() {
            world.prepare_emission();
        }
        world.scene.settings.integrator.check(&world.light_census())?;
        Ok(world)
    }

    /// One emitter for each element of each primitive that shines, of the world or an instance; tells the records of the group.
    fn emitters(&mut self, instance: Option<u32>, primitives: &[Primitive]) -> Vec<Emitter> {
        let group = instance.map_or(0, |i| self.instances[i as usize].group as usize);
        let mut emitters = Vec::new();
        let mut quadric = 0;
        for (i, p) in primitives.iter().enumerate() {
            let is_quadric = matches!(p.shape, Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_));
            let this_quadric = quadric;
            quadric += u32::from(is_quadric);
            let Some(light) = &p.area_light else { continue };
            // A light on a surface that is no surface does not shine.
            if matches!(self.scene.materials[p.material].scattering, Scattering::Interface) {
                continue;
            }
            let emission = self.area_lights.len() as u32;
            let record = &mut self.groups[group].primitives[i];
            if matches!(p.shape, Shape::Curves(_) | Shape::Distances(_)) {
                record.unsampled_emission = Some((emission, light.scale));
            } else {
                record.first_light = Some(emitters.len() as u32);
            }
            let shapes: Vec<EmitterShape> = match &p.shape {
                Shape::Triangles(h) => (0..self.scene.triangle_meshes[*h].indices.len())
                    .map(|f| EmitterShape::Triangle(*h, f as u32))
                    .collect(),
                Shape::Bilinear(h) => (0..self.scene.bilinear_meshes[*h].indices.len())
                    .map(|f| EmitterShape::Patch(*h, f as u32))
                    .collect(),
                Shape::Sphere(_) | Shape::Disk(_) | Shape::Cylinder(_) => vec![EmitterShape::Quadric(this_quadric)],
                Shape::Curves(_) | Shape::Distances(_) => Vec::new(),
            };
            // As in pbrt, what is nowhere there shines as a whole, and is not seen.
            let is_hidden = |&h: &crate::Handle<crate::FloatTexture>| matches!(self.scene.float_textures[h].0, Texture::Constant(a) if a <= 0.0);
            let alpha = p.alpha.filter(|h| !is_hidden(h));
            for shape in shapes {
                let prepared = match shape {
                    EmitterShape::Triangle(mesh, face) => {
                        PreparedTriangle::new(&self.scene.triangle_meshes[mesh], face as usize)
                    }
                    _ => None,
                };
                let brightness = match (light.texture, shape) {
                    (Some(texture), EmitterShape::Triangle(mesh, face)) => {
                        Some(self.mean_emission(texture, mesh.index() as u32, face))
                    }
                    _ => None,
                };
                let mut emitter = Emitter { shape, instance, emission, scale: 1.0, brightness, prepared, alpha };
                emitter.scale = self.emission_scale(light, &emitter);
                emitters.push(emitter);
            }
            self.area_lights.push(light.clone());
        }
        emitters
    }

    /// The mean radiance of a textured triangle in photometric units, from points that cover it. Never zero, since what lies
    /// between the points may shine.
    fn mean_emission(&self, texture: SpectrumInput, mesh: u32, face: u32) -> f32 {
        const STEPS: u32 = 5;
        let rgb = steradian_spectrum::Wavelengths::rgb();
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..STEPS {
            for j in 0..STEPS - i {
                let b = [i, j].map(|k| (k as f32 + 1.0 / 3.0) / STEPS as f32);
                let [r, g, b] = self.mesh_emission(texture, MeshPoint { mesh, face, b }, &rgb).rgb();
                sum += (r + g + b) / 3.0;
                count += 1.0;
            }
        }
        (sum / count).max(1e-3) * steradian_spectrum::ColorSpace::Srgb.photometric()
    }

    /// The factor that gives a light its stated power, for the area of this element.
    fn emission_scale(&self, light: &AreaLight, emitter: &Emitter) -> f32 {
        let Some(power) = light.power else { return light.scale };
        let mut k = match light.image {
            None => 1.0,
            Some(image) => self.scene.images[image].mean_luminance(),
        };
        k *= if light.two_sided { 2.0 } else { 1.0 } * self.emitter_area(emitter) * PI;
        if k > 0.0 { light.scale * power / k } else { 0.0 }
    }
}

fn scratch_error(e: std::io::Error) -> Error {
    Error::Scratch { message: e.to_string() }
}

fn pyramids(scene: &Scene, scratch: Option<&Scratch>) -> Result<Vec<Option<Pyramid>>, Error> {
    let mut used = vec![false; scene.images.len()];
    let maps =
        scene.float_textures.iter().filter_map(|t| if let Texture::Image(m) = &t.0 { Some(m.image) } else { None });
    let spectral = scene
        .spectrum_textures
        .iter()
        .filter_map(|t| if let Texture::Image(m) = &t.kind { Some(m.image) } else { None });
    let normal = scene.materials.iter().filter_map(|m| Some(m.normal_map.as_ref()?.image));
    let directions = scene.materials.iter().filter_map(|m| match &m.scattering {
        Scattering::MetallicRoughness(m) => Some(m.anisotropy.as_ref()?.direction.as_ref()?.image),
        _ => None,
    });
    maps.chain(spectral).chain(normal).chain(directions).for_each(|h| used[h.index()] = true);
    use rayon::prelude::*;
    scene
        .images
        .as_slice()
        .par_iter()
        .zip(used)
        .map(|(image, used)| {
            // Environment maps and emission are looked up by themselves.
            if !used {
                return Ok(None);
            }
            let pyramid = match image.lookup {
                Lookup::Point | Lookup::Bilinear => Pyramid::plain(image.texels.clone(), image.wrap),
                _ => Pyramid::new(image.texels.clone(), image.wrap)
                    .map_err(|e| Error::Image { name: image.name.clone(), message: e.to_string() })?,
            };
            match scratch {
                Some(scratch) => pyramid.into_scratch(scratch).map(Some).map_err(scratch_error),
                None => Ok(Some(pyramid)),
            }
        })
        .collect()
}

/// Whether a surface of this material looks the same whichever way its tangents lie.
fn is_isotropic(material: &Material) -> bool {
    if material.displacement.is_some() || material.normal_map.is_some() {
        return false;
    }
    let round = |r: &Roughness| r.u == r.v;
    match &material.scattering {
        Scattering::Diffuse { .. } | Scattering::ThinDielectric { .. } | Scattering::DiffuseTransmission { .. } => true,
        Scattering::Conductor { roughness, .. } | Scattering::Dielectric { roughness, .. } => round(roughness),
        Scattering::MetallicRoughness(m) => m.anisotropy.is_none(),
        Scattering::CoatedDiffuse { coat, .. } => round(&coat.roughness),
        Scattering::CoatedConductor { roughness, coat, .. } => round(roughness) && round(&coat.roughness),
        _ => false,
    }
}

/// Whether a metal may be smooth, so that neighbouring rays are reflected to neighbours.
fn is_mirror(scene: &Scene, material: &Material) -> bool {
    let Scattering::Conductor { roughness, .. } = &material.scattering else { return false };
    match scene.float_textures[roughness.u].0 {
        Texture::Constant(r) => {
            let alpha = if roughness.remap { TrowbridgeReitz::roughness_to_alpha(r) } else { r };
            TrowbridgeReitz::new(alpha, alpha).is_smooth()
        }
        _ => true,
    }
}

/// Whether any texture looks at the size of the sample.
fn uses_footprints(scene: &Scene) -> bool {
    let filtered = |lookup: Lookup| !matches!(lookup, Lookup::Point | Lookup::Bilinear);
    fn of<T, C>(t: &Texture<T, C>, image: impl Fn(crate::Handle<crate::TextureImage>) -> bool) -> bool {
        match t {
            Texture::Image(m) => image(m.image),
            Texture::Checkerboard { mapping: CheckerMapping::Plane(_) | CheckerMapping::Space(_), .. } => true,
            Texture::Noise { .. } => true,
            _ => false,
        }
    }
    let image = |h: crate::Handle<crate::TextureImage>| filtered(scene.images[h].lookup);
    scene.float_textures.iter().any(|t| of(&t.0, image))
        || scene.spectrum_textures.iter().any(|t| of(&t.kind, image))
        || scene.materials.iter().any(|m| m.displacement.is_some())
}
