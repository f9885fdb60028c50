"""What encoder and reader know of a prediction, whichever it is: `affine_motion` or `blended_motion`."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from gvpipe.sequence import Float32

PREDICTIONS = ("blended", "affine")


@dataclass(frozen=True)
class CodedMotion:
    """A prediction as it is coded.

    Args:
        n_clusters: K.
        step: quantisation step of the transforms, model units.
        sections: of the bitstream.
        predict: ``(n, V, 3)`` positions, model units, of the frames from a first up to another one of the same segment, as the
            decoder predicts them.
    """

    n_clusters: int
    step: float
    sections: dict[str, bytes]
    predict: Callable[[int, int], NDArray[np.float64]]


class Motion(Protocol):
    """A prediction as it is decoded; keeps the transforms of the last segment for the next frame."""

    def rebuild(self, frame: int, samples: NDArray[Any], positions: Float32) -> None:
        """Fill ``positions (V, 3)`` of a frame from its ``samples (3, height * width)``; raises `CorruptFile`."""
        ...


def locate(bounds: list[int], frame: int) -> int:
    """The segment that holds a frame."""
    return bisect_right(bounds, frame) - 1
