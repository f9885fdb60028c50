"""Pictures that are frames: the residuals of a predicted sequence, padded, as the planes of a video (equation 4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.padding import Padding
from gvcodecs.mcgv.motion.contract import CodedMotion
from gvcodecs.mcgv.pictures.outliers import OutlierWriter
from gvcodecs.mcgv.pictures.quantiser import Magnitudes, Quantiser
from gvpipe.arrays import Float64
from gvpipe.codec import Progress
from gvpipe.media.video import B_FRAMES, Plane, Profile, VideoWriter
from gvpipe.sequence import MeshSequence

SMALL = 60, 2000  # bytes a frame, and of a file's own: B-frames save a third of the pictures' at best, and cost 8 each


def measure_residuals(sequence: MeshSequence, motion: CodedMotion, bounds: list[int]) -> Magnitudes:
    """The magnitudes of all residuals, model units."""
    magnitudes = Magnitudes()
    for _, residual in _residuals(sequence, motion, bounds):
        magnitudes.add(residual)
    return magnitudes


def code_frames(
    sequence: MeshSequence,
    motion: CodedMotion,
    bounds: list[int],
    layout: Layout,
    block: int,
    profile: Profile,
    quantiser: Quantiser,
    outliers: OutlierWriter,
    gop: int,
    preset: str,
    report: Progress,
) -> bytes:
    """Code the residuals of a sequence as a video, one picture per frame.

    Args:
        sequence: the animation.
        motion: its prediction.
        bounds: first frame of every segment, and F.
        layout: the vertices' pixels, in blocks of side ``block``.
        profile, gop, preset: of the video; gop is its frames per group of pictures.
        quantiser: of the image coder, and the residuals' step.
        outliers: told of all residuals, for what pictures cannot hold.
        report: told of the part that is done.
    """
    padding = Padding(layout, block)
    shape = (3 * layout.height, layout.width)

    def code(b_frames: int, tell: Callable[[int, Float64], None]) -> bytes:
        with VideoWriter(profile, shape[1], shape[0], sequence.fps, quantiser.level, gop, preset, b_frames) as writer:
            for first, residual in _residuals(sequence, motion, bounds):
                for picture in _pictures(residual, padding, profile, quantiser.step):
                    writer.add(picture)
                tell(first, residual)
            return writer.finish()

    def tell(first: int, residual: Float64) -> None:
        outliers.add(residual)
        report("video", (first + len(residual)) / sequence.n_frames)

    report("video", 0)
    video = code(B_FRAMES, tell)
    if profile.codec == "h264" and len(video) < SMALL[0] * sequence.n_frames + SMALL[1]:
        video = min(video, code(0, lambda first, residual: None), key=len)
    return video


def _residuals(sequence: MeshSequence, motion: CodedMotion, bounds: list[int]) -> Iterator[tuple[int, Float64]]:
    """Yield ``(first frame, (n, V, 3) residuals)`` of the whole sequence (equation 4)."""
    for start, stop in pairwise(bounds):
        for first, block in sequence.chunks(start, stop):
            yield first, block - motion.predict(first, first + len(block))


def _pictures(residual: Float64, padding: Padding, profile: Profile, step: float) -> Iterator[Plane]:
    """Yield one picture per frame: the padded x, y and z planes, one below the other."""
    values = residual.swapaxes(1, 2).reshape(3 * len(residual), -1)  # (n, V, 3) -> (3n, V)
    levels = np.rint(padding.fill(values / step, 0.0)) + profile.middle
    planes = np.clip(levels, profile.low, profile.high).astype(profile.dtype)
    yield from planes.reshape(len(residual), -1, planes.shape[2])
