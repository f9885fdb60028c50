"""OFF with comments, other properties and polygons."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from assets import asset
from mesh_files import PLY_ROWS, same_bits

from gvpipe import io
from gvpipe.asset.field import Field


def test_off_polygons_keep_their_order(tmp_path: Path) -> None:
    text = (
        "# c\nNOFF 4 3 0 # counts\n"
        + "\n\n".join(row + " 0 0 1" for row in PLY_ROWS)
        + "\n4 0 1 2 3\n3 0 1 2 255 0 0\n3 3 2 1\n"
    )
    (tmp_path / "a.off").write_text(text)
    assert io.read(tmp_path / "a.off").faces.tolist() == [[0, 1, 2], [0, 2, 3], [0, 1, 2], [3, 2, 1]]


def test_an_asset_as_off(tmp_path: Path) -> None:
    rng = np.random.default_rng(8)
    kept = {"uv": rng.random((9, 2), np.float32), "face": np.arange(8)}
    colors = rng.integers(0, 256, (3, 9, 4), np.uint8)
    normals = rng.normal(size=(3, 9, 3)).astype(np.float32)
    fields = {"color": Field(colors, kind="color"), "normal": Field(normals, kind="normal")}
    given = asset(attributes=kept, fields=fields)
    notes = io.write(given, tmp_path / "%d.off")
    assert notes == ("OFF has no place for face, parts, materials, metadata; left out (.npz holds everything)",)
    assert (tmp_path / "0.off").read_text().startswith("STCNOFF\n9 5 0\n")
    read = io.read(tmp_path)
    assert read.polygons is not None and read.polygons.tolist() == [4, 4, 4, 3, 3]
    assert np.array_equal(read.faces, given.faces) and same_bits(read.read(0, 3), given.read(0, 3))
    assert same_bits(read.attributes["uv"], kept["uv"])
    assert same_bits(read.fields["color"][:], colors) and same_bits(read.fields["normal"][:], normals)


def test_off_face_colours(tmp_path: Path) -> None:
    colors = np.array([[9, 8, 7, 255], [1, 2, 3, 4]], np.uint8)[[0, 0, 1, 1, 0, 0, 1, 0]]
    given = asset(1, attributes={"color": colors}, fields={}, parts=(), materials=(), images=())
    io.write(given, tmp_path / "a.off")
    read = io.read(tmp_path / "a.off")
    assert read.attributes["color"].domain == "triangle" and same_bits(read.attributes["color"], colors)
