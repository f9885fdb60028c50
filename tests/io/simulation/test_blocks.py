"""Steps of several parts, blocks and pieces; steps without cells; what is inside of volumes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.simulation.dataset import DataArray, join_arrays

GRID = """<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>
<Piece NumberOfPoints="{n}" NumberOfCells="{m}"><Points><DataArray type="Float32" NumberOfComponents="3" format="ascii">{points}
</DataArray></Points><Cells><DataArray type="Int32" Name="connectivity" format="ascii">{nodes}</DataArray>
<DataArray type="Int32" Name="offsets" format="ascii">{offsets}</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{types}</DataArray></Cells>
<PointData>{data}</PointData></Piece></UnstructuredGrid></VTKFile>"""
SQUARE = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]


def grid(path: Path, shift: float = 0.0, names: tuple[str, ...] = ("T",), cells: int = 2) -> Path:
    """A square of two triangles at a place along z, with numbers on its points."""
    points = np.add(SQUARE, [0, 0, shift])
    one = '<DataArray type="Float32" Name="{}" format="ascii">{}</DataArray>'
    data = "".join(one.format(name, " ".join(str(shift + k) for k in range(4))) for name in names)
    nodes = " ".join(map(str, [0, 1, 2, 1, 3, 2][: 3 * cells]))
    ends, types = " ".join(str(3 * k + 3) for k in range(cells)), " ".join(["5"] * cells)
    text = GRID.format(
        n=4, m=cells, points=" ".join(map(str, points.ravel())), nodes=nodes, offsets=ends, types=types, data=data
    )
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return path


def collection(path: Path, entries: list[tuple[float, str, str]]) -> Path:
    rows = "".join(f'<DataSet timestep="{time}" {attributes} file="{file}"/>' for time, attributes, file in entries)
    path.write_text(f'<VTKFile type="Collection" version="0.1"><Collection>{rows}</Collection></VTKFile>')
    return path


def check_two_parts(found: gvpipe.MeshSequence, names: list[str], n_frames: int = 2) -> None:
    """The second part is 10 above the first, and each frame is 1 above the one before."""
    assert (found.n_frames, found.n_vertices, len(found.faces)) == (n_frames, 8, 4)
    assert [part.name for part in found.parts] == names
    heights = found.read(0, n_frames)[:, [0, 4], 2]
    assert heights.tolist() == [[frame, 10 + frame] for frame in range(n_frames)]


def test_parts_of_a_collection(tmp_path: Path) -> None:
    entries = []
    for frame in (1, 0):
        for part in (0, 1):
            grid(tmp_path / f"{part}_{frame}.vtu", 10 * part + frame)
            entries.append((frame / 2, f'part="{part}"', f"{part}_{frame}.vtu"))
    found = gvpipe.read(collection(tmp_path / "a.pvd", entries))
    check_two_parts(found, ["part_0", "part_1"])
    assert found.fps == 2 and found.fields["T"].read(1, 2)[0, :, 0].tolist() == [1, 2, 3, 4, 11, 12, 13, 14]
    assert gvpipe.read(tmp_path / "a.pvd", frames=(1, 2)).n_frames == 1


def test_named_parts_and_missing_ones(tmp_path: Path) -> None:
    for part in "ab":
        grid(tmp_path / f"{part}.vtu", 10 * (part == "b"))
    entries = [(0.0, f'name="{part}"', f"{part}.vtu") for part in "ab"]
    check_two_parts(gvpipe.read(collection(tmp_path / "a.pvd", entries)), ["a", "b"], 1)
    with pytest.raises(InputError, match="no file of part 'b' at time 1; every step needs every part"):
        gvpipe.read(collection(tmp_path / "a.pvd", [*entries, (1.0, 'name="a"', "a.vtu")]))
    with pytest.raises(InputError, match="two files of one time and one part"):
        gvpipe.read(collection(tmp_path / "a.pvd", [*entries, entries[0]]))
    with pytest.raises(InputError, match="lies outside the file's folder"):
        gvpipe.read(collection(tmp_path / "a.pvd", [*entries[:1], (0.0, 'name="b"', "../b.vtu")]))


@pytest.mark.parametrize("kind", ["vtkMultiBlockDataSet", "vtkPartitionedDataSetCollection"])
def test_multi_block_files(kind: str, tmp_path: Path) -> None:
    holder = "Block" if kind == "vtkMultiBlockDataSet" else "Partitions"
    for frame in (0, 1):
        for part in (0, 1):
            grid(tmp_path / "data" / f"{part}_{frame}.vtu", 10 * part + frame, ("T",) if part else ("T", "own"))
        inner = f'<{holder} index="1" name="second"><DataSet index="0" file="data/1_{frame}.vtu"/></{holder}>'
        body = f'<DataSet index="0" name="first" file="data/0_{frame}.vtu"/>{inner}<DataSet index="2"/>'
        (tmp_path / f"a_{frame}.vtm").write_text(f'<VTKFile type="{kind}" version="1.0"><{kind}>{body}</{kind}></VTKFile>')
    found = gvpipe.read(str(tmp_path / "a_*.vtm"))
    check_two_parts(found, ["first", "second"])
    assert list(found.fields) == ["T"] and "numbers 'own' of some blocks" in found.not_carried
    listed = [(float(frame), "", f"a_{frame}.vtm") for frame in (0, 1)]
    check_two_parts(gvpipe.read(collection(tmp_path / "a.pvd", listed)), ["first", "second"])


def test_multi_block_files_name_nothing_outside(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    grid(tmp_path / "out.vtu")
    kind = "vtkMultiBlockDataSet"
    body = '<DataSet index="0" file="../out.vtu"/>'
    (tmp_path / "in" / "a.vtm").write_text(f'<VTKFile type="{kind}" version="1.0"><{kind}>{body}</{kind}></VTKFile>')
    with pytest.raises(InputError, match="lies outside the file's folder"):
        gvpipe.read(tmp_path / "in" / "a.vtm")
    (tmp_path / "in" / "a.vtm").write_text(f'<VTKFile type="{kind}" version="1.0"><{kind}/></VTKFile>')
    with pytest.raises(InputError, match="no blocks with a mesh"):
        gvpipe.read(tmp_path / "in" / "a.vtm")


def poly_block(group: Any, shift: float, n_steps: int) -> None:
    """A VTKHDF group of poly data whose points rise by 1 from step to step."""
    points = np.concatenate([np.add(SQUARE, [0, 0, shift + step]) for step in range(n_steps)])
    group.attrs["Version"], group.attrs["Type"] = (2, 3), np.bytes_("PolyData")
    group["NumberOfPoints"] = np.full(n_steps, 4)
    group["Points"] = points.astype(np.float32)
    for name in ("Vertices", "Lines", "Polygons", "Strips"):
        held = group.create_group(name)
        is_held = name == "Polygons"
        held["NumberOfCells"] = np.array([2 if is_held else 0])
        held["NumberOfConnectivityIds"] = np.array([6 if is_held else 0])
        held["Offsets"] = np.array([0, 3, 6] if is_held else [0])
        held["Connectivity"] = np.array([0, 1, 2, 1, 3, 2] if is_held else [], np.int64)
    if n_steps > 1:
        steps = group.create_group("Steps")
        steps["Values"] = np.arange(n_steps) / 2
        steps["PartOffsets"], steps["NumberOfParts"] = np.zeros(n_steps, int), np.ones(n_steps, int)
        steps["PointOffsets"] = 4 * np.arange(n_steps)
        for name in ("CellOffsets", "ConnectivityIdOffsets"):
            steps[name] = np.zeros((n_steps, 4), int)


@pytest.mark.parametrize("kind", ["PartitionedDataSetCollection", "MultiBlockDataSet"])
def test_blocks_of_vtkhdf(kind: str, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"], root.attrs["Type"] = (2, 3), np.bytes_(kind)
        for number, name in enumerate(("first", "second")):
            poly_block(root.create_group(name), 10 * number, 2)
            root[name].attrs["Index"] = number
        root.create_group("Assembly")
        root["Assembly/link"] = h5py.SoftLink("/VTKHDF/first")
    name = "link" if kind == "MultiBlockDataSet" else "first"  # there the links name the blocks
    check_two_parts(gvpipe.read(tmp_path / "a.vtkhdf"), [name, "second"])


def test_first_steps_without_cells(tmp_path: Path) -> None:
    for frame, cells in enumerate((0, 0, 2, 2)):
        grid(tmp_path / f"{frame}.vtu", frame, cells=cells)
    found = gvpipe.read(collection(tmp_path / "a.pvd", [(float(frame), "", f"{frame}.vtu") for frame in range(4)]))
    assert found.n_frames == 2 and found.read(0, 2)[:, 0, 2].tolist() == [2, 3] and found.metadata.start_time == 2
    assert "the first 2 steps have no cells; the sequence begins behind" in found.notes


def test_what_is_inside_of_volumes_is_named(tmp_path: Path) -> None:
    axis = np.arange(4)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)

    def at(i: int, j: int, k: int) -> int:
        return 16 * i + 4 * j + k

    cells = [
        [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k),
         at(i, j, k + 1), at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)]
        for i in range(3) for j in range(3) for k in range(3)
    ]  # fmt: skip
    text = GRID.format(
        n=64, m=27, points=" ".join(map(str, points.ravel())), nodes=" ".join(map(str, np.ravel(cells))),
        offsets=" ".join(str(8 * k + 8) for k in range(27)), types=" ".join(["12"] * 27), data="",
    )  # fmt: skip
    (tmp_path / "a.vtu").write_text(text)
    found = gvpipe.read(tmp_path / "a.vtu")
    assert found.not_carried == ("inner points (8)", "volume cells (27)")
    report = gvpipe.encode(found, tmp_path / "a.mp4", codec="pca")
    assert report.not_carried == ["inner points (8)", "volume cells (27)"]


def test_blocks_without_rows_join_others() -> None:
    """A part of a mesh may hold nothing, as pieces of parallel runs do."""
    left = LeftBehind()
    held = [
        {"t": _numbers(np.zeros(0)), "v": _numbers(np.zeros((0, 3)))},
        {"t": _numbers(np.ones(2)), "v": _numbers(np.ones((2, 3)))},
    ]
    joined = join_arrays([*held, {"t": _numbers(np.ones(1))}], "blocks", left)
    assert joined["t"].read().tolist() == [[1], [1], [1]] and left.names == ("numbers 'v' of some blocks",)
    assert join_arrays(held, "blocks", left)["v"].read().shape == (2, 3)


def _numbers(values: Any) -> DataArray:
    return DataArray(lambda: values)
