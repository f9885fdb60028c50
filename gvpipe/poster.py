"""The still that stands for a mesh where a codec has no images of its own: file managers and players show it.

Frame 0, three-quarter view, flat shaded, painted back to front; one H.264 picture held for the sequence's length.
"""

from __future__ import annotations

import io
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from gvpipe.sequence import Float32, Int32, MeshSequence
from gvpipe.video import PROFILES, x264_options

SIZE = 160  # pixels, of both sides
MARGIN = 10  # pixels
AZIMUTH, ELEVATION = np.radians(35.0), np.radians(18.0)
BACKGROUND, DARKEST, LIGHTEST = 235, 40, 215  # levels
QP = 38  # 1-2 kB
TRIANGLES_MAX = 200_000  # triangles painted at most


def poster_of(sequence: MeshSequence) -> bytes:
    """Return the poster of a sequence."""
    return make_poster(sequence.read(0, 1)[0], sequence.faces, sequence.fps, sequence.n_frames)


def make_poster(positions: Float32, faces: Int32, fps: float, n_frames: int) -> bytes:
    """Return an MP4 file with one picture of ``positions (V, 3)`` that lasts ``n_frames``."""
    import av

    profile, rate = PROFILES["h264-8"], Fraction(fps).limit_denominator(1001) or Fraction(1, 1001)
    plane = paint(positions, faces)
    neutral = np.full((SIZE // 2, SIZE), profile.middle, np.uint8)
    file = io.BytesIO()
    with av.open(file, "w", format="mp4", options={"fflags": "+bitexact"}) as container:
        stream = container.add_stream("libx264", rate, options=x264_options(QP, 1, "slow"))
        stream.width = stream.height = SIZE
        stream.pix_fmt = profile.pixel_format
        stream.codec_context.time_base = 1 / rate
        picture = av.VideoFrame.from_ndarray(np.concatenate([plane, neutral]), format=profile.pixel_format)
        picture.pts, picture.time_base = 0, 1 / rate
        for packet in [*stream.encode(picture), *stream.encode(None)]:
            packet.duration = n_frames
            container.mux(packet)
    return file.getvalue()


def paint(positions: Float32, faces: Int32) -> NDArray[np.uint8]:
    """Return a ``(SIZE, SIZE)`` picture, levels 16..235; the y axis is up."""
    from PIL import Image, ImageDraw

    image = Image.new("L", (SIZE, SIZE), BACKGROUND)
    right = np.array([np.cos(AZIMUTH), 0, -np.sin(AZIMUTH)])
    back = np.array([np.sin(AZIMUTH) * np.cos(ELEVATION), np.sin(ELEVATION), np.cos(AZIMUTH) * np.cos(ELEVATION)])
    seen = positions.astype(np.float64) @ np.stack([right, np.cross(back, right), back], axis=1)  # (V, 3): x, y, towards us
    low, extent = seen.min(axis=0), np.ptp(seen, axis=0)[:2].max()
    scale = (SIZE - 2 * MARGIN) / extent if 0 < extent < np.inf else 0.0
    pixels = (seen[:, :2] - low[:2] - np.ptp(seen, axis=0)[:2] / 2) * scale * [1, -1] + SIZE / 2
    corners = seen[faces[:: -(-len(faces) // TRIANGLES_MAX) or 1]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    with np.errstate(invalid="ignore", over="ignore"):
        light = np.abs(normals @ [0.4, 0.6, 0.69]) / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    levels = DARKEST + (LIGHTEST - DARKEST) * np.clip(np.nan_to_num(light), 0, 1)
    draw = ImageDraw.Draw(image)
    painted = pixels[faces[:: -(-len(faces) // TRIANGLES_MAX) or 1]]
    for i in np.argsort(corners[:, :, 2].mean(axis=1), kind="stable"):
        draw.polygon(painted[i].ravel().tolist(), fill=int(levels[i]))
    return np.array(image)
