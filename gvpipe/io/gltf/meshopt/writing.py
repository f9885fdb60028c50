"""Buffer views in meshopt's compression, as EXT_meshopt_compression has them: version 0 of attributes, version 1 of triangles.

The encoder is our own: there is no package with wheels that has one (`meshoptimizer` on PyPI is sources of an early version).

Source: as of `gvpipe.io.gltf.meshopt.reading`, whose tests and the reference decoder's check it.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Int64, UInt8
from gvpipe.io.gltf.meshopt.reading import ATTRIBUTES_HEADER, LEAST_TAIL, TRIANGLES_HEADER, TRIANGLES_TAIL

OWN_CODES = 14  # pairs that have a code of their own
QUATERNION_BITS = 16  # at most
LEAST_EXPONENT, MOST_EXPONENT = -126, 104  # of steps
MANTISSA = (1 << 23) - 1  # the largest


def encode_attributes(elements: UInt8) -> bytes:
    """A stream of elements ``(n, stride)``, n at least 1, stride a multiple of 4 up to 256."""
    from gvpipe.io.gltf.meshopt.writing_kernels import write_deltas

    count, stride = elements.shape
    steps = np.diff(elements, axis=0, prepend=elements[:1]).view(np.int8)  # from element to element, modulo 256
    deltas = np.ascontiguousarray(((steps << 1) ^ (steps >> 7)).view(np.uint8).T)
    out = np.zeros(stride * (2 * count + 64), np.uint8)
    length = write_deltas(deltas, out)
    tail: bytes = bytes(max(LEAST_TAIL[0] - stride, 0)) + elements[0].tobytes()
    return bytes([ATTRIBUTES_HEADER]) + out[:length].tobytes() + tail


def encode_triangles(corners: Array) -> bytes:
    """A stream of triangles, whose corners ``(3 n,)`` may come back from another one on, in the same winding."""
    from gvpipe.io.gltf.meshopt.writing_kernels import write_triangles

    corners = corners.astype(np.int64)
    codes = np.zeros(len(corners) // 3, np.uint8)
    out = np.zeros(16 * len(codes), np.uint8)
    table = np.zeros(TRIANGLES_TAIL, np.uint8)
    counts = np.zeros(256, np.int64)
    write_triangles(corners, table, codes, out, counts)
    counts[0] = 0  # always the first
    table[1:OWN_CODES] = np.argsort(-counts, kind="stable")[: OWN_CODES - 1]
    length = write_triangles(corners, table, codes, out, counts)
    return bytes([TRIANGLES_HEADER | 1]) + codes.tobytes() + out[:length].tobytes() + table.tobytes()


def pack_floats(values: Array, step: float) -> UInt8:
    """Floats ``(n, C)`` for filter EXPONENTIAL, as elements ``(n, 4 C)``: within a step, which is rounded to a power of two.

    Raises `OverflowError` for values that are too large for it.
    """
    exponent = int(np.clip(np.floor(np.log2(step)), LEAST_EXPONENT, MOST_EXPONENT)) + 1  # rounding errs by half of it
    mantissa = np.rint(np.ldexp(values.astype(np.float64), -exponent))
    if np.abs(mantissa).max(initial=0) > MANTISSA:
        raise OverflowError(f"{np.abs(values).max():g} is too large for steps of {step:g}")
    packed = (mantissa.astype(np.int32) & 0xFFFFFF) | np.int32(exponent << 24)
    return np.ascontiguousarray(packed.astype("<i4")).view(np.uint8)


def pack_quaternions(quaternions: Float64, bits: int = QUATERNION_BITS) -> UInt8:
    """Unit quaternions ``(n, 4)`` for filter QUATERNION, as elements ``(n, 8)`` of so many bits, 4 to 16."""
    rows = np.arange(len(quaternions))
    largest: Int64 = np.abs(quaternions).argmax(axis=1)
    signs = np.where(quaternions[rows, largest] < 0, -1.0, 1.0)
    full = (1 << (bits - 1)) - 1
    result = np.empty((len(rows), 4), "<i2")
    for i in range(3):
        result[:, i] = np.rint(signs * quaternions[rows, (largest + i + 1) & 3] * np.sqrt(2.0) * full)
    result[:, 3] = full & ~3 | largest
    return result.view(np.uint8)


def pack_unit_vectors(vectors: Array, bits: int) -> UInt8:
    """Vectors of length 1 ``(n, 3)`` for filter OCTAHEDRAL, as elements of 4 bytes for up to 8 bits, else 8."""
    vectors = vectors.astype(np.float64)
    sizes = np.abs(vectors).sum(axis=1, keepdims=True)
    x, y, z = (vectors / np.where(sizes > 0, sizes, 1)).T
    folded_x = np.where(z >= 0, x, np.copysign(1 - np.abs(y), x))
    folded_y = np.where(z >= 0, y, np.copysign(1 - np.abs(x), y))
    full = (1 << (bits - 1)) - 1
    result = np.zeros((len(x), 4), "<i1" if bits <= 8 else "<i2")
    result[:, 0], result[:, 1], result[:, 2] = np.rint(folded_x * full), np.rint(folded_y * full), full
    return result.view(np.uint8)
