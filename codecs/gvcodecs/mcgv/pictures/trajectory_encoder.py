"""Trajectory images of a whole sequence: blend, segments and their pictures, one segment in memory at a time.

Pictures are coded as intra pictures, since components have nothing in common, all with one quantisation parameter: a plane has
``FINENESS`` levels per step (`pictures.trajectories`), and the coder's own quantiser sees a step as one step. Measured on
chicken, cow, samba and horse_gallop: docs/experiments/mcgv-trajectory-images.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gvcodecs.mcgv.base.base_frame import Start
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.header import TrajectoryHeader
from gvcodecs.mcgv.layout.layout import Layout
from gvcodecs.mcgv.layout.padding import Padding
from gvcodecs.mcgv.motion.blend_problem import Fitted
from gvcodecs.mcgv.motion.skinning import Blend, BlendFit
from gvcodecs.mcgv.motion.weight_coding import encode_weights
from gvcodecs.mcgv.pictures.trajectories import PLANES, count_pictures, encode_segment
from gvpipe.foundation.arrays import Float64
from gvpipe.media.video import Plane, Profile, VideoWriter

FINENESS = {"h264-8": 3, "h264-10": 6}  # levels per step: rounding to levels adds a ninth or a thirty-sixth to a step's noise
FIT_STEP = 1.5  # times the quantisation step: the precision at which the blend is chosen
LEVEL = {"h264-8": 17, "h264-10": 23}  # x264's quantisation parameter; it codes intra pictures three lower


@dataclass(frozen=True)
class CodedTrajectories:
    """A sequence as trajectory images: its clusters, the header's part, sections, and the video."""

    n_clusters: int
    header: TrajectoryHeader
    sections: dict[str, bytes]
    video: bytes


def code_trajectories(job: Job, start: Start, fitted: Fitted, layout: Layout) -> CodedTrajectories:
    """Code the points of a start, with an error about that of frames coded with its step.

    Args:
        job: settings, and who hears of progress.
        start: points, base frame and step.
        fitted: the points' blend, fitted for `FIT_STEP` steps.
        layout: the points' pixels.
    """
    settings, profile, bounds = job.settings, job.settings.video_profile, start.bounds
    fit = BlendFit(Blend(start.base, fitted.weights, fitted.n_clusters))
    sections = {"weights": encode_weights(fitted.weights, start.points.causal_neighbours())}
    fineness, level = FINENESS[profile.name], LEVEL[profile.name]
    largest = profile.amplitude / fineness
    padding = Padding(layout, settings.block)
    components, steps = [], []
    width, height = layout.width, PLANES * layout.height
    with VideoWriter(profile, width, height, start.sequence.fps, level, 1, settings.preset) as writer:
        for s, (first, stop) in enumerate(pairwise(bounds)):
            trajectories = _trajectories(start, first, stop)
            error = trajectories.size * start.step * start.step / 12
            coded = encode_segment(trajectories, fit, largest, error)
            sections[f"trajectories.{s}"] = coded.section
            components.append(len(coded.left))
            steps.append(coded.step)
            for picture in _pictures(coded.left * fineness, padding, profile):
                writer.add(picture)
            job.report("video", (s + 1) / (len(bounds) - 1))
        video = writer.finish()
    return CodedTrajectories(fitted.n_clusters, TrajectoryHeader(fineness, tuple(components), tuple(steps)), sections, video)


def _trajectories(start: Start, first: int, stop: int) -> Float64:
    """Displacements from the base frame, ``(P, 3n)``, of the frames ``first`` to ``stop``."""
    result = np.empty((len(start.base), stop - first, 3))
    for frame, block in start.sequence.chunks(first, stop):
        result[:, frame - first : frame - first + len(block)] = block.swapaxes(0, 1) - start.base[:, None]
    return result.reshape(len(start.base), -1)  # (P, n, 3) -> (P, 3n)


def _pictures(levels: Float64, padding: Padding, profile: Profile) -> Iterator[Plane]:
    """Yield pictures of three padded planes each for ``levels (R, P)``; what a plane cannot hold is at its limit."""
    for k in range(count_pictures(len(levels))):
        own = np.zeros((PLANES, levels.shape[1]))
        part = levels[PLANES * k : PLANES * (k + 1)]
        own[: len(part)] = np.clip(part, -profile.amplitude, profile.amplitude)
        planes = profile.samples(padding.fill(own, 0.0))
        yield planes.reshape(-1, planes.shape[2])
