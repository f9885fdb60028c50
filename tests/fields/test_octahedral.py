"""Unit vectors come back within their angle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from waves import MESH, SHEET, decode, encode

from gvpipe.fields.octahedral import angular_bound, from_octahedral, to_octahedral
from gvpipe.foundation.errors import InputError


def _random(seed: int, shape: tuple[int, ...]) -> np.ndarray:
    vectors = np.random.default_rng(seed).normal(size=(*shape, 3))
    vectors[..., 0] *= seed % 3  # on great circles, too
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True), np.float32)


def _angles(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    a, b = a.astype(np.float64), b.astype(np.float64)
    return np.asarray(np.degrees(2 * np.arcsin(np.minimum(1, np.linalg.norm(a - b, axis=-1) / 2))))


@given(st.integers(0, 999))
def test_coordinates_are_exact(seed: int) -> None:
    vectors = _random(seed, (40,))
    coordinates = to_octahedral(vectors)
    assert np.abs(coordinates).max() <= 1
    assert _angles(from_octahedral(coordinates), vectors).max() < 1e-4


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 999), st.floats(1e-3, 80), st.sampled_from([-1.0, 1.0]), st.sampled_from([-1.0, 1.0]))
def test_the_angle_is_kept(seed: int, degrees: float, du: float, dv: float) -> None:
    vectors = _random(seed, (500,))
    bound = angular_bound(degrees).largest
    moved = to_octahedral(vectors).astype(np.float64) + bound * np.array([du, dv])
    assert _angles(from_octahedral(moved), vectors).max() <= degrees


def test_a_field_of_normals() -> None:
    t = np.arange(12)[:, None]
    tilt = np.stack([0.3 * np.sin(SHEET[:, 0] + t / 4), 0.3 * np.cos(SHEET[:, 1] - t / 5), np.ones((12, len(SHEET)))], axis=-1)
    vectors = (tilt / np.linalg.norm(tilt, axis=-1, keepdims=True)).astype(np.float32)
    coordinates = to_octahedral(vectors)
    section = encode(coordinates, angular_bound(1.0), MESH)
    assert _angles(from_octahedral(decode(section, coordinates)), vectors).max() <= 1.0
    assert 8 * len(section) / vectors[..., 0].size < 4


def test_bad_vectors_are_refused() -> None:
    vectors = _random(1, (4, 6))
    vectors[2, 3] *= 1.5
    with pytest.raises(InputError, match="frame 12, row 3 is a vector of length 1.5"):
        to_octahedral(vectors, 10)
    with pytest.raises(InputError, match="frame 0, row 0"):
        to_octahedral(np.full((1, 1, 3), np.nan))
    with pytest.raises(InputError, match="90 are possible"):
        angular_bound(0)
