"""Pictures and materials on squares, to be painted."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from PIL import Image as Pillow
from shapes import SQUARE, sheet

from gvpipe.asset.material import Image, Material
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence

UV = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)  # of a sheet's corners, (0, 0) at the lower left


def image_of(pixels: Any, name: str = "picture", format: str = "PNG") -> Image:
    file = io.BytesIO()
    Pillow.fromarray(np.asarray(pixels, np.uint8)).save(file, format)
    return Image(name, f"image/{format.lower()}", file.getvalue())


def checkers(n: int, cells: int = 2) -> np.ndarray:
    """A black and white board of n pixels a side."""
    place = np.arange(n) * cells // n
    return np.repeat(255 * ((place[:, None] + place) % 2)[:, :, None], 3, axis=2)


def sheets(depths: list[float], materials: list[Material], **changes: Any) -> MeshSequence:
    """Squares one behind the other, a material each."""
    positions = np.concatenate([sheet(z, 0.0) for z in depths])
    faces = np.concatenate([SQUARE + 4 * i for i in range(len(depths))])
    parts = tuple(Part(f"sheet {i}", (4 * i, 4 * i + 4), (2 * i, 2 * i + 2), i) for i in range(len(depths)))
    return MeshSequence(positions[None], faces, parts=parts, materials=tuple(materials), **changes)
