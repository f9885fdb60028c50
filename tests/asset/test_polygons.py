from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gvpipe.asset.part import Part
from gvpipe.asset.polygons import as_polygons, polygon_corners, polygon_starts
from gvpipe.foundation.errors import InputError
from gvpipe.io.mesh import fan

FACES = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]], np.int32)


@given(st.lists(st.integers(3, 9), min_size=1, max_size=20))
def test_corners_of_fans(counts: list[int]) -> None:
    polygons = np.array(counts, np.int32)
    triangles = fan(polygons.astype(np.int64))  # of corners 0, 1, 2 ... in order
    assert triangles.reshape(-1)[polygon_corners(polygons)].tolist() == list(range(sum(counts)))
    assert polygon_starts(polygons.astype(np.int64))[-1] == len(triangles) - (counts[-1] - 2)


def test_fans_are_polygons() -> None:
    polygons = as_polygons([4, 3], FACES, (), "mesh")
    assert polygons is not None
    assert polygons.tolist() == [4, 3]
    assert as_polygons([3, 3, 3], FACES, (), "mesh") is None


@pytest.mark.parametrize(
    ("polygons", "message"),
    [
        ([4], "the polygons' fans are not 3 triangles"),
        ([2, 4, 3], "the polygons' fans are not 3 triangles"),
        ([3, 4], "triangle 2 does not continue the fan of polygon 1"),
        ([4.0, 3.0], "numbers of corners are needed"),
    ],
)
def test_wrong_polygons_are_refused(polygons: list[Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        as_polygons(polygons, FACES, (), "mesh")


def test_a_message_is_one_line() -> None:
    """Arrays of two dimensions have rows below each other."""
    with pytest.raises(InputError, match=r"^mesh: polygons are array\(\[\[4\], \[3\]\]\) \(ndarray\)"):
        as_polygons(np.array([[4], [3]]), FACES, (), "mesh")


def test_numbers_whose_sum_wraps() -> None:
    """Two that add up to 2^64 more than the triangles need."""
    with pytest.raises(InputError, match="the polygons' fans are not 3 triangles"):
        as_polygons(np.array([2**63, 2**63 + 7], np.uint64), FACES, (), "mesh")


def test_a_polygon_is_of_one_part() -> None:
    parts = (Part("a", (0, 7), (0, 1)), Part("b", (0, 7), (1, 3)))
    with pytest.raises(InputError, match="part 'b' starts inside a polygon"):
        as_polygons([4, 3], FACES, parts, "mesh")
