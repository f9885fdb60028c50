"""What encoder and reader see of a prediction, whichever it is: `affine` or `blended`."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Protocol

import numpy as np

from gvcodecs.mcgv.base.surface import DecodedBase
from gvcodecs.mcgv.layout.layout import Layout
from gvpipe.foundation.arrays import Array, Float32, Float64, Int64
from gvpipe.model.sequence import MeshSequence
from gvpipe.runtime.ahead import AHEAD

Fill = Callable[[Float32], None]
PREDICTED = 1 << 18  # vertices of all frames that are predicted at once: more are of no use, and take 100 bytes each


@dataclass(frozen=True)
class CodedMotion:
    """A prediction as it is coded.

    Args:
        n_clusters: K.
        step: quantisation step of the transforms, model units.
        sections: of the bitstream.
        predict: returns ``(n, S, 3)`` positions, model units, of the frames from a first up to another one of the same
            segment, as the decoder predicts them.
    """

    n_clusters: int
    step: float
    sections: dict[str, bytes]
    predict: Callable[[int, int], Float64]


def predicted_chunks(
    sequence: MeshSequence, bounds: list[int], predict: Callable[[int, int], Float64]
) -> Iterator[tuple[int, Float32, Float64]]:
    """Yield a first frame, frames ``(n, V, 3)`` from there on, and their prediction ``(n, S, 3)``: few of large ones.

    Args:
        sequence: whose frames are read.
        bounds: first frame of every segment, and F.
        predict: as of `CodedMotion`.
    """
    n = max(1, PREDICTED // sequence.n_vertices)
    for begin, end in pairwise(bounds):
        for first, block in sequence.chunks(begin, end):
            for k in range(0, len(block), n):
                part = block[k : k + n]
                yield first + k, part, predict(first + k, first + k + len(part))


class Motion(Protocol):
    """A prediction as it is decoded; keeps the transforms of the last segment for the next frame."""

    def rebuild(self, first: int, pictures: Sequence[Array]) -> list[Fill]:
        """Return what together fills what moves of n frames, each on any thread.

        Args:
            first: the first frame; the transforms of all are decoded at once; raises `CorruptFile`.
            pictures: n times ``(3 height, line)`` samples, frame after frame.
        """
        ...


def shared_out(fills: Sequence[Fill]) -> list[Fill]:
    """What fills frames ``positions (V, 3)`` one by one, as what fills ``positions (n, V, 3)``, in so many parts as threads."""

    def fill_every(k: int, positions: Float32) -> None:
        for fill, frame in zip(fills[k::AHEAD], positions[k::AHEAD], strict=True):
            fill(frame)

    return [partial(fill_every, k) for k in range(min(AHEAD, len(fills)))]


class Samples:
    """Where the vertices' samples are in a picture.

    Args:
        surface: whose vertices.
        layout: the sample points' pixels.

    Attributes:
        surface: as given.
        vertices, slots: ``(M,)`` the vertices that move, and their sample points, in the order of their pixels: going through
            a picture from one end to the other takes half the time.
    """

    def __init__(self, surface: DecodedBase, layout: Layout) -> None:
        self.surface = surface
        pixel, self._width = layout.pixel[surface.slot], layout.width
        if layout.width * layout.height > 1:
            order: Int64 = np.sort(pixel << 32 | np.arange(len(pixel))) & 0xFFFFFFFF  # by pixel, then number, as argsort sorts
            self.vertices, self.slots, self._pixel = surface.vertices[order], surface.slot[order], pixel[order]
        else:  # no pictures
            self.vertices, self.slots, self._pixel = surface.vertices, surface.slot, pixel
        self._line, self._pixels = 0, self._pixel

    def pixels(self, line: int) -> Int64:
        """``(M,)`` where they are in a plane whose lines take ``line`` samples, the plane's width or more."""
        if line != self._line:
            row, column = np.divmod(self._pixel, self._width)
            self._line, self._pixels = line, row * line + column
        return self._pixels


def locate(bounds: list[int], frame: int) -> int:
    """The segment that holds a frame."""
    return bisect_right(bounds, frame) - 1
