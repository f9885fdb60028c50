"""What morph targets add to a mesh's attributes, in the form that takes fewer bytes."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float32
from gvpipe.io.gltf.glb import VERTICES, Glb
from gvpipe.io.gltf.quantizing import steps_of

NORMAL_STEP = 1 / 1024  # of what targets of packed files add to normals


def write_deltas(glb: Glb, deltas: Float32, name: str, step: float) -> int:
    """Add what a target adds ``(n, 3)``, without its zeros if that is smaller, and return the number of its accessor."""
    bounds = name == "POSITION"
    moved = np.flatnonzero(deltas.any(axis=1))
    index_size = 2 if len(deltas) <= 65536 else 4
    if not glb.is_packed and len(moved) * (index_size + 12) < 12 * len(deltas):
        return glb.sparse(deltas[moved], moved, (len(deltas), 3), bounds=bounds)
    filtered = steps_of(deltas, step if bounds else NORMAL_STEP) if glb.is_packed else None
    return glb.array(deltas, VERTICES, bounds=bounds, filtered=filtered)
