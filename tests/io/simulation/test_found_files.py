"""What files of VTK's and ParaView's own tests have, written small: blank lines, blocks of a grid, lists without times."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError

CASE = "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\nVARIABLE\nscalar per element: load a.load\n"
HEAD = "one\ntwo\nnode id assign\nelement id assign\n"
CUBE = [[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)]
FACES = [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]]


def ensight(folder: Path, geometry: str, kind: str, values: str) -> gvpipe.MeshSequence:
    (folder / "a.case").write_text(CASE)
    (folder / "a.geo").write_text(HEAD + geometry)
    (folder / "a.load").write_text(f"load\npart\n1\n{kind}\n{values}")
    return gvpipe.read(folder / "a.case")


@pytest.mark.parametrize(
    ("kind", "numbers", "ends"),
    [
        ("uniform", "0\n1\n2\n0.5\n2\n3\n", [[0, 1, 2], [1, 3, 5]]),
        ("rectilinear", "0\n1\n4\n-1\n1\n7\n8\n", [[0, -1, 7], [4, 1, 8]]),
    ],
)
def test_ensight_s_blocks(kind: str, numbers: str, ends: list[list[float]], tmp_path: Path) -> None:
    found = ensight(tmp_path, f"part\n1\nbox\nblock {kind}\n3 2 2\n{numbers}", "block", "5\n6\n")
    assert found.n_vertices == 12 and found.polygons is not None and found.polygons.tolist() == [4] * 10
    assert np.array_equal([found[0].min(axis=0), found[0].max(axis=0)], ends)
    assert sorted(set(found.attributes["load"].values[:, 0].tolist())) == [5, 6]


def test_ensight_s_blocks_of_no_points(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="part 1 has 3 x 0 x 2 points"):
        ensight(tmp_path, "part\n1\nbox\nblock uniform\n3 0 2\n0\n0\n0\n1\n1\n1\n", "block", "5\n")
    with pytest.raises(InputError, match="block uniform range, which is not read"):
        ensight(tmp_path, "part\n1\nbox\nblock uniform range\n3 1 2\n", "block", "5\n")


def test_ensight_s_polyhedra_behind_a_blank_line(tmp_path: Path) -> None:
    coordinates = "".join(f"{point[axis]}\n" for axis in range(3) for point in CUBE)
    faces = "4\n" * 6 + "".join(f"{' '.join(map(str, face))}\n" for face in FACES)
    found = ensight(tmp_path, f"part\n1\nbox\n\ncoordinates\n8\n{coordinates}nfaced\n1\n6\n{faces}", "nfaced", "5\n")
    assert len(found.faces) == 12 and found.polygons is not None and found.polygons.tolist() == [4] * 6
    a, b, c = (found[0][found.faces[:, k]].astype(float) for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(1)
    assert found.attributes["load"].values[0] == 5 and "volume cells" in found.not_carried


def test_a_blank_line_before_ascii(tmp_path: Path) -> None:
    points = "0 0 0 1 0 0 0 1 0\n"
    text = f"# vtk DataFile Version 1.0\ntitle\n\nASCII\n\nDATASET POLYDATA\nPOINTS 3 float\n{points}POLYGONS 1 4\n3 0 1 2\n"
    (tmp_path / "a.vtk").write_text(text)
    assert gvpipe.read(tmp_path / "a.vtk").shape == (1, 3, 3)
    (tmp_path / "a.vtk").write_text(text.replace("ASCII", "text"))
    with pytest.raises(InputError, match="its third line is 'TEXT'"):
        gvpipe.read(tmp_path / "a.vtk")


def test_lists_without_times_and_blocks_of_pieces(tmp_path: Path) -> None:
    """Entries of a list are numbered within their part; a multi-block's pieces are blocks."""
    for name in ("a", "b", "c", "d"):
        sheet = np.array([[[0, 0, ord(name)], [1, 0, ord(name)], [0, 1, ord(name)]]], np.float32)
        gvpipe.write(gvpipe.MeshSequence(sheet, np.array([[0, 1, 2]], np.int32)), tmp_path / f"{name}.vtp")
    entries = [(0, "a"), (1, "b"), (0, "c"), (1, "d")]
    listed = "".join(f'<DataSet part="{part}" file="{name}.vtp"/>' for part, name in entries)
    (tmp_path / "x.pvd").write_text(f'<VTKFile type="Collection"><Collection>{listed}</Collection></VTKFile>')
    found = gvpipe.read(tmp_path / "x.pvd")
    assert found.shape == (2, 6, 3) and found[1][:, 2].tolist() == [ord("c")] * 3 + [ord("d")] * 3
    pieces = "".join(f'<Piece index="{k}"><DataSet index="0" file="{name}.vtp"/></Piece>' for k, name in enumerate("ab"))
    (tmp_path / "x.vtm").write_text(
        f'<VTKFile type="vtkMultiBlockDataSet" version="1.0"><vtkMultiBlockDataSet><Block index="0" name="lid">{pieces}'
        "</Block></vtkMultiBlockDataSet></VTKFile>"
    )
    assert gvpipe.read(tmp_path / "x.vtm").n_vertices == 6


@pytest.mark.skipif(importlib.util.find_spec("meshio") is None, reason="no meshio")
def test_binary_ucd_files_are_told_from_abaqus_ones(tmp_path: Path) -> None:
    (tmp_path / "a.inp").write_bytes(b"\x07\x00\x00\xea\xff\x80\x81")
    with pytest.raises(InputError, match="it is no text, as meshio needs it"):
        gvpipe.read(tmp_path / "a.inp")


def test_steps_of_several_parts_that_share_their_cells(tmp_path: Path) -> None:
    """As VTK's warping_spheres.vtkhdf: sizes of the parts of all steps, and cells that are there once."""
    h5py = pytest.importorskip("h5py")
    one = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    points = np.concatenate([one + np.array([x, 0, step]) for step in range(3) for x in (0, 5)]).astype(np.float32)
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0])
        root.attrs.create("Type", b"PolyData", dtype=h5py.string_dtype("ascii", 8))
        root["Points"], root["NumberOfPoints"] = points, [3] * 6
        for name in ("Vertices", "Lines", "Polygons", "Strips"):
            count = int(name == "Polygons")
            group = root.create_group(name)
            group["NumberOfCells"], group["NumberOfConnectivityIds"] = [count] * 6, [3 * count] * 6
            group["Offsets"] = np.array([0, 3, 0, 3] if count else [0, 0])
            group["Connectivity"] = np.array([0, 1, 2, 0, 2, 1] if count else [], np.int64)
        steps = root.create_group("Steps")
        steps.attrs["NSteps"] = 3
        steps["Values"], steps["NumberOfParts"] = [0.0, 0.5, 1.0], [2] * 3
        steps["PartOffsets"], steps["PointOffsets"] = [0, 2, 4], [0, 6, 12]
        steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = np.zeros((3, 4), np.int64)
    found = gvpipe.read(tmp_path / "a.vtkhdf")
    assert found.faces.tolist() == [[0, 1, 2], [3, 5, 4]] and found.fps == 2
    assert np.array_equal(found[:].reshape(-1, 3), points)
