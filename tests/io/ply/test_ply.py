"""PLY as text and binary, with polygons and other properties."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from assets import assert_same_attribute, asset, faces_of, picture
from hypothesis import given
from hypothesis import strategies as st
from mesh_files import PLY_ROWS, fast, grid, same_bits

from gvpipe import io
from gvpipe.asset.field import Field
from gvpipe.asset.material import Image, Material, Texture
from gvpipe.asset.part import Part
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence

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


RAGGED = [[[0, 1, 2], [0, 1, 2, 3], [2, 3, 0]], [[0, 1, 2, 3], [0, 1, 2], [2, 3, 0]], [[0, 1, 2, 3], [1, 2, 3]]]


@pytest.mark.parametrize("faces", RAGGED)
@pytest.mark.parametrize("order", ["<", ">"])
def test_ply_binary_polygons_that_differ(tmp_path: Path, faces: list[list[int]], order: str) -> None:
    whole = ply_binary(order, faces)
    (tmp_path / "a.ply").write_bytes(whole)
    read = io.read(tmp_path / "a.ply")
    assert read.polygons is not None and read.polygons.tolist() == [len(face) for face in faces]
    assert read.faces.tolist() == faces_of(faces).tolist()
    assert np.asarray(read.attributes["flag"]).tolist() == [[7]] * len(read.faces)
    assert read.not_carried == ("list 'id'",)
    for cut in range(1, 40):
        (tmp_path / "b.ply").write_bytes(whole[:-cut])
        with pytest.raises(InputError, match=r"b.ply cannot be read as PLY: it announces"):
            io.read(tmp_path / "b.ply")


PLY_WRONG = {
    "twice": ("property float y", "property float x", "its header has two properties 'x' of element 'vertex'"),
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


IMAGES = (Image("cloth", "image/png", picture()),)


def test_an_asset_as_ply(tmp_path: Path) -> None:
    sheet = asset(parts=(Part("", (0, 9), (0, 8), 0),), materials=(Material("", base_color_texture=Texture(0)),), images=IMAGES)
    notes = io.write(sheet, tmp_path / "%d.ply")
    # flow differs within polygons, so that triangles are written
    assert notes == ("PLY has no place for polygons, metadata, units; left out (.npz holds everything)",)
    read = io.read(tmp_path)
    assert read.polygons is None and np.array_equal(read.faces, sheet.faces)
    assert (read.materials[0].base_color_texture, read.images) == (Texture(0), IMAGES)
    assert same_bits(read.read(0, 3), sheet.read(0, 3))
    assert set(read.attributes) == {"uv", "color", "weight", "id"} and set(read.fields) == {"stress", "flow"}
    assert_same_attribute(read.attributes["uv"], sheet.attributes["uv"], sheet.faces)
    for name in ("color", "weight", "id"):
        assert same_bits(read.attributes[name], sheet.attributes[name])
    for name in ("stress", "flow"):
        assert same_bits(read.fields[name][1:3], sheet.fields[name][1:3])
        assert read.fields[name].domain == sheet.fields[name].domain


def test_ply_polygons_and_their_numbers(tmp_path: Path) -> None:
    sides = np.array([3, 3, 4, 4, 5, 5, 6, 7], np.int16)  # equal in the triangles of each quad
    kept = {"uv": asset().attributes["uv"], "side": sides}
    sheet = asset(1, attributes=kept, fields={}, materials=(), images=(), parts=())
    io.write(sheet, tmp_path / "a.ply")
    read = io.read(tmp_path / "a.ply")
    assert read.polygons is not None and read.polygons.tolist() == [4, 4, 4, 3, 3]
    assert np.array_equal(read.faces, sheet.faces)
    assert_same_attribute(read.attributes["uv"], sheet.attributes["uv"], sheet.faces)
    assert read.attributes["side"].domain == "triangle" and same_bits(read.attributes["side"], sides[:, None])


RANDOM = np.random.default_rng(2)
COLORS = [
    RANDOM.integers(0, 256, (4, 37, 4), np.uint8),
    RANDOM.integers(0, 65536, (4, 37, 4), np.uint16),
    RANDOM.random((4, 37, 4), np.float32),
]


@pytest.mark.parametrize("colors", COLORS, ids=lambda colors: colors.dtype.name)
def test_ply_colours_and_normals_that_change(tmp_path: Path, colors: Any) -> None:
    normals = np.random.default_rng(2).normal(size=(4, 37, 3)).astype(np.float32)
    moving = grid(4)
    fields = {"color": Field(colors, kind="color"), "normal": Field(normals, kind="normal")}
    io.write(MeshSequence(moving[0:4], moving.faces, fields=fields), tmp_path / "m" / "%d.ply")
    read = io.read(tmp_path / "m")
    assert read.attributes == {} and {each.kind for each in read.fields.values()} == {"color", "normal"}
    assert same_bits(read.fields["color"][:], colors) and same_bits(read.fields["normal"][2:3], normals[2:3])
    still = {"color": colors[0], "normal": normals[0]}
    io.write(MeshSequence(moving[0:1], moving.faces, attributes=still), tmp_path / "s" / "%d.ply")
    (tmp_path / "s" / "1.ply").write_bytes((tmp_path / "s" / "0.ply").read_bytes())
    read = io.read(tmp_path / "s")
    assert read.fields == {} and all(same_bits(read.attributes[name], values) for name, values in still.items())


def test_a_number_that_changes_late_is_a_field(tmp_path: Path) -> None:
    heat = np.ones((12, 37), np.float32)
    heat[7, 4] = 2
    moving = grid(12)
    io.write(MeshSequence(moving[0:12], moving.faces, fields={"heat": heat}), tmp_path / "%02d.ply")
    read = io.read(tmp_path)
    assert read.attributes == {} and same_bits(read.fields["heat"][:], heat)
    holes = heat.copy()
    holes[0, 3] = np.nan
    io.write(MeshSequence(moving[0:12], moving.faces, fields={"heat": holes}), tmp_path / "%02d.ply")
    assert same_bits(io.read(tmp_path).fields["heat"][:], holes)
    io.write(MeshSequence(moving[5:6], moving.faces), tmp_path / "05.ply")
    with pytest.raises(InputError, match=r"05.ply has no 'heat', 00.ply has it \(37,\)"):
        io.read(tmp_path).fields["heat"].read(0, 12)


def test_ply_names_that_mean_something_else(tmp_path: Path) -> None:
    values = np.arange(37, dtype=np.float32)
    sheet = grid(1, attributes={"x": values, "u": values, "v": values, "two words": values, "e_0": values})
    io.write(sheet, tmp_path / "a.ply")
    read = io.read(tmp_path / "a.ply")
    assert set(read.attributes) == {"x_", "u_", "v_", "two_words", "e_0"}
    assert all(same_bits(each, values[:, None]) for each in read.attributes.values())
    assert same_bits(read.read(0, 1), sheet.read(0, 1))


@fast
@given(st.lists(st.tuples(st.integers(0, 400), st.integers(0, 255)), min_size=1, max_size=4), st.sampled_from(RAGGED))
def test_mutated_ply_is_read_or_refused(tmp_path: Path, changes: list[tuple[int, int]], faces: list[list[int]]) -> None:
    data = bytearray(ply_binary("<", faces))
    for at, byte in changes:
        data[at % len(data)] = byte
    (tmp_path / "a.ply").write_bytes(bytes(data))
    with contextlib.suppress(InputError):
        io.read(tmp_path / "a.ply")


def test_normals_of_nothing_become_zeros(tmp_path: Path) -> None:
    head = PLY_HEAD.format("ascii", "property float nx\nproperty float ny\nproperty float nz\n")
    rows = [f"{row} {normal}" for row, normal in zip(PLY_ROWS, ["0 0 1", "nan nan nan", "0 1 0", "1 0 0"], strict=True)]
    (tmp_path / "a.ply").write_text(head + "\n".join(rows) + "\n3 0 1 2\n3 0 2 3\n")
    assert io.read(tmp_path / "a.ply").attributes["normal"].tolist() == [[0, 0, 1], [0, 0, 0], [0, 1, 0], [1, 0, 0]]
