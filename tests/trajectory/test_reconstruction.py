"""Frames from segments: each vertex gets its point, and what is no position is refused by its frame."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import CorruptFile
from gvpipe.trajectory import reconstruction
from gvpipe.trajectory.basis import Basis
from gvpipe.trajectory.product_kernels import MANY_FRAMES, TILE
from gvpipe.trajectory.reconstruction import Segment, read_frames

BOUNDS = [0, 10, 13]


def test_vertices_get_their_points_from_any_segment() -> None:
    segments, points = _segments(), np.array([2, 0, 0, 3, 1])
    spans = zip(segments, pairwise(BOUNDS), strict=True)
    whole = np.concatenate([_positions(segment, end - begin) for segment, (begin, end) in spans])
    expected = whole.astype(np.float32)[:, points]
    for start, stop in ((0, 13), (3, 4), (9, 12), (5, 5)):
        assert np.array_equal(read_frames(start, stop, BOUNDS, points, lambda s: segments[s]), expected[start:stop])


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e39])
@pytest.mark.parametrize("large", [1, 1 << 18])
def test_no_position_is_refused_by_its_frame(value: float, large: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reconstruction, "LARGE", large)  # from 1 on by two threads
    segments = _segments()
    segments[0].basis.mean[3 * 9 + 1] = value
    read_frames(0, 9, BOUNDS, np.arange(4), lambda s: segments[s])
    with pytest.raises(CorruptFile, match="frame 9 does not decode to finite positions"):
        read_frames(0, 13, BOUNDS, np.arange(4), lambda s: segments[s])


@pytest.mark.parametrize("n_components", [0, 1, 4, 7])
@pytest.mark.parametrize("n_frames", [1, MANY_FRAMES - 1, MANY_FRAMES])
def test_sums_run_first_to_last_whatever_the_number_of_vertices(n_frames: int, n_components: int) -> None:
    rng = np.random.default_rng(5)
    basis = Basis(rng.normal(size=3 * n_frames), rng.normal(size=(3 * n_frames, n_components)))
    segment, points = Segment(basis, rng.normal(size=(90, n_components))), rng.integers(0, 90, 2 * TILE + 7)
    expected = _positions(segment, n_frames).astype(np.float32)[:, points]
    assert np.array_equal(read_frames(0, n_frames, [0, n_frames], points, lambda _: segment), expected)


def _positions(segment: Segment, n_frames: int) -> Float64:
    """Of the points, ``(n, P, 3)``, term by term."""
    sums = np.zeros((len(segment.coefficients), 3 * n_frames))
    for column, weights in zip(segment.coefficients.T, segment.basis.vectors.T, strict=True):
        sums += column[:, None] * weights
    return (sums + segment.basis.mean).reshape(-1, n_frames, 3).swapaxes(0, 1)


def _segments() -> list[Segment]:
    rng = np.random.default_rng(3)
    lengths = np.diff(BOUNDS)
    return [
        Segment(Basis(rng.normal(size=3 * n), rng.normal(size=(3 * n, 2))), rng.normal(size=(4, 2))) for n in lengths.tolist()
    ]
