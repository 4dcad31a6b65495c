"""The scenes, one file each."""

from __future__ import annotations

from typing import Callable

from ..model import Scene
from . import cornell, fog, interior, many_lights, meshes, plates, textured

# In the order of the tables. Built only when asked for: some are large.
SCENES: dict[str, Callable[[], Scene]] = {
    "cornell": cornell.build,
    "plates": plates.build,
    "interior": interior.build,
    "many-lights": many_lights.build,
    "mesh-1m": meshes.build_1m,
    "mesh-8m": meshes.build_8m,
    "textured": textured.build,
    "fog": fog.build,
}
