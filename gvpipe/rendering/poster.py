"""The still that stands for a mesh where a codec has no images of its own: file managers and players show it.

Frame 0 from the renderer's usual view, in grey; one H.264 picture held for the sequence's length.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Float32, Int32, UInt8
from gvpipe.media.film import hold_picture
from gvpipe.media.video import PROFILES
from gvpipe.model.sequence import MeshSequence
from gvpipe.rasterizer.camera import framing
from gvpipe.rasterizer.renderer import Renderer

SIZE = 96  # pixels, of both sides
SAMPLES = 3  # per pixel and axis
QP = 41  # 74 to 286 bytes: small files pay for it, too
LUMA = np.array([0.2126, 0.7152, 0.0722])  # BT.709, of sRGB bytes


def poster_of(sequence: MeshSequence) -> bytes:
    """Return the poster of a sequence, an MP4 file."""
    return make_poster(sequence.read(0, 1)[0], sequence.faces, sequence.fps, sequence.n_frames)


def make_poster(positions: Float32, faces: Int32, fps: float, n_frames: int) -> bytes:
    """Return an MP4 file with one picture of ``positions (V, 3)`` that lasts ``n_frames``."""
    return hold_picture(paint(positions, faces), fps, n_frames, QP)


def paint(positions: Float32, faces: Int32) -> UInt8:
    """Return a ``(SIZE, SIZE)`` picture, levels 16..235; the y axis is up. Without triangles it is empty."""
    profile = PROFILES["h264-8"]
    if not len(faces):
        return np.full((SIZE, SIZE), profile.high, np.uint8)
    camera = framing(MeshSequence(positions[None], faces))
    grey = Renderer(faces, positions, (SIZE, SIZE), samples=SAMPLES).draw(positions, camera) @ LUMA
    plane: UInt8 = np.rint(profile.low + (profile.high - profile.low) / 255 * grey).astype(np.uint8)
    return plane
