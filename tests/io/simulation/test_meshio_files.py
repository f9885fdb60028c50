"""Files that meshio reads: surfaces of volume meshes, fields, frames, and what is refused."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gvpipe.io
from gvpipe.foundation.errors import InputError
from gvpipe.io.simulation.meshio_files import MeshioLoader

meshio: Any = pytest.importorskip("meshio")

POINTS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)], np.float64)
HEXAHEDRA = np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])


def boxes(shift: float = 0.0) -> Any:
    """Two hexahedra side by side, with numbers per point and per cell."""
    return meshio.Mesh(
        POINTS + np.array([0, 0, shift]),
        [("hexahedron", HEXAHEDRA)],
        point_data={"heat": POINTS[:, 0] + shift},
        cell_data={"load": [np.array([3.0, 5.0])]},
    )


@pytest.mark.parametrize("suffix", ["msh", "inp", "bdf", "mesh", "su2", "avs", "f3grid"])
def test_surface(tmp_path: Path, suffix: str) -> None:
    kind = {"file_format": "gmsh"} if suffix == "msh" else {}
    meshio.write(tmp_path / f"a.{suffix}", meshio.Mesh(POINTS, [("hexahedron", HEXAHEDRA)]), **kind)
    read = gvpipe.io.read(tmp_path / f"a.{suffix}")
    assert (read.n_vertices, len(read.faces)) == (12, 20)
    assert np.allclose(read[0] + read.origin, POINTS)
    a, b, c = (read[0][read.faces[:, k]].astype(float) for k in range(3))
    assert float(np.sum(np.cross(a, b) * c)) / 6 == pytest.approx(2.0)  # outwards


def test_frames_and_fields(tmp_path: Path) -> None:
    for frame in range(3):
        meshio.write(tmp_path / f"a_{frame}.msh", boxes(frame / 2), file_format="gmsh")
    read = gvpipe.io.read(str(tmp_path / "a_*.msh"))
    assert len(read) == 3 and np.allclose(read[2] + read.origin, POINTS + np.array([0, 0, 1]))
    assert np.allclose(np.asarray(read.fields["heat"].read(1, 2)).reshape(-1), POINTS[:, 0] + 0.5)
    load = np.asarray(read.attributes["load"].values).reshape(-1)
    assert read.attributes["load"].domain == "triangle" and np.unique(load).tolist() == [3.0, 5.0]


def test_numbers_of_many_components_are_left_out(tmp_path: Path) -> None:
    mesh = meshio.Mesh(POINTS, [("hexahedron", HEXAHEDRA)], {"heat": POINTS[:, 0], "wide": np.ones((12, 65))})
    meshio.write(tmp_path / "a.avs", mesh)
    read = gvpipe.io.read(tmp_path / "a.avs")
    assert "heat" in read.attributes and "wide" not in read.attributes
    assert "'wide', which are not numbers of 1 to 64 components" in read.not_carried


def test_threads_share_a_process(tmp_path: Path) -> None:
    """A message names the file of its own request."""
    paths = [tmp_path / f"{number}.msh" for number in range(20)]
    for path in paths:
        path.write_bytes(b"hello\n")
    loader = MeshioLoader()

    def message(path: Path) -> str:
        with pytest.raises(InputError) as caught:
            loader(path)
        return str(caught.value)

    with ThreadPoolExecutor(4) as pool:
        messages = list(pool.map(message, paths))
    assert [str(path) in said for path, said in zip(paths, messages, strict=True)] == [True] * 20


@pytest.mark.parametrize("data", [b"hello\n", b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 9 1 9\n"])
@pytest.mark.parametrize("suffix", ["msh", "inp", "su2", "nas", "vol"])
def test_damage(tmp_path: Path, suffix: str, data: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(data)
    with pytest.raises(InputError, match=rf"a\.{suffix}") as raised:
        gvpipe.io.read(tmp_path / f"a.{suffix}")
    assert "\n" not in str(raised.value) and capsys.readouterr() == ("", "")


def test_text_that_meshio_may_not_read(tmp_path: Path) -> None:
    """meshio 5.3.5 and NumPy 2.4 do not read numbers per point of Gmsh's text."""
    meshio.write(tmp_path / "a.msh", boxes(), file_format="gmsh", binary=False)
    try:
        assert len(gvpipe.io.read(tmp_path / "a.msh").faces) == 20
    except InputError as exc:
        assert "save it as binary" in str(exc)


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such limit")
def test_a_node_of_a_large_number(tmp_path: Path) -> None:
    """meshio makes a table as long as the largest number: 2 GB for 1 kB, without its limit of memory."""
    meshio.write(tmp_path / "a.msh", meshio.Mesh(POINTS, [("hexahedron", HEXAHEDRA)]), file_format="gmsh")
    data, numbers = (tmp_path / "a.msh").read_bytes(), np.arange(1, 13)
    assert data.count(numbers.tobytes()) == 1
    (tmp_path / "a.msh").write_bytes(data.replace(numbers.tobytes(), np.append(numbers[:-1], 1 << 28).tobytes()))
    with pytest.raises(InputError, match=r"a\.msh cannot be read as MSH: Unable to allocate 2\.00 GiB"):
        gvpipe.io.read(tmp_path / "a.msh")


def test_includes_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "a.inp").write_text("*NODE\n1, 0, 0, 0\n*Include, input=../b.inp\n")
    with pytest.raises(InputError, match=r"a\.inp .* it includes other files, which are not followed"):
        gvpipe.io.read(tmp_path / "a.inp")


def test_missing_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.msh").write_text("x")
    monkeypatch.setitem(sys.modules, "meshio", None)
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[vtk\]'"):
        gvpipe.io.read(tmp_path / "a.msh")
