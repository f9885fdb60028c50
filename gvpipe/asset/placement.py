"""Where texture coordinates lie on an image."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.material import Texture
from gvpipe.foundation.arrays import Array, Float64


def from_upper_left(texture: Texture, uv: Array) -> Float64:
    """Coordinates ``(..., 2)`` from the lower left as parts of the image from its upper left, moved as the texture says."""
    given = uv[..., :2].astype(np.float64) * (1, -1) + (0, 1)
    with np.errstate(over="ignore", invalid="ignore"):
        cos, sin = np.cos(texture.rotation), np.sin(texture.rotation)
        u, v = given[..., 0] * texture.tiling[0], given[..., 1] * texture.tiling[1]
        moved: Float64 = np.stack([cos * u + sin * v, cos * v - sin * u], axis=-1) + texture.offset
    return moved
