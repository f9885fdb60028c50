"""Sequences come back from files exactly as they went in, and what is wrong with a file is said in one line."""

from __future__ import annotations

import contextlib
import errno
import os
import struct
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from io import FileIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gvpipe import io
from gvpipe.atomic import atomic_path
from gvpipe.errors import InputError, OutputError
from gvpipe.sequence import MeshSequence

FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)
POSITIONS = hnp.arrays(np.float32, st.tuples(st.integers(1, 4), st.integers(3, 6), st.just(3)), elements=FLOATS)
FACES = np.array([[2, 0, 1], [0, 1, 2], [1, 1, 0]], np.int32)
FRAME_SUFFIXES = ["obj", "ply", "off", "glb"]
fast = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)


def same_bits(a: Any, b: Any) -> bool:
    return np.asarray(a).shape == np.asarray(b).shape and np.asarray(a).tobytes() == np.asarray(b).tobytes()


def grid(n_frames: int = 4, n: int = 5, attributes: Mapping[str, Any] | None = None) -> MeshSequence:
    """A waving sheet of (n + 1)^2 vertices and one vertex that no triangle uses."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    rest = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    moving = np.stack([rest + np.array([0, 0, 1]) * np.sin(rest + 0.3 * f) / 3 for f in range(n_frames)])
    positions = np.concatenate([moving, np.full((n_frames, 1, 3), 7.25)], axis=1)
    a = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = np.concatenate([np.stack([a, a + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + n + 1], 1)])
    return MeshSequence(positions.astype(np.float32), faces.astype(np.int32), attributes=attributes or {})


def obj_file(folder: Path, text: str, name: str = "f.obj") -> Path:
    (folder / name).write_bytes(text.encode())
    return folder / name


SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


# npz


@fast
@given(POSITIONS, st.floats(0.5, 1000))
def test_npz_round_trip(tmp_path: Path, positions: Any, fps: float) -> None:
    io.write(MeshSequence(positions, FACES, fps), tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz")
    assert same_bits(read.positions, positions)
    assert same_bits(read.faces, FACES)
    assert read.fps == fps


def test_npz_attributes_and_numpy_reads_it(tmp_path: Path) -> None:
    sequence = grid()
    n, corners = sequence.n_vertices, 3 * len(sequence.faces)
    rng = np.random.default_rng(0)
    kept = {
        "uv": rng.random((corners, 2), np.float32),
        "normal": rng.random((n, 3), np.float32),
        "color": rng.integers(0, 256, (n, 4), np.uint8),
    }
    io.write(grid(attributes=kept), tmp_path / "a.npz")
    read = io.read(tmp_path / "a.npz", fps=12)
    assert read.fps == 12
    assert all(same_bits(read.attributes[name], kept[name]) for name in kept)
    with np.load(tmp_path / "a.npz") as archive:
        assert set(archive.files) == {"vertices", "faces", "fps", *kept}
    first = (tmp_path / "a.npz").read_bytes()
    io.write(grid(attributes=kept), tmp_path / "b.npz")
    assert (tmp_path / "b.npz").read_bytes() == first


def test_npz_float64_and_no_fps(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", vertices=np.ones((2, 3, 3)) / 3, faces=FACES.astype(np.uint64))
    read = io.read(tmp_path / "a.npz")
    assert read.fps == 30
    assert same_bits(read.positions, np.full((2, 3, 3), 1 / 3, np.float32))


OK = {"vertices": np.zeros((2, 3, 3), np.float32), "faces": FACES}
BAD_ARCHIVES = {
    "no vertices": ({"faces": FACES}, "no array 'vertices' (it holds faces)"),
    "no faces": ({"vertices": OK["vertices"]}, "no array 'faces'"),
    "flat": ({**OK, "vertices": np.zeros((3, 3))}, "'vertices' has shape (3, 3)"),
    "text": ({**OK, "vertices": np.full((1, 3, 3), "a")}, "'vertices' has shape (1, 3, 3) and type <U1"),
    "objects": ({**OK, "vertices": np.full((1, 3, 3), None)}, "cannot be read as .npz (Object arrays"),
    "faces": ({**OK, "faces": FACES[:, :2]}, "faces have shape (3, 2)"),
    "index": ({**OK, "faces": FACES + 1}, "vertex indices must lie in 0..2"),
    "fps": ({**OK, "fps": np.arange(3)}, "'fps' has shape (3,)"),
    "fps 0": ({**OK, "fps": 0}, "fps is 0"),
    "uv": ({**OK, "uv": np.zeros((3, 3))}, "'uv' has shape (3, 3)"),
    "uv rows": ({**OK, "uv": np.zeros((4, 2))}, "'uv' has 4 rows"),
    "nan": ({**OK, "vertices": np.full((2, 3, 3), np.nan)}, "frame 0, vertex 0 is [nan, nan, nan]"),
    "too large": ({**OK, "vertices": np.full((2, 3, 3), 1e300)}, "float32 can hold"),
}


@pytest.mark.parametrize(("arrays", "message"), BAD_ARCHIVES.values(), ids=BAD_ARCHIVES.keys())
def test_npz_errors(tmp_path: Path, arrays: Any, message: str) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InputError) as error:
        io.read(tmp_path / "a.npz")
    assert message in str(error.value)
    assert str(tmp_path / "a.npz") in str(error.value)
    assert "\n" not in str(error.value)


def test_npz_damaged(tmp_path: Path) -> None:
    io.write(grid(2, 2), tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for stop in range(0, len(whole), 7):
        (tmp_path / "b.npz").write_bytes(whole[:stop])
        with pytest.raises(InputError, match=r"is not an .npz archive, or is cut short"):
            io.read(tmp_path / "b.npz")
    np.save(tmp_path / "c.npy", FACES)
    os.rename(tmp_path / "c.npy", tmp_path / "c.npz")
    with pytest.raises(InputError, match=r"is not an \.npz archive"):
        io.read(tmp_path / "c.npz")
    with pytest.raises(InputError, match="no such file"):
        io.read(tmp_path / "d.npz")


def test_npz_flipped_bytes(tmp_path: Path) -> None:
    io.write(grid(2, 2), tmp_path / "a.npz")
    whole = (tmp_path / "a.npz").read_bytes()
    for at in range(0, len(whole), 11):
        (tmp_path / "b.npz").write_bytes(whole[:at] + bytes([whole[at] ^ 255]) + whole[at + 1 :])
        with contextlib.suppress(InputError):  # a flip in a field that zip readers ignore does no harm
            assert same_bits(io.read(tmp_path / "b.npz").positions, grid(2, 2).positions)


# frame files, both ways


@pytest.mark.parametrize("suffix", FRAME_SUFFIXES)
def test_frames_round_trip(tmp_path: Path, suffix: str) -> None:
    sequence = grid()
    io.write(sequence, tmp_path / "out" / f"w%03d.{suffix}", start=8)
    assert sorted(os.listdir(tmp_path / "out")) == [f"w{i:03d}.{suffix}" for i in range(8, 12)]
    read = io.read(tmp_path / "out", fps=24)
    assert read.fps == 24
    assert read.positions.shape == sequence.positions.shape
    assert same_bits(read.faces, sequence.faces)
    assert same_bits(read.read(2, 4), sequence.read(2, 4))  # out of order, then from the spool
    assert same_bits(read.read(0, 4), sequence.read(0, 4))
    assert read.attributes == {}


@fast
@given(POSITIONS)
def test_text_is_exact(tmp_path: Path, positions: Any) -> None:
    sequence = MeshSequence(positions, FACES)
    for suffix in ("obj", "off"):
        with tempfile.TemporaryDirectory(dir=tmp_path) as folder:
            io.write(sequence, f"{folder}/%d.{suffix}")
            read = io.read(folder)
            assert same_bits(read.read(0, len(positions)), positions)
            assert same_bits(read.faces, FACES)


def test_stl_is_welded_in_order_of_appearance(tmp_path: Path) -> None:
    sequence = grid()
    io.write(sequence, tmp_path / "%d.stl")
    read = io.read(tmp_path)
    assert read.n_vertices == sequence.n_vertices - 1  # the unused vertex is not in the file
    first_seen = np.unique(read.faces.ravel(), return_index=True)[1]
    assert (np.diff(first_seen) > 0).all()
    assert same_bits(read.read(0, 4)[:, read.faces], sequence.read(0, 4)[:, sequence.faces])


def test_stl_that_tears(tmp_path: Path) -> None:
    sequence = grid()
    io.write(sequence, tmp_path / "%d.stl")
    data = bytearray((tmp_path / "2.stl").read_bytes())
    data[84 + 50 * 3 + 12 : 84 + 50 * 3 + 16] = struct.pack("<f", 99)  # triangle 3, corner 0, x
    (tmp_path / "2.stl").write_bytes(data)
    read = io.read(tmp_path)
    with pytest.raises(InputError, match=r"of triangle \d+ shares a vertex with another in 0.stl but not in 2.stl"):
        read.read(0, 4)


def test_stl_text_and_other_count(tmp_path: Path) -> None:
    triangle = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 {} 0\nendloop\nendfacet\n"
    (tmp_path / "1.stl").write_text("solid a\n" + triangle.format(1) * 2 + "endsolid a\n")
    (tmp_path / "2.stl").write_text("solid a\n" + triangle.format(2) * 2 + "endsolid a\n")
    (tmp_path / "3.stl").write_text("solid a\n" + triangle.format(1) + "endsolid a\n")
    read = io.read(tmp_path)
    assert read.faces.tolist() == [[0, 1, 2], [0, 1, 2]]
    assert read.read(1, 2)[0].tolist() == [[0, 0, 0], [1, 0, 0], [0, 2, 0]]
    with pytest.raises(InputError, match=r"3.stl has 1 triangles, 1.stl has 2"):
        read.read(2, 3)


UV_VERTEX = np.linspace(0, 1, 74, dtype=np.float32).reshape(37, 2)
COLORS = np.random.default_rng(1).integers(0, 256, (37, 4), np.uint8) | np.array([0, 0, 0, 255], np.uint8)


@pytest.mark.parametrize("suffix", ["obj", "ply", "off", "glb"])
@pytest.mark.parametrize("kept", [{"uv"}, {"color"}, {"uv", "color"}], ids=lambda kept: "+".join(sorted(kept)))
def test_vertex_attributes(tmp_path: Path, suffix: str, kept: set[str]) -> None:
    attributes = {name: values for name, values in (("uv", UV_VERTEX), ("color", COLORS)) if name in kept}
    sequence = grid(attributes=attributes)
    assert sequence.n_vertices == 37
    io.write(sequence, tmp_path / f"%d.{suffix}")
    read = io.read(tmp_path)
    assert same_bits(read.read(0, 4), sequence.read(0, 4))
    assert set(read.attributes) == kept - ({"uv"} if suffix == "off" else set())
    used = np.unique(sequence.faces)
    for name, values in read.attributes.items():
        np.testing.assert_allclose(np.asarray(values)[used], attributes[name][used], atol=1e-7)


@pytest.mark.parametrize("suffix", ["obj", "ply"])
def test_corner_texture_coordinates(tmp_path: Path, suffix: str) -> None:
    uv = np.random.default_rng(2).random((150, 2), np.float32)
    io.write(grid(attributes={"uv": uv}), tmp_path / f"%d.{suffix}")
    read = io.read(tmp_path)
    assert read.n_vertices == 37
    assert same_bits(read.attributes["uv"], uv)


# OBJ as others write it


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


# other formats as others write them


PLY_HEAD = (
    "ply\nformat {} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{}"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
)
PLY_ROWS = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"]


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
    assert "2 of 2 faces have more than 3 corners" in read.notes[0]


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


def test_off_polygons_keep_their_order(tmp_path: Path) -> None:
    text = (
        "# c\nNOFF 4 3 0 # counts\n"
        + "\n\n".join(row + " 0 0 1" for row in PLY_ROWS)
        + "\n4 0 1 2 3\n3 0 1 2 255 0 0\n3 3 2 1\n"
    )
    (tmp_path / "a.off").write_text(text)
    assert io.read(tmp_path / "a.off").faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 2, 1]]


def glb(positions: Any, nodes: list[dict[str, Any]], primitives: int = 1) -> bytes:
    """A hand-made GLB: one mesh of some equal primitives, used by the nodes given."""
    import json

    blob = np.asarray(positions, "<f4").tobytes() + np.array([0, 1, 2, 0], "<u2").tobytes()
    n_bytes = 12 * len(positions)
    tree = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(blob)}],
        "bufferViews": [{"buffer": 0, "byteLength": n_bytes}, {"buffer": 0, "byteOffset": n_bytes, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}] * primitives}],
        "nodes": nodes,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "scene": 0,
    }
    header = json.dumps(tree).encode()
    header += b" " * (-len(header) % 4)
    chunks = struct.pack("<II", len(header), 0x4E4F534A) + header + struct.pack("<II", len(blob), 0x004E4942) + blob
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def test_glb_scenes_are_joined_with_their_transforms(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 5, 5]], np.float32)
    nodes = [{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b", "translation": [1, 2, 3], "scale": [-1, 1, 1]}]
    for i in range(3):
        (tmp_path / f"{i}.glb").write_bytes(glb(corners + i, nodes, primitives=2))
    read = io.read(tmp_path)
    assert read.positions.shape == (3, 16, 3)
    moved = corners * [-1, 1, 1] + [1, 2, 3]
    blocks = read.read(0, 1)[0].reshape(4, 4, 3)
    assert sorted(block[0].tolist() for block in blocks) == sorted([corners[0].tolist(), moved[0].tolist()] * 2)
    for block, faces in zip(blocks, read.faces - 4 * np.arange(4)[:, None], strict=True):
        mirrored = same_bits(block, moved.astype(np.float32))
        assert mirrored or same_bits(block, corners)
        assert faces.tolist() == ([2, 1, 0] if mirrored else [0, 1, 2])
    later = read.read(2, 3)[0].reshape(4, 4, 3)
    for before, after in zip(blocks, later, strict=True):
        assert (abs(after - before) == 2).all()


@pytest.mark.parametrize("included", [True, False])
def test_glb_normals_are_those_of_the_file(tmp_path: Path, included: bool) -> None:
    import trimesh

    mesh = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], vertex_normals=[[0, 0.6, 0.8]] * 3, process=False)
    (tmp_path / "a.glb").write_bytes(mesh.export(file_type="glb", include_normals=included))
    read = io.read(tmp_path / "a.glb")
    assert set(read.attributes) == ({"normal"} if included else set())
    for values in read.attributes.values():
        np.testing.assert_allclose(values, [[0, 0.6, 0.8]] * 3, atol=1e-6)


GARBAGE = [("ply", b"hello"), ("stl", b"hello"), ("off", b"hello"), ("glb", b"hello"), ("gltf", b"hello")]


@pytest.mark.parametrize(("suffix", "data"), GARBAGE + [(suffix, b"") for suffix, _ in GARBAGE])
def test_garbage(tmp_path: Path, suffix: str, data: bytes) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(data)
    with pytest.raises(InputError) as error:
        io.read(tmp_path / f"a.{suffix}")
    assert f"a.{suffix} cannot be read as {suffix.upper()}: " in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("suffix", ["ply", "stl", "off", "glb"])
def test_every_truncation_is_refused(tmp_path: Path, suffix: str) -> None:
    io.write(grid(1, 2), tmp_path / f"a.{suffix}")
    whole = (tmp_path / f"a.{suffix}").read_bytes()
    for stop in range(0, len(whole) - 2, 13):  # a text without its last line end is whole
        (tmp_path / f"b.{suffix}").write_bytes(whole[:stop])
        with pytest.raises(InputError, match=f"b.{suffix} "):
            io.read(tmp_path / f"b.{suffix}")


# differences between frames, and where frames live


@pytest.mark.parametrize("suffix", FRAME_SUFFIXES)
def test_frames_that_differ(tmp_path: Path, suffix: str) -> None:
    sequence = grid(2)
    io.write(sequence, tmp_path / f"w%d.{suffix}")
    other = MeshSequence(np.concatenate([sequence.read(1, 2)] * 2, axis=1), sequence.faces)
    io.write(other, tmp_path / f"w1.{suffix}")
    with pytest.raises(InputError, match=f"w1.{suffix} has 74 vertices, w0.{suffix} has 37; all frames"):
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
    with pytest.raises(InputError, match=f"w1.{suffix} has 49 triangles, w0.{suffix} has 50; all frames"):
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
    with pytest.raises(InputError, match=r"2.obj cannot be read as OBJ: No such file"):
        read.read(0, 3)


def test_frames_are_parsed_once(tmp_path: Path) -> None:
    io.write(grid(3), tmp_path / "%d.obj")
    read = io.read(tmp_path)
    first = read.read(0, 3)
    for file in tmp_path.iterdir():
        file.unlink()
    assert same_bits(read.read(0, 3), first)
    assert same_bits(read.positions[2:0:-1], first[2:0:-1])


def test_without_a_spool_frames_are_parsed_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    io.write(grid(3), tmp_path / "%d.obj")

    def full(*args: Any, **options: Any) -> Any:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    read = io.read(tmp_path)
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_gives_the_spool_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    io.write(grid(3), tmp_path / "%d.obj")
    monkeypatch.setattr(tempfile, "TemporaryFile", lambda **options: FileIO("/dev/full", "r+"))
    read = io.read(tmp_path)
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))
    assert same_bits(read.read(0, 3), grid(3).read(0, 3))


# writing


def test_write_targets(tmp_path: Path) -> None:
    sequence = grid(2)
    io.write(sequence, f"{tmp_path}/new/")
    assert sorted(os.listdir(tmp_path / "new")) == ["0000.obj", "0001.obj"]
    io.write(sequence, tmp_path / "new", start=1)
    assert sorted(os.listdir(tmp_path / "new")) == ["0000.obj", "0001.obj", "0002.obj"]
    io.write(grid(1), tmp_path / "one.ply")
    assert io.read(tmp_path / "one.ply").n_frames == 1


BAD_TARGETS = {
    "bare": ("out", "cannot be written as a file without extension; give a folder that ends in '/'"),
    "unknown": ("out_%d.xyz", "cannot be written as .xyz"),
    "read only": ("out_%d.gltf", "cannot be written as .gltf"),
    "no pattern": ("out.obj", "would hold one frame of 2; give a pattern such as"),
    "two numbers": ("%d_%d.obj", "2 numbers in the pattern"),
}


@pytest.mark.parametrize(("target", "message"), BAD_TARGETS.values(), ids=BAD_TARGETS.keys())
def test_write_errors(tmp_path: Path, target: str, message: str) -> None:
    with pytest.raises(InputError) as error:
        io.write(grid(2), tmp_path / target)
    assert message in str(error.value)
    assert os.listdir(tmp_path) == []


def test_a_later_frame_that_fails_leaves_whole_files_only(tmp_path: Path) -> None:
    io.write(grid(3), tmp_path / "in" / "%d.obj")
    (tmp_path / "in" / "1.obj").write_text("v")
    read = io.read(tmp_path / "in")
    (tmp_path / "a.npz").write_bytes(b"old")
    with pytest.raises(InputError, match=r"1.obj cannot be read"):
        io.write(read, tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() == b"old"
    assert sorted(os.listdir(tmp_path)) == ["a.npz", "in"]


def test_output_errors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OutputError, match="No such file or directory; create its folder first"):
        io.write(grid(2), tmp_path / "no" / "a.npz")
    (tmp_path / "file").touch()
    with pytest.raises(OutputError, match="choose another folder"):
        io.write(grid(2), tmp_path / "file" / "%d.obj")

    def full(*args: Any, **options: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "open", full)
    with pytest.raises(OutputError) as error:
        io.write(grid(2), tmp_path / "a.npz")
    assert str(error.value) == (
        f"cannot write {tmp_path / 'a.npz'}: No space left on device; free some space or choose another disk"
    )
    assert os.listdir(tmp_path) == ["file"]


def test_atomic_path(tmp_path: Path) -> None:
    target = tmp_path / "a.mp4"
    target.write_text("old")
    with pytest.raises(KeyboardInterrupt), atomic_path(target) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert target.read_text() == "old"
    with atomic_path(target) as temporary:
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".mp4")
        temporary.write_text("new")
        assert target.read_text() == "old"
    assert target.read_text() == "new"
    assert os.listdir(tmp_path) == ["a.mp4"]
    with pytest.raises(OutputError, match="not an ordinary file"), atomic_path(tmp_path):
        pass


@pytest.mark.skipif(sys.platform == "win32", reason="permissions and links of POSIX")
def test_atomic_path_keeps_links_and_permissions(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "link.npz").symlink_to(tmp_path / "real" / "a.npz")
    with atomic_path(tmp_path / "link.npz") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.npz").is_symlink()
    (tmp_path / "plain").touch()
    assert (tmp_path / "real" / "a.npz").stat().st_mode == (tmp_path / "plain").stat().st_mode
    with pytest.raises(OutputError, match="not an ordinary file"), atomic_path("/dev/null"):
        pass


def test_trimesh_loads_only_when_needed() -> None:
    import subprocess

    code = "import sys, gvpipe.io; sys.exit('trimesh' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
