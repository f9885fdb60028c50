"""Frames of one sequence have the same vertices and triangles, and finite positions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mesh_files import FRAME_SUFFIXES, grid

from gvpipe import io
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence


@pytest.mark.parametrize("suffix", FRAME_SUFFIXES)
def test_frames_that_differ(tmp_path: Path, suffix: str) -> None:
    sequence = grid(2)
    io.write(sequence, tmp_path / f"w%d.{suffix}")
    other = MeshSequence(np.concatenate([sequence.read(1, 2)] * 2, axis=1), sequence.faces)
    io.write(other, tmp_path / f"w1.{suffix}")
    with pytest.raises(InputError, match=f"w1.{suffix} has 74 vertices, w0.{suffix} has 37 .frame 1.; all frames"):
        io.read(tmp_path).read(0, 2)
    faces = sequence.faces.copy()
    faces[31] = faces[31][::-1]
    io.write(MeshSequence(sequence.read(1, 2), faces), tmp_path / f"w1.{suffix}")
    with pytest.raises(InputError) as error:
        io.read(tmp_path).read(0, 2)
    assert f"triangle 31 is {faces[31].tolist()} in w1.{suffix}, but {sequence.faces[31].tolist()} in w0.{suffix}" in str(
        error.value
    )
    io.write(MeshSequence(sequence.read(1, 2), sequence.faces[:-1]), tmp_path / f"w1.{suffix}")
    with pytest.raises(InputError, match=f"w1.{suffix} has 49 triangles, w0.{suffix} has 50 .frame 1.; all frames"):
        io.read(tmp_path).read(0, 2)


def test_a_later_frame_that_is_not_finite_or_gone(tmp_path: Path) -> None:
    io.write(grid(3), tmp_path / "%d.obj")
    text = (tmp_path / "2.obj").read_text().split("\n")
    text[4] = "v 1 inf 0"
    (tmp_path / "2.obj").write_text("\n".join(text))
    read = io.read(tmp_path)
    with pytest.raises(InputError, match=r"2.obj: frame 2, vertex 4 is \[1.0, inf, 0.0\]"):
        read.read(0, 3)
    (tmp_path / "2.obj").unlink()
    with pytest.raises(InputError, match=r"2.obj: no such file"):
        read.read(0, 3)
