"""Fields in the coding that the web player reads: quantised, predicted from the frames before, deflated in groups of frames.

What: one section per field. Values become levels, ``value = low + step (level - 1)``; level 0 is a hole (NaN). Why: the player
needs any frame at once, in little JavaScript, and shows colours: about 512 of them are enough::

    section = [u32] frames of a group, [f64] low, [f64] step, [f64] largest magnitude, group count x [u32] bytes, groups
    group   = [u8] order + 3 x rows, zlib stream of all low bytes of the folded residuals, then of all high bytes

The residual of a level is its difference from a prediction modulo 2^16, folded (0, -1, 1, -2, ...) to 0, 1, 2, 3, ...:

- order 0 predicts 0, order 1 the frame before, order 2 the line through the two frames before; the first frame of a group
  is predicted by 0, its second by the first if the order is not 0;
- where ``rows`` is 1, and in frames predicted by 0, what is left is predicted by what is left of the *parent*: of a vertex its
  last neighbour before it, of triangles and of vertices without one the row before; the first row has none.
"""

from __future__ import annotations

import itertools
import math
import struct
import zlib
from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Array, Float32, Int32, Int64
from gvpipe.asset.field import Field
from gvpipe.asset_coding.directory import WEB
from gvpipe.errors import InputError

CODING = WEB  # of these fields in section `asset`
COLOURS = 1023  # halves of it are the least number of levels that a range gets, but for fields with a coarser bound
MAX_GROUP = 32  # frames
GROUP_VALUES = 1 << 21  # at most in a group, unless one frame has more: what the player unpacks at a time
MAX_LEVEL = 65535
HEAD = struct.Struct("<Iddd")
ORDERS = 3
MAX_VALUES = 1 << 26  # of a frame
PASS_VALUES = 1 << 22  # read at a time to find the range
FAST, SMALL = 1, 9  # levels of zlib


@dataclass(frozen=True)
class WebField:
    """A field as the web player reads it.

    Args:
        data: the section.
        bound: largest difference of a value from the source's; 0: none.
        range: smallest and largest value; None if all are holes.
    """

    data: bytes
    bound: float
    range: tuple[float, float] | None


@dataclass(frozen=True)
class Lattice:
    """Levels of values: ``low + step (level - 1)``."""

    low: float
    step: float

    def levels(self, values: Array) -> Array:
        """``(...) int64`` 0 for holes."""
        wide = values.astype(np.float64)
        holes = ~np.isfinite(wide)
        wide[holes] = self.low
        return np.where(holes, 0, 1 + np.rint((wide - self.low) / self.step).astype(np.int64))

    def values(self, levels: Array) -> Float32:
        """The values of levels, NaN for holes: what the player shows."""
        values = self.low + self.step * (levels.astype(np.float64) - 1)
        return np.where(levels == 0, np.nan, values).astype(np.float32)


def encode_web_field(field: Field, faces: Int32, bound: float = 0.0) -> WebField:
    """Code a field for the web player.

    Args:
        field: read twice, some frames at a time.
        faces: ``(T, 3)`` of the mesh, over the field's vertices.
        bound: that the field itself keeps; the coding's is that or 1/1023 of the range, whichever is larger. Integers of at
            most 65535 levels are exact.

    Raises:
        InputError: a frame has too many values for a browser.
    """
    n_frames, n_values = len(field), field.shape[1] * field.n_components
    if n_values > MAX_VALUES:
        raise InputError(f"{field.name} has {n_values} values a frame; the web player shows up to {MAX_VALUES}")
    low, high, largest = find_range(field)
    lattice, kept = choose_lattice(low, high, bound, field.dtype.kind in "iu")
    size = max(1, min(MAX_GROUP, n_frames, GROUP_VALUES // n_values))
    parents = find_parents(field.shape[1], faces if field.domain == "vertex" else faces[:0])
    groups = [
        encode_group(lattice.levels(field.read(start, min(start + size, n_frames))), parents)
        for start in range(0, n_frames, size)
    ]
    head = HEAD.pack(size, lattice.low, lattice.step, largest) + np.array([len(group) for group in groups], "<u4").tobytes()
    return WebField(head + b"".join(groups), kept, (low, high) if low <= high else None)


def find_range(field: Field) -> tuple[float, float, float]:
    """The smallest and the largest finite value, and the largest length of a row; ``(inf, -inf, 0)`` of holes alone."""
    low, high, largest = math.inf, -math.inf, 0.0
    count = max(1, PASS_VALUES // (field.shape[1] * field.n_components))
    for start in range(0, len(field), count):
        block = field.read(start, min(start + count, len(field))).astype(np.float64)
        finite = np.isfinite(block)
        low = min(low, float(block.min(where=finite, initial=math.inf)))
        high = max(high, float(block.max(where=finite, initial=-math.inf)))
        lengths = np.linalg.norm(np.where(finite, block, 0.0), axis=2)
        largest = max(largest, float(lengths.max(initial=0.0)))
    return low, high, largest


def choose_lattice(low: float, high: float, bound: float, is_integer: bool) -> tuple[Lattice, float]:
    """Levels for values in a range, and the bound that they keep."""
    if low >= high:
        return Lattice(low if low == high else 0.0, 1.0), 0.0
    if is_integer and high - low < MAX_LEVEL:
        return Lattice(low, 1.0), 0.0
    kept = max(bound, (high - low) / COLOURS)
    rounding = float(np.spacing(np.float32(max(abs(low), abs(high)))))  # to float32, at most half of it; and in float64
    if rounding < kept / 2:
        return Lattice(low, 2 * (kept - rounding)), kept
    return Lattice(low, 2 * kept), kept + rounding


def find_parents(n_rows: int, faces: Int32) -> Int64:
    """``(R,)`` the row that predicts each row: its last neighbour before it, without one the row before; -1 for row 0.

    Examples:
        >>> find_parents(5, np.array([[0, 4, 1]], np.int32)).tolist()
        [-1, 0, 1, 2, 1]
    """
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    ends = ends[ends[:, 0] != ends[:, 1]]
    parents = np.full(n_rows, -1, np.int64)
    np.maximum.at(parents, ends.max(axis=1), ends.min(axis=1))
    return np.where(parents < 0, np.arange(n_rows) - 1, parents)


def encode_group(levels: Array, parents: Int64) -> bytes:
    """Code ``(n, R, C)`` levels, by the prediction that deflates them best."""
    choices = itertools.product(range(ORDERS if len(levels) > 1 else 1), (0, 1))
    planes = {(order, rows): _planes(_residuals(levels, parents, order, rows)) for order, rows in choices}
    order, rows = min(planes, key=lambda key: len(zlib.compress(planes[key], FAST)))
    return bytes([order + ORDERS * rows]) + zlib.compress(planes[order, rows], SMALL)


def _residuals(levels: Array, parents: Int64, order: int, rows: int) -> Array:
    """What is left of levels ``(n, R, C)``, modulo 2^16 as integers of -2^15..2^15 - 1."""
    left = levels.copy()
    if order:
        left[1:] -= levels[:-1]
    if order == 2:
        left[2:] -= levels[1:-1] - levels[:-2]
    first = len(left) if rows or order == 0 else 1  # frames whose rows predict each other
    left[:first, 1:] -= left[:first, parents[1:]]
    return ((left + 32768) & 65535) - 32768


def _planes(residuals: Array) -> bytes:
    folded = np.where(residuals < 0, -2 * residuals - 1, 2 * residuals).astype(np.uint16).ravel()
    return (folded & 255).astype(np.uint8).tobytes() + (folded >> 8).astype(np.uint8).tobytes()
