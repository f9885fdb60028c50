"""Frames from segments: each vertex gets its point, and what is no position is refused by its frame."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gvpipe.errors import CorruptFile
from gvpipe.trajectory import reconstruction
from gvpipe.trajectory.basis import Basis
from gvpipe.trajectory.reconstruction import Segment, read_frames

BOUNDS = [0, 10, 13]


def test_vertices_get_their_points_from_any_segment() -> None:
    segments, points = _segments(), np.array([2, 0, 0, 3, 1])
    spans = zip(segments, pairwise(BOUNDS), strict=True)
    whole = np.concatenate([segment.positions(0, end - begin) for segment, (begin, end) in spans])
    expected = whole.astype(np.float32)[:, :, points].swapaxes(1, 2)
    for start, stop in ((0, 13), (3, 4), (9, 12), (5, 5)):
        assert np.array_equal(read_frames(start, stop, BOUNDS, points, lambda s: segments[s]), expected[start:stop])


@pytest.mark.parametrize("value", [np.nan, np.inf, -1e39])
@pytest.mark.parametrize("run", [1, 1 << 16])
def test_no_position_is_refused_by_its_frame(value: float, run: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reconstruction, "LARGE", 1)  # on other threads
    monkeypatch.setattr(reconstruction, "RUN", run)
    segments = _segments()
    segments[0].basis.mean[3 * 9 + 1] = value
    read_frames(0, 9, BOUNDS, np.arange(4), lambda s: segments[s])
    with pytest.raises(CorruptFile, match="frame 9 does not decode to finite positions"):
        read_frames(0, 13, BOUNDS, np.arange(4), lambda s: segments[s])


def _segments() -> list[Segment]:
    rng = np.random.default_rng(3)
    lengths = np.diff(BOUNDS)
    return [
        Segment(Basis(rng.normal(size=3 * n), rng.normal(size=(3 * n, 2))), rng.normal(size=(2, 4))) for n in lengths.tolist()
    ]
