"""Texels that no triangle uses, filled smoothly from those around them: no edge of a chart costs bits or bleeds into it.

`mcgv` fills its residuals block by block, where each pixel stands alone and a block is all that matters
(`gvcodecs.mcgv.layout.padding`). A texture is seen in smaller sizes, too, and H.264 smooths across blocks. So here colours
spread through a pyramid: each level holds the mean of the used texels below it, and what is empty takes the level above,
interpolated (pull and push; Gortler, Grzeszczuk, Szeliski and Cohen, "The Lumigraph", 1996, section 3.4).

Far from all charts the first picture's fill stays, since what moves costs bits: a quarter of all of them, at 1024 x 1024
texels of which a quarter is used.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool, Float32, UInt8

NEAR, FAR = 8, 24  # texels from a chart: what is nearer moves with it, what is farther stands still, between it fades


class TexelFill:
    """Fills the pictures of one row, first to last.

    Args:
        used: ``(H, W)`` texels that stay as they are.
    """

    def __init__(self, used: Bool) -> None:
        import cv2

        self._is_needed = bool(used.any() and not used.all())
        if not self._is_needed:
            return
        self._used = used.astype(np.uint8)
        self._weights: list[Float32] = [_halved(used.astype(np.float32))]
        while max(self._weights[-1].shape) > 1 and self._weights[-1].min() == 0:
            self._weights.append(_halved(self._weights[-1]))
        self._inverse = [(1 / np.maximum(weights, 1e-6))[:, :, None] for weights in self._weights]
        away = cv2.distanceTransform(1 - self._used, cv2.DIST_L2, 3)
        moves = np.clip((FAR - away) / (FAR - NEAR), 0, 1).astype(np.float32)
        self._band = np.flatnonzero((self._used == 0) & (moves > 0))  # texels that move, but are not used
        self._moves = moves.reshape(-1, 1)[self._band]
        self._still: UInt8 | None = None

    def __call__(self, pixels: UInt8) -> UInt8:
        """A picture ``(H, W, 3) uint8`` with other texels in place of those that are not used."""
        if not self._is_needed:
            return pixels
        import cv2

        spread = self._spread(pixels)
        if self._still is None:
            self._still = spread
        still, moving = (each.reshape(-1, 3)[self._band].astype(np.float32) for each in (self._still, spread))
        result = self._still.copy()
        result.reshape(-1, 3)[self._band] = still + self._moves * (moving - still) + np.float32(0.5)
        cv2.copyTo(np.ascontiguousarray(pixels), self._used, result)
        return result

    def _spread(self, pixels: UInt8) -> UInt8:
        """The fill of all texels, ``(H, W, 3)``."""
        import cv2

        seen = cv2.bitwise_and(np.ascontiguousarray(pixels), np.ascontiguousarray(pixels), mask=self._used)
        sums = [_halved(np.asarray(seen, np.float32))]
        for _ in self._weights[1:]:
            sums.append(_halved(sums[-1]))
        colours = np.asarray(sums.pop() * self._inverse[-1], np.float32)
        for level in range(len(sums) - 1, -1, -1):
            height, width = self._weights[level].shape
            larger = cv2.resize(colours, (width, height), interpolation=cv2.INTER_LINEAR)
            colours = np.asarray(larger, np.float32).reshape(height, width, 3)
            is_own = self._weights[level][:, :, None] > 0
            np.copyto(colours, sums[level] * self._inverse[level], where=is_own)
        levels = np.clip(colours + np.float32(0.5), 0, 255).astype(np.uint8)
        height, width = self._used.shape
        return np.asarray(cv2.resize(levels, (width, height), interpolation=cv2.INTER_LINEAR), np.uint8).reshape(
            height, width, 3
        )


def _halved(level: Float32) -> Float32:
    """The mean of each two by two texels; what an odd side lacks counts as empty."""
    import cv2

    height, width = level.shape[:2]
    padded = (
        np.pad(level, ((0, height % 2), (0, width % 2), *(((0, 0),) * (level.ndim - 2)))) if height % 2 or width % 2 else level
    )
    size = (padded.shape[1] // 2, padded.shape[0] // 2)
    half = np.asarray(cv2.resize(padded, size, interpolation=cv2.INTER_AREA), np.float32)
    return half.reshape(size[1], size[0], *level.shape[2:])
