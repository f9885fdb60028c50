"""The average as bytes."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from tubes import CODING, surface_of, tube

import gvpipe
from gvcodecs.laplacian.average_coding import decode_average, encode_average
from gvcodecs.laplacian.mesh_scale import edge_lengths
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence


def test_what_is_too_far_to_be_decoded_is_not_written(tmp_path: Path) -> None:
    side = 1e-5 * np.arange(10)
    points = np.column_stack([*(axis.ravel() for axis in np.meshgrid(side, side)), np.zeros(100)])
    corner = np.arange(90).reshape(9, 10)[:, :9].ravel()
    faces = np.vstack(
        [np.column_stack([corner, corner + 1, corner + 10]), np.column_stack([corner + 1, corner + 11, corner + 10])]
    )
    frames = np.repeat(np.vstack([points, [2e4, 0, 0]])[None], 4, axis=0)
    frames[:, :50, 2] += 1e-6 * np.arange(4)[:, None]
    sequence = MeshSequence(frames.astype(np.float32), faces.astype(np.int32), 30.0)
    with pytest.raises(InputError, match="pca"):
        gvpipe.encode(sequence, tmp_path / "a.mp4", "laplacian")
    assert not list(tmp_path.iterdir())


def test_the_average_comes_back_to_its_precision() -> None:
    points, surface = surface_of(tube(12, 40))
    unit = edge_lengths(points, surface.edges).mean()
    sizes = []
    for step in (1 / 4, 1 / 64):
        coding = dataclasses.replace(CODING, average_step=step)
        data, theirs = encode_average(5 + points, surface, coding)
        assert np.array_equal(decode_average(data, surface, coding), theirs)
        wanted = (points - points.mean(axis=0)) / unit
        lengths, expected = (edge_lengths(p, surface.edges) for p in (theirs, wanted))
        assert np.abs(lengths - expected).mean() < step
        sizes.append(len(data))
    assert sizes[0] < 0.7 * sizes[1]
