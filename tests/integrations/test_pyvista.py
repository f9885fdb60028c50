"""Geometry videos in PyVista and trimesh; PyVista's part where it is installed."""

from __future__ import annotations

import importlib.util
import runpy
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from doc_pictures import keep
from folders import ROOT

import gvpipe

HAS_PYVISTA = importlib.util.find_spec("pyvista") is not None
needs_pyvista = pytest.mark.skipif(not HAS_PYVISTA, reason="pyvista is not there: pip install 'gvpipe[pyvista]'")
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0], [3, 0.5, 0]], np.float32)


def plates() -> gvpipe.MeshSequence:
    """Two quads and a triangle that rise, in two parts, with a number per vertex and one per polygon."""
    faces = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [4, 6, 5]], np.int32)
    positions = CORNERS + np.array([0, 0, 1], np.float32) * np.arange(4, dtype=np.float32)[:, None, None] / 4
    return gvpipe.MeshSequence(
        positions,
        faces,
        fps=4,
        attributes={"uv": CORNERS[:, :2] / 3, "material": np.array([7, 7, 8, 8, 9], np.int32)},
        fields={
            "heat": np.arange(28, dtype=np.float32).reshape(4, 7),
            "load": (np.arange(4)[:, None] + np.array([0, 0, 1, 1, 2])).astype(np.int32),
        },
        parts=(gvpipe.Part("lid", (0, 7), (0, 2)), gvpipe.Part("rest", (0, 7), (2, 5))),
        polygons=np.array([4, 4, 3], np.int32),
    )


def test_trimesh_has_positions_numbers_and_looks() -> None:
    given = scene()
    mesh: Any = gvpipe.to_trimesh(given, -1)
    assert np.array_equal(mesh.vertices, given[len(given) - 1]) and np.array_equal(mesh.faces, given.faces)
    assert np.array_equal(mesh.vertex_attributes["stress"], given.fields["stress"][-1])
    assert np.array_equal(mesh.face_attributes["state"], given.fields["state"][-1])
    assert np.array_equal(mesh.visual.vertex_colors, np.asarray(given.attributes["color"]))
    textured: Any = gvpipe.to_trimesh(plates())
    assert np.array_equal(textured.visual.uv, CORNERS[:, :2] / 3)
    with pytest.raises(IndexError, match="frame 4 of sequence: there are 4"):
        gvpipe.to_trimesh(plates(), 4)


@needs_pyvista
@pytest.mark.slow
class TestPyVista:
    """With the package itself."""

    def test_frame_shares_memory(self) -> None:
        given = plates()
        mesh = gvpipe.to_pyvista(given, 2)
        assert np.shares_memory(mesh.points, given.positions) and np.array_equal(mesh.points, given[2])
        assert np.shares_memory(mesh.point_data["heat"], given.fields["heat"].values)
        assert np.shares_memory(mesh.active_texture_coordinates, np.asarray(given.attributes["uv"]))
        assert mesh.n_cells == 3 and [mesh.get_cell(k).n_points for k in range(3)] == [4, 4, 3]
        assert mesh.cell_data["load"].tolist() == [2, 3, 4] and mesh.cell_data["material"].tolist() == [7, 8, 9]
        assert mesh.cell_data["part"].tolist() == [0, 1, 1] and list(mesh.field_data["part_names"]) == ["lid", "rest"]
        assert mesh.field_data["TimeValue"] == [0.5]

    def test_there_and_back(self) -> None:
        given = scene()
        found = gvpipe.from_pyvista([gvpipe.to_pyvista(given, k) for k in range(len(given))])
        assert np.array_equal(found[:], given[:]) and np.array_equal(found.faces, given.faces) and found.fps == given.fps
        assert np.array_equal(found.fields["stress"][:], given.fields["stress"][:])
        assert [part.name for part in found.parts] == [part.name for part in given.parts]

    def test_reader(self, tmp_path: Path) -> None:
        """Registered by the entry point; the shots of a capture on one clock."""
        import pyvista as pv

        small = gvpipe.MeshSequence(plates()[:2][:, :4], plates().faces[:2], 4)
        gvpipe.encode(gvpipe.Capture([plates(), small]), tmp_path / "a.mp4")
        first: Any = pv.read(tmp_path / "a.mp4")
        assert (first.n_points, first.n_cells) == (7, 3)
        reader = pv.get_reader(tmp_path / "a.mp4")
        assert isinstance(reader, pv.TimeReader) and reader.number_time_points == 6
        assert reader.time_values == [0, 0.25, 0.5, 0.75, 1, 1.25] and reader.notes == ()
        with gvpipe.open_capture(tmp_path / "a.mp4") as video:
            for frame, time in enumerate(reader.time_values):
                reader.set_active_time_value(time + 0.1)
                assert reader.active_time_value == time and np.array_equal(reader.read().points, video[frame])
            assert reader.read().n_points == video.to_pyvista(5).n_points == 4
            assert reader.read().field_data["TimeValue"] == video.to_pyvista(-1).field_data["TimeValue"] == 1.25
            reader.set_active_time_point(1)
            assert reader.read().cell_data["load"].tolist() == video.to_pyvista(1).cell_data["load"].tolist()
        gvpipe.encode(plates(), tmp_path / "b.mp4")
        assert gvpipe.from_pyvista(pv.get_reader(tmp_path / "b.mp4")).shape == (4, 7, 3)

    def test_volume(self, tmp_path: Path) -> None:
        """All cells and points of the grid, whose order is the source's."""
        import pyvista as pv

        sample = runpy.run_path(str(ROOT / "samples" / "volume.py"), run_name="volume")
        (tmp_path / "a").mkdir()
        nodes = sample["hexahedra"]((4, 3, 3))
        for k, frame in enumerate(sample["frames"]((4, 3, 3), 2)):
            (tmp_path / "a" / f"{k}.vtu").write_bytes(sample["vtu"](frame, nodes))
        gvpipe.encode(str(tmp_path / "a" / "%d.vtu"), tmp_path / "a.mp4", volume=True, max_error=1e-4)
        grid: Any = pv.read(tmp_path / "a.mp4")
        source: Any = pv.read(tmp_path / "a" / "0.vtu")
        assert isinstance(grid, pv.UnstructuredGrid) and np.array_equal(grid.cells, source.cells)
        assert np.abs(grid.points - source.points).max() <= 1e-4
        assert set(source.array_names) <= set(grid.array_names)

    def test_bad_files(self, tmp_path: Path) -> None:
        import pyvista as pv

        with pytest.raises(FileNotFoundError):
            pv.get_reader(tmp_path / "none.mp4")
        (tmp_path / "a.mp4").write_bytes(b"no video")
        with pytest.raises(gvpipe.GvpipeError, match=r"a\.mp4"):
            pv.read(tmp_path / "a.mp4")

    def test_picture_of_the_documentation(self, tmp_path: Path, request: pytest.FixtureRequest) -> None:
        """In a process of its own: VTK warns where there is no screen, and its windows outlive the test."""
        gvpipe.encode(gvpipe.read(ROOT / "samples" / "flag.npz"), tmp_path / "flag.mp4")
        code = f"""import pyvista as pv
reader = pv.get_reader({str(tmp_path / "flag.mp4")!r})
reader.set_active_time_point(20)
plotter = pv.Plotter(off_screen=True, window_size=(480, 320))
plotter.add_mesh(reader.read(), scalars="strain", show_edges=True)
plotter.view_xy()
plotter.screenshot({str(tmp_path / "flag.png")!r})"""
        subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
        keep(tmp_path / "flag.png", "pyvista", request)

    def test_core_imports_no_pyvista(self) -> None:
        code = "import gvpipe, sys; gvpipe.to_trimesh, gvpipe.to_pyvista, gvpipe.Player; print('pyvista' in sys.modules)"
        assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "False"
