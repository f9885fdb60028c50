"""Patterns of frame names, also those of other programs."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.io.frames.pattern import Pattern, match_pattern
from gvpipe.model.sequence import MeshSequence


@pytest.mark.parametrize(
    ("path", "pattern"),
    [
        ("w.#.obj", Pattern("w.", ".obj", 1)),
        ("w.###.obj", Pattern("w.", ".obj", 3)),
        ("$F.obj", Pattern("", ".obj", 0)),
        ("$F4.obj", Pattern("", ".obj", 4)),
        ("C#_%04d.obj", Pattern("C#_", ".obj", 4)),
        ("a#b/f.obj", None),
    ],
)
def test_forms(path: str, pattern: Pattern | None) -> None:
    assert match_pattern(path) == pattern


def test_one_number_in_a_pattern() -> None:
    with pytest.raises(InputError, match="2 numbers"):
        match_pattern("##_##.obj")


def test_a_name_that_exists_is_no_pattern(sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence.part(0, 1), tmp_path / "C.obj")
    (tmp_path / "C.obj").rename(tmp_path / "C#.obj")
    assert len(gvpipe.read(tmp_path / "C#.obj")) == 1


@given(st.integers(0, 10**7), st.integers(0, 8))
def test_pattern_inverts(number: int, width: int) -> None:
    pattern = Pattern("a", ".obj", width)
    assert pattern.number(pattern.name(number)) == number
    assert pattern.name(number) == f"a%0{width}d.obj" % number if width else True


def test_match_pattern() -> None:
    assert match_pattern("out/f%04d_x.obj") == Pattern("f", "_x.obj", 4)
    assert match_pattern("out/f%d.obj") == Pattern("f", ".obj", 0)
    assert match_pattern("out/f.obj") is None
