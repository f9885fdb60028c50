"""Polyhedra: their faces as files list them, and the surface that they make with other cells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cell_grids import lattice, sequence_of, voronoi

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import Cells, equal_cells, join_cells
from gvpipe.grids.polyhedra import Polyhedra, from_faces, from_streams
from gvpipe.io.simulation.surface import extract_surface

POINTS = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1, 2, 3)], np.float64)
PENTAGON = ((0, 0), (2, 0), (3, 1), (1, 2), (-1, 1))
HEXAHEDRON = [1, 2, 6, 5, 9, 10, 14, 13]


def faces_of(x: int) -> list[list[int]]:
    """The six faces of the cube at x, the first two halves of one side: seven in all."""
    at = [x, x + 1, x + 5, x + 4, x + 8, x + 9, x + 13, x + 12]
    quads = [[0, 4, 7, 3], [1, 2, 6, 5], [0, 1, 5, 4], [3, 7, 6, 2], [0, 3, 2, 1]]
    return [*([at[k] for k in quad] for quad in quads), [at[4], at[5], at[6]], [at[4], at[6], at[7]]]


def streams(*cubes: int) -> list[int]:
    return [number for x in cubes for number in [7, *(n for face in faces_of(x) for n in (len(face), *face))]]


def grid() -> Cells:
    """A polyhedron, a hexahedron, a polyhedron in a row."""
    stream = np.array(streams(0, 2))
    made = from_streams(stream, np.array([0, len(stream) // 2]), np.array([len(stream) // 2, len(stream)]))
    nodes = [0, 1, 4, 5, 8, 9, 12, 13, *HEXAHEDRON, 2, 3, 6, 7, 10, 11, 14, 15]
    return Cells(np.array([42, 12, 42], np.uint8), np.array([0, 8, 16, 24]), np.array(nodes), made)


@pytest.mark.parametrize("turned", [False, True])
def test_the_surface_is_closed_and_looks_outwards(turned: bool) -> None:
    cells = grid()
    assert cells.polyhedra is not None
    if turned:  # a face that looks inwards
        nodes = cells.polyhedra.nodes.copy()
        nodes[:4] = nodes[3::-1]
        cells = replace(cells, polyhedra=Polyhedra(cells.polyhedra.counts, cells.polyhedra.sizes, nodes))
    surface = extract_surface(cells, POINTS)
    a, b, c = (POINTS[surface.points][surface.faces[:, k]] for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6 == pytest.approx(3)
    edges = surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    forth = {tuple(edge) for edge in edges.tolist()}
    assert len(forth) == len(edges) and all((b, a) in forth for a, b in forth)
    assert sorted(set(surface.cells.tolist())) == [0, 1, 2] and surface.polygons is not None
    assert "volume cells (3)" in surface.not_carried and not surface.without_inside


def test_selected_and_joined() -> None:
    cells = grid()
    back = cells.select(np.array([2, 0]))
    assert back.polyhedra is not None and back.polyhedra.nodes[:4].tolist() == faces_of(2)[0]
    assert join_cells([cells.select(np.array([0])), cells.select(np.array([1, 2]))], [0, 0]).equals(cells)
    two = join_cells([cells, cells], [0, 16])
    assert two.polyhedra is not None and two.polyhedra.nodes.max() == 31
    shifted = cells.renumbered(np.arange(16) + 5)
    assert shifted.polyhedra is not None and shifted.polyhedra.nodes.min() == 5 and not shifted.equals(cells)


def test_faces_by_numbers_are_the_same() -> None:
    stream = grid().polyhedra
    assert stream is not None
    ends = np.concatenate([[0], np.cumsum(stream.sizes)])
    found = from_faces(np.array([0, 7, 7, 14]), np.arange(14), ends, stream.nodes).select(np.array([0, 2]))
    assert found.equals(stream)


@pytest.mark.parametrize(
    "stream", [[7, 4, 0, 1], [1, 2, 0, 1], [1, 3, 0, 1, 2, 9], [0, 1], [2, 3, 0, 1, 2, 300, 0], [1, -1, 0, 1, 2]]
)
def test_damaged_streams(stream: list[int]) -> None:
    with pytest.raises(ValueError, match="polyhedr"):
        from_streams(np.array(stream), np.array([0]), np.array([len(stream)]))


def test_damaged_numbers() -> None:
    for offsets, faces, ends in (([0, 2], [0, 9], [0, 3, 6]), ([0, 3], [0, 1], [0, 3, 6]), ([0, 2], [0, 1], [0, 5, 3])):
        with pytest.raises(ValueError, match="polyhedr"):
            from_faces(np.array(offsets), np.array(faces), np.array(ends), np.arange(6))


def vtu(cells: Cells, new: bool) -> str:
    known = cells.polyhedra
    assert known is not None

    def array(name: str, values: object, kind: str = "Int64", more: str = "") -> str:
        numbers = " ".join(map(str, np.asarray(values).reshape(-1).tolist()))
        return f'<DataArray type="{kind}" Name="{name}" format="ascii"{more}>{numbers}</DataArray>'

    stream = streams(0, 2)
    lists = (
        array("face_connectivity", known.nodes) + array("face_offsets", np.cumsum(known.sizes))
        + array("polyhedron_to_faces", np.arange(14)) + array("polyhedron_offsets", [7, 7, 14])
        if new
        else array("faces", stream) + array("faceoffsets", [len(stream) // 2, -1, len(stream)])
    )  # fmt: skip
    points = array("Points", POINTS, "Float32", ' NumberOfComponents="3"')
    rows = array("connectivity", cells.nodes) + array("offsets", cells.offsets[1:]) + array("types", cells.types, "UInt8")
    load = array("load", [1.5, 2.5, 3.5], "Float32")
    return (
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>'
        f'<Piece NumberOfPoints="16" NumberOfCells="3"><CellData>{load}</CellData><Points>{points}</Points>'
        f"<Cells>{rows}{lists}</Cells></Piece></UnstructuredGrid></VTKFile>"
    )


def check(sequence: gvpipe.MeshSequence) -> None:
    surface = extract_surface(grid(), POINTS)
    assert np.array_equal(sequence[0], POINTS) and len(sequence.faces) == len(surface.faces)
    load = sequence.attributes["load"].values[:, 0]
    assert sorted(set(load.tolist())) == [1.5, 2.5, 3.5] and "volume cells (3)" in sequence.not_carried


@pytest.mark.parametrize("new", [False, True])
def test_vtu_of_both_layouts(new: bool, tmp_path: Path) -> None:
    (tmp_path / "a.vtu").write_text(vtu(grid(), new))
    check(gvpipe.read(tmp_path / "a.vtu"))
    volume = gvpipe.read(tmp_path / "a.vtu", volume=True)
    assert volume.volume is not None and volume.volume.cells.types.tolist() == [42, 12, 42] and not volume.not_carried
    gvpipe.encode(volume, tmp_path / "a.mp4", "pca")
    again = gvpipe.open(tmp_path / "a.mp4").sequence()
    assert again.volume is not None and len(again.faces) == len(volume.faces)
    for name in ("b.vtu", "b.vtkhdf", "b.xdmf"):
        gvpipe.write(again, tmp_path / name)
        back = gvpipe.read(tmp_path / name, volume=True).volume
        assert back is not None and back.cells.equals(volume.volume.cells)
    text = vtu(grid(), new).replace("polyhedron_offsets", "x").replace("faceoffsets", "x")
    (tmp_path / "b.vtu").write_text(text)
    with pytest.raises(InputError, match="2 of its cells are polyhedra without a list of their faces"):
        gvpipe.read(tmp_path / "b.vtu")


HUGE = 2**63 - 1
HOSTILE = {  # bounds whose differences wrap, so that they add up
    "offsets": ("offsets", [HUGE, -HUGE - 2, -1]),
    "face_offsets": ("face_offsets", [HUGE, -HUGE - 2, -1, 4]),
    "polyhedron_offsets": ("polyhedron_offsets", [HUGE, -HUGE - 2, -1]),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_bounds_that_wrap_are_refused(name: str, tmp_path: Path) -> None:
    array, values = HOSTILE[name]
    values = [each if each <= HUGE and each >= -HUGE - 1 else HUGE for each in values]
    text = vtu(grid(), True)
    start = text.index(">", text.index(f'Name="{array}"')) + 1
    stop = text.index("<", start)
    kept = text[start:stop].split()[len(values) :]
    (tmp_path / "a.vtu").write_text(text[:start] + " ".join(map(str, values)) + " " + " ".join(kept) + text[stop:])
    with pytest.raises(InputError, match=r"a\.vtu"):
        gvpipe.read(tmp_path / "a.vtu", volume=True)


def test_counts_that_wrap_are_refused() -> None:
    quarter = np.array([2**62] * 4 + [3])
    with pytest.raises(ValueError, match="other numbers of faces or corners"):
        Polyhedra(quarter, np.full(3, 3), np.zeros(9, np.int64))
    with pytest.raises(ValueError, match="cut short"):
        from_streams(np.array([1, HUGE, 0, 1, 2]), np.array([0]), np.array([5]))


def test_faces_that_all_share_are_refused() -> None:
    """Else a list of n times one face of n corners would take the square of n numbers."""
    n = 2000
    with pytest.raises(ValueError, match="at most two can have each"):
        from_faces(np.array([0, n]), np.zeros(n, np.int64), np.array([0, n]), np.arange(n))


def test_legacy_files_have_streams(tmp_path: Path) -> None:
    stream = streams(0, 2)
    half = len(stream) // 2
    lines = [f"{half} {' '.join(map(str, stream[:half]))}", f"8 {' '.join(map(str, HEXAHEDRON))}",
             f"{half} {' '.join(map(str, stream[half:]))}"]  # fmt: skip
    points = "\n".join(" ".join(map(str, point)) for point in POINTS.tolist())
    text = f"# vtk DataFile Version 2.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 16 float\n{points}\n"
    text += f"CELLS 3 {len(stream) + 11}\n" + "\n".join(lines) + "\nCELL_TYPES 3\n42\n12\n42\n"
    text += "CELL_DATA 3\nSCALARS load float\nLOOKUP_TABLE default\n1.5 2.5 3.5\n"
    (tmp_path / "a.vtk").write_text(text)
    check(gvpipe.read(tmp_path / "a.vtk"))


def test_vtkhdf_has_numbers_of_faces(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    cells = grid()
    known = cells.polyhedra
    assert known is not None
    with h5py.File(tmp_path / "a.vtkhdf", "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 4])
        root.attrs.create("Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", 16))
        sizes = {"Points": 16, "Cells": 3, "ConnectivityIds": 24, "Faces": 14, "FaceConnectivityIds": len(known.nodes),
                 "PolyhedronToFaceIds": 14}  # fmt: skip
        arrays = {f"NumberOf{name}": [count] for name, count in sizes.items()} | {
            "Points": POINTS, "Connectivity": cells.nodes, "Offsets": cells.offsets, "Types": cells.types,
            "FaceConnectivity": known.nodes, "FaceOffsets": np.concatenate([[0], np.cumsum(known.sizes)]),
            "PolyhedronToFaces": np.arange(14), "PolyhedronOffsets": [0, 7, 7, 14],
        }  # fmt: skip
        for name, values in arrays.items():
            root[name] = values
        root.create_group("CellData")["load"] = np.array([1.5, 2.5, 3.5], np.float32)
    check(gvpipe.read(tmp_path / "a.vtkhdf"))


def test_data_objects_of_vtk_hold_polyhedra() -> None:
    pytest.importorskip("vtkmodules")
    given = sequence_of(*voronoi(12))
    objects = [gvpipe.to_vtk(given, frame) for frame in range(len(given))]
    back = gvpipe.from_vtk(objects, [0, 1, 2], volume=True)
    assert objects[0].GetCellType(0) == 42 and back.volume is not None and given.volume is not None
    own, other = (each.cells.renumbered(np.asarray(each.order)) for each in (given.volume, back.volume))
    assert own.polyhedra is not None and other.polyhedra is not None and own.polyhedra.equals(other.polyhedra)
    assert gvpipe.from_vtk(objects, [0, 1, 2]).volume is None


@pytest.mark.parametrize("kind", [11, 15])
def test_cells_that_xdmf_has_not(kind: int, tmp_path: Path) -> None:
    """Voxels become hexahedra of the same corners; prisms are refused by name, and no file is left."""
    pytest.importorskip("h5py")
    corners = lattice((2, 2, 2)) if kind == 11 else np.array([[x, y, z] for z in (0, 1) for x, y in PENTAGON], np.float64)
    given = sequence_of(equal_cells(kind, np.arange(len(corners))[None]), corners)
    if kind == 15:
        with pytest.raises(InputError, match=r"XDMF has no cells of VTK's type 15; write .vtu, .pvd or .vtkhdf"):
            gvpipe.write(given, tmp_path / "a.xdmf")
        assert not list(tmp_path.iterdir())
        return
    gvpipe.write(given, tmp_path / "a.xdmf")
    found = gvpipe.read(tmp_path / "a.xdmf", volume=True)
    assert found.volume is not None and found.volume.cells.types.tolist() == [12]
    assert np.array_equal(np.asarray(found[0])[found.volume.cells.nodes], corners[[0, 1, 3, 2, 4, 5, 7, 6]].astype(np.float32))
