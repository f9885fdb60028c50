"""Alembic: scenes come back, polygons are turned round, other writers' archives are read, bad files refused."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import assert_same, scene

from gvpipe import io
from gvpipe.foundation.errors import InputError

pytest.importorskip("alembic3d")


@pytest.mark.usefixtures("new_processes")
def test_everything_comes_back(tmp_path: Path) -> None:
    given = scene()
    io.write(given, tmp_path / "a.abc")
    read = io.read(tmp_path / "a.abc")
    assert_same(read, given)
    assert [material.name for material in read.materials] == ["wood", "1 cloth"]


def test_polygons_in_the_file_are_clockwise(tmp_path: Path) -> None:
    from alembic3d import Abc, AbcGeom

    io.write(scene(), tmp_path / "a.abc")
    archive = Abc.IArchive(str(tmp_path / "a.abc"))
    above = archive.getTop().getChild("world").getChild("2 left")
    mesh = AbcGeom.IPolyMesh(above, "sheet")
    schema = mesh.getSchema()
    assert list(schema.getFaceIndicesProperty().getValue()) == [0, 3, 4, 1, 1, 4, 5, 2]
    assert schema.getNumSamples() == 6
    assert schema.getTimeSampling().getSampleTime(0) == 0.5


def archive_of(path: Path, samples: list[list[list[float]]], faces: list[list[int]], matrices: Any = ()) -> None:
    """An archive of one mesh below one transform, as another program writes it, at 10 samples a second."""
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    archive = Abc.OArchive(str(path))
    sampling = AbcCoreAbstract.TimeSampling(0.1, 0.0)
    xform = AbcGeom.OXform(archive.getTop(), "x")
    xform.getSchema().setTimeSampling(sampling)
    for matrix in matrices:
        sample = AbcGeom.XformSample()
        sample.setMatrix(imath.M44d(*np.asarray(matrix, float).reshape(-1).tolist()))
        xform.getSchema().set(sample)
    mesh = AbcGeom.OPolyMesh(xform, "m")
    schema = mesh.getSchema()
    schema.setTimeSampling(sampling)
    for points, corners in zip(samples, faces, strict=True):
        positions = imath.V3fArray(len(points))
        np.asarray(positions)[...] = points
        indices, counts = imath.IntArray(len(corners)), imath.IntArray(len(corners) // 3)
        np.asarray(indices)[...] = corners
        np.asarray(counts)[...] = 3
        schema.set(AbcGeom.OPolyMeshSchemaSample(positions, indices, counts))


TRIANGLE = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]


def test_transform_of_a_mesh_that_stands_still(tmp_path: Path) -> None:
    moved = np.eye(4)
    moved[3, 2] = 4
    archive_of(tmp_path / "a.abc", [TRIANGLE], [[0, 2, 1]], [np.eye(4), moved])
    read = io.read(tmp_path / "a.abc")
    assert (len(read), read.fps) == (2, 10)
    assert read[:][:, 0, 2].tolist() == [0, 4]
    assert read.faces.tolist() == [[0, 1, 2]]
    assert io.read(tmp_path / "a.abc", fps=20)[:][:, 0, 2].tolist() == pytest.approx([0, 2, 4])


def test_topology_that_changes(tmp_path: Path) -> None:
    archive_of(tmp_path / "a.abc", [TRIANGLE, TRIANGLE], [[0, 2, 1], [0, 1, 2]])
    with pytest.raises(InputError, match="the topology of mesh /x/m changes at frame 1"):
        io.read(tmp_path / "a.abc")


def test_position_that_is_not_finite(tmp_path: Path) -> None:
    broken = [[float("nan"), 0.0, 0.0], *TRIANGLE[1:]]
    archive_of(tmp_path / "a.abc", [TRIANGLE, broken], [[0, 2, 1], [0, 2, 1]])
    read = io.read(tmp_path / "a.abc")
    with pytest.raises(InputError, match="frame 1, vertex 0 is"):
        read.read(0, 2)


def test_archive_without_mesh(tmp_path: Path) -> None:
    from alembic3d import Abc, AbcGeom

    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    xform = AbcGeom.OXform(archive.getTop(), "x")
    del xform, archive
    with pytest.raises(InputError, match=r"a\.abc has no polygon mesh"):
        io.read(tmp_path / "a.abc")


BAD = {
    b"#usda 1.0": "is not an Alembic file",
    b"\x89HDF\r\n\x1a\n": "old HDF5 kind; export it again as Ogawa",
    b"Ogawa\x00\x00\x01": "was not written to its end",
    b"Ogawa\xff\x00\x01" + bytes(8): "cannot be read as Alembic",
}


@pytest.mark.parametrize("data", BAD)
def test_bad_files(tmp_path: Path, data: bytes) -> None:
    (tmp_path / "a.abc").write_bytes(data)
    with pytest.raises(InputError, match=BAD[data]) as caught:
        io.read(tmp_path / "a.abc")
    assert "\n" not in str(caught.value)


def test_cut_file(tmp_path: Path) -> None:
    io.write(scene(), tmp_path / "a.abc")
    data = (tmp_path / "a.abc").read_bytes()
    for part in range(1, 8):
        (tmp_path / "b.abc").write_bytes(data[: len(data) * part // 8])
        with pytest.raises(InputError, match=r"b\.abc"):
            io.read(tmp_path / "b.abc")


def test_missing_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    io.write(scene(), tmp_path / "a.abc")
    monkeypatch.setitem(sys.modules, "alembic3d", None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[alembic\]'"):
        io.read(tmp_path / "a.abc")
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[alembic\]'"):
        io.write(scene(), tmp_path / "b.abc")


@pytest.mark.usefixtures("new_processes")
def test_library_that_dies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A damaged archive may crash the library, in a process of its own."""
    (tmp_path / "dying.py").write_text("import os\nos.abort()\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr("gvpipe.io.alembic.process.WORKER", "dying")
    io.write(scene(), tmp_path / "a.abc")
    with pytest.raises(InputError, match=r"a\.abc cannot be read as Alembic: Alembic's library died of it; export it again"):
        io.read(tmp_path / "a.abc")


def test_arrays_of_the_library() -> None:
    """Those without a buffer, which are read in other ways, have the numbers that NumPy takes from them one by one."""
    imath = pytest.importorskip("imath")
    from gvpipe.io.alembic.numbers import as_integers, as_matrix, as_numbers
    from gvpipe.io.alembic.param_writer import filled

    large = filled(imath.UnsignedIntArray, np.array([0, 1, 2**31, 2**32 - 1, 77]))
    assert np.array_equal(as_integers(large), np.array(large)) and len(as_integers(imath.UnsignedIntArray(0))) == 0
    for kind, width in ((imath.C3fArray, 3), (imath.C4fArray, 4)):
        colors = filled(kind, np.arange(2 * width, dtype=np.float32).reshape(2, width))
        assert np.array_equal(as_numbers(colors), np.array(colors).reshape(2, width))
    matrix = imath.M44d(*map(float, range(16)))
    assert np.array_equal(as_matrix(matrix), np.arange(16).reshape(4, 4))


def test_what_has_no_place_is_named(tmp_path: Path) -> None:
    import imath
    from alembic3d import Abc, AbcGeom

    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    mesh = AbcGeom.OPolyMesh(archive.getTop(), "m")
    schema = mesh.getSchema()
    points, indices, counts = imath.V3fArray(3), imath.IntArray(3), imath.IntArray(1)
    np.asarray(points)[...] = TRIANGLE
    np.asarray(indices)[...] = [0, 2, 1]
    np.asarray(counts)[...] = 3
    sample = AbcGeom.OPolyMeshSchemaSample(points, indices, counts)
    sample.setVelocities(points)
    schema.set(sample)
    Abc.OFloatProperty(schema.getUserProperties(), "mass").setValue(3.0)
    Abc.OStringProperty(schema.getArbGeomParams(), "tag").setValue("x")
    del archive, mesh, schema
    assert io.read(tmp_path / "a.abc").not_carried == ("parameter tag", "user property mass", "velocities")


def test_texture_coordinates_that_change_are_named(tmp_path: Path) -> None:
    import imath
    from alembic3d import Abc, AbcCoreAbstract, AbcGeom

    archive = Abc.OArchive(str(tmp_path / "a.abc"))
    mesh = AbcGeom.OPolyMesh(archive.getTop(), "m")
    schema = mesh.getSchema()
    schema.setTimeSampling(AbcCoreAbstract.TimeSampling(0.1, 0.0))
    for shift in (0.0, 0.5):
        points, indices, counts, uv = imath.V3fArray(3), imath.IntArray(3), imath.IntArray(1), imath.V2fArray(3)
        np.asarray(points)[...] = TRIANGLE
        np.asarray(indices)[...] = [0, 2, 1]
        np.asarray(counts)[...] = 3
        np.asarray(uv)[...] = np.array(TRIANGLE)[:, :2] + shift
        sample = AbcGeom.OPolyMeshSchemaSample(points, indices, counts)
        sample.setUVs(AbcGeom.OV2fGeomParamSample(uv, AbcGeom.GeometryScope.kVertexScope))
        schema.set(sample)
    del archive, mesh, schema
    assert io.read(tmp_path / "a.abc").not_carried == ("animation of parameter uv",)
