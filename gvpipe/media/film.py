"""Videos that people look at rather than decode: films in colour, and one picture that is held."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import UInt8
from gvpipe.media.video import PROFILES, PlainPackets, VideoWriter, check_x264, has_x264, without_avx512, x264_options

SMOOTH = ":no-deblock=0:deblock=0,0"  # for x264's filter of blocks, which pictures of data do without
FILM = {"preset": "medium", "crf": "20"}  # x264 codes for the eye
JPEG_STEP = 16  # levels: 2 kB for a poster


def write_film(path: Path, pictures: Iterable[UInt8], fps: float) -> None:
    """Write an MP4 film of ``(height, width, 3)`` sRGB pictures with even sides; x264 codes them for the eye.

    Raises:
        InputError: this FFmpeg has no x264.
    """
    import av

    check_x264()
    rate = Fraction(fps).limit_denominator(1001) or Fraction(1, 1001)
    with av.open(os.fspath(path), "w", format="mp4", options={"fflags": "+bitexact", "movflags": "+faststart"}) as container:
        stream = container.add_stream(
            "libx264", rate, options={**FILM, "x264-params": f"threads=1:log-level=0{without_avx512()}"}
        )
        stream.pix_fmt = "yuv420p"
        context = stream.codec_context
        context.time_base = 1 / rate
        context.color_range = 1  # limited
        context.colorspace = context.color_primaries = 1  # BT.709
        context.color_trc = 13  # sRGB
        for k, picture in enumerate(pictures):
            if k == 0:
                stream.height, stream.width = picture.shape[:2]
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
            frame.pts, frame.time_base = k, 1 / rate
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def hold_picture(plane: UInt8, fps: float, n_frames: int, quality: int) -> bytes:
    """Return an MP4 file of one ``h264-8`` plane with even sides that lasts ``n_frames``; a JPEG where there is no x264."""
    import av

    if not has_x264():
        return _hold_jpeg(plane, fps / n_frames)
    profile, rate = PROFILES["h264-8"], Fraction(fps).limit_denominator(1001) or Fraction(1, 1001)
    height, width = plane.shape
    neutral = np.full((height // 2, width), profile.middle, np.uint8)
    file = io.BytesIO()
    with av.open(file, "w", format="mp4", options={"fflags": "+bitexact"}) as container:
        options = x264_options(quality, 1, "slow")
        options["x264-params"] += SMOOTH
        stream = container.add_stream("libx264", rate, options=options)
        stream.width, stream.height, stream.pix_fmt = width, height, profile.pixel_format
        stream.codec_context.time_base = 1 / rate
        picture = av.VideoFrame.from_ndarray(np.concatenate([plane, neutral]), format=profile.pixel_format)
        picture.pts, picture.time_base = 0, 1 / rate
        for packet in PlainPackets(stream)([*stream.encode(picture), *stream.encode(None)]):
            packet.duration = n_frames
            container.mux(packet)
    return file.getvalue()


def _hold_jpeg(plane: UInt8, fps: float) -> bytes:
    """Return the same as one JPEG at a rate of one picture for all frames."""
    levels, profile = PROFILES["h264-8"], PROFILES["jpeg"]
    spread = np.interp(plane, (levels.low, levels.high), (profile.low, profile.high))
    with VideoWriter(profile, plane.shape[1], plane.shape[0], fps, JPEG_STEP) as writer:
        writer.add(np.rint(spread).astype(profile.dtype))
        return writer.finish()
