"""Pictures to PNG: of 16 bits a channel, which Pillow does not write, and of 8 bits, which OpenCV writes sooner."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, UInt8


def encode_png16(pixels: Array) -> bytes:
    """Return ``pixels (H, W, 3) uint16``, red first, as a PNG."""
    return _encode(pixels, np.dtype(np.uint16))


def encode_png8(pixels: UInt8) -> bytes:
    """The same of ``(H, W, 3) uint8``."""
    return _encode(pixels, np.dtype(np.uint8))


def _encode(pixels: Array, dtype: np.dtype[Any]) -> bytes:
    import cv2

    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != dtype or not pixels.size:
        raise ValueError(
            f"pixels of shape {pixels.shape} and type {pixels.dtype} cannot be written; (H, W, 3) {dtype} is needed"
        )
    is_done, data = cv2.imencode(".png", np.ascontiguousarray(pixels[:, :, ::-1]))
    if not is_done:
        raise ValueError(f"OpenCV cannot write a PNG of {pixels.shape[1]} x {pixels.shape[0]} pixels")
    return data.tobytes()
