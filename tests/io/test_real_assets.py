"""Real OBJ and PLY files, where the folder that holds them stands beside the project: read, written, and read again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from assets import assert_same_attribute, assert_same_static
from folders import DATA

from gvpipe import io
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence

ASSETS = DATA / "assets"
STILL = sorted(path for path in ASSETS.glob("fbx/*/*.obj"))
SERIES = [path for path in (ASSETS / "objseq" / "cesium_man_obj", ASSETS / "plyseq" / "fox_run_ply") if path.exists()]


def assert_same_sequence(read: MeshSequence, given: MeshSequence, suffix: str) -> None:
    for first, block in given.chunks():
        assert np.array_equal(read.read(first, first + len(block)), block)
    if suffix != "ply":
        assert_same_static(read, given)
    assert np.array_equal(read.faces, given.faces)
    if given.polygons is None or read.polygons is None:
        assert read.polygons is given.polygons
    else:
        assert np.array_equal(read.polygons, given.polygons)
    for name, each in given.attributes.items():
        if name in read.attributes:
            assert_same_attribute(read.attributes[name], each, given.faces)


@pytest.mark.skipif(not STILL, reason="no ../shared/data")
@pytest.mark.parametrize("suffix", ["obj", "ply", "npz"])
def test_still_files_come_back(tmp_path: Path, suffix: str) -> None:
    for number, path in enumerate(STILL):
        given = io.read(path)
        io.write(given, tmp_path / f"{number}.{suffix}")
        read = io.read(tmp_path / f"{number}.{suffix}", given.fps)
        assert_same_sequence(read, given, suffix)
        held = {"obj": {"uv", "normal", "color"}, "ply": {"uv"}}.get(suffix, set(given.attributes))
        assert set(given.attributes) & held <= set(read.attributes), path


@pytest.mark.skipif(not SERIES, reason="no ../shared/data")
@pytest.mark.parametrize("path", SERIES, ids=lambda path: path.name)
@pytest.mark.parametrize("target", ["%d.obj", "%d.ply", "a.npz"])
def test_series_come_back(tmp_path: Path, path: Path, target: str) -> None:
    given = io.read(path, 24)
    io.write(given, tmp_path / target)
    read = io.read(tmp_path / target if target.endswith("npz") else tmp_path, 24)
    if target[-3:] in (path.name[-3:], "npz"):
        assert set(read.fields) == set(given.fields)
    for name in set(given.fields) & set(read.fields):
        assert np.array_equal(read.fields[name][:], given.fields[name][:])
    assert_same_sequence(read, given, target[-3:])


@pytest.mark.skipif(not SERIES, reason="no ../shared/data")
@pytest.mark.parametrize("name", ["objseq/topology_changes_obj1", "plyseq/topology_changes_ply1"])
def test_series_whose_connectivity_changes_are_refused(name: str) -> None:
    with pytest.raises(InputError, match="all frames need the same vertices and triangles"):
        io.read(ASSETS / name).read(0, 10)
