"""Holes of a field, NaN, come back where they were."""

from __future__ import annotations

import numpy as np
import pytest
from waves import EXACT, MESH, SHEET, decode, encode, wave

from gvpipe.fields.values import FieldBound
from gvpipe.foundation.errors import InputError


def _with_holes(seed: int = 0, share: float = 0.1) -> tuple[np.ndarray, np.ndarray]:
    values = wave(n_components=2)
    holes = np.random.default_rng(seed).random(values.shape) < share
    holes[:, 3] = True  # a row without any value
    values[holes] = np.nan
    return values, holes


@pytest.mark.parametrize("bound", [FieldBound(0.05), EXACT])
def test_holes_come_back(bound: FieldBound) -> None:
    values, holes = _with_holes()
    back = decode(encode(values, bound, holes=True), values)
    assert np.array_equal(np.isnan(back), holes)
    assert np.abs(back[~holes] - values[~holes]).max() <= bound.largest


def test_infinity_is_refused_beside_holes() -> None:
    values, _ = _with_holes()
    values[2, 0, 1] = np.inf
    with pytest.raises(InputError, match="frame 2, row 0, component 1"):
        encode(values, FieldBound(0.05), holes=True)


def test_all_holes() -> None:
    values = np.full((4, len(SHEET), 1), np.nan, np.float32)
    section = encode(values, FieldBound(1), holes=True)
    assert np.isnan(decode(section, values, MESH)).all()
    assert len(section) < 60


def test_still_holes_cost_one_outline() -> None:
    values = wave(n_frames=30)
    values[:, (SHEET[:, 0] > SHEET[:, 0].mean())] = np.nan
    few = values[:10]
    mask = len(encode(np.where(np.isnan(values), values, 0), FieldBound(1), holes=True))
    assert mask < len(encode(np.where(np.isnan(few), few, 0), FieldBound(1), holes=True)) + 12
