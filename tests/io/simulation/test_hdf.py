"""HDF5: VTKHDF and XDMF; what a sequence writes comes back; files take numbers from nowhere else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe.io
from gvpipe.asset.attribute import Attribute
from gvpipe.asset.field import Field
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence

h5py = pytest.importorskip("h5py")

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)


def sequence_of_quads() -> MeshSequence:
    """Two quads and a triangle over 3 frames, with numbers of every kind that VTK has a place for."""
    points = np.concatenate([SQUARE, SQUARE[1:3] + np.array([1, 0, 0]), [[0.5, 2, 0]]])
    moving = points + np.arange(3)[:, None, None] * np.float32(0.25)
    faces = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [3, 2, 6]])
    normals = np.tile(np.array([[0, 0, 1]], np.float32), (7, 1))
    return MeshSequence(
        moving.astype(np.float32),
        faces,
        10,
        {"id": Attribute(np.array([1, 1, 2, 2, 3]), "triangle"), "normal": normals, "color": np.full((7, 4), 9, np.uint8)},
        fields={
            "heat": Field(np.arange(21, dtype=np.float32).reshape(3, 7)),
            "flow": Field(np.ones((3, 7, 3), np.float32) * np.arange(3, dtype=np.float32)[:, None, None]),
            "load": Field(np.array([[0, 0, 1, 1, 2], [1, 1, 2, 2, 3], [2, 2, 3, 3, 4]], np.int32), "triangle"),
        },
        polygons=np.array([4, 4, 3]),
    )


@pytest.mark.parametrize("name", ["a.pvd", "a.vtkhdf", "out/a_%04d.vtp"])
def test_written_and_read(tmp_path: Path, name: str) -> None:
    given = sequence_of_quads()
    assert gvpipe.io.write(given, tmp_path / name) == ()
    found = gvpipe.io.read(str(tmp_path / name), fps=10 if "%" in name else None)
    assert found.fps == given.fps and np.array_equal(found[:], given[:]) and np.array_equal(found.faces, given.faces)
    assert found.polygons is not None and found.polygons.tolist() == [4, 4, 3]
    assert set(found.fields) == set(given.fields) and set(found.attributes) == set(given.attributes)
    for key, field in given.fields.items():
        assert np.array_equal(found.fields[key][:], field[:]) and found.fields[key].domain == field.domain
    for key, attribute in given.attributes.items():
        assert np.array_equal(np.asarray(found.attributes[key]), np.asarray(attribute))
        assert found.attributes[key].kind == attribute.kind


def test_values_inside_of_polygons_need_triangles(tmp_path: Path) -> None:
    """Nothing is lost where the triangles of a quad differ: triangles are written, and the quads are said to be lost."""
    given = sequence_of_quads()
    values = np.arange(15, dtype=np.float32).reshape(3, 5)
    given = MeshSequence(given[:], given.faces, 10, fields={"load": Field(values, "triangle")}, polygons=given.polygons)
    notes = gvpipe.io.write(given, tmp_path / "a.vtkhdf")
    found = gvpipe.io.read(tmp_path / "a.vtkhdf")
    assert any("polygons" in note for note in notes) and found.polygons is None
    assert np.array_equal(found.fields["load"][:], values)


def test_corners_have_no_place(tmp_path: Path) -> None:
    given = MeshSequence(SQUARE[None], np.array([[0, 1, 2], [0, 2, 3]], np.int32), 10, {"uv": np.zeros((6, 2), np.float32)})
    assert any("uv" in note for note in gvpipe.io.write(given, tmp_path / "a.pvd"))


def xdmf(path: Path, steps: int = 3, file: str = "a.h5") -> None:
    """A quad, its geometry included by name as dolfinx writes it, and a function at 3 times."""
    grids = "".join(
        '<Grid Name="u" GridType="Uniform"><xi:include xpointer="xpointer(//Grid[@Name=&quot;mesh&quot;]'
        f'/*[self::Topology or self::Geometry])"/><Time Value="{step / 4}"/><Attribute Name="u" AttributeType="Scalar" '
        f'Center="Node"><DataItem Dimensions="4 1" Format="HDF">{file}:/u/{step}</DataItem></Attribute></Grid>'
        for step in range(steps)
    )
    path.write_text(
        '<Xdmf Version="3.0" xmlns:xi="http://www.w3.org/2001/XInclude"><Domain><Grid Name="mesh" GridType="Uniform">'
        '<Topology TopologyType="Quadrilateral"><DataItem Dimensions="1 4" NumberType="Int" Format="XML">0 1 2 3</DataItem>'
        f'</Topology><Geometry GeometryType="XYZ"><DataItem Dimensions="4 3" Format="HDF">{file}:/x</DataItem></Geometry>'
        f'</Grid><Grid Name="u" GridType="Collection" CollectionType="Temporal">{grids}</Grid></Domain></Xdmf>'
    )


def xdmf_numbers(path: Path, steps: int = 3) -> Any:
    with h5py.File(path, "w") as file:
        file["x"] = SQUARE
        for step in range(steps):
            file[f"u/{step}"] = np.arange(4.0)[:, None] * step


def test_xdmf(tmp_path: Path) -> None:
    xdmf(tmp_path / "a.xdmf")
    xdmf_numbers(tmp_path / "a.h5")
    sequence = gvpipe.io.read(tmp_path / "a.xdmf")
    assert sequence.fps == 4 and np.array_equal(sequence[2], SQUARE) and sequence.polygons is not None
    assert sequence.fields["u"][2].tolist() == [0, 2, 4, 6]


def test_xdmf_names_files_beside_it(tmp_path: Path) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    xdmf_numbers(tmp_path / "a.h5")
    for name, message in (("../a.h5", "outside"), ("b.h5", "missing")):
        xdmf(folder / "a.xdmf", file=name)
        with pytest.raises(InputError, match=message):
            gvpipe.io.read(folder / "a.xdmf")


def test_links_are_not_followed(tmp_path: Path) -> None:
    """Neither to other files, nor virtual datasets; and a dataset of any size costs no memory."""
    gvpipe.io.write(sequence_of_quads(), tmp_path / "good.vtkhdf")
    for kind, message in (
        ("link", "another file"),
        ("soft", "another file"),
        ("virtual", "other files"),
        ("huge", "cannot hold"),
    ):
        path = tmp_path / f"{kind}.vtkhdf"
        path.write_bytes((tmp_path / "good.vtkhdf").read_bytes())
        with h5py.File(path, "a") as file:
            del file["VTKHDF/Points"]
            if kind == "link":
                file["VTKHDF/Points"] = h5py.ExternalLink("good.vtkhdf", "VTKHDF/Points")
            elif kind == "soft":
                file["elsewhere"] = h5py.ExternalLink("good.vtkhdf", "VTKHDF/Points")
                file["VTKHDF/Points"] = h5py.SoftLink("/elsewhere")
            elif kind == "virtual":
                layout = h5py.VirtualLayout((21, 3), "f4")
                layout[:] = h5py.VirtualSource(str(tmp_path / "good.vtkhdf"), "VTKHDF/Points", (21, 3))
                file["VTKHDF"].create_virtual_dataset("Points", layout)
            else:
                file["VTKHDF/NumberOfPoints"][0] = 1 << 40
                file["VTKHDF"].create_dataset("Points", (1 << 41, 3), "f4", chunks=(1024, 3))
        with pytest.raises(InputError, match=message):
            gvpipe.io.read(path)


def test_missing_library(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gvpipe.io.write(sequence_of_quads(), tmp_path / "a.vtkhdf")
    monkeypatch.setitem(__import__("sys").modules, "h5py", None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[vtk\]'"):
        gvpipe.io.read(tmp_path / "a.vtkhdf")
