"""What writing does to names and units is said, a line each; what can be kept is."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.asset.part import Part
from gvpipe.model.sequence import MeshSequence

FRAMES = np.random.default_rng(3).random((3, 6, 3), np.float32)
FACES = np.array([[0, 1, 2], [3, 4, 5]], np.int32)
STILL, MOVING = np.arange(6, dtype=np.float32)[:, None], np.arange(18, dtype=np.float32).reshape(3, 6)


def scene(**changes: Any) -> MeshSequence:
    return MeshSequence(FRAMES, FACES, 24.0, **changes)


def write(sequence: MeshSequence, path: Path) -> tuple[MeshSequence, str]:
    """The sequence, written and read, and the notes."""
    for suffix, needs in ((".usda", "pxr"), (".abc", "alembic3d"), (".vtkhdf", "h5py")):
        if path.suffix == suffix:
            pytest.importorskip(needs)
    notes = gvpipe.write(sequence, path)
    assert all("\n" not in note for note in notes)
    return gvpipe.read(path.parent if "%" in path.name else path, fps=24), "\n".join(notes)


ENDINGS = [("a.usda", "USD"), ("a.abc", "Alembic"), ("a.vtkhdf", "VTKHDF"), ("out/%d.ply", "PLY"), ("a.pvd", "VTP")]


@pytest.mark.parametrize(("name", "label"), ENDINGS)
def test_a_field_stands_for_an_attribute_of_its_name(tmp_path: Path, name: str, label: str) -> None:
    given = scene(attributes={"heat": Attribute(STILL, unit="K")}, fields={"heat": Field(MOVING, unit="K")})
    read, notes = write(given, tmp_path / name)
    assert f"{label} has one value of a name; the fields heat stand for the attributes" in notes
    assert np.array_equal(read.fields["heat"].read(0, 3)[..., 0], MOVING) and "heat" not in read.attributes
    if label == "VTKHDF":
        assert read.fields["heat"].unit == "K" and "unit" not in notes
    else:
        assert "units" in notes


def test_names_that_mean_something_in_usd(tmp_path: Path) -> None:
    fields = {"st": Field(MOVING), "normals": Field(MOVING + 1), "von mises": Field(MOVING + 2), "von_mises": Field(MOVING + 3)}
    given = scene(attributes={"uv": FRAMES[0, :, :2].copy()}, fields=fields)
    read, notes = write(given, tmp_path / "a.usda")
    assert "names were changed for USD: 'st' is 'own_st', 'normals' is 'own_normals', 'von mises' is 'von_mises'" in notes
    names = {"st": "own_st", "normals": "own_normals", "von mises": "von_mises", "von_mises": "von_mises_1"}
    for name, one in fields.items():
        assert np.array_equal(read.fields[names[name]].read(0, 3), one.read(0, 3))
    assert np.array_equal(np.asarray(read.attributes["uv"]), FRAMES[0, :, :2])


def test_names_of_parts(tmp_path: Path) -> None:
    parts = (Part("left/arm", (0, 3), (0, 1)), Part("1 leg", (3, 6), (1, 2)))
    read, notes = write(scene(parts=parts), tmp_path / "a.usda")
    assert "'1 leg' is '_1_leg'" in notes and [part.name for part in read.parts] == ["left/arm", "1 leg"]
    read, notes = write(scene(parts=parts, fields={"a/b": Field(MOVING)}), tmp_path / "a.abc")
    assert "names were changed for Alembic: 'a/b' is 'a_b', 'left/arm' is 'left_arm'" in notes
    assert [part.name for part in read.parts] == ["left_arm", "1 leg"] and "a_b" in read.fields


@pytest.mark.parametrize(("name", "label"), [("a.usda", "USD"), ("a.abc", "Alembic")])
def test_parts_of_one_name(tmp_path: Path, name: str, label: str) -> None:
    parts = (Part("arm", (0, 3), (0, 1), parent="body"), Part("arm", (3, 6), (1, 2), parent="body"))
    read, notes = write(scene(parts=parts), tmp_path / name)
    assert notes.count(f"names were changed for {label}: 'arm' is 'arm_1'") == 1
    assert len(read.parts) == 2


def test_names_that_ply_does_not_have(tmp_path: Path) -> None:
    fields = {"x": Field(MOVING), "von mises": Field(MOVING)}
    read, notes = write(scene(fields=fields), tmp_path / "out" / "%d.ply")
    assert "names were changed for PLY: 'x' is 'x_', 'von mises' is 'von_mises'" in notes
    assert set(read.fields) == {"x_", "von_mises"}
    _, notes = write(scene(fields={"heat": Field(MOVING), "flow": Field(FRAMES)}), tmp_path / "plain" / "%d.ply")
    assert "names" not in notes
