"""The layout of a plane: which pixel carries which slot."""

from __future__ import annotations

from dataclasses import dataclass

from gvpipe.foundation.arrays import Int64


@dataclass(frozen=True)
class Layout:
    """Where each slot sits in a plane of ``height x width`` pixels.

    Args:
        width, height: of one plane, pixels, multiples of the block size.
        pixel: ``(S,)`` row-major index of each slot's pixel, all distinct.
    """

    width: int
    height: int
    pixel: Int64
