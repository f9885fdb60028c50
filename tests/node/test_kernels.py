"""Kernels as WebAssembly, in Node: what they make of recorded calls is what numba made of them, bit for bit."""

from __future__ import annotations

import json
import runpy
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from folders import DATA, GOLDEN, ROOT, SAMPLES
from waves import EXACT, SHEET, SHEET_FACES, wave

import gvpipe
from gvpipe.fields.encoder import encode_field
from gvpipe.fields.mesh import FieldMesh
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.segment import MODES
from gvpipe.fields.values import FieldBound

NODE = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
TOOL = ROOT / "tools" / "build_wasm.py"
KERNELS = runpy.run_path(str(TOOL))["KERNELS"]
FIELDS = sorted((DATA / "fields").glob("*.npz"))
MOST = 300  # frames x rows x components of a real field that is decoded here, in thousands
TARGETS = {"predict_rows": -4, "predict_rbf": -6}  # which argument says whether a call encodes
TARGETS |= dict.fromkeys(["predict_kalman", "predict_lsp", "predict_navg"], -5)

Call = tuple[str, list[Any], list[Any], list[Any]]  # name, arguments before and after, results


@NODE
@pytest.mark.parametrize("mode", [MODES[0], *(pytest.param(mode, marks=pytest.mark.slow) for mode in MODES[1:3])])
def test_kernels_equal_numba_on_fields(mode: str, tmp_path: Path) -> None:
    """Of vertices and of triangles, with rows that keep their values."""
    values = wave(n_components=2)
    values[:, ::7] = values[0, ::7]
    cells = values[:, SHEET_FACES].mean(axis=2)
    with recorded() as calls:
        decode(values, FieldMesh(SHEET_FACES, len(SHEET)), mode)
        decode(cells, FieldMesh(SHEET_FACES, len(SHEET), "triangle"), mode)
    used = {name for name, *_ in calls}
    assert used >= {"build_order", "weigh_hierarchy", "find_dual", "decode_rows"}
    assert ("predict_kalman" if mode == "trajectories" else "predict_rows") in used
    compare(calls, tmp_path)


@NODE
@pytest.mark.parametrize("name", ["pca-1-graded", "pca-1-kalman", "pca-1-lsp", "pca-1-navg", "pca-1-still"])
def test_kernels_equal_numba_on_trajectories(name: str, tmp_path: Path) -> None:
    """`rbf` calls the system's power function, whose last bit may differ."""
    with recorded() as calls, gvpipe.open(GOLDEN / f"{name}.mp4") as video:
        video[:]
        if len(video.levels) > 1:
            assert len(video.level(1).faces)
    used = {name for name, *_ in calls}
    assert used >= {"build_order", "weigh_hierarchy", "code_residuals" if "graded" in name else "decode_residuals"}
    predictor = name.split("-")[-1].replace("graded", "kalman")
    assert used >= ({"keep_ranks", "weigh_traversal", "fit_still"} if "still" in name else {f"predict_{predictor}"})
    compare(calls, tmp_path)


@NODE
@pytest.mark.parametrize(
    "name",
    [
        *("mcgv-1-seams", "mcgv-1-fitted-seams", "pca-1-seams", "pdct-1-seams", "mcgv-1-klt", "pca-1-order"),
        *("mcgv-1-predicted", "mcgv-1-trellis"),
    ],
)
def test_kernels_equal_numba_on_meshes(name: str, tmp_path: Path) -> None:
    """Seams, vertex orders, adaptive positions, clips, a blend's matrix and transforms."""
    with recorded() as calls, gvpipe.open(GOLDEN / f"{name}.mp4") as video:
        assert np.isfinite(video[0]).all()
    used = {each for each, *_ in calls}
    if name.endswith("klt"):
        assert used >= {"find_energies", "invert_factors", "blend_rows", "multiply", "weighted_sums"}
    elif name.endswith("order"):
        assert used >= {"sort_neighbours", "code_by_candidates"}
    elif name.endswith(("predicted", "trellis")):
        assert used >= {"code_residuals", "predict_kalman"}
    elif name.startswith("mcgv"):
        assert used >= {
            "order_by_corners",
            "code_fitted" if "fitted" in name else "code_positions",
            "visit_corners",
            "code_visits",
        }
    elif name.startswith("pca"):
        assert used >= {"decode_ranks", "sort_neighbours", "traverse_visits"}
    else:
        assert used >= {"find_members", "find_frames", "shape_members", "decode_deltas", "rebuild_positions", "place_seeds"}
    compare(calls, tmp_path)


@NODE
@pytest.mark.parametrize("name", ["laplacian-1-rigid", "laplacian-1-still"])
def test_kernels_equal_numba_on_laplacians(name: str, tmp_path: Path) -> None:
    with recorded() as calls, gvpipe.open(GOLDEN / f"{name}.mp4") as video:
        video[:]
    used = {name for name, *_ in calls}
    assert used >= {"link_vertices", "select_anchors", "laplace_rows", "thin_rows", "fineness", "scale_rows", "weigh_deltas"}
    assert used >= {"normal_matrix", "order_unknowns", "factorise", "multiply_transposed", "add_rows", "solve_columns"}
    compare(calls, tmp_path)


@NODE
@pytest.mark.slow
def test_kernels_equal_numba_on_a_sample(tmp_path: Path) -> None:
    gvpipe.encode(SAMPLES / "flag.npz", tmp_path / "flag.mp4", preset="fast")
    with recorded() as calls, gvpipe.open(tmp_path / "flag.mp4") as video:
        video.fields["strain"].read(0, len(video))
    compare(calls, tmp_path)


@NODE
@pytest.mark.slow
@pytest.mark.skipif(not FIELDS, reason="no ../shared/data")
@pytest.mark.parametrize("path", FIELDS[:1], ids=lambda path: path.stem)  # test_fields.py has all, by the reader
def test_kernels_equal_numba_on_real_fields(path: Path, tmp_path: Path) -> None:
    with np.load(path) as data:
        faces, n_vertices = data["faces"].astype(np.int32), data["vertices"].shape[1]
        for key in [key for key in data.files if key.startswith("field_")]:
            values = data[key].reshape(*data[key].shape[:2], -1)
            domain = "vertex" if values.shape[1] == n_vertices else "triangle"
            values = values[: max(2, 1000 * MOST // values[0].size)]
            with recorded() as calls:
                decode(values, FieldMesh(faces, n_vertices, domain))
            compare(calls, tmp_path)


def decode(values: np.ndarray[Any, Any], mesh: FieldMesh, mode: str = "") -> None:
    """Code a field within 1/200 of its range, in one mode or the best, and decode it."""
    bound = EXACT if mode == "exact" else FieldBound(float(np.nanmax(values) - np.nanmin(values)) / 200)
    modes = (mode,) if mode else MODES[:3]
    holes = bool(np.isnan(values).any())
    section = encode_field(lambda start, stop: values[start:stop], len(values), mesh, bound, holes=holes, modes=modes)
    FieldReader(section, len(values), FieldMesh(mesh.faces, mesh.n_vertices, mesh.domain), "field").read(0, len(values))


@contextmanager
def recorded() -> Iterator[list[Call]]:
    """The calls of `KERNELS` while it is open, but for those that encode."""
    calls: list[Call] = []
    with pytest.MonkeyPatch.context() as patch:
        for path in KERNELS:
            module, _, name = path.rpartition(".")
            patch.setattr(import_module(module), name, noting(getattr(import_module(module), name), name, calls))
        yield calls


def noting(kernel: Callable[..., Any], name: str, calls: list[Call]) -> Callable[..., Any]:
    def call(*given: Any) -> Any:
        before = [copied(each) for each in unpacked(given)]
        result = kernel(*given)
        if name not in TARGETS or not before[TARGETS[name]].size:
            after = unpacked(given)
            twice = [
                isinstance(each, np.ndarray) and any(each is other for other in after[i + 1 :]) for i, each in enumerate(after)
            ]
            kept = [None if is_twice else copied(each) for each, is_twice in zip(after, twice, strict=True)]  # the last counts
            calls.append((name, before, kept, [copied(each) for each in unpacked(result)]))
        return result

    if hasattr(kernel, "_numba_type_"):  # other kernels that call it are compiled with the kernel itself
        call.__dict__["_numba_type_"] = kernel._numba_type_
    return call


def unpacked(value: Any) -> list[Any]:
    """Arrays and numbers of tuples in tuples; nothing of None."""
    if isinstance(value, tuple):
        return [each for part in value for each in unpacked(part)]
    return [] if value is None else [value]


def copied(value: Any) -> Any:
    return value.copy() if isinstance(value, np.ndarray) else value


def compare(calls: list[Call], folder: Path) -> None:
    """Arguments and results after the same calls of WebAssembly are equal, as bytes."""
    assert calls
    data, listed = bytearray(), []
    for name, before, *_ in calls:
        given: list[Any] = []
        for value in before:
            if isinstance(value, np.ndarray):
                given.append({"type": value.dtype.name, "shape": value.shape, "at": len(data)})
                data += value.tobytes()
            else:
                given.append(float(value))
        listed.append({"name": name, "given": given})
    (folder / "calls.json").write_text(json.dumps(listed))
    (folder / "calls.bin").write_bytes(data)
    script = Path(__file__).with_name("run_kernels.mjs")
    done = subprocess.run(["node", script, folder], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = (folder / "results.bin").read_bytes()
    for (name, _, after, result), own in zip(calls, json.loads((folder / "results.json").read_text()), strict=True):
        for number, (value, kept) in enumerate(zip([*after, *result], [*own["given"], *own["returned"]], strict=True)):
            if value is None:  # an array that is given twice, which JavaScript has as two
                continue
            if not isinstance(value, np.ndarray):
                assert value == kept, (name, number)
                continue
            assert (value.dtype.name, list(value.shape)) == (kept["type"], kept["shape"]), (name, number)
            assert value.tobytes() == found[kept["at"] : kept["at"] + value.nbytes], (name, number)


@NODE
@pytest.mark.parametrize(("failures", "wanted"), [(0, [1, "open"]), (5, [6, "open"]), (6, [6, "RangeError"])])
def test_memory_is_asked_for_several_times(failures: int, wanted: list[Any]) -> None:
    """Browsers give back the memories of workers some time after they ended."""
    script = Path(__file__).with_name("run_memory.mjs")
    ended = subprocess.run(["node", script, str(failures)], capture_output=True, text=True, check=True)
    assert json.loads(ended.stdout) == wanted
