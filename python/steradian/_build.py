"""Scenes from dictionaries and arrays.

A description has pbrt's entities and parameters, so that pbrt's documentation is its documentation. Arrays of vertices, faces and pixels
go in as they are; a mesh is copied once into the form that the reader takes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from ._image import Image
from ._scene import Scene, loads
from .errors import InputError

# What pbrt reads as whole numbers; every other number may have a fraction.
_INTEGERS = {
    "xresolution", "yresolution", "pixelsamples", "xsamples", "ysamples", "maxdepth", "seed", "nsamples", "levels", "octaves",
    "splitdepth", "photonsperiteration", "bootstrapsamples", "chains", "mutationsperpixel", "dimension", "degree", "pixelbounds",
}  # fmt: skip
_POINTS = {"P", "from", "to", "p0", "p1", "portal"}
_VECTORS = {"vs", "vt", "dir"}
_TYPES = r"(integer|float|point2|vector2|point3|vector3|point|vector|normal|normal3|spectrum|rgb|blackbody|bool|string|texture) "


class _Writer:
    def __init__(self) -> None:
        self.lines: list[str] = []
        self.files: dict[str, bytes] = {}

    def file(self, stem: str, content: bytes) -> str:
        name = f"memory:{len(self.files)}-{stem}"
        self.files[name] = content
        return name

    def parameter(self, entity: str, name: str, value: Any) -> str:
        typed = re.match(_TYPES, name)
        if typed:
            kind, name = typed.group(1), name[typed.end() :]
        elif isinstance(value, (bool, np.bool_)):
            kind = "bool"
        elif isinstance(value, str):
            kind = "string"
        elif isinstance(value, (Image, np.ndarray)) and name in ("filename", "image"):
            kind, name = "string", "filename"
        elif isinstance(value, Mapping):
            raise InputError(f"{entity}: {name!r} cannot be a dictionary")
        else:
            flat = np.asarray(value)
            if flat.dtype.kind not in "iuf":
                raise InputError(f"{entity}: {name!r} is {type(value).__name__}; a parameter is numbers, texts or truth values")
            if name in _INTEGERS:
                kind = "integer"
            elif name in _POINTS:
                kind = "point3"
            elif name in _VECTORS:
                kind = "vector3"
            else:
                kind = "rgb" if flat.size == 3 else "float"
        if name == "filename" and isinstance(value, (Image, np.ndarray)):
            image = value if isinstance(value, Image) else Image.from_array(value)
            value = self.file("image.exr", image._native.encode("image.exr", "clip", 0.0, False))
        return f'"{kind} {name}" [ {_values(entity, name, value)} ]'

    def entity(self, directive: str, kind: str, parameters: Mapping[str, Any], skip: Iterable[str] = ()) -> None:
        skipped = {"type", *skip}
        words = [self.parameter(f"{directive} {kind}", n, v) for n, v in parameters.items() if n not in skipped]
        self.lines.append(" ".join([f'{directive} "{_text(kind)}"', *words]))


def _text(value: str) -> str:
    return value.replace("\\", "\\\\").replace('"', '\\"')


def _values(entity: str, name: str, value: Any) -> str:
    if isinstance(value, str):
        return f'"{_text(value)}"'
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)) and value and all(isinstance(v, str) for v in value):
        return " ".join(f'"{_text(v)}"' for v in value)
    flat = np.asarray(value).ravel()
    if flat.dtype.kind == "b":
        return " ".join("true" if v else "false" for v in flat)
    if flat.dtype.kind in "iu":
        return " ".join(str(int(v)) for v in flat)
    if flat.dtype.kind != "f" or not np.isfinite(flat).all():
        raise InputError(f"{entity}: {name!r} must be finite numbers")
    return " ".join(np.format_float_positional(np.float32(v), unique=True, trim="0") for v in flat)


def _kind(entity: str, description: Mapping[str, Any], absent: Optional[str] = None) -> str:
    kind = description.get("type", absent)
    if not isinstance(kind, str):
        raise InputError(f"{entity} needs a 'type'")
    return kind


def _rows(entity: str, name: str, value: npt.ArrayLike, columns: int, dtype: str) -> npt.NDArray[Any]:
    array = np.asarray(value)
    if array.dtype.kind not in "iuf" or array.ndim != 2 or array.shape[1] != columns:
        raise InputError(f"{entity}: {name!r} must be an array of N x {columns} numbers, not {array.shape}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise InputError(f"{entity}: {name!r} must be finite")
    return array.astype(dtype, copy=False)


def mesh_bytes(
    vertices: npt.ArrayLike,
    faces: npt.ArrayLike,
    normals: Optional[npt.ArrayLike] = None,
    uv: Optional[npt.ArrayLike] = None,
) -> bytes:
    """A triangle mesh as a binary PLY file: vertices N x 3, faces M x 3 (indices from 0), normals N x 3, uv N x 2."""
    p = _rows("mesh", "vertices", vertices, 3, "<f4")
    f = np.asarray(faces)
    if f.dtype.kind not in "iu":
        raise InputError("mesh: 'faces' must be whole numbers")
    f = _rows("mesh", "faces", f, 3, "<i8")
    if len(f) and (f.min() < 0 or f.max() >= len(p)):
        raise InputError(f"mesh: 'faces' must be from 0 to {len(p) - 1}, and there is {f.min()} to {f.max()}")
    columns = [("x", p[:, 0]), ("y", p[:, 1]), ("z", p[:, 2])]
    for names, columns_of in ((("nx", "ny", "nz"), normals), (("u", "v"), uv)):
        if columns_of is None:
            continue
        values = _rows("mesh", "normals" if len(names) == 3 else "uv", columns_of, len(names), "<f4")
        if len(values) != len(p):
            raise InputError(f"mesh: {len(p)} vertices and {len(values)} {'normals' if len(names) == 3 else 'uv'}")
        columns += [(n, values[:, i]) for i, n in enumerate(names)]
    table = np.empty(len(p), dtype=[(n, "<f4") for n, _ in columns])
    for name, column in columns:
        table[name] = column
    triangles = np.empty(len(f), dtype=[("n", "u1"), ("i", "<i4", 3)])
    triangles["n"], triangles["i"] = 3, f
    properties = "".join(f"property float {n}\n" for n, _ in columns)
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(p)}\n{properties}"
        f"element face {len(f)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    return header.encode() + table.tobytes() + triangles.tobytes()


def _matrix(value: npt.ArrayLike) -> str:
    m = np.asarray(value, dtype=np.float64)
    if m.shape != (4, 4):
        raise InputError(f"'to_world' must be a matrix of 4 x 4, not {m.shape}")
    # pbrt writes matrices column by column.
    return "ConcatTransform [ " + _values("to_world", "to_world", m.T) + " ]"


_SHAPE_KEYS = ("vertices", "faces", "normals", "uv", "material", "emission", "to_world", "translate")


def _shape(w: _Writer, shape: Mapping[str, Any]) -> None:
    kind = _kind("a shape", shape, "mesh" if "vertices" in shape else None)
    w.lines.append("AttributeBegin")
    if "to_world" in shape:
        w.lines.append(_matrix(shape["to_world"]))
    if "translate" in shape:
        w.lines.append(f"Translate {_values(kind, 'translate', shape['translate'])}")
    material = shape.get("material")
    if isinstance(material, Mapping):
        w.entity("Material", _kind("a material", material), material)
    elif material is not None:
        w.lines.append(f'NamedMaterial "{_text(str(material))}"')
    emission = shape.get("emission")
    if isinstance(emission, Mapping):
        w.entity("AreaLightSource", _kind("an emission", emission, "diffuse"), emission)
    elif emission is not None:
        w.entity("AreaLightSource", "diffuse", {"rgb L": np.broadcast_to(np.asarray(emission, dtype=np.float64), 3)})
    if kind == "mesh":
        content = mesh_bytes(shape["vertices"], shape["faces"], shape.get("normals"), shape.get("uv"))
        rest = {n: v for n, v in shape.items() if n not in _SHAPE_KEYS}
        w.entity("Shape", "plymesh", {**rest, "string filename": w.file("mesh.ply", content)})
    else:
        w.entity("Shape", kind, shape, skip=("material", "emission", "to_world", "translate"))
    w.lines.append("AttributeEnd")


def describe(description: Mapping[str, Any]) -> tuple[str, dict[str, bytes]]:
    """The pbrt text of a description, and the files that it names."""
    known = {"camera", "film", "sampler", "integrator", "textures", "materials", "lights", "shapes"}
    unknown = set(description) - known
    if unknown:
        raise InputError(f"a scene has {', '.join(sorted(known))}, and no {', '.join(map(repr, sorted(unknown)))}")
    w = _Writer()
    camera = description.get("camera", {"type": "perspective"})
    if "look_at" in camera:
        eye, target, up = (*camera["look_at"], (0.0, 1.0, 0.0))[:3]
        w.lines.append("LookAt " + "  ".join(_values("camera", "look_at", v) for v in (eye, target, up)))
    if "to_world" in camera:
        w.lines.append(_matrix(np.linalg.inv(np.asarray(camera["to_world"], dtype=np.float64))))
    w.entity("Camera", _kind("a camera", camera, "perspective"), camera, skip=("look_at", "to_world"))
    film = dict(description.get("film", {}))
    if "size" in film:
        film["xresolution"], film["yresolution"] = film.pop("size")
    w.entity("Film", _kind("a film", film, "rgb"), film)
    for name, absent in (("sampler", "zsobol"), ("integrator", "volpath")):
        if name in description:
            one = description[name]
            w.entity(name.capitalize(), _kind(name, one, absent), one)
    w.lines.append("WorldBegin")
    for name, texture in description.get("textures", {}).items():
        value = texture.get("value", "spectrum")
        head = f'Texture "{_text(name)}" "{value}" "{_text(_kind("a texture", texture, "imagemap"))}"'
        words = [w.parameter(f"texture {name}", n, v) for n, v in texture.items() if n not in ("type", "value")]
        w.lines.append(" ".join([head, *words]))
    for name, material in description.get("materials", {}).items():
        words = [w.parameter(f"material {name}", n, v) for n, v in material.items() if n != "type"]
        kind = _text(_kind(f"material {name}", material))
        w.lines.append(" ".join([f'MakeNamedMaterial "{_text(name)}" "string type" "{kind}"', *words]))
    for light in description.get("lights", []):
        w.lines.append("AttributeBegin")
        if "to_world" in light:
            w.lines.append(_matrix(light["to_world"]))
        w.entity("LightSource", _kind("a light", light), light, skip=("to_world",))
        w.lines.append("AttributeEnd")
    for shape in description.get("shapes", []):
        _shape(w, shape)
    return "\n".join(w.lines) + "\n", w.files


def build(description: Mapping[str, Any], name: str = "<dictionary>") -> Scene:
    """A scene from a dictionary of pbrt's entities and of arrays.

    >>> scene = steradian.build({
    ...     "camera": {"fov": 40, "look_at": [(0, 1, 5), (0, 0, 0)]},
    ...     "film": {"size": (320, 240)},
    ...     "materials": {"red": {"type": "diffuse", "reflectance": [0.8, 0.1, 0.1]}},
    ...     "lights": [{"type": "infinite", "L": [0.4, 0.45, 0.5]}],
    ...     "shapes": [{"vertices": p, "faces": f, "material": "red"}, {"type": "sphere", "emission": 5, "translate": (0, 3, 0)}],
    ... })

    A parameter may carry pbrt's type in its name, as in ``"rgb L"``; without, it is told by the value.
    Errors show the line of the pbrt text that was made, which is ``steradian.describe(...)[0]``.
    """
    text, files = describe(description)
    return loads(text, name, files)


__all__ = ["build", "describe", "mesh_bytes"]
