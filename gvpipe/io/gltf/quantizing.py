"""Attributes of packed files in fewer bits: KHR_mesh_quantization, and what meshopt's filters take.

=======================  ==================================================  =========================
attribute                as                                                  off by
=======================  ==================================================  =========================
positions of skeletons   16 bits of the largest extent, where that will do   1 / 131,070 of it, an axis
other positions          floats in steps                                     5e-6 of the diagonal
normals, tangents        8 bits of octahedral coordinates                    about a degree
texture coordinates      16 bits, in 0..1; up to 128 floats in steps         1 / 131,070; 1 / 65,536
others                   what they are                                       nothing
=======================  ==================================================  =========================

Source: Khronos, KHR_mesh_quantization; EXT_meshopt_compression, appendix B (filters).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Array, Float32, Float64, UInt16
from gvpipe.io.gltf.attribute_writing import GltfAttribute
from gvpipe.io.gltf.glb import Filtered
from gvpipe.io.gltf.meshopt.writing import MANTISSA, pack_floats, pack_unit_vectors

EXTENSION = "KHR_mesh_quantization"
FULL = 65535
NORMAL_BITS = 8
UV_STEP = 2.0**-16
LEAST_STEP = 2.0**-120  # finer ones lie below what float32 has in full


class Lattice(NamedTuple):
    """Integers of 16 bits for positions: ``low + step * integer``.

    Args:
        low: ``(3,)`` the smallest position of each axis.
        step: the same for all axes, more than 0.
    """

    low: Float64
    step: float

    @classmethod
    def around(cls, points: Array) -> Lattice:
        """The finest one that holds ``points (n, 3)``."""
        low = points.min(axis=0).astype(np.float64)
        return cls(low, float((points.max(axis=0) - low).max()) / FULL or 1.0)

    def integers(self, points: Array) -> UInt16:
        """The nearest integers to ``points (n, 3)``."""
        return np.rint((points - self.low) / self.step).astype(np.uint16)

    def positions(self, points: Array) -> Float32:
        """The positions ``(n, 3)`` that stand for ``points (n, 3)``."""
        return (self.low + self.step * self.integers(points)).astype(np.float32)

    def matrix(self) -> Float64:
        """``(4, 4)`` that takes integers to positions."""
        result = np.diag([self.step, self.step, self.step, 1.0])
        result[:3, 3] = self.low
        return result


def steps_of(values: Array, step: float) -> Filtered | None:
    """Floats ``(n, C)`` within a step, for packed files; None where they are too large for it, and stay what they are."""
    is_held = step >= LEAST_STEP and np.abs(values).max(initial=0) < step * MANTISSA
    return Filtered(pack_floats(values, step), "EXPONENTIAL") if is_held else None


def quantized(one: GltfAttribute) -> GltfAttribute:
    """An attribute as packed files have it."""
    kind = one.name.partition("_")[0]
    if one.values.dtype.kind != "f" or not len(one.values):
        return one
    if kind in ("NORMAL", "TANGENT"):
        elements = pack_unit_vectors(one.values[:, :3], NORMAL_BITS)
        if kind == "TANGENT":
            elements[:, 3] = np.where(one.values[:, 3] < 0, -127, 127).astype(np.int8).view(np.uint8)
        return replace(
            one, values=np.rint(127 * one.values).astype(np.int8), normalized=True, filtered=Filtered(elements, "OCTAHEDRAL")
        )
    if kind == "TEXCOORD" and one.values.min() >= 0 and one.values.max() <= 1:
        return replace(one, values=np.rint(FULL * one.values.astype(np.float64)).astype(np.uint16), normalized=True)
    return replace(one, filtered=steps_of(one.values, UV_STEP)) if kind == "TEXCOORD" else one


def needs_extension(one: GltfAttribute) -> bool:
    """Whether the specification alone does not allow an attribute's type: normals and tangents are floats there."""
    return one.name in ("NORMAL", "TANGENT") and one.values.dtype.kind != "f"
