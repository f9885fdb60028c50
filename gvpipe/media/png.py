"""Pictures of 16 bits a channel to PNG, which Pillow does not write."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Array


def encode_png16(pixels: Array) -> bytes:
    """Return ``pixels (H, W, 3) uint16``, red first, as a PNG."""
    import cv2

    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.dtype != np.uint16 or not pixels.size:
        raise ValueError(
            f"pixels of shape {pixels.shape} and type {pixels.dtype} cannot be written; (H, W, 3) uint16 is needed"
        )
    is_done, data = cv2.imencode(".png", np.ascontiguousarray(pixels[:, :, ::-1]))
    if not is_done:
        raise ValueError(f"OpenCV cannot write a PNG of {pixels.shape[1]} x {pixels.shape[0]} pixels")
    return data.tobytes()
