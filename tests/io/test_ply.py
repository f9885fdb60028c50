"""PLY as text and binary, with polygons and other properties."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from mesh_files import PLY_ROWS

from gvpipe import io
from gvpipe.errors import InputError

PLY_HEAD = (
    "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{}"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
)


def test_ply_text_colours_and_truncation(tmp_path: Path) -> None:
    head = PLY_HEAD.format("ascii", "property uchar red\nproperty uchar green\nproperty uchar blue\n")
    text = head + "\n".join(f"{row} {10 * i} 20 30" for i, row in enumerate(PLY_ROWS)) + "\n3 0 1 2\n3 0 2 3\n"
    (tmp_path / "a.ply").write_text(text)
    read = io.read(tmp_path / "a.ply")
    assert read.faces.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert read.attributes["color"].tolist() == [[10 * i, 20, 30, 255] for i in range(4)]
    (tmp_path / "b.ply").write_text(text[:-8])
    with pytest.raises(InputError, match=r"b.ply cannot be read as PLY: it announces 2 of element 'face' but ends"):
        io.read(tmp_path / "b.ply")


def test_ply_texture_does_not_split_vertices(tmp_path: Path) -> None:
    head = PLY_HEAD.format("ascii", "").replace("end_header", "property list uchar float texcoord\nend_header")
    faces = "3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 6 .5 .5 1 1 0 1\n"
    (tmp_path / "a.ply").write_text(head + "\n".join(PLY_ROWS) + "\n" + faces)
    read = io.read(tmp_path / "a.ply")
    assert read.n_vertices == 4
    assert read.attributes["uv"].tolist() == [[0, 0], [1, 0], [1, 1], [0.5, 0.5], [1, 1], [0, 1]]


def test_ply_polygons_keep_their_order(tmp_path: Path) -> None:
    head = PLY_HEAD.format("ascii", "").replace("face 2", "face 3")
    (tmp_path / "a.ply").write_text(head + "\r\n".join(PLY_ROWS) + "\r\n4 0 1 2 3\r\n3 0 1 2\r\n3 3 2 1\r\n")
    assert io.read(tmp_path / "a.ply").faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 2, 1]]


def ply_binary(order: str, faces: list[list[int]]) -> bytes:
    """A hand-made binary file with a flag before each face and a list behind it; ``order`` is NumPy's letter."""
    name = "binary_big_endian" if order == ">" else "binary_little_endian"
    head = PLY_HEAD.format(name, "").replace("property list", "property uchar flag\nproperty list")
    head = head.replace("face 2", f"face {len(faces)}").replace("end_header", "property list uchar short id\nend_header")
    rows = np.array([row.split() for row in PLY_ROWS], order + "f4").tobytes()
    for face in faces:
        rows += bytes([7, len(face)]) + np.array(face, order + "i4").tobytes() + bytes([1, 0, 0])
    return head.encode() + rows


@pytest.mark.parametrize("order", ["<", ">"])
def test_ply_binary_orders_and_other_properties(tmp_path: Path, order: str) -> None:
    (tmp_path / "a.ply").write_bytes(ply_binary(order, [[0, 1, 2, 3], [3, 2, 1, 0]]))
    read = io.read(tmp_path / "a.ply")
    assert read.read(0, 1)[0].tolist() == [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
    assert read.faces.tolist() == [[0, 1, 2], [0, 2, 3], [3, 2, 1], [3, 1, 0]]
    assert read.polygons is not None and read.polygons.tolist() == [4, 4]


@pytest.mark.parametrize("faces", [[[0, 1, 2], [0, 1, 2, 3], [2, 3, 0]], [[0, 1, 2, 3], [0, 1, 2], [2, 3, 0]]])
def test_ply_binary_polygons_that_differ_are_refused(tmp_path: Path, faces: list[list[int]]) -> None:
    (tmp_path / "a.ply").write_bytes(ply_binary("<", faces))
    with pytest.raises(InputError, match=r"list 'vertex_indices' of element 'face' has lengths \d and \d; in a binary file"):
        io.read(tmp_path / "a.ply")


PLY_WRONG = {
    "type": ("property float x", "property half x", "its header holds 'property half x', which is not PLY's"),
    "no y": ("property float y", "property float w", "its vertices lack x, y or z"),
    "no list": ("property list uchar int vertex_indices", "property int a", "its faces have no list vertex_indices or"),
    "short list": ("3 0 2 3", "4 0 2 3", "a line of element 'face' has fewer numbers than its properties need"),
    "negative list": ("3 0 2 3", "-3 0 2 3", "a list of element 'face' has length -3"),
    "word": ("1 1 0", "1 one 0", "."),
}


@pytest.mark.parametrize(("old", "new", "message"), PLY_WRONG.values(), ids=PLY_WRONG.keys())
def test_ply_that_is_wrong(tmp_path: Path, old: str, new: str, message: str) -> None:
    text = PLY_HEAD.format("ascii", "") + "\n".join(PLY_ROWS) + "\n3 0 1 2\n3 0 2 3\n"
    assert old in text
    (tmp_path / "a.ply").write_text(text.replace(old, new))
    with pytest.raises(InputError, match=f"a.ply cannot be read as PLY: {message}"):
        io.read(tmp_path / "a.ply")
