"""Planes that cut: what is left of surfaces, and the sections of volumes, with their numbers."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import ROOT
from PIL import Image
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import VOLUMES, equal_cells, structured_cells
from gvpipe.rendering.cut import Cut, cut_triangles, is_cut, parse_cut, section
from gvpipe.rendering.cut_scene import CutLook, CutScene
from gvpipe.rendering.field_map import FieldMap

BLOCKS: Any = runpy.run_path(str(ROOT / "tests" / "io" / "simulation" / "test_volumes.py"), run_name="test_volumes")
LOOK = CutLook((160, 120), "smooth", 1, "viridis")


def area(points: np.ndarray, faces: np.ndarray) -> float:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def lattice(n: int) -> np.ndarray:
    z, y, x = np.meshgrid(*[np.arange(float(n))] * 3, indexing="ij")
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("height", [0.25, 0.5, 1.0, 1.75])
def test_a_section_fills_the_block(height: float) -> None:
    points = lattice(3)
    piece = section(structured_cells((3, 3, 3)), points @ [0, 0, 1] - height)
    found = piece.blend(points)
    assert np.allclose(found[:, 2], height) and np.isclose(area(found, piece.faces), 4)
    tilted = points @ [0.3, 0.2, 1] - height - 0.4
    piece = section(structured_cells((3, 3, 3)), tilted)
    assert np.allclose(piece.blend(tilted[:, None]), 0, atol=1e-12) and set(piece.sources) <= set(range(8))


@pytest.mark.parametrize("kind", [10, 12, 13, 14])
def test_every_type_of_cell_is_cut(kind: int) -> None:
    """The section of a cell has the area of the outline that the plane cuts of its hull."""
    from scipy.spatial import ConvexHull

    shapes = {
        10: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        12: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]],
        13: [[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1]],
        14: [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1]],
    }
    points = np.array(shapes[kind], float)
    height = points @ [0.1, 0.2, 1] - 0.35
    piece = section(equal_cells(kind, np.arange(len(points))[None]), height)
    edges = {tuple(sorted(pair)) for face in VOLUMES[kind] for pair in zip(face, face[1:] + face[:1], strict=True)}
    crossed = [(a, b) for a, b in edges if (height[a] <= 0) != (height[b] <= 0)]
    outline = [points[a] + (points[b] - points[a]) * height[a] / (height[a] - height[b]) for a, b in crossed]
    flat = np.array(outline)[:, :2]  # seen from above; the plane leans by its normal
    expected = ConvexHull(flat).volume * np.linalg.norm([0.1, 0.2, 1])
    assert np.isclose(area(piece.blend(points), piece.faces), expected)


def test_triangles_are_cut_where_they_cross() -> None:
    waves = waving(8, 1)
    points = waves[0].astype(np.float64)
    height = points[:, 0] - points[:, 0].mean() - 0.01
    below, above = cut_triangles(waves.faces, height), cut_triangles(waves.faces, -height)
    assert np.isclose(
        area(below.blend(points), below.faces) + area(above.blend(points), above.faces), area(points, waves.faces)
    )
    assert below.blend(height).max() <= 1e-12
    assert len(cut_triangles(waves.faces, np.full(len(points), 1.0)).faces) == 0


def test_colours_of_a_section_are_the_volume_s() -> None:
    given = BLOCKS["block"]("tetrahedra", shuffled=True)
    for name in ("heat", "energy"):
        shown = FieldMap(given, name, range(len(given)), limits=(0, 100))
        points, faces, values = CutScene(given, Cut(1, 0.5, True), LOOK, shown).mesh(2)
        assert values is not None and np.isfinite(values).all()
        assert len(values) == (len(points) if name == "heat" else len(faces))
        normals = np.cross(points[faces[:, 1]] - points[faces[:, 0]], points[faces[:, 2]] - points[faces[:, 0]])
        on_plane = points[faces][:, :, 1].min(axis=1) > points[:, 1].max() - 1e-6
        assert on_plane.any() and (normals[on_plane, 1] >= 0).all()
    plain = CutScene(given, parse_cut("-z=20%"), LOOK, None)
    assert plain.mesh(0)[2] is None and plain.draw(0, gvpipe.Camera(target=(0, 0.2, 0.55), distance=2)).shape == (120, 160, 3)


def test_planes_are_parsed() -> None:
    assert parse_cut("x=0.3") == Cut(0, 0.3) and parse_cut("-y=-2e1") == Cut(1, -20.0, sign=-1)
    assert is_cut("z=10%") and not is_cut("walk") and not is_cut(None) and is_cut("w=3")
    for wrong in ("x=", "x=1.2.3", "q=1", "x=--1", "x=1e400", "x=nan"):
        with pytest.raises(InputError, match="x=0.3, y=30% or -z=0.3"):
            parse_cut(wrong)


def test_render_cuts(tmp_path: Path, run: Any) -> None:
    source = BLOCKS["write_block"](tmp_path / "in.pvd")
    assert run("encode", source, tmp_path / "a.mp4", "--codec", "pca", "--volume").status == 0
    command = ("--field", "temperature", "--size", "320x240", "--frame", "3", "--range", "0,300")
    for name, more in (("whole", ()), ("half", ("--clip", "y=50%")), ("other", ("--clip=-y=50%",))):
        assert run("render", tmp_path / "a.mp4", tmp_path / f"{name}.png", *command, *more).status == 0
    pictures = {name: np.asarray(Image.open(tmp_path / f"{name}.png")) for name in ("whole", "half", "other")}
    assert len({picture.tobytes() for picture in pictures.values()}) == 3
    assert run("render", source, tmp_path / "s.png", *command, "--clip", "y=50%").status == 0  # its volume is read
    finished = run("render", tmp_path / "a.mp4", tmp_path / "n.png", "--clip", "y=-9")
    assert finished.status == 1 and "is left by the plane y=-9; move it" in finished.err
