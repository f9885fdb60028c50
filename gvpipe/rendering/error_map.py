"""Vertex errors as colours: how far each vertex lies from the reference's, and the legend that tells what a colour means.

Errors are in percent of the reference's frame-0 bounding-box diagonal, as ``rmse_diag`` and ``max_diag`` of `gvpipe.metrics`
are in parts of it (model units where the diagonal is 0). One scale serves all frames that are drawn together.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gvpipe.metrics import aligned
from gvpipe.rendering.camera import sampled, used_vertices
from gvpipe.rendering.colours import BACKGROUND, error_colours
from gvpipe.sequence import MeshSequence

Picture = NDArray[np.uint8]


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
        diagonal = float(np.linalg.norm(np.ptp(reference.read(0, 1)[0].astype(np.float64), axis=0)))
        self._unit, self._unit_name = (diagonal / 100, "% of diagonal") if diagonal > 0 else (1.0, "model units")
        used = used_vertices(self.sequence)  # what no triangle uses cannot be seen
        self.largest = largest or max(float(self.errors(frame)[used].max()) for frame in sampled(frames))

    def errors(self, frame: int) -> NDArray[np.float64]:
        """``(V,)`` distances, percent of the diagonal."""
        original = self._reference.read(frame, frame + 1)[0].astype(np.float64)
        distance: NDArray[np.float64] = np.linalg.norm(self.sequence.read(frame, frame + 1)[0] - original, axis=1)
        return distance / self._unit

    def values(self, frame: int) -> NDArray[np.float64]:
        """``(V,)`` errors as parts of the scale's end; where there is no error at all, zeros."""
        return self.errors(frame) / (self.largest or 1.0)

    def legend(self, size: tuple[int, int]) -> tuple[Picture, tuple[int, int]]:
        """Return a colour bar with its numbers for a picture of a size, and the row and column that it goes to."""
        from PIL import Image, ImageDraw, ImageFont

        width, height = size
        text = max(9, min(height // 32, width // 26))  # pixels
        font = ImageFont.load_default(text)
        edge, bar, length = text, text, min(height - 5 * text, 9 * text)
        labels = [f"{self.largest * part:.3g}" for part in (1.0, 0.5, 0.0)]
        title = f"vertex error, {self._unit_name}"
        background = tuple(round(255 * channel) for channel in BACKGROUND)
        columns = min(width, round(max(font.getlength(title), 1.6 * bar + max(map(font.getlength, labels)))) + 2 * edge)
        image = Image.new("RGB", (columns, min(height, length + 4 * text)), background)
        draw = ImageDraw.Draw(image)
        draw.text((edge, edge // 2), title, fill=(60, 60, 60), font=font)
        top = 2 * text + text // 2
        ramp = np.rint(255 * error_colours(np.linspace(1, 0, max(length, 2))))
        for row, colour in enumerate(ramp.astype(int).tolist()):
            draw.line([(edge, top + row), (edge + bar - 1, top + row)], fill=tuple(colour))
        for label, part in zip(labels, (0.0, 0.5, 1.0), strict=True):
            middle = top + part * (len(ramp) - 1)
            draw.text((edge + round(1.6 * bar), middle), label, fill=(60, 60, 60), font=font, anchor="lm")
        return np.asarray(image), (height - image.height, 0)
