"""Steradian: a physically based Monte Carlo renderer.

>>> import numpy as np, steradian
>>> scene = steradian.load("kitchen.pbrt")
>>> scene["camera.fov"] = 30
>>> image = steradian.render(scene, spp=64, aovs=["albedo", "normal"])
>>> np.asarray(image).mean(axis=(0, 1)), image["albedo"].shape
>>> image.write("kitchen.exr")
"""

from __future__ import annotations

from types import ModuleType

from . import sampling
from ._build import build, describe
from ._image import Image, compare, read, tonemap, write
from ._scene import Scene, load, loads, render, render_progressive
from ._steradian import __version__, run
from .errors import Diagnostic, InputError, MachineError, SceneError, SteradianError

__all__ = [
    "Diagnostic",
    "Image",
    "InputError",
    "MachineError",
    "Scene",
    "SceneError",
    "SteradianError",
    "__version__",
    "build",
    "compare",
    "describe",
    "distributed",
    "load",
    "loads",
    "read",
    "render",
    "render_progressive",
    "run",
    "sampling",
    "tonemap",
    "write",
]


def __getattr__(name: str) -> ModuleType:
    if name == "distributed":
        import importlib

        return importlib.import_module(".distributed", __name__)
    raise AttributeError(f"module 'steradian' has no attribute {name!r}")
