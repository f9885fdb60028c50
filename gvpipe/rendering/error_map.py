"""Vertex errors as colours: how far each vertex lies from the reference's, and the legend of the colours.

Errors are in percent of the reference's frame-0 bounding-box diagonal, or in model units where the diagonal is 0. One scale
serves all frames that are drawn together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gvpipe.arrays import Float64, UInt8
from gvpipe.errors import InputError
from gvpipe.metrics.comparison import aligned
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.rasterizer.camera import sampled, used_vertices
from gvpipe.rasterizer.colours import BACKGROUND, error_colours
from gvpipe.sequence import MeshSequence

SMALLEST = (160, 120)  # pixels, of a picture with a legend
INK = (60, 60, 60)


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
        from PIL import Image, ImageDraw, ImageFont

        width, height = size
        if width < SMALLEST[0] or height < SMALLEST[1]:
            raise InputError(f"a picture of {width}x{height}; with a legend, {SMALLEST[0]}x{SMALLEST[1]} pixels are the least")
        text = max(9, min(height // 28, width // 38))  # pixels
        font = ImageFont.load_default(text)
        bar = 8 * text  # pixels, its length
        top = height - 2 * text - bar
        labels = {part: f"{self.largest * part:.3g}" for part in (1.0, 0.5, 0.0)}
        titles = ["vertex error,", self._unit_name]
        columns = (
            round(max(max(map(font.getlength, titles)), 1.6 * text + max(map(font.getlength, labels.values())))) + 2 * text
        )
        image = Image.new("RGB", (columns, height), tuple(round(255 * channel) for channel in BACKGROUND))
        draw = ImageDraw.Draw(image)
        for line, title in enumerate(titles):
            draw.text((text, top + (1.3 * line - 3.4) * text), title, fill=INK, font=font)
        for row, colour in enumerate(np.rint(255 * error_colours(np.linspace(1, 0, bar))).astype(int).tolist()):
            draw.line([(text, top + row), (2 * text - 1, top + row)], fill=tuple(colour))
        for part, label in labels.items():
            draw.text((2.6 * text, top + (1 - part) * (bar - 1)), label, fill=INK, font=font, anchor="lm")
        return np.asarray(image)
