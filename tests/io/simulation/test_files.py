"""Simulation files made here, by hand: what is read of them, and what is refused in one line."""

from __future__ import annotations

import base64
import zlib
from pathlib import Path

import numpy as np
import pytest

import gvpipe.io
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError
from gvpipe.io.options import ReadOptions
from gvpipe.io.simulation.exodus import group_vectors, read_exodus

POINTS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], np.float32)


def inline(values: Array, form: str) -> str:
    """The content of a DataArray: text, base64, or base64 of zlib in blocks of 16 bytes."""
    raw = np.ascontiguousarray(values).tobytes()
    if form == "ascii":
        return " ".join(map(str, values.reshape(-1).tolist()))
    if form == "base64":
        return base64.b64encode(np.array([len(raw)], "<u4").tobytes() + raw).decode()
    blocks = [zlib.compress(raw[at : at + 16]) for at in range(0, len(raw), 16)]
    header = np.array([len(blocks), 16, len(raw) % 16, *map(len, blocks)], "<u4").tobytes()
    return base64.b64encode(header).decode() + base64.b64encode(b"".join(blocks)).decode()


def vtu(points: Array, stress: Array, form: str = "ascii", cell: int = 7) -> str:
    """A hexahedron with a number per point and one per cell."""

    def array(name: str, values: Array, kind: str, width: int = 1) -> str:
        return (
            f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" '
            f'format="{"ascii" if form == "ascii" else "binary"}">{inline(values, form)}</DataArray>'
        )

    packed = ' compressor="vtkZLibDataCompressor"' if form == "zlib" else ""
    return (
        f'<?xml version="1.0"?><VTKFile type="UnstructuredGrid" byte_order="LittleEndian" header_type="UInt32"{packed}>'
        '<UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="1">'
        f"<PointData>{array('stress', stress.astype('<f4'), 'Float32')}</PointData>"
        f"<CellData>{array('block', np.array([cell], '<i8'), 'Int64')}</CellData>"
        f"<Points>{array('Points', points.astype('<f4'), 'Float32', 3)}</Points>"
        f"<Cells>{array('connectivity', np.arange(8, dtype='<i8'), 'Int64')}{array('offsets', np.array([8], '<i8'), 'Int64')}"
        f"{array('types', np.array([12], 'u1'), 'UInt8')}</Cells></Piece></UnstructuredGrid></VTKFile>"
    )


@pytest.mark.parametrize("form", ["ascii", "base64", "zlib"])
def test_vtu(tmp_path: Path, form: str) -> None:
    for step in range(3):
        (tmp_path / f"a_{step}.vtu").write_text(vtu(POINTS + step, np.arange(8) * step, form))
    sequence = gvpipe.io.read(str(tmp_path / "a_*.vtu"))
    assert sequence.shape == (3, 8, 3) and sequence.polygons is not None and sequence.polygons.tolist() == [4] * 6
    assert np.array_equal(sequence[2], POINTS + 2)
    assert sequence.fields["stress"][2].tolist() == [0, 2, 4, 6, 8, 10, 12, 14]
    assert sequence.attributes["block"].domain == "triangle" and set(sequence.attributes["block"].values[:, 0].tolist()) == {7}


def test_pvd_keeps_uneven_times(tmp_path: Path) -> None:
    """The rate is that of the mean step, the times are kept, and files are read in the order of time."""
    for step in range(3):
        (tmp_path / f"s{step}.vtu").write_text(vtu(POINTS + step, np.full(8, step)))
    listed = "".join(f'<DataSet timestep="{time}" file="s{step}.vtu"/>' for step, time in ((2, 4.0), (0, 1.0), (1, 1.5)))
    (tmp_path / "a.pvd").write_text(f'<VTKFile type="Collection"><Collection>{listed}</Collection></VTKFile>')
    sequence = gvpipe.io.read(tmp_path / "a.pvd")
    assert sequence.fps == pytest.approx(2 / 3) and sequence.metadata.start_time == 1
    assert list(sequence.times) == [1, 1.5, 4] and any("uneven" in note for note in sequence.notes)
    assert sequence.fields["stress"][:][:, 0].tolist() == [0, 1, 2]


@pytest.mark.parametrize(("name", "message"), [("../out.vtu", "outside"), ("none.vtu", "missing"), ("", "no file name")])
def test_list_names_files_beside_it(tmp_path: Path, name: str, message: str) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (tmp_path / "out.vtu").write_text(vtu(POINTS, np.zeros(8)))
    (folder / "a.pvd").write_text(
        f'<VTKFile type="Collection"><Collection><DataSet timestep="0" file="{name}"/></Collection></VTKFile>'
    )
    with pytest.raises(InputError, match=message):
        gvpipe.io.read(folder / "a.pvd")
    (folder / "a.vtu.series").write_text(f'{{"files": [{{"name": "{name}", "time": 0}}]}}')
    with pytest.raises(InputError, match=message):
        gvpipe.io.read(folder / "a.vtu.series")


def test_changing_topology(tmp_path: Path) -> None:
    """The frame is named, with what reads those before it."""
    whole = vtu(POINTS, np.zeros(8))
    (tmp_path / "a0.vtu").write_text(whole)
    (tmp_path / "a1.vtu").write_text(whole)
    (tmp_path / "a2.vtu").write_text(whole.replace("0 1 2 3 4 5 6 7<", "1 2 3 0 5 6 7 4<"))
    with pytest.raises(InputError, match=r"a2\.vtu.*frames 0:2"):
        gvpipe.io.read(str(tmp_path / "a*.vtu")).read(0, 3)


LEGACY = """# vtk DataFile Version 3.0
a
{form}
DATASET UNSTRUCTURED_GRID
POINTS 8 float
{points}
CELLS 1 9
{cells}
CELL_TYPES 1
{types}
POINT_DATA 8
SCALARS heat float 1
LOOKUP_TABLE default
{heat}
VECTORS speed float
{speed}
"""


@pytest.mark.parametrize("form", ["ASCII", "BINARY"])
def test_legacy(tmp_path: Path, form: str) -> None:
    values = {
        "points": POINTS,
        "cells": np.array([8, *range(8)]),
        "types": np.array([12]),
        "heat": np.arange(8, dtype=np.float32),
        "speed": POINTS * 2,
    }

    def encoded(each: Array) -> str:
        wide = each.astype(">f4" if each.dtype.kind == "f" else ">i4")
        return inline(each, "ascii") if form == "ASCII" else wide.tobytes().decode("latin-1")

    text = LEGACY.format(form=form, **{name: encoded(each) for name, each in values.items()})
    (tmp_path / "a.vtk").write_bytes(text.encode("latin-1"))
    sequence = gvpipe.io.read(tmp_path / "a.vtk")
    assert np.array_equal(sequence[0], POINTS) and len(sequence.faces) == 12
    assert sequence.attributes["heat"].tolist() == [[float(k)] for k in range(8)]
    assert np.array_equal(np.asarray(sequence.attributes["speed"]), POINTS * 2)


def exodus(path: Path, n_steps: int = 3) -> None:
    """Two hexahedra in two blocks, a displacement, a node and an element variable."""
    from scipy.io import netcdf_file

    points = np.concatenate([POINTS, POINTS[[1, 2, 5, 6]] + np.array([1, 0, 0])])
    with netcdf_file(path, "w", version=2) as file:
        for name, size in (
            ("time_step", None),
            ("num_nodes", 12),
            ("one", 1),
            ("eight", 8),
            ("n", 33),
            ("n_nod", 4),
            ("two", 2),
        ):
            file.createDimension(name, size)
        for axis, letter in enumerate("xyz"):
            file.createVariable(f"coord{letter}", "d", ("num_nodes",))[:] = points[:, axis]
        for number, nodes in ((1, [1, 2, 3, 4, 5, 6, 7, 8]), (2, [2, 9, 10, 3, 6, 11, 12, 7])):
            held = file.createVariable(f"connect{number}", "i", ("one", "eight"))
            held[:] = [nodes]
            held.elem_type = b"HEX8"  # type: ignore[attr-defined]  # any attribute is one of the file
        for name, rows, words in (("eb_names", "two", [b"steel", b"foam"]),
                                  ("name_nod_var", "n_nod", [b"dispx", b"dispy", b"dispz", b"T"]),
                                  ("name_elem_var", "one", [b"damage"])):  # fmt: skip
            held = file.createVariable(name, "c", (rows, "n"))
            for row, word in enumerate(words):
                held[row] = np.frombuffer(word.ljust(33, b"\0"), "S1")
        file.createVariable("time_whole", "d", ("time_step",))[:] = np.arange(n_steps) / 10
        for number in range(4):
            held = file.createVariable(f"vals_nod_var{number + 1}", "d", ("time_step", "num_nodes"))
            for step in range(n_steps):
                held[step] = np.full(12, step * (number == 2)) if number < 3 else np.arange(12) + step
        held = file.createVariable("vals_elem_var1eb1", "d", ("time_step", "one"))
        for step in range(n_steps):
            held[step] = [step + 1]


def test_exodus(tmp_path: Path) -> None:
    """Positions move by the displacement, blocks are parts, and the face between the blocks is left out."""
    exodus(tmp_path / "a.e")
    sequence = gvpipe.io.read(tmp_path / "a.e")
    assert sequence.fps == 10 and sequence.n_vertices == 12 and len(sequence.faces) == 20
    assert [(part.name, part.triangles) for part in sequence.parts] == [("steel", (0, 10)), ("foam", (10, 20))]
    assert np.allclose(sequence[2] - sequence[0], [0, 0, 2])
    assert sequence.fields["disp"].shape == (3, 12, 3) and sequence.fields["T"][1][3] == 4
    damage = sequence.fields["damage"][2]
    assert set(damage[:10]) == {3} and set(damage[10:]) == {0}
    assert any("lack some blocks" in note for note in sequence.notes)


def test_frames_of_a_file(tmp_path: Path) -> None:
    exodus(tmp_path / "a.e", 5)
    part = read_exodus(tmp_path / "a.e", ReadOptions(frames=(2, None)))
    assert len(part) == 3 and part.metadata.start_time == pytest.approx(0.2)
    assert np.array_equal(part[0], gvpipe.io.read(tmp_path / "a.e")[2])
    with pytest.raises(InputError, match="frames 7:9 asked for; .* <= 5 is needed"):
        read_exodus(tmp_path / "a.e", ReadOptions(frames=(7, 9)))


def test_group_vectors() -> None:
    assert group_vectors(["DISPLX", "DISPLY", "x", "stress_xx", "v_x", "v_y", "v_z"]) == {
        "DISPL": [0, 1], "x": [2], "stress_xx": [3], "v": [4, 5, 6],
    }  # fmt: skip


def test_ensight(tmp_path: Path) -> None:
    """Geometry that stands still, and a variable with a file per step."""
    (tmp_path / "a.case").write_text(
        "FORMAT\ntype: ensight gold\nGEOMETRY\nmodel: a.geo\nVARIABLE\nscalar per node: 1 heat a.heat**\n"
        "scalar per element: 1 load a.load**\nTIME\ntime set: 1\nnumber of steps: 2\nfilename start number: 3\n"
        "filename increment: 1\ntime values: 0 0.5\n"
    )
    numbers = "\n".join(str(x) for x in POINTS.T.reshape(-1))
    (tmp_path / "a.geo").write_text(
        f"a\nb\nnode id off\nelement id off\npart\n1\nbox\ncoordinates\n8\n{numbers}\nhexa8\n1\n1 2 3 4 5 6 7 8\n"
    )
    for step in range(2):
        heat = "\n".join(str(k + 10.0 * step) for k in range(8))
        (tmp_path / f"a.heat{3 + step:02d}").write_text(f"heat\npart\n1\ncoordinates\n{heat}\n")
        (tmp_path / f"a.load{3 + step:02d}").write_text(f"load\npart\n1\nhexa8\n{step}\n")
    sequence = gvpipe.io.read(tmp_path / "a.case")
    assert sequence.fps == 2 and np.array_equal(sequence[1], POINTS) and sequence.parts[0].name == "box"
    assert sequence.fields["heat"][1].tolist() == [10 + k for k in range(8)]
    assert sequence.fields["load"].domain == "triangle" and set(sequence.fields["load"][1]) == {1}
    (tmp_path / "a.heat04").unlink()
    with pytest.raises(InputError, match=r"a\.heat04.*missing"):
        gvpipe.io.read(tmp_path / "a.case")


SUFFIXES = [".vtu", ".vtp", ".vtk", ".pvd", ".series", ".vtkhdf", ".xdmf", ".e", ".case", ".fbx"]


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("data", [b"", b"\0" * 40, b"# nothing of the kind\n", b'<?xml version="1.0"?><html/>', b"{}"])
def test_other_content(tmp_path: Path, suffix: str, data: bytes) -> None:
    """One line that names the file."""
    if suffix in (".vtkhdf", ".fbx"):
        pytest.importorskip("h5py" if suffix == ".vtkhdf" else "ufbx")
    path = tmp_path / f"a{suffix}"
    path.write_bytes(data)
    with pytest.raises(InputError) as caught:
        gvpipe.io.read(path)
    assert "a" + suffix in str(caught.value) and "\n" not in str(caught.value)


def test_cut_files(tmp_path: Path) -> None:
    """Every prefix is refused, or is read as far as it is whole."""
    exodus(tmp_path / "a.e")
    (tmp_path / "a.vtu").write_text(vtu(POINTS, np.zeros(8), "zlib"))
    for name in ("a.e", "a.vtu"):
        whole = (tmp_path / name).read_bytes()
        refused = 0
        for stop in range(0, len(whole) - 30, 37):
            path = tmp_path / f"cut{Path(name).suffix}"
            path.write_bytes(whole[:stop])
            try:
                gvpipe.io.read(path).read(0, 1)
            except InputError as exc:
                refused += 1
                assert "\n" not in str(exc)
        assert refused > len(whole) // 37 // 2


def test_positions_that_are_not_finite(tmp_path: Path) -> None:
    bad = POINTS.copy()
    bad[3, 1] = np.nan
    (tmp_path / "a.vtu").write_text(vtu(bad, np.zeros(8)))
    with pytest.raises(InputError, match="vertex 3"):
        gvpipe.io.read(tmp_path / "a.vtu")


def test_sizes_that_no_file_can_have(tmp_path: Path) -> None:
    text = vtu(POINTS, np.zeros(8)).replace('NumberOfPoints="8"', 'NumberOfPoints="99999999999"')
    (tmp_path / "a.vtu").write_text(text)
    with pytest.raises(InputError, match="cannot hold"):
        gvpipe.io.read(tmp_path / "a.vtu")


def test_damaged_numbers(tmp_path: Path) -> None:
    """Numbers are decoded after the mesh; what is wrong with them is one line with the file's name, too."""
    text = vtu(POINTS, np.arange(8), "base64")
    (tmp_path / "a.vtu").write_text(text.replace(inline(np.arange(8, dtype="<f4"), "base64"), "IAAAAA=="))
    with pytest.raises(InputError, match=r"a\.vtu: 'stress' cannot be read.*cut short"):
        gvpipe.io.read(tmp_path / "a.vtu")
