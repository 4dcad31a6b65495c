"""What a scene is, before any renderer has heard of it.

Right-handed world, y up, lengths without a unit. Colours are linear sRGB. Emission is radiance and leaves a triangle on the side from
which its corners run counter-clockwise; scenes are built so that nothing ever sees the other side, because renderers disagree there.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Callable

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float32]
Indices = npt.NDArray[np.uint32]
Rgb = tuple[float, float, float]

BLACK: Rgb = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Texture:
    """A picture in 8-bit sRGB, (height, width, 3), first row on top; v = 0 is its lower edge."""

    name: str
    pixels: npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Diffuse:
    """Lambert's model."""

    reflectance: Rgb | Texture


@dataclass(frozen=True)
class Conductor:
    """Fresnel's equations for n = 1 and k from the reflectance at normal incidence; GGX of width `alpha`, 0 for a mirror."""

    reflectance: Rgb
    alpha: float

    def extinction(self) -> Rgb:
        """k with which n = 1 reflects `reflectance` straight back."""
        k = [2.0 * np.sqrt(r) / np.sqrt(1.0 - r) for r in self.reflectance]
        return (float(k[0]), float(k[1]), float(k[2]))


@dataclass(frozen=True)
class Dielectric:
    """Glass; GGX of width `alpha`, 0 for smooth. Closed meshes only."""

    ior: float
    alpha: float


@dataclass(frozen=True)
class Fog:
    """The inside of a closed mesh that is itself invisible: homogeneous, Henyey and Greenstein's phase function."""

    sigma_a: Rgb
    sigma_s: Rgb
    g: float


Material = Diffuse | Conductor | Dielectric | Fog


@dataclass(frozen=True)
class Mesh:
    """Flat triangles. `points` (n, 3), `faces` (m, 3), `uv` (n, 2). An emitting mesh reflects nothing."""

    name: str
    points: Floats
    faces: Indices
    material: Material = Diffuse(BLACK)
    emission: Rgb | None = None
    uv: Floats | None = None


@dataclass(frozen=True)
class Camera:
    """A pinhole; `fov` in degrees across the shorter side of the picture."""

    eye: Rgb
    target: Rgb
    fov: float
    width: int
    height: int


@dataclass(frozen=True)
class Scene:
    """One scene. `depth` counts scattering events: 1 is direct light. `spp` are the two counts that are timed."""

    name: str
    sentence: str
    camera: Camera
    meshes: list[Mesh]
    depth: int
    spp: tuple[int, int]
    # Radiance from each of n directions: (n, 3) to (n, 3).
    sky: Callable[[Floats], Floats] | None = None
    # Why a difference from Steradian's picture is no error, by renderer.
    remarks: dict[str, str] = field(default_factory=dict)

    def triangles(self) -> int:
        """How many triangles there are."""
        return sum(len(mesh.faces) for mesh in self.meshes)

    def has_fog(self) -> bool:
        """Whether any mesh bounds a medium."""
        return any(isinstance(mesh.material, Fog) for mesh in self.meshes)
