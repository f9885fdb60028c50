"""Whole files of mcgv: any scale, many segments, B-frames where they pay."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from folders import SAMPLES
from sequences import grid, waving

import gvpipe
from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.base import base_frame
from gvcodecs.mcgv.encode_job import Job
from gvcodecs.mcgv.encoding.initial_skinning import fit_skinning
from gvcodecs.mcgv.motion import blended
from gvcodecs.mcgv.motion.skinning import Blend, BlendFit
from gvpipe.coding.codec import Memo
from gvpipe.coding.quality_scale import error_of
from gvpipe.coding.registry import open_reader
from gvpipe.container import bitstream
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.model.sequence import MeshSequence


@pytest.mark.parametrize("scale", [1e-38, 1e-30, 1e-10, 1e10, 1e30, 3e37])
def test_any_float32_scale(sequence: MeshSequence, scale: float) -> None:
    """A model of any size that float32 holds comes back at the same relative error."""
    codec = Mcgv(preset="ultrafast", clusters=2, gop=4)
    scaled = MeshSequence((sequence.read(0, 11) * np.float64(scale)).astype(np.float32), sequence.faces)
    bitstream = codec.encode(scaled).bitstream
    back = open_reader(bitstream).read(0, 11)
    kg = measure_errors(sequence, lambda start, stop: (back[start:stop].astype(float) / scale).astype(np.float32)).kg
    # a blend alone may err less, in fewer bytes
    least = 0.8 * error_of(75) if bitstream.header.get("pictures", True) else 0.0
    assert kg is not None and least < kg < 1.2 * error_of(75)


def test_more_segments_than_sections_are_not_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bitstream has 4096 sections at most; segments then get longer than was asked for.

    Small limits, no farther apart, stand for the real ones.
    """
    n_frames, segments, n_sections = 60, 40, 50
    assert n_sections - segments <= bitstream.MAX_SECTIONS - base_frame.MAX_SEGMENTS
    monkeypatch.setattr(base_frame, "MAX_SEGMENTS", segments)
    monkeypatch.setattr(bitstream, "MAX_SECTIONS", n_sections)
    away = np.linspace(0, 1, n_frames, dtype=np.float32)[:, None, None]
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    sequence = MeshSequence(square + away, np.array([[0, 1, 2], [0, 2, 3]], np.int32), 30.0)
    gvpipe.encode(sequence, tmp_path / "a.mp4", segment=1, clusters=1, preset="ultrafast")
    assert gvpipe.decode(tmp_path / "a.mp4").n_frames == n_frames


def test_b_frames_only_where_they_pay() -> None:
    """Nearly empty pictures go without: tables that tell their order would cost more than they save."""
    sequence = waving(16, 64)
    coarse = Mcgv(prediction="blended", quality=40).encode(sequence).bitstream.video
    assert b"ctts" not in coarse
    rng = np.random.default_rng(0)
    noisy = np.asarray(sequence.positions[:]) + rng.normal(0, 0.02, (64, sequence.n_vertices, 3))
    fine = Mcgv(prediction="affine", quality=75).encode(MeshSequence(noisy.astype(np.float32), sequence.faces)).bitstream.video
    assert b"ctts" in fine


def test_blends_beat_the_published_prediction() -> None:
    """At equal quality: fewer bytes, and a smaller error."""
    sequence = waving(24, 60)
    sizes, errors = [], []
    for prediction in ("blended", "affine"):
        stream = Mcgv(prediction=prediction, quality=60).encode(sequence).bitstream
        sizes.append(sum(map(len, stream.sections.values())) + len(stream.video))
        decoded = open_reader(stream).read(0, 60)
        errors.append(float(np.square(decoded - np.asarray(sequence.positions[:])).mean()))
    assert sizes[0] < sizes[1]
    assert errors[0] < errors[1]


def test_pieces_that_part_are_predicted_each_for_itself() -> None:
    """Two sheets that start as one surface, edge on edge, and fly apart: no vertex follows the other sheet."""
    points, faces = grid(12)
    left = points - [points[:, 0].max(), 0, 0]
    drift = np.linspace(0, 3, 20)[:, None, None] * np.array([1.0, 0, 0.5])
    frames = np.concatenate([left - drift, points + drift], axis=1).astype(np.float32)
    sequence = MeshSequence(frames, np.concatenate([faces, faces + len(points)]).astype(np.int32), fps=25.0)
    stream = Mcgv(prediction="blended", quality=60).encode(sequence).bitstream
    extent = float(np.linalg.norm(np.ptp(frames[0], axis=0)))
    errors = np.linalg.norm(open_reader(stream).read(0, 20) - frames, axis=2) / extent
    assert errors.max() < 0.02 and "outliers" not in stream.sections


def test_a_blend_is_solved_once_for_all_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files are those of an encoder that keeps nothing."""
    solved: list[int] = []

    class Counted(BlendFit):
        def __init__(self, blend: Blend) -> None:
            solved.append(blend.n_clusters)
            super().__init__(blend)

    monkeypatch.setattr(blended, "BlendFit", Counted)
    files, counts = [], []
    for kept in (blended.KEPT, 0):
        monkeypatch.setattr(blended, "KEPT", kept)
        made = Mcgv(quality=60).encode(waving(12, 40)).bitstream
        files.append((made.sections, made.video))
        counts.append(len(solved))
        solved.clear()
    assert files[0] == files[1] and counts[0] < counts[1]


def test_a_blend_asked_for_again_is_the_same() -> None:
    job = Job(Mcgv(), waving(12, 20), Memo(), lambda stage, done: None)
    start = base_frame.begin(job, 1e-3, 1e-3)
    found = fit_skinning(job, start, 1e-3)
    assert fit_skinning(job, start, 1e-3)[0] is found[0]
    others = (start, 2e-3), (dataclasses.replace(start, step=2e-3), 1e-3), (base_frame.begin(job, 1e-2, 1e-2), 1e-3)
    for other, target_error in others:
        assert fit_skinning(job, start, 1e-3)[0] is not fit_skinning(job, other, target_error)[0]


def test_rigid_parts_have_one_error_at_all_qualities(tmp_path: Path) -> None:
    """Files of the sample robot, whose parts are rigid, are about the same below quality 90."""
    robot = gvpipe.read(SAMPLES / "robot.npz")
    files = []
    for quality in (50, 80):
        n_bytes = gvpipe.encode(robot, tmp_path / "a.mp4", quality=quality).bytes
        files.append((n_bytes, measure_errors(robot, gvpipe.decode(tmp_path / "a.mp4").read).kg or 0.0))
    (few, coarse), (many, fine) = files
    assert abs(many - few) < 0.03 * many
    assert abs(fine - coarse) < 0.05 * coarse < 0.05 * error_of(90)
