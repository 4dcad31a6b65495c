"""A sun of one texel and 1e5 in a dim map: how noisy are Steradian and Cycles at equal numbers of samples?

    PYTHON sun_in_map.py FOLDER STERADIAN [TEXELS]

PYTHON is that of the environment which `benches/peers/run` makes. Each renderer is compared with its own picture of many samples. A firefly is a pixel that is
off by more than the reference and a tenth of its mean, and is counted again where it is off by several times that. With one bounce only what the sun lights itself is seen.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np

WIDTH, HEIGHT, BOUNCES = 160, 120, (5, 1)
SAMPLES, SEEDS = (16, 64), (1, 2, 3, 4)
REFERENCE = 1024
TIMES = (1, 2, 4, 8)
MAP = (1024, 512)
BALLS = [(-2.3, "matte", 0.0), (0.0, "metal", 0.25), (2.3, "metal", 0.05)]
EYE, TARGET, FOV = (0.0, -9.0, 3.2), (0.0, 0.0, 0.8), 42.0
METAL = (1.0, 4.0)


def main() -> None:
    """Makes everything, measures, prints a table."""
    folder, steradian = Path(sys.argv[1]), sys.argv[2]
    texels = int(sys.argv[3]) if len(sys.argv) > 3 else 1
    folder.mkdir(parents=True, exist_ok=True)
    _call("map", folder, texels)
    (folder / "scene.xml").write_text(_xml())
    print(f"sun of {texels} x {texels} texels; relMSE, and fireflies in {WIDTH * HEIGHT} pixels, {TIMES} times as far off")
    for bounces in BOUNCES:
        for name in ("steradian", "cycles"):
            _measure(name, bounces, texels, folder, steradian)


def _measure(name: str, bounces: int, texels: int, folder: Path, steradian: str) -> None:
    def render(spp: int, seed: int) -> np.ndarray:
        out = folder / f"{name}-{texels}-{bounces}-{spp}-{seed}.npy"
        if name == "cycles":
            _call("cycles", folder, bounces, spp, seed, out)
        else:
            picture = out.with_suffix(".pfm")
            options = ["--color", "rgb", "--max-depth", bounces, "--spp", spp, "--seed", seed, "-o", picture]
            subprocess.run([steradian, "render", folder / "scene.xml", "-q", *map(str, options)], check=True)
            np.save(out, _pfm(picture))
        return np.load(out).astype(np.float64)

    reference = render(REFERENCE, 99)
    limit = reference + 0.1 * reference.mean()
    for spp in SAMPLES:
        errors, flies = [], []
        for seed in SEEDS:
            off = render(spp, seed) - reference
            errors.append(np.mean(off**2 / (reference**2 + 1e-2)))
            farthest = np.max(np.abs(off) / limit, axis=-1)
            flies.append([np.count_nonzero(farthest > k) for k in TIMES])
        print(f"{name:10} {bounces} bounces {spp:4} spp  relMSE {np.mean(errors):9.5f}  fireflies {np.mean(flies, axis=0)}  mean {reference.mean((0, 1)).round(4)}", flush=True)


def _call(*words: object) -> None:
    subprocess.run([sys.executable, __file__, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def _pfm(path: Path) -> np.ndarray:
    _, size, _, data = path.read_bytes().split(b"\n", 3)
    width, height = map(int, size.split())
    return np.frombuffer(data, "<f4").reshape(height, width, 3)[::-1]


def write_map(folder: str, texels: str) -> None:
    """The map, by the renderer that is at hand for it."""
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    width, height = MAP
    rows = np.broadcast_to(np.float32([0.25, 0.3, 0.4]), (height, width, 3)).copy()
    x, y, n = int(0.62 * width), int(0.3 * height), int(texels)
    rows[y : y + n, x : x + n] = 1e5
    mi.Bitmap(rows).write(f"{folder}/map.exr")


def _xml() -> str:
    shapes = '<shape type="rectangle"><transform name="to_world"><scale value="30"/></transform><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></shape>'
    for x, kind, alpha in BALLS:
        bsdf = '<bsdf type="diffuse"><rgb name="reflectance" value="0.6 0.3 0.2"/></bsdf>'
        if kind == "metal":
            eta, k = METAL
            bsdf = f'<bsdf type="roughconductor"><float name="alpha" value="{alpha}"/><float name="eta" value="{eta}"/><float name="k" value="{k}"/></bsdf>'
        shapes += f'<shape type="sphere"><point name="center" x="{x}" y="0" z="1"/>{bsdf}</shape>'
    point = lambda p: ", ".join(map(str, p))
    return f"""<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><float name="fov" value="{FOV}"/><string name="fov_axis" value="y"/>
<transform name="to_world"><lookat origin="{point(EYE)}" target="{point(TARGET)}" up="0, 0, 1"/></transform>
<film type="hdrfilm"><integer name="width" value="{WIDTH}"/><integer name="height" value="{HEIGHT}"/><rfilter type="box"/></film>
<sampler type="independent"/></sensor>
<emitter type="envmap"><string name="filename" value="map.exr"/><transform name="to_world"><rotate x="1" angle="90"/><rotate z="1" angle="90"/></transform></emitter>
{shapes}</scene>"""


def cycles(folder: str, bounces: str, spp: str, seed: str, out: str) -> None:
    """One picture by Cycles: nothing clamped, nothing smoothed."""
    import bpy
    import mathutils

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    tree = scene.world.node_tree
    sky = tree.nodes.new("ShaderNodeTexEnvironment")
    sky.image = bpy.data.images.load(f"{folder}/map.exr")
    sky.image.colorspace_settings.name = "Linear Rec.709"
    tree.links.new(sky.outputs["Color"], tree.nodes["Background"].inputs["Color"])

    def material(kind: str, color: tuple[float, ...], alpha: float = 0.0) -> bpy.types.Material:
        made = bpy.data.materials.new(kind)
        made.use_nodes = True
        nodes = made.node_tree.nodes
        nodes.clear()
        if kind == "metal":
            node = nodes.new("ShaderNodeBsdfMetallic")
            node.fresnel_type, node.distribution = "PHYSICAL_CONDUCTOR", "GGX"
            node.inputs["IOR"].default_value, node.inputs["Extinction"].default_value = (METAL[0],) * 3, (METAL[1],) * 3
            node.inputs["Roughness"].default_value = alpha**0.5
        else:
            node = nodes.new("ShaderNodeBsdfDiffuse")
            node.inputs["Color"].default_value = (*color, 1.0)
        made.node_tree.links.new(node.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        return made

    bpy.ops.mesh.primitive_plane_add(size=60)
    bpy.context.object.data.materials.append(material("matte", (0.5, 0.5, 0.5)))
    for x, kind, alpha in BALLS:
        bpy.ops.mesh.primitive_uv_sphere_add(segments=256, ring_count=128, location=(x, 0, 1))
        bpy.ops.object.shade_smooth()
        bpy.context.object.data.materials.append(material(kind, (0.6, 0.3, 0.2), alpha))
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle_y = "VERTICAL", np.radians(FOV)
    camera = bpy.data.objects.new("camera", lens)
    camera.location = EYE
    camera.rotation_euler = (mathutils.Vector(TARGET) - mathutils.Vector(EYE)).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = WIDTH, HEIGHT, 100
    c = scene.cycles
    c.device, c.use_adaptive_sampling, c.use_denoising, c.pixel_filter_type = "CPU", False, False, "BOX"
    c.sample_clamp_direct = c.sample_clamp_indirect = c.blur_glossy = 0.0
    c.max_bounces = c.diffuse_bounces = c.glossy_bounces = int(bounces) - 1
    c.samples, c.seed = int(spp), int(seed)
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = out.replace(".npy", ".exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(WIDTH * HEIGHT * 4, np.float32)
    image.pixels.foreach_get(pixels)
    np.save(out, pixels.reshape(HEIGHT, WIDTH, 4)[::-1, :, :3])


if len(sys.argv) > 1 and sys.argv[1] == "map":
    write_map(*sys.argv[2:])
elif len(sys.argv) > 1 and sys.argv[1] == "cycles":
    cycles(*sys.argv[2:])
else:
    main()
