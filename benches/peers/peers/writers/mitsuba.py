"""Mitsuba 3: what `mitsuba.load_dict` takes, as JSON; meshes are the PLY files that Steradian reads."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..environment import latitude_longitude
from ..files import write_pfm, write_ply, write_png
from ..model import Conductor, Dielectric, Diffuse, Fog, Material, Mesh, Rgb, Scene, Texture

SKY_WIDTH = 2048

Dict = dict[str, Any]


def write(scene: Scene, folder: Path) -> None:
    """Writes mitsuba.json and the files that it names. The camera's matrix is left to the child: `look_at` holds its arguments."""
    camera = scene.camera
    # Mitsuba counts vertices from the camera: one more than scattering events.
    whole: Dict = {
        "type": "scene",
        "integrator": {"type": "volpath" if scene.has_fog() else "path", "max_depth": scene.depth + 1},
        "sensor": {
            "type": "perspective", "fov": camera.fov, "fov_axis": "smaller", "near_clip": 1e-3, "far_clip": 1e4,
            "look_at": [list(camera.eye), list(camera.target), [0, 1, 0]],
            "film": {"type": "hdrfilm", "width": camera.width, "height": camera.height, "pixel_format": "rgb",
                     "component_format": "float32", "rfilter": {"type": "box"}},
        },
    }
    if scene.sky:
        write_pfm(folder / "sky-latlong.pfm", latitude_longitude(scene.sky, SKY_WIDTH))
        whole["sky"] = {"type": "envmap", "filename": "sky-latlong.pfm"}
    for mesh in scene.meshes:
        whole[mesh.name] = _mesh(mesh, folder)
    (folder / "mitsuba.json").write_text(json.dumps(whole, indent=1))


def _mesh(mesh: Mesh, folder: Path) -> Dict:
    write_ply(folder / f"{mesh.name}.ply", mesh)
    shape: Dict = {"type": "ply", "filename": f"{mesh.name}.ply", "face_normals": True, "flip_tex_coords": True, "bsdf": _material(mesh.material, folder)}
    if mesh.emission:
        shape["emitter"] = {"type": "area", "radiance": _rgb(mesh.emission)}
    if isinstance(mesh.material, Fog):
        fog = mesh.material
        total = [a + s for a, s in zip(fog.sigma_a, fog.sigma_s)]
        shape["interior"] = {
            "type": "homogeneous",
            "sigma_t": {"type": "rgb", "value": total},
            "albedo": {"type": "rgb", "value": [s / t for s, t in zip(fog.sigma_s, total)]},
            "phase": {"type": "hg", "g": fog.g},
        }
    return shape


def _material(material: Material, folder: Path) -> Dict:
    match material:
        case Diffuse(Texture(name, pixels)):
            write_png(folder / f"{name}.png", pixels)
            return _both_sides({"type": "diffuse", "reflectance": {"type": "bitmap", "filename": f"{name}.png"}})
        case Diffuse(reflectance):
            return _both_sides({"type": "diffuse", "reflectance": _rgb(reflectance)})
        case Conductor(_, alpha):
            # `spectral_k` is for spectral variants, which would take an unbounded `rgb` for the colour of a light.
            optics: Dict = {"eta": 1.0, "k": _rgb(material.extinction()), "spectral_k": _curve(material.extinction())}
            if alpha == 0.0:
                return _both_sides({"type": "conductor", **optics})
            return _both_sides({"type": "roughconductor", "distribution": "ggx", "alpha": alpha, **optics})
        case Dielectric(ior, alpha):
            glass: Dict = {"int_ior": ior, "ext_ior": 1.0}
            if alpha == 0.0:
                return {"type": "dielectric", **glass}
            return {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha, **glass}
        case Fog():
            return {"type": "null"}


def _curve(value: Rgb) -> Dict:
    """A smooth spectrum that is about `value` where red, green and blue are."""
    red, green, blue = value
    nodes = {360: blue, 470: blue, 520: green, 570: green, 620: red, 830: red}
    return {"type": "irregular", "wavelengths": ", ".join(map(str, nodes)), "values": ", ".join(f"{k:.6g}" for k in nodes.values())}


def _both_sides(bsdf: Dict) -> Dict:
    return {"type": "twosided", "bsdf": bsdf}


def _rgb(value: Rgb) -> Dict:
    return {"type": "rgb", "value": list(value)}
