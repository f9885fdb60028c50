"""OBJ as programs write it: faces, indices, colours, and errors that name the line."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mesh_files import SQUARE, obj_file

from gvpipe import io
from gvpipe.errors import InputError


def test_obj_keeps_order_where_texture_indices_differ(tmp_path: Path) -> None:
    text = (
        SQUARE + "v 9 9 9\n" + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 .5\nvn 0 0 1\nf 1/5/1 2/2/1 3/3/1\nf 1/1/1 3/3/1 4/4/1\n"
    )
    read = io.read(obj_file(tmp_path, text))
    assert read.read(0, 1)[0].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [9, 9, 9]]
    assert read.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert read.attributes["uv"].tolist() == [[0.5, 0.5], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]]
    assert np.asarray(read.attributes["normal"]).tolist() == [[0, 0, 1]] * 4 + [[0, 0, 0]]


OBJ_FACES = {
    "quad": ("f 1 2 3 4\n", [[0, 1, 2], [0, 2, 3]]),
    "mixed polygons": ("f 1 2 3\nf 4 3 2 1\nf 1 2 4\n", [[0, 1, 2], [3, 2, 1], [3, 1, 0], [0, 1, 3]]),
    "relative": ("f -4 -3 -2\n", [[0, 1, 2]]),
    "relative before the end": ("f -4 -3 -2\nv 5 5 5\nf -5 -1 2\n", [[0, 1, 2], [0, 4, 1]]),
    "groups": ("o a\ng b\nusemtl c\ns 1\nf 1 2 3\no d\nf 1 3 4\nl 1 2\np 1\n", [[0, 1, 2], [0, 2, 3]]),
    "materials do not sort": (
        "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\nusemtl a\nf 4 3 2\n",
        [[0, 1, 2], [0, 2, 3], [3, 2, 1]],
    ),
    "mixed corners": (
        "vt 0 0\nvn 0 0 1\nf 1 2 3\nf 1/1 3/1 4/1\nf 1//1 2//1 4//1\n",
        [[0, 1, 2], [0, 2, 3], [0, 1, 3]],
    ),
    "empty corner part": ("vt 0 0\nf 1/ 2/ 3/\n", [[0, 1, 2]]),
    "windows": ("f 1 2 3\r\nf 1 3 4\r\n", [[0, 1, 2], [0, 2, 3]]),
    "no last line end": ("f 1 2 3", [[0, 1, 2]]),
    "comments": ("# f 4 4 4\nf 1 2 3 # f 3 3 3\n", [[0, 1, 2]]),
    "indented, tabs, blanks": ("  f\t1  2\t3  \n\n\n\tf 1 3 4 \n", [[0, 1, 2], [0, 2, 3]]),
    "continued": ("f 1 2 \\\n3\n", [[0, 1, 2]]),
    "other keywords": ("vp 1 2\nfoo 1\nfo 9 9 9\nf 1 2 3\n", [[0, 1, 2]]),
}


@pytest.mark.parametrize(("text", "faces"), OBJ_FACES.values(), ids=OBJ_FACES.keys())
@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_obj_faces(tmp_path: Path, text: str, faces: Any, line_end: str) -> None:
    whole = (SQUARE + text).replace("\r\n", "\n").replace("\n", line_end)
    read = io.read(obj_file(tmp_path, "\ufeff" + whole))
    assert read.faces.tolist() == faces
    assert read.read(0, 1)[0][:4].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]


def test_obj_colours_and_weights(tmp_path: Path) -> None:
    read = io.read(obj_file(tmp_path, "v 0 0 0 1 0 0\nv 1 0 0 0 0.2 0\nv 1 1 0 0 0 .5\nf 1 2 3\n"))
    assert read.attributes["color"].tolist() == [[255, 0, 0, 255], [0, 51, 0, 255], [0, 0, 128, 255]]
    read = io.read(obj_file(tmp_path, "v 0 0 0 1\nv 1 0 0\nv 1e0 1 -.5E1 1 0 0\nf 1 2 3\n"))
    assert read.read(0, 1)[0].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, -5]]
    assert read.attributes == {}


def test_obj_relative_indices_are_never_taken_from_the_first_frame(tmp_path: Path) -> None:
    obj_file(tmp_path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nf -3 -2 -1\nv 0 1 0\n", "1.obj")
    obj_file(tmp_path, "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf -3 -2 -1\n", "2.obj")
    with pytest.raises(InputError, match=r"triangle 0 is \[1, 2, 3\] in 2.obj, but \[0, 1, 2\] in 1.obj"):
        io.read(tmp_path).read(0, 2)


BAD_OBJ = {
    "empty": ("", "it has no vertices"),
    "prose": ("this is a text\nfor people\n", "it has no vertices"),
    "no faces": (SQUARE, "it has no faces"),
    "letters": ("v a b c\nf 1 1 1\n", "cannot be read as OBJ"),
    "comma": ("v 1,0 2,0 3,0\nf 1 1 1\n", "cannot be read as OBJ"),
    "short vertex": ("v 1 2\nv 1 2 3 4\nf 1 1 1\n", "entry 1 has 2 numbers"),
    "out of range": (SQUARE + "f 1 2 5\n", "triangle 0 is [0, 1, 4], but vertices are 0..3"),
    "before the start": (SQUARE + "f 1 2 -5\n", "but vertices are 0..3"),
    "zero": (SQUARE + "f 0 1 2\n", "OBJ counts from 1"),
    "two corners": (SQUARE + "f 1 2 3\nf 1 2\n", "face 2 has 2 corners"),
    "bad corner": (SQUARE + "f 1 2 x\n", "cannot be read as OBJ"),
    "four parts": (SQUARE + "f 1/1/1/1 2 3\n", "not a corner"),
    "texture index": (SQUARE + "vt 0 0\nf 1/1 2/2 3/1\n", "'vt' entry outside 1..1"),
    "nan": ("v 0 0 0\nv 1 nan 0\nv 1 1 0\nf 1 2 3\n", "frame 0, vertex 1 is [1.0, nan, 0.0]"),
    "too large": ("v 0 0 0\nv 1 1e39 0\nv 1 1 0\nf 1 2 3\n", "float32 can hold"),
    "nul": ("v 0 0 0\0\0\nf 1 1 1\n", "cannot be read as OBJ"),
}


@pytest.mark.parametrize(("text", "message"), BAD_OBJ.values(), ids=BAD_OBJ.keys())
def test_obj_errors(tmp_path: Path, text: str, message: str) -> None:
    path = obj_file(tmp_path, text)
    with pytest.raises(InputError) as error:
        io.read(path)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.sampled_from(
            ["v", "f", "vt", "vn", " ", "\n", "1", "2", "3", "-1", "/", "//", ".", "e", "#", "\\", "\r", "\t", "é"]
        ),
        max_size=40,
    )
)
def test_obj_never_fails_otherwise(tmp_path: Path, pieces: list[str]) -> None:
    path = obj_file(tmp_path, "v 0 0 0\nv 1 0 0\nf 1 2 1\n" + "".join(pieces))
    with contextlib.suppress(InputError):
        io.read(path)
