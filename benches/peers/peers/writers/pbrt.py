"""pbrt-v4's language with binary PLY: Steradian and pbrt read the same file."""

from __future__ import annotations

from pathlib import Path

from ..environment import equal_area
from ..files import write_pfm, write_ply, write_png
from ..model import Conductor, Dielectric, Diffuse, Fog, Material, Mesh, Scene, Texture

SKY_SIZE = 1024


def write(scene: Scene, folder: Path) -> None:
    """Writes scene.pbrt and the files that it names."""
    camera = scene.camera
    lines = [
        f'Integrator "{"volpath" if scene.has_fog() else "path"}" "integer maxdepth" {scene.depth}',
        'PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5',
        f'Film "rgb" "integer xresolution" {camera.width} "integer yresolution" {camera.height} "string filename" "out.pfm"',
        # The world is right-handed; pbrt's camera is not.
        "Scale -1 1 1",
        f"LookAt {_numbers(camera.eye)}  {_numbers(camera.target)}  0 1 0",
        f'Camera "perspective" "float fov" {camera.fov}',
        "WorldBegin",
    ]
    if scene.sky:
        write_pfm(folder / "sky.pfm", equal_area(scene.sky, SKY_SIZE))
        lines.append('LightSource "infinite" "string filename" "sky.pfm"')
    for mesh in scene.meshes:
        lines += _mesh(mesh, folder)
    (folder / "scene.pbrt").write_text("\n".join(lines) + "\n")


def _mesh(mesh: Mesh, folder: Path) -> list[str]:
    write_ply(folder / f"{mesh.name}.ply", mesh)
    lines = ["AttributeBegin", *_material(mesh.material, folder)]
    if mesh.emission:
        lines.append(f'AreaLightSource "diffuse" "rgb L" [ {_numbers(mesh.emission)} ]')
    if isinstance(mesh.material, Fog):
        fog = mesh.material
        lines.append(f'MakeNamedMedium "{mesh.name}" "string type" "homogeneous" "rgb sigma_a" [ {_numbers(fog.sigma_a)} ] '
                     f'"rgb sigma_s" [ {_numbers(fog.sigma_s)} ] "float g" {fog.g}')
        lines.append(f'MediumInterface "{mesh.name}" ""')
    return [*lines, f'Shape "plymesh" "string filename" "{mesh.name}.ply"', "AttributeEnd"]


def _material(material: Material, folder: Path) -> list[str]:
    match material:
        case Diffuse(Texture(name, pixels)):
            write_png(folder / f"{name}.png", pixels)
            return [f'Texture "{name}" "spectrum" "imagemap" "string filename" "{name}.png" "string filter" "bilinear"',
                    f'Material "diffuse" "texture reflectance" "{name}"']
        case Diffuse(reflectance):
            return [f'Material "diffuse" "rgb reflectance" [ {_numbers(reflectance)} ]']
        case Conductor(reflectance, alpha):
            return [f'Material "conductor" "rgb reflectance" [ {_numbers(reflectance)} ] "float roughness" {alpha} "bool remaproughness" false']
        case Dielectric(ior, alpha):
            return [f'Material "dielectric" "float eta" {ior} "float roughness" {alpha} "bool remaproughness" false']
        case Fog():
            return ['Material "interface"']


def _numbers(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.9g}" for value in values)
