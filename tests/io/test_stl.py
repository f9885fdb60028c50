"""STL has no shared vertices: they are welded in order of appearance."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from mesh_files import grid, same_bits

from gvpipe import io
from gvpipe.asset.part import Part
from gvpipe.foundation.errors import InputError


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


def test_solids_are_parts(tmp_path: Path) -> None:
    triangle = "facet normal 0 0 1\nouter loop\nvertex 0 0 {0}\nvertex 1 0 {0}\nvertex 0 1 {0}\nendloop\nendfacet\n"
    text = "solid lid\n" + triangle.format(0) + "endsolid lid\nsolid big box\n"
    (tmp_path / "a.stl").write_text(text + triangle.format(1) + triangle.format(0) + "endsolid big box\n")
    read = io.read(tmp_path / "a.stl")
    assert read.parts == (Part("lid", (0, 3), (0, 1)), Part("big box", (0, 6), (1, 3)))
    notes = io.write(read, tmp_path / "b.stl")
    assert notes == ("STL has no place for parts; left out (.npz holds everything)",)


def test_damaged_files(tmp_path: Path) -> None:
    """Sizes that do not fit are said; a text needs its ends, and three numbers for each vertex."""
    io.write(grid(1), tmp_path / "a.stl")
    whole = (tmp_path / "a.stl").read_bytes()
    text = b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"
    for data, words in (
        (whole[:-1], "its header says 50 triangles, 2584 bytes, but it has 2583 bytes"),
        (whole + b"more", "but it has 2588 bytes"),
        (b"\x99" * 40, "it has 40 bytes, and is no text"),
        (text[:-10], "has no 'endsolid'"),
        (text.replace(b"vertex 1 0 0\n", b""), "its 1 facets have 2 vertices"),
        (text.replace(b"1 0 0", b"1 x 0"), ""),
        (b"solid a\nendsolid a\n", "it has no triangles"),
    ):
        (tmp_path / "a.stl").write_bytes(data)
        with pytest.raises(InputError, match=r"a\.stl cannot be read as STL: ") as caught:
            io.read(tmp_path / "a.stl")
        assert words in str(caught.value)
    (tmp_path / "a.stl").write_bytes(b"solid " + whole[6:])  # binary, though it begins like a text
    assert len(io.read(tmp_path / "a.stl").faces) == 50
