"""Affine maps as bytes: the round trip, and the error of quantising."""

from __future__ import annotations

import numpy as np
import pytest

from gvcodecs.mcgv.motion.affine_coding import decode_transforms, dequantise, encode_transforms, quantise
from gvpipe.foundation.errors import CorruptFile


@pytest.mark.parametrize("scale", [0, 1, 3, 1000, 1e8])
@pytest.mark.parametrize("n_frames", [1, 2, 3, 40])
def test_transforms_round_trip(scale: float, n_frames: int) -> None:
    """Noise, random walks and smooth motion at any size come back exactly; smooth motion costs less than noise."""
    random = np.random.default_rng(n_frames)
    noise = np.rint(random.normal(0, scale, (n_frames, 3, 4, 3))).astype(np.int64)
    smooth = np.rint(scale * np.sin(np.arange(n_frames)[:, None, None, None] / 40 + random.uniform(0, 6, (3, 4, 3)))).astype(
        np.int64
    )
    coded = []
    for lattice in (noise, noise.cumsum(axis=0), smooth):
        coded.append(encode_transforms(lattice))
        assert np.array_equal(decode_transforms(coded[-1], n_frames, 3, "transforms.0"), lattice)
    assert n_frames < 40 or scale < 1000 or len(coded[2]) < len(coded[0])
    for cut in range(0, len(coded[0]), 1 + len(coded[0]) // 60):
        with pytest.raises(CorruptFile, match=r"transforms\.0"):
            decode_transforms(coded[0][:cut], n_frames, 3, "transforms.0")


def test_transforms_quantise_within_half_a_step() -> None:
    random = np.random.default_rng(7)
    rest, moved = random.normal(0, 1, (5, 4, 3)), random.normal(0, 9, (8, 5, 4, 3))
    for step in (1e-6, 0.01, 3.0):
        assert np.abs(dequantise(quantise(moved, rest, step), rest, step) - moved).max() <= step / 2 * (1 + 1e-9)
