"""A scene as a .blend file for Cycles: SCENE FOLDER. Emission, materials and sky are made to mean what they mean elsewhere."""

from __future__ import annotations

import sys
from pathlib import Path

import bpy
import mathutils
import numpy as np

from ..environment import blender
from ..files import write_png
from ..model import Conductor, Dielectric, Diffuse, Fog, Mesh, Scene, Texture
from ..scenes import SCENES

SKY_WIDTH = 2048


def main() -> None:
    """Builds the scene in an empty file and saves it."""
    name, folder = sys.argv[1:]
    scene = SCENES[name]()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    target = bpy.context.scene
    target.world = bpy.data.worlds.new("world")
    for mesh in scene.meshes:
        target.collection.objects.link(_object(mesh, Path(folder)))
    _camera(scene, target)
    _world(scene, target.world)
    _settings(scene, target)
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(folder) / "scene.blend"), compress=False)


def _object(mesh: Mesh, folder: Path) -> bpy.types.Object:
    data = bpy.data.meshes.new(mesh.name)
    faces = np.ascontiguousarray(mesh.faces, np.int32)
    data.vertices.add(len(mesh.points))
    data.vertices.foreach_set("co", np.ascontiguousarray(mesh.points, np.float32).ravel())
    data.loops.add(faces.size)
    data.loops.foreach_set("vertex_index", faces.ravel())
    data.polygons.add(len(faces))
    data.polygons.foreach_set("loop_start", np.arange(0, faces.size, 3, dtype=np.int32))
    if mesh.uv is not None:
        layer = data.uv_layers.new(name="uv")
        layer.uv.foreach_set("vector", np.ascontiguousarray(mesh.uv[faces.ravel()], np.float32).ravel())
    data.update(calc_edges=True)
    data.shade_flat()
    data.materials.append(_material(mesh, folder))
    return bpy.data.objects.new(mesh.name, data)


def _material(mesh: Mesh, folder: Path) -> bpy.types.Material:
    material = bpy.data.materials.new(mesh.name)
    if not material.use_nodes:
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")

    def node(kind: str, **inputs: object) -> bpy.types.Node:
        made = tree.nodes.new(kind)
        for key, value in inputs.items():
            made.inputs[key.replace("_", " ")].default_value = value
        return made

    socket = "Surface"
    if mesh.emission:
        # Strength carries the magnitude: colours of sockets are clamped nowhere, but read better.
        strength = max(mesh.emission)
        shader = node("ShaderNodeEmission", Color=(*(c / strength for c in mesh.emission), 1.0), Strength=strength)
        # Nobody sees the back.
        material.cycles.emission_sampling = "FRONT"
    else:
        match mesh.material:
            case Diffuse(Texture(name, pixels)):
                shader = node("ShaderNodeBsdfDiffuse")
                image = tree.nodes.new("ShaderNodeTexImage")
                write_png(folder / f"{name}.png", pixels)
                image.image = bpy.data.images.load(str(folder / f"{name}.png"))
                image.image.colorspace_settings.name = "sRGB"
                image.image.pack()
                tree.links.new(image.outputs["Color"], shader.inputs["Color"])
            case Diffuse(reflectance):
                shader = node("ShaderNodeBsdfDiffuse", Color=(*reflectance, 1.0))
            case Conductor(_, alpha):
                shader = node("ShaderNodeBsdfMetallic", Roughness=alpha**0.5)
                # Its sockets exist only once the model of Fresnel's law is chosen.
                shader.fresnel_type = "PHYSICAL_CONDUCTOR"
                shader.distribution = "GGX"
                shader.inputs["IOR"].default_value = (1.0, 1.0, 1.0)
                shader.inputs["Extinction"].default_value = mesh.material.extinction()
            case Dielectric(ior, alpha):
                shader = node("ShaderNodeBsdfGlass", Color=(1.0, 1.0, 1.0, 1.0), IOR=ior, Roughness=alpha**0.5)
                shader.distribution = "GGX"
            case Fog(sigma_a, sigma_s, g):
                shader = node("ShaderNodeVolumeCoefficients", Absorption_Coefficients=sigma_a, Scatter_Coefficients=sigma_s, Anisotropy=g)
                socket = "Volume"
    tree.links.new(shader.outputs[0], output.inputs[socket])
    return material


def _camera(scene: Scene, target: bpy.types.Scene) -> None:
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.sensor_width = data.sensor_height = 32.0
    data.angle_y = np.radians(scene.camera.fov)
    data.clip_start, data.clip_end = 1e-3, 1e4
    camera = bpy.data.objects.new("camera", data)
    eye, at = mathutils.Vector(scene.camera.eye), mathutils.Vector(scene.camera.target)
    back = (eye - at).normalized()
    right = mathutils.Vector((0, 1, 0)).cross(back).normalized()
    up = back.cross(right)
    camera.matrix_world = mathutils.Matrix(((right.x, up.x, back.x, eye.x), (right.y, up.y, back.y, eye.y),
                                            (right.z, up.z, back.z, eye.z), (0, 0, 0, 1)))
    target.collection.objects.link(camera)
    target.camera = camera


def _world(scene: Scene, world: bpy.types.World) -> None:
    if not world.use_nodes:
        world.use_nodes = True
    tree = world.node_tree
    tree.nodes.clear()
    background = tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    if scene.sky:
        rows = blender(scene.sky, SKY_WIDTH)[::-1]
        image = bpy.data.images.new("sky", SKY_WIDTH, SKY_WIDTH // 2, float_buffer=True, is_data=False)
        image.colorspace_settings.name = "Linear Rec.709"
        image.pixels.foreach_set(np.concatenate([rows, np.ones((*rows.shape[:2], 1), np.float32)], -1).astype(np.float32).ravel())
        image.file_format = "OPEN_EXR"
        image.pack()
        sky = tree.nodes.new("ShaderNodeTexEnvironment")
        sky.image = image
        tree.links.new(sky.outputs["Color"], background.inputs["Color"])
    output = tree.nodes.new("ShaderNodeOutputWorld")
    tree.links.new(background.outputs[0], output.inputs["Surface"])


def _settings(scene: Scene, target: bpy.types.Scene) -> None:
    """The same integral, nothing clamped, nothing smoothed; all else stays as Blender sets it."""
    target.render.engine = "CYCLES"
    target.render.resolution_x, target.render.resolution_y = scene.camera.width, scene.camera.height
    target.render.resolution_percentage = 100
    target.render.film_transparent = False
    cycles = target.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0
    cycles.blur_glossy = 0.0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    # Cycles does not count the bounce that direct light is.
    bounces = scene.depth - 1
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = bounces
    cycles.transmission_bounces = cycles.volume_bounces = bounces
    cycles.transparent_max_bounces = 128
    target.render.image_settings.file_format = "OPEN_EXR"
    target.render.image_settings.color_depth = "32"
    target.render.image_settings.color_mode = "RGB"


main()
