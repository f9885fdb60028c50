"""Quality is monotone for every codec and setting: a higher one takes no fewer bytes and leaves no larger error.

Two things are allowed. A fit that comes out a little better for a finer step may save `SCATTER` of the bytes. Where two
qualities ask for more than is left anyway, both may be one file.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from sequences import patched, waving, wrinkled

import gvpipe
from gvpipe.metrics.vertex_errors import measure_errors
from gvpipe.model.sequence import MeshSequence

SCATTER = 0.015  # part of the bytes, and of the error
COARSE, ALL = (0, 10, 40), (10, 20, 30, 40, 50, 60, 70, 80, 90, 100)
SEQUENCES: dict[str, Callable[[], MeshSequence]] = {
    "waving": functools.partial(waving, 16, 24),
    "patched": patched,
    "wrinkled": wrinkled,
}
VARIANTS: list[tuple[str, dict[str, Any]]] = [
    ("laplacian", {}),
    ("laplacian", {"operator": "cotangent", "delta_prediction": "rigid"}),
    ("laplacian", {"operator": "tutte", "delta_prediction": "none"}),
    ("mcgv", {}),
    ("mcgv", {"image": "jpeg"}),
    ("mcgv", {"profile": "precise"}),
    ("mcgv", {"placement": "halves"}),
    ("mcgv", {"placement": "tiles"}),
    ("mcgv", {"transform": "klt"}),
    ("mcgv", {"prediction": "affine"}),
    ("mcgv", {"prediction": "affine", "image": "jpeg"}),
    ("mcgv", {"prediction": "affine", "placement": "halves"}),
    ("pca", {}),
    ("pca", {"predictor": "rbf"}),
    ("pca", {"predictor": "lsp"}),
    ("pca", {"predictor": "navg"}),
    ("pdct", {}),
    ("pdct", {"clusters": 3, "fineness": 2.0}),
]
NAMED = [pytest.param(*each, id=" ".join([each[0], *(f"{k}={v}" for k, v in each[1].items())])) for each in VARIANTS]


def _files(
    sequence: MeshSequence, codec: str, settings: dict[str, Any], qualities: Sequence[int], folder: Path
) -> list[tuple[int, float]]:
    """Bytes and Karni-Gotsman error of each quality."""
    found = []
    for quality in qualities:
        n_bytes = gvpipe.encode(sequence, folder / "q.mp4", codec, quality=quality, **settings).bytes
        found.append((n_bytes, measure_errors(sequence, gvpipe.decode(folder / "q.mp4").read).kg or 0.0))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", SEQUENCES)
@pytest.mark.parametrize(("codec", "settings"), NAMED)
def test_bytes_rise_and_errors_fall(codec: str, settings: dict[str, Any], name: str, tmp_path: Path) -> None:
    found = _files(SEQUENCES[name](), codec, settings, ALL, tmp_path)
    for (before, error), (after, finer) in pairwise(found):
        assert after >= (1 - SCATTER) * before - 16, found
        assert finer <= (1 + SCATTER) * error, found


@pytest.mark.parametrize(
    ("codec", "settings"),
    [
        pytest.param("mcgv", {"prediction": "affine", "placement": "halves"}, id="mcgv", marks=pytest.mark.slow),
        pytest.param("mcgv", {"prediction": "affine", "image": "jpeg"}, id="mcgv jpeg", marks=pytest.mark.slow),
        pytest.param("pdct", {}, id="pdct"),
    ],
)
def test_qualities_that_ask_for_nothing_have_one_size(codec: str, settings: dict[str, Any], tmp_path: Path) -> None:
    """What predictions alone leave is less than the first qualities ask for, so that pictures and deltas are empty."""
    found = _files(waving(8, 8), codec, settings, COARSE, tmp_path)
    same = [each for each in found if each[1] == found[0][1]]
    assert len(same) >= 2
    assert max(n_bytes for n_bytes, _ in same) - min(n_bytes for n_bytes, _ in same) <= 4  # digits of numbers in the header
    assert [n_bytes for n_bytes, _ in found[len(same) :]] == sorted(n_bytes for n_bytes, _ in found[len(same) :])
    assert min(found)[0] == min(n_bytes for n_bytes, _ in same)


@pytest.mark.slow
def test_a_blend_alone_is_taken_where_a_finer_step_meets_the_target(tmp_path: Path) -> None:
    """Pictures took 13 % more bytes than at quality 10, since the step of the nearest error left more than was asked for."""
    found = _files(waving(16, 24), "mcgv", {}, (5, 10), tmp_path)
    assert found[0][0] <= found[1][0]
    assert found[0][1] >= found[1][1]
