from __future__ import annotations

import numpy as np
import pytest

from gvpipe.asset.part import Part, check_parts
from gvpipe.foundation.errors import InputError

FACES = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
GOOD = (Part("a", (0, 3), (0, 1), 0), Part("b", (3, 6), (1, 2), None, "a"))


def test_parts_that_hold_all_triangles() -> None:
    assert check_parts(list(GOOD), FACES, 6, 1, "mesh") == GOOD
    empty = (*GOOD, Part("empty", (0, 0), (2, 2)))
    assert check_parts(empty, FACES, 6, 1, "mesh") == empty


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ((Part("a", (0, 6), (0, 1)),), "the parts end at triangle 1 of 2"),
        ((Part("a", (0, 6), (1, 2)),), "triangles 1 to 2; they start at 0"),
        ((Part("a", (0, 6), (0, 3)),), "end by 2"),
        ((Part("a", (0, 7), (0, 2)),), "vertices 0 to 7; there are 6"),
        ((Part("a", (0, 6), (0, 2), 1),), "material 1; there are 1 materials"),
        ((Part("a", (0, 4), (0, 1)), Part("b", (4, 6), (1, 2))), "part 'b' has vertices 4 to 6, but its triangles use 3 to 5"),
    ],
)
def test_wrong_parts_are_refused(parts: tuple[Part, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        check_parts(parts, FACES, 6, 1, "mesh")


def test_ten_thousand_parts() -> None:
    faces = np.arange(30_000, dtype=np.int32).reshape(-1, 3)
    parts = [Part(str(k), (3 * k, 3 * k + 3), (k, k + 1)) for k in range(10_000)]
    assert len(check_parts(parts, faces, 30_000, 0, "mesh")) == 10_000


def test_something_else_is_no_part() -> None:
    with pytest.raises(TypeError, match="part 0 is a str"):
        check_parts(("a",), FACES, 6, 1, "mesh")
