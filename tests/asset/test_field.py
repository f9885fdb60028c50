from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gvpipe.asset.field import Field, as_field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError

ROWS = {"vertex": 4, "corner": 6, "triangle": 2, "part": 1}


class Lazy:
    shape = (6, 4)
    dtype = np.dtype(np.float64)

    def __init__(self) -> None:
        self.asked: list[slice] = []

    def __getitem__(self, key: slice, /) -> Array:
        self.asked.append(key)
        return np.arange(24.0).reshape(6, 4)[key]


def test_frames_load_when_they_are_read() -> None:
    lazy = Lazy()
    field = Field(lazy, unit="MPa")
    assert not lazy.asked
    assert field[2].tolist() == [8, 9, 10, 11]
    assert field[-1].dtype == np.float64  # as it is read
    assert field[1:3].shape == (2, 4)
    assert field[::-2].tolist() == np.arange(24.0).reshape(6, 4)[::-2].tolist()
    assert field.read(0, 2).shape == (2, 4, 1)
    assert max(key.stop - key.start for key in lazy.asked) <= 2
    assert field.part(2, 4)[0].tolist() == field[2].tolist()
    assert field.select(np.array([3, 0]))[1].tolist() == [7, 4]
    with pytest.raises(IndexError, match="frame 6"):
        field[6]


def test_components_stay_as_they_were_given() -> None:
    assert Field(np.zeros((2, 4, 1)))[0].shape == (4, 1)
    assert Field(np.zeros((2, 4, 3))).kind == "vector"
    assert Field(np.zeros((2, 4), np.int16)).dtype == np.int16
    assert Field(np.zeros((2, 4), bool)).dtype == np.uint8


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (np.zeros(4), r"shape \(4,\)"),
        (np.zeros((2, 4, 65)), "1 to 64 components"),
        (np.zeros((2, 4), np.int64), "32 bits"),
        (np.zeros((2, 4), complex), "floating-point numbers or integers"),
        (np.zeros((3, 4)), r"\(2 frames, 4 rows, one per vertex\)"),
        (np.zeros((2, 5)), r"\(2 frames, 4 rows, one per vertex\)"),
        (Field(np.zeros((2, 4)), "triangle"), "2 rows, one per triangle"),
    ],
)
def test_wrong_fields_are_refused(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        as_field("stress", given, 2, ROWS, "mesh")


def test_rows_say_the_domain() -> None:
    assert as_field("stress", np.zeros((2, 2)), 2, ROWS, "mesh").domain == "triangle"
    assert as_field("stress", np.zeros((2, 4)), 2, ROWS, "mesh").domain == "vertex"


def test_kinds_are_checked() -> None:
    with pytest.raises(InputError, match="a normal has 3"):
        Field(np.zeros((2, 4)), kind="normal")
    with pytest.raises(InputError, match="did you mean 'vector'"):
        Field(np.zeros((2, 4, 3)), kind="vektor")
