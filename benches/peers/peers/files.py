"""The few file formats that everybody reads: binary PLY, PFM, PNG."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .model import Floats, Mesh


def write_ply(path: Path, mesh: Mesh) -> None:
    """Little-endian PLY with x y z, u v where there are any, and triangles."""
    names = ["x", "y", "z"] + (["u", "v"] if mesh.uv is not None else [])
    columns = mesh.points if mesh.uv is None else np.concatenate([mesh.points, mesh.uv], axis=1)
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(columns)}"]
    header += [f"property float {name}" for name in names]
    header += [f"element face {len(mesh.faces)}", "property list uchar int vertex_indices", "end_header", ""]
    faces = np.empty(len(mesh.faces), np.dtype([("n", "u1"), ("i", "<i4", 3)]))
    faces["n"] = 3
    faces["i"] = mesh.faces
    with path.open("wb") as file:
        file.write("\n".join(header).encode())
        file.write(columns.astype("<f4").tobytes())
        file.write(faces.tobytes())


def write_pfm(path: Path, image: Floats) -> None:
    """A colour PFM, (height, width, 3), first row on top."""
    height, width, _ = image.shape
    path.write_bytes(f"PF\n{width} {height}\n-1.0\n".encode() + image[::-1].astype("<f4").tobytes())


def read_pfm(path: Path) -> Floats:
    """A colour PFM as (height, width, 3), first row on top."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    if kind != b"PF":
        raise ValueError(f"{path.name} is no colour PFM")
    width, height = map(int, size.split())
    order = "<f4" if float(scale) < 0 else ">f4"
    return np.frombuffer(data, order, width * height * 3).reshape(height, width, 3)[::-1].astype(np.float32)


def write_png(path: Path, pixels: npt.NDArray[np.uint8]) -> None:
    """An 8-bit RGB PNG, (height, width, 3)."""
    height, width, _ = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)) + chunk(b"IEND", b""))
