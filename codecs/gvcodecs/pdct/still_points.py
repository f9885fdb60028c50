"""Points that never move: the base frame has nearly their position, and a few bits refine it, once for all clips.

A clip codes neither cluster nor deltas of them, and the file's reader puts them where this section says::

    section = [float64] step, [varint] bytes, flags (`gvpipe.trajectory.still_vertices`) along the traversal, [integers]
              position less the base's, in steps: x of all still points along the traversal, then y, then z
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gvcodecs.pdct.dictionary import BaseFrame
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.segments import LARGEST_STEP, SMALLEST_STEP
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Bool, Float32
from gvpipe.trajectory.still_vertices import decode_flags, encode_flags

SECTION = "still"
HEAD = struct.Struct("<d")


@dataclass(frozen=True)
class StillPoints:
    """Args:
    points: ``(S,)``, in the order of the traversal.
    positions: ``(S, 3) float32``, model units.
    """

    points: NDArray[np.intp]
    positions: Float32


def encode_still(still: Bool, frame: Float32, surface: BaseFrame, step: float) -> bytes:
    """Code the points that ``still (P,)`` flags, in the order of points that ``surface`` has.

    Args:
        still: one at least is set.
        frame: ``(P, 3)`` any frame, model units.
        surface: with all points in its traversal.
        step: what differences from the base frame are rounded to, model units.
    """
    points = surface.traversal[still[surface.traversal]]
    step = float(np.clip(step, SMALLEST_STEP, LARGEST_STEP))
    off = np.rint((frame[points].astype(np.float64) - surface.base[points]) / step).astype(np.int64)
    flags = encode_flags(still[surface.traversal])
    return HEAD.pack(step) + pack_block(flags) + encode_integers(off.T)


def decode_still(data: bytes, surface: BaseFrame) -> StillPoints:
    """Mirror of `encode_still`; raises `CorruptFile` if the bytes are not what it writes."""
    cursor = Cursor(data, SECTION)
    (step,) = cursor.struct(HEAD)
    if not SMALLEST_STEP <= step <= LARGEST_STEP:  # NaN neither
        raise cursor.corrupt(f"its step is {step}")
    flags = decode_flags(cursor.block(), len(surface.traversal), SECTION)
    points = surface.traversal[flags]
    off = decode_integers(cursor.rest(), 3 * len(points), name=SECTION).reshape(3, -1).T
    with np.errstate(over="ignore"):
        positions = (surface.base[points] + step * off).astype(np.float32)
    if not np.isfinite(positions).all():
        raise cursor.corrupt("a position is larger than float32 can hold")
    return StillPoints(points, positions)
