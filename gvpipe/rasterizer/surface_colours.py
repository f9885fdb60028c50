"""The base colours of places on a mesh, without light: material, texture and vertex colours, mixed as in pictures of it."""

from __future__ import annotations

import numpy as np

from gvpipe.asset.material import Material
from gvpipe.foundation.arrays import Float64, Int32, UInt8
from gvpipe.rasterizer.colours import LEVELS, srgb_codes
from gvpipe.rasterizer.look import Asset, look_of
from gvpipe.rasterizer.scene import BASE, Fragments

COLOUR = "color"  # name and kind of the attribute


def has_paint(asset: Asset) -> bool:
    """Whether an asset's colours differ from place to place: by pictures, by vertices or by materials."""
    used = used_materials(asset)
    colour = asset.attributes.get(COLOUR)
    has_colours = colour is not None and colour.kind == COLOUR and colour.domain != "part"
    return has_colours or any(each.base_color_texture for each in used) or len({each.base_color for each in used}) > 1


def used_materials(asset: Asset) -> list[Material]:
    """The materials that triangles have, each once."""
    numbers = {part.material for part in asset.parts if part.material is not None and part.triangles[0] < part.triangles[1]}
    return [asset.materials[number] for number in sorted(numbers)]


class SurfaceColours:
    """The base colours of an asset at its first frame.

    Args:
        asset: a `gvpipe.MeshSequence`.

    Attributes:
        notes: on images that could not be decoded, a line each.

    Raises:
        InputError: as `look_of`.
    """

    def __init__(self, asset: Asset) -> None:
        self._look, self.notes, _ = look_of(asset)
        self._codes = srgb_codes()

    def at(self, triangles: Int32, weights: Float64) -> UInt8:
        """sRGB bytes ``(n, 3)`` at places of the mesh.

        Textures are read as they are magnified: between four texels, in linear light.

        Args:
            triangles: ``(n,)`` of the places.
            weights: ``(n, 3)`` barycentric coordinates.
        """
        from gvpipe.rasterizer.fragment_kernels import base_colours
        from gvpipe.rasterizer.texture_kernels import sample_role

        n = len(triangles)
        if not len(self._look.of_triangles):  # neither materials nor colours
            return np.full((n, 3), 255, np.uint8)
        fragments = _fragments(triangles, weights)
        if self._look.roles[BASE]:
            sample_role(self._look, BASE, fragments, n)
        base_colours(self._look, fragments, n)
        levels = np.clip(fragments.colours[:, :3], 0, 1) * (LEVELS - 1) + 0.5
        return np.asarray(self._codes[levels.astype(np.int32)])


def _fragments(triangles: Int32, weights: Float64) -> Fragments:
    """Places without size; what light needs is left out."""
    n = len(triangles)
    none, spread = np.zeros(0, np.int64), np.zeros((n, 3, 3))
    spread[:, 0] = weights
    return Fragments(
        triangles=np.ascontiguousarray(triangles, np.int32),
        places=np.zeros((0, 2), np.int64),
        widths=none,
        counts=none,
        is_last=np.zeros(0, np.bool_),
        weights=spread,
        outside=np.zeros(0, np.bool_),
        normals=np.zeros((0, 3)),
        colours=np.empty((n, 4)),
        light=np.zeros((0, 3)),
        textures=np.empty(n, np.int32),
        uv=np.empty((n, 3, 2)),
        samples=np.ones((1, n, 4)),
    )
