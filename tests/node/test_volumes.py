"""What lies inside of a surface, decoded by JavaScript in Node: Python's bits."""

from __future__ import annotations

import json
import runpy
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cell_grids import quadratic, sequence_of, voronoi
from folders import ROOT
from pages import BUNDLE

import gvpipe
from gvpipe.asset_coding import volume_encoder
from gvpipe.asset_coding.volume_list import BY_CORNERS, BY_WALK, IN_ORDER
from gvpipe.asset_coding.volume_rows import VolumeRows
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.grids.cells import equal_cells

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
MADE: Any = runpy.run_path(str(ROOT / "tests" / "io" / "simulation" / "test_volumes.py"), run_name="test_volumes")
BLOCK: Any = runpy.run_path(str(ROOT / "samples" / "volume.py"), run_name="volume")
SIZES = (7, 6, 5)


def block(folder: Path, cut: bool) -> Path:
    """The sample's block of a few frames as hexahedra, or as tetrahedra."""
    nodes = BLOCK["tetrahedra" if cut else "hexahedra"](SIZES)
    for k, frame in enumerate(BLOCK["frames"](SIZES, 4, cut)):
        (folder / f"grid_{k}.vtu").write_bytes(BLOCK["vtu"](frame, nodes))
    return folder / "grid_*.vtu"


def check(path: Path, folder: Path) -> int:
    """Compare a file's grid and numbers; the way in which its cells are coded."""
    sequence = gvpipe.open(path).sequence()
    volume = sequence.volume
    assert volume is not None
    wanted = [["point", name] for name in volume.point_fields] + [["cell", name] for name in volume.cell_fields]
    (folder / "wanted.json").write_text(json.dumps(wanted))
    script = Path(__file__).with_name("run_volume.mjs")
    done = subprocess.run(["node", script, BUNDLE / "geometry-video.js", path, folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    grid = json.loads((folder / "grid.json").read_text())
    rows = VolumeRows(volume.cells, sequence.faces, sequence.polygons, sequence.n_vertices, volume.n_points)
    for name in ("types", "offsets", "nodes"):
        assert np.array_equal(grid[name], getattr(volume.cells, name)), name
    assert np.array_equal(grid["triangles"], rows.triangles) and np.array_equal(grid["inner"], rows.inner)
    values = b""
    for k in range(len(sequence)):
        values += np.asarray(volume.points[k : k + 1]).tobytes()
        values += b"".join(field.read(k, k + 1).tobytes() for field in volume.point_fields.values())
        values += b"".join(field.read(k, k + 1)[:, rows.inner].tobytes() for field in volume.cell_fields.values())
    assert (folder / "values.bin").read_bytes() == values
    return read_file(path).section("volume.cells")[0]


@pytest.mark.parametrize(
    ("cut", "reorder"),
    [(False, False), pytest.param(True, True, marks=pytest.mark.slow)],
    ids=["order kept", "any order"],
)
def test_grids_and_numbers_are_pythons(cut: bool, reorder: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    force_walk(monkeypatch)
    gvpipe.encode(block(tmp_path, cut), tmp_path / "a.mp4", "pca", volume=True, reorder=reorder, fps=10)
    assert check(tmp_path / "a.mp4", tmp_path) == BY_WALK


def test_cells_in_order_are_pythons(tmp_path: Path) -> None:
    """Of a type that the walk does not know, with points in any order."""
    sequence = MADE["block"]("hexahedra", True)
    nodes = sequence.volume.cells.nodes.reshape(-1, 8)[:, [0, 1, 3, 2, 4, 5, 7, 6]]
    sequence = replace(sequence, volume=replace(sequence.volume, cells=equal_cells(11, nodes)))
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca", fields={"energy": "exact"})
    assert check(tmp_path / "a.mp4", tmp_path) == IN_ORDER


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hexahedra", "tetrahedra", "mixed"])
@pytest.mark.parametrize("shuffled", [False, True])
@pytest.mark.parametrize("reorder", [False, True])
def test_walks_are_pythons(kind: str, shuffled: bool, reorder: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    force_walk(monkeypatch)
    gvpipe.encode(MADE["block"](kind, shuffled), tmp_path / "a.mp4", "pca", reorder=reorder, fields={"energy": "exact"})
    assert check(tmp_path / "a.mp4", tmp_path) == BY_WALK


def force_walk(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let cells in order be large."""
    monkeypatch.setattr(volume_encoder, "encode_cells", lambda cells: bytes(1 << 20))


@pytest.mark.parametrize(
    ("kind", "reorder"), [(24, False), *(pytest.param(kind, True, marks=pytest.mark.slow) for kind in (25, 26, 29))]
)
def test_quadratic_cells_are_pythons(kind: int, reorder: bool, tmp_path: Path) -> None:
    gvpipe.encode(sequence_of(*quadratic(kind)), tmp_path / "a.mp4", "pca", reorder=reorder)
    assert check(tmp_path / "a.mp4", tmp_path) == BY_CORNERS


def test_polyhedra_are_left_out_with_a_note(tmp_path: Path) -> None:
    gvpipe.encode(sequence_of(*voronoi(12)), tmp_path / "a.mp4", "pca")
    script = f"""
        const {{ process }} = globalThis;
        delete globalThis.process;
        globalThis.window = globalThis;
        globalThis.location = new URL("http://localhost/");
        const {{ GeometryVideo }} = await import({json.dumps((BUNDLE / "geometry-video.js").as_uri())});
        const {{ readFileSync }} = await import("node:fs");
        const video = await GeometryVideo.load(new Uint8Array(readFileSync({json.dumps(str(tmp_path / "a.mp4"))})));
        console.log(JSON.stringify([video.volume, video.notes, video.frameCount]));
        process.exit(0);
    """
    done = subprocess.run(["node", "--input-type=module", "-e", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    volume, notes, n_frames = json.loads(done.stdout)
    assert volume is None and n_frames == 3 and "polyhedra, which gvpipe's Python alone decodes" in " ".join(notes)


@pytest.mark.slow
def test_damaged_sections_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bytes changed or cut in sections whose checksums are right: values, or an error of gvpipe's own."""
    force_walk(monkeypatch)
    gvpipe.encode(MADE["block"]("mixed"), tmp_path / "a.mp4", "pca", fields={"energy": "exact"})
    whole, rng, files = read_file(tmp_path / "a.mp4"), np.random.default_rng(2), []
    for name in [each for each in whole.sections if each.startswith("volume")]:
        for trial in range(8):
            data = bytearray(whole.section(name))
            if trial % 2:
                del data[int(rng.integers(len(data))) :]
            else:
                data[int(rng.integers(min(len(data), 20 if trial % 4 else len(data))))] ^= int(rng.integers(1, 256))
            files.append(tmp_path / f"{name}.{trial}.mp4")
            write_file(replace(whole, sections={**whole.sections, name: bytes(data)}), files[-1])
    script = Path(__file__).with_name("run_damaged_volumes.mjs")
    done = subprocess.run(["node", script, BUNDLE / "geometry-video.js", *files], capture_output=True, text=True)
    lines = done.stdout.splitlines()
    assert done.returncode == 0 and len(lines) == len(files), done.stderr[-2000:]
    assert all(line == "read" or line.startswith("GeometryVideoError ") for line in lines), lines
    assert sum(line != "read" for line in lines) > len(files) // 2
