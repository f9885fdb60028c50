"""The transforms of skinning as bytes."""

from __future__ import annotations

import numpy as np
import pytest

from gvcodecs.mcgv.motion.skinning_coding import decode_trajectories, encode_trajectories
from gvpipe.foundation.errors import CorruptFile


@pytest.mark.parametrize(("n_clusters", "n_frames"), [(1, 1), (3, 2), (5, 40), (40, 9)])
def test_trajectories_round_trip(n_clusters: int, n_frames: int) -> None:
    draw = np.random.default_rng(n_frames)
    rows = np.cumsum(draw.standard_normal((4 * n_clusters, n_frames, 3)), axis=1).reshape(4 * n_clusters, -1)
    sizes = []
    for step in (1.0, 0.05):
        data, coded = encode_trajectories(rows, step)
        decoded = decode_trajectories(data, n_clusters, n_frames, step, "transforms.0")
        assert np.array_equal(decoded.rows(0, n_frames), coded.rows(0, n_frames))
        assert np.allclose(decoded.rows(n_frames // 2, n_frames), coded.rows(0, n_frames)[:, 3 * (n_frames // 2) :])
        error = np.sqrt(np.square(decoded.rows(0, n_frames) - rows).mean())
        assert error < 0.6 * step
        sizes.append(len(data))
    assert sizes[0] < sizes[1]


def test_hostile_trajectories() -> None:
    data, _ = encode_trajectories(np.cumsum(np.ones((12, 30)), axis=1), 0.1)
    draw = np.random.default_rng(0)
    for _ in range(100):
        changed = bytearray(data[: draw.integers(1, len(data) + 1)])
        changed[draw.integers(len(changed))] = draw.integers(256)
        try:
            assert decode_trajectories(bytes(changed), 3, 10, 0.1, "transforms.0").rows(0, 10).shape == (12, 30)
        except CorruptFile:
            continue
    for cut in range(len(data)):
        with pytest.raises(CorruptFile):
            decode_trajectories(data[:cut], 3, 10, 0.1, "transforms.0")
