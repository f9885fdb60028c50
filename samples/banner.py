"""A texture that moves, for the flag: diagonal stripes that run across it, and a bar that grows from frame to frame.

Whole numbers alone, so that every machine makes the same pictures; they are stored as a video of H.264.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from gvpipe.media.picture_video import encode_pictures

FRAMES = 48
FPS = 24.0
WIDTH, HEIGHT = 96, 64  # pixels
STRIPE = 24  # pixels
COLOURS = np.array([(196, 40, 48), (244, 236, 216)], np.uint8)
BAR = np.array((24, 60, 120), np.uint8)


def make_banner() -> npt.NDArray[np.uint8]:
    """Return the pictures ``(FRAMES, HEIGHT, WIDTH, 3)``."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    pictures = np.empty((FRAMES, HEIGHT, WIDTH, 3), np.uint8)
    for frame in range(FRAMES):
        pictures[frame] = COLOURS[(x + y + 2 * frame) // STRIPE % 2]
        pictures[frame, HEIGHT - 16 :, : 2 * (frame + 1)] = BAR
    return pictures


def write_banner(path: Path) -> None:
    """Write the pictures as a video."""
    path.write_bytes(encode_pictures(make_banner(), (WIDTH, HEIGHT), FPS))
