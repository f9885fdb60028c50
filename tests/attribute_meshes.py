"""Meshes for tests of attributes: awkward ones, and what every mesh needs."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from sequences import awkward, grid, patched

from gvpipe.attributes.surface import Surface


def surfaces() -> dict[str, Surface]:
    """Awkward meshes, with their positions where these are finite in float32 squares."""
    found = {}
    for name, sequence in {**awkward(), "patched": patched()}.items():
        found[name] = Surface(sequence.faces, sequence.n_vertices, np.ascontiguousarray(sequence.read(0, 1)[0]), 3)
    points, faces = grid(7)
    hub = np.stack([np.zeros(400), 1 + np.arange(400), 1 + (np.arange(400) + 1) % 400], axis=1).astype(np.int32)
    found["hub"] = Surface(hub, 401)
    found["no positions"] = Surface(faces, len(points))
    found["nothing"] = Surface(np.zeros((0, 3), np.int32), 0)
    found["one vertex, many corners"] = Surface(np.zeros((9, 3), np.int32), 1, np.ones((1, 3), np.float32))
    return found


each_surface = pytest.mark.parametrize("surface", surfaces().values(), ids=surfaces().keys())


def quilt(n: int = 20) -> tuple[Surface, NDArray[np.int64]]:
    """A sheet whose triangles belong to four patches, and the patch of each corner."""
    points, faces = grid(n)
    middle = points[faces].mean(axis=1)
    patch = (middle[:, 0] > 0.5) + 2 * (middle[:, 1] > 1 / 3)
    return Surface(faces, len(points), points.astype(np.float32)), np.repeat(patch, 3)
