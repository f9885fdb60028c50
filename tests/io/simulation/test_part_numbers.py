"""Parts of a sequence in VTK's files: numbers of cells and names, read back as they were, by gvpipe and by VTK.

VTK runs in a process of its own, by this Python or by the one that the environment variable ``VTK_PYTHON`` names.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.asset.part import Part
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import equal_cells, join_cells
from gvpipe.grids.volume import Volume
from gvpipe.io.simulation.part_numbers import free_key

PYTHON = os.environ.get("VTK_PYTHON") or (sys.executable if importlib.util.find_spec("vtkmodules") else "")
SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], np.float32)
NAMES = ("left", "r\u00e4d/\u00fc <&>", "left")


def three_squares(is_shared: bool = False, **more: Any) -> gvpipe.MeshSequence:
    """Three squares above each other, each a part; a part's vertices are its own unless they are shared."""
    positions = np.stack([np.concatenate([np.add(SQUARE, [0, 0, 10 * k + frame]) for k in range(3)]) for frame in range(3)])
    faces = np.concatenate([np.array([[0, 1, 2], [1, 3, 2]]) + 4 * k for k in range(3)])
    spans = [(0, 12)] * 3 if is_shared else [(4 * k, 4 * k + 4) for k in range(3)]
    if is_shared:
        faces[2] = [1, 3, 6]
    parts = tuple(Part(name, spans[k], (2 * k, 2 * k + 2)) for k, name in enumerate(NAMES))
    return gvpipe.MeshSequence(positions.astype(np.float32), faces.astype(np.int32), 10.0, parts=parts, **more)


def check_same(found: gvpipe.MeshSequence, given: gvpipe.MeshSequence) -> None:
    assert found.parts == given.parts
    assert np.array_equal(found[:], given[:]) and np.array_equal(found.faces, given.faces)
    assert set(found.fields) == set(given.fields) and set(found.attributes) == set(given.attributes)
    assert not found.not_carried


def by_vtk(script: str, path: Path) -> Any:
    """What a script prints of a file by a Python that has VTK, as JSON; anything that VTK warns of is an error."""
    if not PYTHON:
        pytest.skip("vtk is not there: pip install vtk")
    done = subprocess.run([PYTHON, "-c", script, str(path)], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stderr.strip(), done.stderr
    return json.loads(done.stdout)


READ_XML = """
import json, sys, vtk
path = sys.argv[1]
kind = vtk.vtkXMLPolyDataReader if path.endswith("vtp") else vtk.vtkXMLUnstructuredGridReader
reader = kind(); reader.SetFileName(path); reader.Update(); held = reader.GetOutput()
cells, names = held.GetCellData().GetArray("part"), held.GetFieldData().GetAbstractArray("part_names")
print(json.dumps({
    "numbers": [int(cells.GetValue(k)) for k in range(cells.GetNumberOfValues())],
    "names": [names.GetValue(k) for k in range(names.GetNumberOfValues())],
}))
"""


READ_HDF = """
import json, sys, vtk
from vtk.util.numpy_support import vtk_to_numpy
reader = vtk.vtkHDFReader(); reader.SetFileName(sys.argv[1])
reader.Update()  # VTK 9.7.2 stays at the first step of blocks, also in its own files, where UpdateInformation comes before
held = reader.GetOutputInformation(0)
times = list(held.Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()))
blocks, fields, cells, texts = [], [], [], []
names = []
for time in times:
    reader.UpdateTimeStep(time); made = reader.GetOutputDataObject(0)
    if made.IsA("vtkMultiBlockDataSet"):
        leaves = [made.GetBlock(k) for k in range(made.GetNumberOfBlocks())]
        names = [made.GetMetaData(k).Get(vtk.vtkCompositeDataSet.NAME()) for k in range(len(leaves))]
    else:
        leaves = [made]
    blocks.append([vtk_to_numpy(each.GetPoints().GetData()).tolist() for each in leaves])
    for found, group, name in ((fields, "GetPointData", "heat"), (cells, "GetCellData", "part")):
        arrays = [getattr(each, group)().GetArray(name) for each in leaves]
        found.append([None if one is None else vtk_to_numpy(one).tolist() for one in arrays])
    one = leaves[0].GetFieldData().GetAbstractArray("part_names")
    texts.append(None if one is None else [one.GetValue(k) for k in range(one.GetNumberOfValues())])
print(json.dumps({"times": times, "names": names, "points": blocks, "heat": fields, "part": cells, "texts": texts}))
"""


@pytest.mark.parametrize("is_shared", [False, True])
@pytest.mark.parametrize("name", ["a.pvd", "a_%02d.vtp", "a_%02d.vtu", "a.vtkhdf", "a.xdmf"])
def test_parts_come_back(name: str, is_shared: bool, tmp_path: Path) -> None:
    heat = gvpipe.Field(np.arange(36, dtype=np.float32).reshape(3, 12), "vertex")
    given = three_squares(is_shared, fields={"heat": heat})
    notes = gvpipe.write(given, tmp_path / name)
    assert not any("parts" in note for note in notes)
    found = gvpipe.read(tmp_path / name)
    if name.endswith("hdf") and not is_shared:  # links of one group have different names, without a slash
        assert any("names were changed for VTKHDF" in note for note in notes)
        assert [part.name for part in found.parts] == ["left", "r\u00e4d_\u00fc <&>", "left_2"]
        found = replace(found, parts=tuple(replace(each, name=name) for each, name in zip(found.parts, NAMES, strict=True)))
    check_same(found, given)


@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
def test_vtk_reads_numbers_and_names(suffix: str, tmp_path: Path) -> None:
    gvpipe.write(three_squares(), tmp_path / f"a_%d{suffix}")
    found = by_vtk(READ_XML, tmp_path / f"a_0{suffix}")
    assert found == {"numbers": [0, 0, 1, 1, 2, 2], "names": list(NAMES)}


def test_a_name_that_is_taken(tmp_path: Path) -> None:
    given = three_squares(attributes={"part": np.arange(6)[::-1].astype(np.int32)})
    notes = gvpipe.write(given, tmp_path / "a.pvd")
    assert "VTP: 'part' is taken, so that the numbers of parts are called 'part_2'" in notes
    found = gvpipe.read(tmp_path / "a.pvd")
    check_same(found, given)
    assert np.asarray(found.attributes["part"].values).ravel().tolist() == [5, 4, 3, 2, 1, 0]
    assert free_key({"part", "part_2"}) == "part_3"


def test_one_part_and_what_is_left_out(tmp_path: Path) -> None:
    plain = three_squares()
    parents = tuple(Part("a", (0, 12), (0, 6), 0, "arm") for _ in range(1))
    given = gvpipe.MeshSequence(plain[:], plain.faces, 10.0, parts=parents, materials=(gvpipe.Material("red"),))
    notes = " ".join(gvpipe.write(given, tmp_path / "a.pvd"))
    assert "materials" in notes and "names of the parts' parents" in notes
    assert [part.name for part in gvpipe.read(tmp_path / "a.pvd").parts] == ["a"]
    gvpipe.write(gvpipe.MeshSequence(plain[:], plain.faces, 10.0), tmp_path / "b.pvd")
    assert not gvpipe.read(tmp_path / "b.pvd").parts and b"part" not in (tmp_path / "b" / "b_0000.vtp").read_bytes()


def test_polygons_have_the_numbers_of_their_parts(tmp_path: Path) -> None:
    plain = three_squares()
    faces = np.concatenate([np.array([[0, 1, 3], [0, 3, 2]]) + 4 * k for k in range(3)]).astype(np.int32)
    given = gvpipe.MeshSequence(plain[:], faces, 10.0, parts=plain.parts, polygons=np.array([4, 4, 4], np.int32))
    gvpipe.write(given, tmp_path / "a.pvd")
    found = gvpipe.read(tmp_path / "a.pvd")
    check_same(found, given)
    assert found.polygons is not None and found.polygons.tolist() == [4, 4, 4]


GRID = """<VTKFile type="PolyData" version="1.0"><PolyData><FieldData>{texts}</FieldData>
<Piece NumberOfPoints="4" NumberOfPolys="2"><Points>
<DataArray type="Float32" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 1 1 0</DataArray></Points>
<Polys><DataArray type="Int32" Name="connectivity" format="ascii">0 1 2 1 3 2</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">3 6</DataArray></Polys>
<CellData>{cells}</CellData></Piece></PolyData></VTKFile>"""
PART = '<DataArray type="{}" Name="part" format="ascii">{}</DataArray>'
TEXTS = '<Array type="String" Name="part_names" NumberOfTuples="2" format="ascii">97 0 -61 -68 0</Array>'


@pytest.mark.parametrize(
    ("cells", "texts"),
    [
        (PART.format("Int32", "1 0"), TEXTS),  # they fall
        (PART.format("Int32", "0 2"), TEXTS),  # no name
        (PART.format("Int32", "-1 0"), TEXTS),
        (PART.format("Float32", "0 1"), TEXTS),
        (PART.format("Int32", "0 1"), ""),
    ],
)
def test_other_numbers_stay_numbers(cells: str, texts: str, tmp_path: Path) -> None:
    (tmp_path / "a.vtp").write_text(GRID.format(cells=cells, texts=texts))
    found = gvpipe.read(tmp_path / "a.vtp")
    assert not found.parts and "part" in found.attributes
    assert found.not_carried == (("field data 'part_names'",) if texts else ())


def test_names_as_vtk_writes_them(tmp_path: Path) -> None:
    (tmp_path / "a.vtp").write_text(GRID.format(cells=PART.format("Int64", "0 1"), texts=TEXTS))
    found = gvpipe.read(tmp_path / "a.vtp")
    assert [part.name for part in found.parts] == ["a", "\u00fc"] and not found.attributes and not found.not_carried
    (tmp_path / "a.vtp").write_text(GRID.format(cells=PART.format("Int64", "0 1"), texts=TEXTS.replace("97", "a")))
    with pytest.raises(InputError, match=r"a\.vtp"):
        gvpipe.read(tmp_path / "a.vtp")


def solid(with_flat: bool = True) -> gvpipe.MeshSequence:
    """Two tetrahedra, each a block, and a triangle of a third part beside them."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [5, 0, 0], [6, 0, 0], [5, 1, 0]], np.float32)
    cells = join_cells([equal_cells(10, np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))], [0])
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [1, 4, 3]] + ([[5, 6, 7]] if with_flat else [])
    positions = np.stack([points + frame for frame in range(2)])
    parts = [Part("one", (0, 8), (0, 3)), Part("two", (0, 8), (3, 6))] + ([Part("flat", (0, 8), (6, 7))] if with_flat else [])
    inside = Volume(cells, np.zeros((2, 0, 3), np.float32), blocks=(("one", 1), ("two", 1)))
    return gvpipe.MeshSequence(positions, np.array(faces, np.int32), 10.0, parts=tuple(parts), volume=inside)


@pytest.mark.parametrize("with_flat", [True, False])
@pytest.mark.parametrize("name", ["a.pvd", "a.xdmf", "a_%d.vtu", "a.vtkhdf"])
def test_blocks_of_volumes_come_back(name: str, with_flat: bool, tmp_path: Path) -> None:
    given = solid(with_flat)
    assert not any("parts" in note for note in gvpipe.write(given, tmp_path / name))
    found = gvpipe.read(tmp_path / name, volume=True)
    assert found.volume is not None and given.volume is not None
    assert found.volume.blocks == given.volume.blocks and not found.fields and not found.attributes
    assert [(part.name, part.triangles) for part in found.parts] == [(part.name, part.triangles) for part in given.parts]
    assert [part.name for part in gvpipe.read(tmp_path / name).parts] == [part.name for part in given.parts]


def test_vtk_reads_numbers_of_volumes(tmp_path: Path) -> None:
    gvpipe.write(solid(), tmp_path / "a_%d.vtu")
    assert by_vtk(READ_XML, tmp_path / "a_0.vtu") == {"numbers": [0, 1, 2], "names": ["one", "two", "flat"]}


def test_blocks_of_blocks_have_both_names(tmp_path: Path) -> None:
    gvpipe.write(three_squares(), tmp_path / "a_%d.vtp")
    rows = "".join(f'<DataSet timestep="0" name="{k}" file="a_{k}.vtp"/>' for k in range(2))
    (tmp_path / "a.pvd").write_text(f'<VTKFile type="Collection" version="0.1"><Collection>{rows}</Collection></VTKFile>')
    names = [part.name for part in gvpipe.read(tmp_path / "a.pvd").parts]
    assert names[:2] == ["0/left", f"0/{NAMES[1]}"] and len(set(names)) == 6


def with_heat(is_shared: bool = False) -> gvpipe.MeshSequence:
    heat = gvpipe.Field(np.arange(36, dtype=np.float32).reshape(3, 12), "vertex", unit="K")
    still = np.arange(6, dtype=np.int32)
    given = three_squares(is_shared, fields={"heat": heat}, attributes={"number": gvpipe.Attribute(still, "triangle")})
    return replace(given, metadata=gvpipe.Metadata(start_time=0.5, times=(0.5, 0.75, 4.0)))


def test_vtk_reads_blocks_of_hdf(tmp_path: Path) -> None:
    """Points, numbers, names and times of each block at each step."""
    pytest.importorskip("h5py")
    given = with_heat()
    gvpipe.write(given, tmp_path / "a.vtkhdf")
    found = by_vtk(READ_HDF, tmp_path / "a.vtkhdf")
    assert found["times"] == [0.5, 0.75, 4.0] and found["names"] == ["left", "r\u00e4d_\u00fc <&>", "left_2"]
    assert np.array_equal(np.reshape(found["points"], (3, 12, 3)), given[:])
    assert np.array_equal(np.reshape(found["heat"], (3, 12)), given.fields["heat"][:])
    again = gvpipe.read(tmp_path / "a.vtkhdf")
    assert again.fields["heat"].unit == "K" and np.array_equal(again.times, given.times)
    assert np.asarray(again.attributes["number"].values).ravel().tolist() == list(range(6))


@pytest.mark.parametrize("has_volume", [False, True])
def test_vtk_reads_numbers_of_hdf(has_volume: bool, tmp_path: Path) -> None:
    """Parts that share vertices are numbers of cells, in every step."""
    pytest.importorskip("h5py")
    given = solid() if has_volume else with_heat(True)
    gvpipe.write(given, tmp_path / "a.vtkhdf")
    found = by_vtk(READ_HDF, tmp_path / "a.vtkhdf")
    numbers, names = ([0, 1, 2], ["one", "two", "flat"]) if has_volume else ([0, 0, 1, 1, 2, 2], list(NAMES))
    assert all(each == [numbers] for each in found["part"]) and all(each == names for each in found["texts"])
    assert np.array_equal(np.squeeze(found["points"], 1), given[:])


def test_frames_of_many_parts_are_read_once(tmp_path: Path) -> None:
    """However many blocks a file has, each span of frames is read once."""
    pytest.importorskip("h5py")
    n_parts = 40
    asked: list[tuple[int, int]] = []

    class Counted:
        shape = (5, 4 * n_parts, 3)

        def __getitem__(self, key: slice) -> np.ndarray:
            asked.append((key.start, key.stop))
            moved = [np.concatenate([np.add(SQUARE, [0, frame, k]) for k in range(n_parts)]) for frame in range(5)]
            return np.stack(moved)[key].astype(np.float32)

    faces = np.concatenate([np.array([[0, 1, 2], [1, 3, 2]]) + 4 * k for k in range(n_parts)]).astype(np.int32)
    parts = tuple(Part(f"p{k}", (4 * k, 4 * k + 4), (2 * k, 2 * k + 2)) for k in range(n_parts))
    given = gvpipe.MeshSequence(Counted(), faces, 10.0, parts=parts)
    asked.clear()
    gvpipe.write(given, tmp_path / "a.vtkhdf")
    assert len(asked) == 1
    found = gvpipe.read(tmp_path / "a.vtkhdf")
    assert found.parts == parts and np.array_equal(found[:], Counted()[0:5])


@pytest.mark.parametrize("kind", ["square", "long", "number", "many"])
def test_texts_of_hdf_that_cannot_be(kind: str, tmp_path: Path) -> None:
    """Names of another shape, far longer than the file, or too many are refused; numbers are no names."""
    h5py = pytest.importorskip("h5py")
    gvpipe.write(three_squares(True), tmp_path / "a.vtkhdf")
    with h5py.File(tmp_path / "a.vtkhdf", "a") as file:
        group = file["VTKHDF/FieldData"]
        del group["part_names"]
        if kind == "square":
            group.create_dataset("part_names", data=np.array([[b"a", b"b"]]))
        elif kind == "number":
            group["part_names"] = np.arange(3)
        else:
            size = (200_000,) if kind == "many" else (50_000,)
            group.create_dataset("part_names", size, f"S{10 if kind == 'many' else 50_000}", chunks=(100,), compression="gzip",
                                 fillvalue=b"a" * (10 if kind == "many" else 50_000))  # fmt: skip
    if kind == "number":
        found = gvpipe.read(tmp_path / "a.vtkhdf")
        assert "part" in found.attributes and not found.parts
        return
    with pytest.raises(InputError, match=r"a\.vtkhdf: frame 0 .*part_names.*(a list of at most|bytes; at most)"):
        gvpipe.read(tmp_path / "a.vtkhdf")


@pytest.mark.parametrize("kind", ["circle", "outside"])
def test_assemblies_that_go_nowhere(kind: str, tmp_path: Path) -> None:
    """A group that holds itself ends; a link to another file is not followed."""
    h5py = pytest.importorskip("h5py")
    gvpipe.write(three_squares(), tmp_path / "a.vtkhdf")
    with h5py.File(tmp_path / "a.vtkhdf", "a") as file:
        assembly = file["VTKHDF/Assembly"]
        if kind == "circle":
            assembly["again"], assembly["once_more"] = assembly, assembly  # hard links
        else:
            assembly["far"] = h5py.ExternalLink("/etc/hostname", "/VTKHDF")
    with pytest.raises(InputError, match=r"a\.vtkhdf.*(nested more than|another file)"):
        gvpipe.read(tmp_path / "a.vtkhdf")
