"""Which texels of an image the triangles show."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gvpipe.asset.material import Texture
from gvpipe.asset.placement import from_upper_left
from gvpipe.foundation.arrays import Array, Bool, Float64
from gvpipe.model.sequence import MeshSequence

PER_TEXEL = 1.5  # points that are looked at along a texel
INWARD = 1e-3  # that they are moved to the middle of their triangle: an edge between two texels shows those inside alone
MOST_POINTS = 1 << 20  # at a time
LARGEST = 4  # images that a triangle may span; where one spans more, all texels are shown


def used_texels(sequence: MeshSequence, number: int, size: tuple[int, int]) -> Bool:
    """Return which texels of an image the triangles touch, ``(height, width)``, rows from the top.

    Points of each triangle are looked at, `PER_TEXEL` along its longest side.

    Args:
        sequence: with the image's materials and their coordinates.
        number: of the image.
        size: of the image: width and height, pixels.
    """
    width, height = size
    used = np.zeros((height, width), np.bool_)
    for texture, corners in _shown(sequence, number):
        placed = from_upper_left(texture, corners) * size  # (T, 3, 2), texels
        placed = placed[np.isfinite(placed).all(axis=(1, 2))]
        longest = np.linalg.norm(placed - np.roll(placed, 1, axis=1), axis=2).max(axis=1, initial=0)
        if longest.max(initial=0) > LARGEST * max(size):
            used[:] = True
            return used
        steps = 1 << np.ceil(np.log2(np.maximum(PER_TEXEL * longest, 1))).astype(np.int64)
        for n in np.unique(steps).tolist():
            weights = _grid(n)
            chosen = placed[steps == n]
            block = max(1, MOST_POINTS // len(weights))
            for start in range(0, len(chosen), block):
                points = np.einsum("pc,tcx->tpx", weights, chosen[start : start + block])
                x, y = (_wrapped(points[..., axis], size[axis], texture.wrap[axis]) for axis in (0, 1))
                used[y, x] = True
    return used


def _shown(sequence: MeshSequence, number: int) -> Iterator[tuple[Texture, Array]]:
    """Textures that show an image, each with the coordinates of corners ``(T, 3, 2)`` that it has."""
    for part in sequence.parts:
        if part.material is None:
            continue
        faces = slice(*part.triangles)
        for texture in sequence.materials[part.material].textures.values():
            attribute = sequence.attributes.get(texture.uv)
            if texture.image != number or attribute is None or attribute.shape[1] < 2:
                continue
            values = np.asarray(attribute)[:, :2]
            if attribute.domain == "vertex":
                yield texture, values[sequence.faces[faces]]
            elif attribute.domain == "corner":
                yield texture, values.reshape(-1, 3, 2)[faces]


def _grid(n: int) -> Float64:
    """Weights of the corners ``(P, 3)`` of points in a triangle, n + 1 along each side."""
    i, j = np.nonzero(np.add.outer(np.arange(n + 1), np.arange(n + 1)) <= n)
    return (1 - INWARD) / n * np.stack([i, j, n - i - j], axis=1) + INWARD / 3


def _wrapped(texels: Float64, n: int, wrap: str) -> Array:
    """Rows or columns of points, as a texture goes on beyond its image."""
    index = np.floor(texels).astype(np.int64)
    if wrap == "clamp":
        return np.clip(index, 0, n - 1)
    if wrap == "repeat":
        return index % n
    index %= 2 * n
    return np.minimum(index, 2 * n - 1 - index)
