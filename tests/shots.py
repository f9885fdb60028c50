"""Pictures of the player, by pixels where points of the mesh lie."""

from __future__ import annotations

import base64
import io

import numpy as np
import numpy.typing as npt
from pages import TEXT
from PIL import Image as Pillow

SHOT = f"""{TEXT} const blob = await element.still();
    return [text(new Uint8Array(await blob.arrayBuffer())), element.projection];"""
Pixels = npt.NDArray[np.int64]


class Shot:
    """A picture of the player: ``shot(x, y, z)`` is the pixel ``(4,)`` where a point lies; alpha is 0 beside the mesh."""

    def __init__(self, data: str, projection: list[float]) -> None:
        self.pixels = np.asarray(Pillow.open(io.BytesIO(base64.b64decode(data))).convert("RGBA"), int)
        self._projection = np.reshape(projection, (4, 4))

    def place(self, *point: float) -> tuple[int, int]:
        """Row and column of a point's pixel."""
        x, y, _, w = np.array([*point, 1.0]) @ self._projection
        height, width = self.pixels.shape[:2]
        return int((0.5 - y / w * 0.5) * height), int((x / w * 0.5 + 0.5) * width)

    def __call__(self, *point: float) -> Pixels:
        return np.asarray(self.pixels[self.place(*point)])


def hue(pixel: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Shares of red, green and blue in linear light."""
    srgb = np.asarray(pixel, float)[:3] / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    return np.asarray(linear / linear.sum())
