"""What stands for the video of a file without pictures: one pixel of zero residuals, which all slots share."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gvcodecs.mcgv.motion.blended import CHUNK
from gvcodecs.mcgv.motion.contract import locate
from gvpipe.media.video import Plane


class NoPictures:
    """Reads as a `gvpipe.media.video.VideoReader` does; a group of pictures is what shares a chunk of transforms.

    Args:
        bounds: first frame of every segment, and F.
        zero: the sample of a zero residual.
    """

    def __init__(self, bounds: list[int], zero: int) -> None:
        self._bounds = bounds
        self._plane: Plane = np.full((3, 1), zero, np.uint8)

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return self._bounds[-1]

    def group(self, frame: int) -> tuple[int, int]:
        """``(start, stop)`` of the frames whose transforms are made together with those of a frame."""
        s = locate(self._bounds, frame)
        start = frame - (frame - self._bounds[s]) % CHUNK
        return start, min(start + CHUNK, self._bounds[s + 1])

    def close(self) -> None:
        """There is nothing to let go of."""

    def read(self, start: int, stop: int) -> Iterator[tuple[int, list[Plane]]]:
        """Yield the frames ``start`` to ``stop`` at once: the first, and for each ``(3, 1)`` samples."""
        yield start, [self._plane] * (stop - start)
