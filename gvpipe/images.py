"""Planes to JPEG and back, by OpenCV.

JPEG decoders differ by one level in places, so OpenCV's decoder is part of the format: what an encoder writes is what
this module reads.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.errors import CorruptFile

END_OF_IMAGE = b"\xff\xd9"

UInt8 = NDArray[np.uint8]


def encode_jpeg(plane: UInt8, quality: int) -> bytes:
    """Return ``plane (H, W) uint8`` as a greyscale baseline JPEG with optimised Huffman tables; ``quality`` is 1..100."""
    import cv2

    options = [cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1]
    done, data = cv2.imencode(".jpg", plane, options)
    if not done:
        raise ValueError(f"OpenCV cannot write a plane of shape {plane.shape} as JPEG")
    return data.tobytes()


def decode_jpeg(data: bytes, height: int, width: int) -> UInt8:
    """Mirror of `encode_jpeg`.

    Raises:
        CorruptFile: not a greyscale JPEG of that size.
    """
    import cv2

    try:
        # OpenCV fills up what a truncated image lacks
        plane = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data.endswith(END_OF_IMAGE) else None
    except cv2.error as exc:
        raise CorruptFile("an image of the video is corrupt: OpenCV cannot read it as JPEG") from exc
    if plane is None or plane.shape != (height, width):
        found = "unreadable" if plane is None else f"of shape {plane.shape}"
        raise CorruptFile(f"an image of the video is {found}; a greyscale JPEG of {width}x{height} is needed")
    return np.asarray(plane, np.uint8)
