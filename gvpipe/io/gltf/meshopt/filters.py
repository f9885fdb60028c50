"""Filters of meshopt's compression: what the decoded integers of an element stand for.

Source: as of `gvpipe.io.gltf.meshopt.reading`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gvpipe.foundation.arrays import Array, Floats, UInt8


def _numbers(elements: UInt8, letter: str) -> Array:
    """Elements of 4 or 8 bytes as four integers each; raises `ValueError` for others."""
    if elements.shape[1] not in (4, 8):
        raise ValueError(f"a filter of four numbers cannot have {elements.shape[1]} bytes an element")
    return np.ascontiguousarray(elements).view(f"<{letter}{elements.shape[1] // 4}")


def _rounded(values: Floats) -> Floats:
    """Rounded to integers, halves away from zero."""
    return np.trunc(values + np.copysign(np.float32(0.5), values))


def unit_vectors(elements: UInt8) -> UInt8:
    """Octahedral normals: x, y, what stands for 1, and a fourth number that stays."""
    numbers = _numbers(elements, "i")
    x, y, one = (numbers[:, i].astype(np.float32) for i in range(3))
    z = one - np.abs(x) - np.abs(y)
    fold = np.minimum(z, 0)
    x, y = x + np.where(x >= 0, fold, -fold), y + np.where(y >= 0, fold, -fold)
    length = np.sqrt(x * x + y * y + z * z)
    scale = np.iinfo(numbers.dtype).max / np.where(length > 0, length, 1)
    result = numbers.copy()
    for i, values in enumerate((x, y, z)):
        result[:, i] = _rounded(values * scale).astype(numbers.dtype)
    return result.view(np.uint8)


def quaternions(elements: UInt8) -> UInt8:
    """Unit quaternions without their largest number, whose place is in the low bits of the fourth."""
    if elements.shape[1] != 8:
        raise ValueError(f"a quaternion has 8 bytes, not {elements.shape[1]}")
    numbers = _numbers(elements, "i")
    scale = np.float32(np.sqrt(0.5)) / (numbers[:, 3] | 3).astype(np.float32)
    three = numbers[:, :3].astype(np.float32) * scale[:, None]
    largest = np.sqrt(np.maximum(1 - (three * three).sum(axis=1), 0))
    place = (numbers[:, 3] & 3).astype(np.int64)
    result = np.empty_like(numbers)
    rows = np.arange(len(numbers))
    for i in range(3):
        result[rows, (place + i + 1) & 3] = _rounded(three[:, i] * np.float32(32767)).astype(np.int16)
    result[rows, place] = _rounded(largest * np.float32(32767)).astype(np.int16)
    return result.view(np.uint8)


def floats(elements: UInt8) -> UInt8:
    """float32 from 24 bits of mantissa and 8 bits of exponent, both signed."""
    packed: Array = np.ascontiguousarray(elements).view("<i4")
    with np.errstate(over="ignore"):
        values = np.ldexp(((packed << 8) >> 8).astype(np.float32), packed >> 24)
    return np.asarray(values.astype("<f4").view(np.uint8))


def colors(elements: UInt8) -> UInt8:
    """RGBA from luma, two signed colour differences and alpha, whose highest bit says how many bits there are."""
    numbers = _numbers(elements, "u")
    signed = numbers.view(f"<i{numbers.itemsize}").astype(np.int32)
    luma, alpha = numbers[:, 0].astype(np.int32), numbers[:, 3].astype(np.int32)
    orange, green = signed[:, 1], signed[:, 2]
    full = alpha.copy()
    for shift in (1, 2, 4, 8):
        full |= full >> shift
    alpha = ((alpha << 1) & full) | (alpha & 1)
    largest = np.iinfo(numbers.dtype).max
    scale = largest / np.maximum(full, 1).astype(np.float32)
    four = np.stack([luma + orange - green, luma + green, luma - orange - green, alpha], axis=1)
    scaled = np.floor(four * scale[:, None] + np.float32(0.5))
    return np.clip(scaled, 0, largest).astype(numbers.dtype).view(np.uint8)


FILTERS: dict[str, Callable[[UInt8], UInt8]] = {
    "NONE": lambda elements: elements,
    "OCTAHEDRAL": unit_vectors,
    "QUATERNION": quaternions,
    "EXPONENTIAL": floats,
    "COLOR": colors,
}
