"""Steps as they should not be: each is one clear line with file, frame and remedy, or is read as the line says."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe
from gvpipe.foundation.errors import InputError, TopologyChange

AXIS = np.arange(3)
POINTS = np.stack(np.meshgrid(AXIS, AXIS, AXIS, indexing="ij"), axis=-1).reshape(-1, 3).astype(float)
INNER = 13
N_STEPS = 5


def _at(i: int, j: int, k: int) -> int:
    return 9 * i + 3 * j + k


HEXAHEDRA = [
    [_at(i, j, k), _at(i + 1, j, k), _at(i + 1, j + 1, k), _at(i, j + 1, k),
     _at(i, j, k + 1), _at(i + 1, j, k + 1), _at(i + 1, j + 1, k + 1), _at(i, j + 1, k + 1)]
    for i in range(2) for j in range(2) for k in range(2)
]  # fmt: skip
TET_10 = np.array(
    [
        [0, 0, 0],
        [1, 0, 0],
        [0, 1, 0],
        [0, 0, 1],
        [0.5, 0, 0],
        [0.5, 0.5, 0],
        [0, 0.5, 0],
        [0, 0, 0.5],
        [0.5, 0, 0.5],
        [0, 0.5, 0.5],
    ]
)


def numbers(name: str, values: Any, kind: str = "Float64") -> str:
    flat = np.asarray(values)
    width = flat.shape[1] if flat.ndim == 2 else 1
    words = " ".join(map(str, flat.reshape(-1).tolist()))
    return f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{width}" format="ascii">{words}</DataArray>'


def grid(
    path: Path, points: Any = POINTS, cells: Any = HEXAHEDRA, types: Any = None, point: str = "", cell: str = "", count: int = 0
) -> None:
    """One .vtu; ``count`` is the number of cells that it claims."""
    ends, flat = np.cumsum([len(each) for each in cells]), [node for each in cells for node in each]
    held = numbers("connectivity", flat, "Int64") + numbers("offsets", ends, "Int64")
    held += numbers("types", types or [12] * len(cells), "UInt8")
    path.write_text(
        '<VTKFile type="UnstructuredGrid" version="1.0"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="{len(points)}" NumberOfCells="{count or len(cells)}"><Points>{numbers("p", points)}</Points>'
        f"<Cells>{held}</Cells><PointData>{point}</PointData><CellData>{cell}</CellData></Piece></UnstructuredGrid></VTKFile>"
    )


def series(folder: Path, steps: list[dict[str, Any]], times: Any = None) -> Path:
    """A .pvd of steps."""
    listed = ""
    for k, step in enumerate(steps):
        grid(folder / f"a{k}.vtu", **step)
        listed += f'<DataSet timestep="{k if times is None else times[k]}" file="a{k}.vtu"/>'
    path = folder / "a.pvd"
    path.write_text(f'<VTKFile type="Collection" version="0.1"><Collection>{listed}</Collection></VTKFile>')
    return path


def moving() -> list[dict[str, Any]]:
    return [{"points": POINTS + frame} for frame in range(N_STEPS)]


both = pytest.mark.parametrize("volume", [False, True])


@both
def test_blocks_that_come_and_go(volume: bool, tmp_path: Path) -> None:
    steps = moving()
    steps[2]["cells"] = HEXAHEDRA[:6]
    found = gvpipe.read(series(tmp_path, steps), volume=volume)
    with pytest.raises(TopologyChange, match=r"frame 2.*\(--split\)") as caught:
        gvpipe.encode(found, tmp_path / "a.mp4", "pca")
    assert "a.pvd" in str(caught.value) or "a2.vtu" in str(caught.value)


@both
@pytest.mark.parametrize("place", ["point", "cell"])
def test_arrays_of_some_steps(place: str, volume: bool, tmp_path: Path) -> None:
    rows = len(POINTS) if place == "point" else len(HEXAHEDRA)
    steps = moving()
    for step in steps[:3]:
        step[place] = numbers("heat", np.arange(rows) + step["points"][0, 0])
    with pytest.raises(
        InputError, match=r"a\.pvd.*(frame 4|a4\.vtu) has no 'heat'.*(remove it from all or none|same properties)"
    ):
        gvpipe.read(series(tmp_path, steps), volume=volume)[:]
    steps = moving()
    steps[2][place] = numbers("heat", np.arange(rows))
    assert "heat of later frames" in gvpipe.read(series(tmp_path, steps), volume=volume).not_carried


@both
def test_numbers_of_another_type_or_shape(volume: bool, tmp_path: Path) -> None:
    """Fractions do not become whole numbers because the first step has some."""
    steps = moving()
    for k, step in enumerate(steps):
        step["point"] = numbers("heat", np.arange(27) + k, "Int32")
    steps[3]["point"] = numbers("heat", np.arange(27) + 0.5)
    with pytest.raises(
        InputError, match=r"(a\.pvd|a3\.vtu): frame 3: 'heat' is of type float64.*int32; save all frames with one type"
    ):
        gvpipe.read(series(tmp_path, steps), volume=volume).fields["heat"].read(0, N_STEPS)
    steps[3]["point"] = numbers("heat", np.arange(27) + 3.0)
    assert gvpipe.read(series(tmp_path, steps), volume=volume).fields["heat"].read(3, 4)[0, 1, 0] == 4
    steps[3]["point"] = numbers("heat", np.zeros((27, 3), int), "Int32")
    with pytest.raises(InputError, match=r"(frame 3|a3\.vtu).*3\).*(save all with one shape|same properties)"):
        gvpipe.read(series(tmp_path, steps), volume=volume).fields["heat"].read(0, N_STEPS)


@both
@pytest.mark.parametrize("kind", [24, 71])
def test_cells_of_mixed_order(kind: int, volume: bool, tmp_path: Path) -> None:
    """A quadratic cell beside a linear one; one of any order keeps its corners, which is said."""
    points = np.concatenate([TET_10, [[1, 1, 1]]])
    cells = [list(range(10)), [1, 2, 3, 10]]
    steps = [{"points": points + frame, "cells": cells, "types": [kind, 10]} for frame in range(2)]
    found = gvpipe.read(series(tmp_path, steps), volume=volume)
    gvpipe.encode(found, tmp_path / "a.mp4", "pca")
    assert ("curvature of cells of higher order" in found.not_carried) == (kind == 71)
    assert (gvpipe.read(tmp_path / "a.mp4").volume is not None) == volume


@both
def test_cells_that_are_inside_out(volume: bool, tmp_path: Path) -> None:
    """The surface looks outwards all the same, and later steps may be turned inside out."""
    turned = [[cell[k] for k in (0, 3, 2, 1, 4, 7, 6, 5)] for cell in HEXAHEDRA]
    steps = [{"points": POINTS, "cells": turned}, {"points": POINTS * [1, 1, -1], "cells": turned}]
    found = gvpipe.read(series(tmp_path, steps), volume=volume)
    corners = found[0:1][0][found.faces].astype(float)
    volume_of_surface = np.einsum("ti,ti->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume_of_surface == pytest.approx(8)
    gvpipe.encode(found, tmp_path / "a.mp4", "pca")


@both
@pytest.mark.parametrize("frame", [0, 3])
@pytest.mark.parametrize("row", [0, INNER])
def test_points_that_are_no_numbers(row: int, frame: int, volume: bool, tmp_path: Path) -> None:
    steps = moving()
    steps[frame]["points"] = steps[frame]["points"].copy()
    steps[frame]["points"][row, 1] = np.nan
    path = series(tmp_path, steps)
    if row == INNER and not volume:
        gvpipe.encode(path, tmp_path / "a.mp4", "pca")
        return
    where = f"point {INNER} inside" if row == INNER else "vertex 0"
    with pytest.raises(InputError, match=rf"a(\.pvd|{frame}\.vtu): frame {frame}, {where} is .*nan.*finite number") as caught:
        gvpipe.encode(gvpipe.read(path, volume=volume), tmp_path / "a.mp4", "pca")
    assert "\n" not in str(caught.value)


@both
@pytest.mark.parametrize("row", [0, INNER])
def test_numbers_that_are_none(row: int, volume: bool, tmp_path: Path) -> None:
    steps = moving()
    for k, step in enumerate(steps):
        heat = np.arange(27.0) + k
        heat[row] = np.nan
        step["point"] = numbers("heat", heat)
    found = gvpipe.read(series(tmp_path, steps), volume=volume)
    if row == INNER and not volume:
        gvpipe.encode(found, tmp_path / "a.mp4", "pca")
        return
    with pytest.raises(InputError, match=r"a\.pvd: field 'heat': frame 0.*nan.*nan=keep") as caught:
        gvpipe.encode(found, tmp_path / "a.mp4", "pca")
    assert "\n" not in str(caught.value)
    gvpipe.encode(found, tmp_path / "a.mp4", "pca", fields={"heat": "0.1%,nan=keep"})
    again = gvpipe.read(tmp_path / "a.mp4")
    held = again.fields["heat"] if row == 0 else again.volume.point_fields["heat"]  # type: ignore[union-attr]
    assert int(np.isnan(held[0:1]).sum()) == 1


@both
def test_fill_values_are_named(volume: bool, tmp_path: Path) -> None:
    steps = moving()
    for k, step in enumerate(steps):
        heat = np.arange(27.0) + k
        heat[0] = 1e30
        step["point"] = numbers("heat", heat) + numbers("large", np.full(27, 1e30))
    notes = [note for note in gvpipe.read(series(tmp_path, steps), volume=volume).notes if "fill values" in note]
    assert len(notes) == 1 and notes[0].startswith("'heat' has values of 1e+30 in frame 0") and "nan=keep" in notes[0]


@both
def test_a_hundred_million_cells_of_nothing(volume: bool, tmp_path: Path) -> None:
    steps = moving()[:1]
    steps[0]["count"] = 10**8
    with pytest.raises(InputError, match=r"a\.pvd.*100000000 x 1 numbers, which a file of \d+ bytes cannot hold; export"):
        gvpipe.read(series(tmp_path, steps), volume=volume)


@both
def test_a_hundred_million_cells_of_hdf(volume: bool, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"], root.attrs["Type"] = (2, 3), np.bytes_("UnstructuredGrid")
        n_cells = 10**8
        root["NumberOfPoints"], root["NumberOfCells"] = [8], [n_cells]
        root["NumberOfConnectivityIds"], root["Points"] = [8 * n_cells], np.zeros((8, 3))
        for name, size in {"Types": n_cells, "Offsets": n_cells + 1, "Connectivity": 8 * n_cells}.items():
            root.create_dataset(name, (size,), "u1" if name == "Types" else "i8", chunks=(1 << 20,), compression="gzip")
    with pytest.raises(InputError, match=r"a\.vtkhdf: frame 0 cannot be read: .* of \d+ bytes cannot hold; export"):
        gvpipe.read(tmp_path / "a.vtkhdf", volume=volume)


@both
def test_times_that_do_not_rise(volume: bool, tmp_path: Path) -> None:
    """A list is read in the order of time; frames of one time stay, and a note names them."""
    steps = moving()[:3]
    back = gvpipe.read(series(tmp_path, steps, (2, 1, 0)), volume=volume)
    assert back[:][:, 0, 0].tolist() == [2, 1, 0] and back.times.tolist() == [0, 1, 2]
    twice = gvpipe.read(series(tmp_path, steps, (0, 1, 1)), volume=volume)
    assert twice.times.tolist() == [0, 1, 1]
    assert any("the steps' times do not rise (frame 1 is at 1 s, frame 2 at 1 s)" in note for note in twice.notes)
    with_nan = gvpipe.read(series(tmp_path, steps, (0, "nan", 1)), volume=volume)
    assert any("the time of frame" in note and "is nan" in note for note in with_nan.notes)


def test_times_of_hdf_that_run_backwards(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    faces = np.array([[0, 1, 2]], np.int32)
    given = gvpipe.MeshSequence(np.stack([POINTS[:3] + frame for frame in range(3)]).astype(np.float32), faces, 1.0)
    gvpipe.write(given, tmp_path / "a.vtkhdf")
    with h5py.File(tmp_path / "a.vtkhdf", "a") as file:
        file["VTKHDF/Steps/Values"][...] = (2, 1, 0)
    found = gvpipe.read(tmp_path / "a.vtkhdf")
    assert found.times.tolist() == [2, 1, 0]
    assert any("do not rise (frame 0 is at 2 s, frame 1 at 1 s)" in note for note in found.notes)


@both
def test_numbers_that_float32_rounds_to_zero(volume: bool, tmp_path: Path) -> None:
    """Memory that a program left as it was is no reason to refuse a file."""
    steps = moving()
    for k, step in enumerate(steps):
        step["cell"] = numbers("status", np.arange(8) * 1e-308 * (k + 1))
    found = gvpipe.read(series(tmp_path, steps), volume=volume)
    assert found.fields["status"].dtype == np.float32
    gvpipe.encode(found, tmp_path / "a.mp4", "pca")
