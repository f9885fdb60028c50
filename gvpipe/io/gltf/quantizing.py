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

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.gltf.attribute_writing import GltfAttribute
from gvpipe.io.gltf.glb import Filtered
from gvpipe.io.gltf.meshopt.writing import MANTISSA, pack_floats, pack_unit_vectors

EXTENSION = "KHR_mesh_quantization"
POSITION_BITS = 16
FULL = (1 << POSITION_BITS) - 1
EXACT = 5e-6  # of the diagonal: what rounding may add where nothing else is off
NORMAL_BITS = 8
UV_STEP = 2.0**-16
LEAST_STEP = 2.0**-120  # finer ones lie below what float32 has in full


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
