"""Vertex errors as colours: how far each vertex lies from the reference's, and the legend of the colours.

Errors are in percent of the reference's frame-0 bounding-box diagonal, or in model units where the diagonal is 0. One scale
serves all frames that are drawn together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gvpipe.foundation.arrays import Float64, UInt8
from gvpipe.metrics.pairing import aligned
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import sampled, used_vertices
from gvpipe.rasterizer.colormaps import colormap
from gvpipe.rendering.legend import paint_legend


class ErrorMap:
    """The errors of a sequence against its reference.

    Args:
        reference: the original.
        distorted: as many frames and vertices, the same triangles in any order.
        frames: that are drawn; the scale ends at the largest error in at most 64 of them.
        largest: the scale's end, percent of the diagonal, instead.

    Raises:
        InputError: the two do not belong together; the message names what differs.
    """

    def __init__(
        self, reference: MeshSequence, distorted: MeshSequence, frames: Sequence[int], largest: float | None = None
    ) -> None:
        self._reference, self.sequence = reference, aligned(reference, distorted)
        diagonal = frame_diagonal(reference)
        self._unit, self._unit_name = (diagonal / 100, "% of diagonal") if diagonal > 0 else (1.0, "model units")
        used = used_vertices(self.sequence)  # what no triangle uses cannot be seen
        self.largest = largest or max(float(self.errors(frame)[used].max()) for frame in sampled(frames))

    def errors(self, frame: int) -> Float64:
        """``(V,)`` distances, percent of the diagonal."""
        original, here = (side.read_exact(frame, frame + 1)[0] for side in (self._reference, self.sequence))
        apart = self.sequence.origin - self._reference.origin
        distance: Float64 = np.linalg.norm(here + apart - original, axis=1)
        return distance / self._unit

    def values(self, frame: int) -> Float64:
        """``(V,)`` errors as parts of the scale's end; where there is no error at all, zeros."""
        return self.errors(frame) / (self.largest or 1.0)

    def legend(self, size: tuple[int, int]) -> UInt8:
        """Return a colour bar with its numbers: ``(H, w, 3) uint8``, the left edge of a picture of ``size`` (width, height).

        Raises:
            InputError: the picture is too small for it.
        """
        ticks = {part: f"{self.largest * part:.3g}" for part in (1.0, 0.5, 0.0)}
        return paint_legend(size, ["vertex error,", self._unit_name], ticks, colormap("errors"))
