"""Pictures that are frames: the residuals of a predicted sequence, padded, as the planes of a video (equation 4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.padding import Padding
from gvcodecs.mcgv.motion.contract import CodedMotion, predicted_chunks
from gvcodecs.mcgv.pictures.outliers import OutlierWriter
from gvcodecs.mcgv.pictures.quantiser import ImageQuantiser, Magnitudes, choose_quantiser
from gvpipe.foundation.arrays import Float64
from gvpipe.media.video import B_FRAMES, Plane, Profile, VideoWriter

PIXELS = 1 << 19  # of pictures that are made at a time: they may be many times as large as positions
SMALL = 60, 2000  # bytes a frame, and of a file's own: B-frames save a third of the pictures' at best, and cost 8 each

Residuals = Iterator[tuple[int, Float64]]
"""The first frame, and ``(n, P, 3)`` residuals, model units, of it and those after it."""


@dataclass(frozen=True)
class CodedFrames:
    """Residuals as they are coded.

    Args:
        step: model units per level of the pictures.
        video: one picture per frame.
        outliers: the section, empty if the pictures hold everything.
    """

    step: float
    video: bytes
    outliers: bytes


def measure_residuals(start: Start, motion: CodedMotion) -> Magnitudes:
    """The magnitudes of all residuals, model units."""
    magnitudes = Magnitudes()
    for _, residual in _residuals(start, motion):
        magnitudes.add(residual)
    return magnitudes


def code_frames(job: Job, start: Start, motion: CodedMotion, layout: Layout, magnitudes: Magnitudes) -> CodedFrames:
    """Code what a prediction leaves, of such magnitudes, as one picture per frame and outliers."""
    settings, profile = job.settings, job.settings.video_profile
    quantiser = choose_quantiser(start.step, profile, magnitudes)
    outliers = OutlierWriter(profile, quantiser.step, start.step, settings.gop, start.sequence.n_vertices)
    padding = Padding(layout, settings.block)

    def collected() -> Residuals:
        for first, residual in _residuals(start, motion):
            yield first, residual
            outliers.add(residual)
            job.report("video", (first + len(residual)) / start.sequence.n_frames)

    job.report("video", 0)
    video = _write_video(job, padding, quantiser, collected(), B_FRAMES)
    if profile.codec == "h264" and len(video) < SMALL[0] * start.sequence.n_frames + SMALL[1]:
        video = min(video, _write_video(job, padding, quantiser, _residuals(start, motion), 0), key=len)
    return CodedFrames(quantiser.step, video, outliers.finish())


def _write_video(job: Job, padding: Padding, quantiser: ImageQuantiser, residuals: Residuals, b_frames: int) -> bytes:
    settings, profile, layout = job.settings, job.settings.video_profile, padding.layout
    width, height, fps = layout.width, 3 * layout.height, job.sequence.fps
    with VideoWriter(profile, width, height, fps, quantiser.level, settings.gop, settings.preset, b_frames) as writer:
        n = max(1, PIXELS // (width * height))  # frames at a time
        for _, residual in residuals:
            for first in range(0, len(residual), n):
                for picture in _pictures(residual[first : first + n], padding, profile, quantiser.step):
                    writer.add(picture)
        return writer.finish()


def _residuals(start: Start, motion: CodedMotion) -> Residuals:
    """Yield the residuals of all frames (equation 4)."""
    for first, block, predicted in predicted_chunks(start.sequence, start.bounds, motion.predict):
        yield first, block - predicted


def _pictures(residual: Float64, padding: Padding, profile: Profile, step: float) -> Iterator[Plane]:
    """Yield one picture per frame: the padded x, y and z planes, one below the other."""
    values = residual.swapaxes(1, 2).reshape(3 * len(residual), -1)  # (n, P, 3) -> (3n, P)
    planes = profile.samples(padding.fill(values / step, 0.0))
    yield from planes.reshape(len(residual), -1, planes.shape[2])
