"""What the samples of the picture look like, one stretch of a row after the other. Kernels only: they import numba."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.rasterizer.fragment_kernels import base_colours, empty_fragments, gather, merge, weigh
from gvpipe.rasterizer.light_kernels import light_materials, light_paint, resolve
from gvpipe.rasterizer.normal_kernels import bump_normals, seen_normals
from gvpipe.rasterizer.scene import NORMAL, ROLES, Fragments, Look, Paint, Scene
from gvpipe.rasterizer.texture_kernels import sample_role
from gvpipe.runtime.compiled import compiled

STRETCH = 512  # pixels of a row that are shaded together: their fragments stay in the processor's cache
N_ROLES = len(ROLES)


@compiled
def shade(triangles: Array, scene: Scene, look: Look | None, paint: Paint, rows: tuple[int, int], picture: Array) -> None:
    """Fill rows from the first of ``rows`` to before the second of ``picture (h, w, 3) uint8``.

    Light is summed linearly over each pixel's samples and coded as sRGB at the end.

    Args:
        triangles: ``(L, H, W) int32`` that samples see, whole numbers of them per pixel and axis.
        look: materials, or None; numba then leaves out all that they need.
    """
    width, samples = picture.shape[1], triangles.shape[1] // picture.shape[0]
    fragments = empty_fragments(STRETCH * samples * samples * triangles.shape[0])
    for y in range(rows[0], rows[1]):
        for left in range(0, width, STRETCH):
            starts = np.empty(min(STRETCH, width - left) + 1, np.int64)
            n = gather(triangles, samples, (left, y), starts, fragments)
            if look is not None and n > 0 and len(look.textures) > 0 and triangles.shape[0] == 1:
                n = merge(starts, fragments)
            if n > 0:
                weigh(scene, fragments, n, look is not None)
                seen_normals(scene, fragments, n)
                if look is None:
                    light_paint(paint, fragments, n)
                else:
                    _light_materials(scene, look, paint, fragments, n)
            resolve(paint, starts, fragments, picture, (left, y))


@compiled
def _light_materials(scene: Scene, look: Look, paint: Paint, fragments: Fragments, n: int) -> None:
    """Fill the light of fragments that have weights and normals."""
    for role in range(N_ROLES):
        if look.roles[role]:
            sample_role(look, role, fragments, n)
            if role == NORMAL:
                bump_normals(scene, look, fragments, n)
    base_colours(look, fragments, n)
    light_materials(look, paint, fragments, n)
