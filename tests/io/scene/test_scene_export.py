"""Attributes of every domain and kind reach a scene file, or a note says why not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scenes import scene

from gvpipe import io
from gvpipe.asset.attribute import Attribute
from gvpipe.io.scene.export import export_layer, export_meshes, uncovered
from gvpipe.model.sequence import MeshSequence

TANGENT = np.tile(np.array([[1, 0, 0, -1]], np.float32), (9, 1))


def with_more() -> MeshSequence:
    more = {
        "room": Attribute(np.array([[4], [5], [6]], np.int32), "part", "label"),
        "tangent": Attribute(TANGENT, "vertex", "tangent"),
        "tint": Attribute(np.array([[0, 128, 255]], np.uint8), "vertex", "color", np.zeros(9, np.int32)),
    }
    return replace(scene(), attributes={**scene().attributes, **more})


def test_meshes_of_parts() -> None:
    given = scene()
    sheet, piece = export_meshes(given, "none")
    assert (sheet.name, sheet.parent, sheet.groups) == ("sheet", "world/2 left", ((0, 1, 0), (1, 2, 1)))
    assert sheet.corners.tolist() == [0, 1, 4, 3, 1, 2, 5, 4]
    assert piece.corners.tolist() == [0, 1, 2]
    assert uncovered(given, [sheet, piece]) == 0
    assert uncovered(given, [piece]) == 6


def test_rows_of_parts_become_those_of_polygons() -> None:
    sheet, piece = export_meshes(with_more(), "none")
    room = with_more().attributes["room"]
    assert export_layer("room", room, sheet).values.tolist() == [[4], [5]]
    assert export_layer("room", room, piece).values.tolist() == [[6]]


def test_usd_has_all_of_them(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    io.write(with_more(), tmp_path / "a.usda")
    read = io.read(tmp_path / "a.usda").attributes
    assert np.asarray(read["room"])[:, 0].tolist() == [4, 4, 5, 5, 6]
    assert np.array_equal(np.asarray(read["tangent"]), TANGENT)
    assert np.allclose(np.asarray(read["color1"]), [0, 128 / 255, 1])


def test_alembic_says_what_it_has_no_place_for(tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    notes = io.write(with_more(), tmp_path / "a.abc")
    assert any("Alembic has no place for tangent" in note for note in notes)
    read = io.read(tmp_path / "a.abc").attributes
    assert np.asarray(read["room"])[:, 0].tolist() == [4, 4, 5, 5, 6]
    assert "tangent" not in read
    assert np.allclose(np.asarray(read["color1"]), [0, 128 / 255, 1])
