"""Files of every released codec version decode for ever, to the same positions.

Goldens are written by ``pytest tests/test_golden.py --write-golden`` where they are absent; one that is there is never
written again.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from cell_grids import SPLITS, lattice, quadratic, sequence_of, voronoi
from folders import GOLDEN
from sequences import held, partly_still, patched, rigid, waving

import gvpipe
from gvpipe.foundation.isolation.python import run_python
from gvpipe.grids.cells import Cells, equal_cells, structured_cells

CURRENT: dict[str, tuple[str, dict[str, Any]]] = {
    "laplacian-1": ("laplacian", {"segment": 7}),
    "laplacian-1-now": ("laplacian", {"segment": 7}),
    "laplacian-1-rigid": ("laplacian", {"delta_prediction": "rigid", "reorder": True}),
    "laplacian-1-still": ("laplacian", {"segment": 7}),
    "laplacian-1-tutte": ("laplacian", {"operator": "tutte"}),
    "mcgv-1-affine": ("mcgv", {"clusters": 5, "prediction": "affine", "placement": "halves"}),
    "mcgv-1-charts": ("mcgv", {"clusters": 5, "profile": "precise", "placement": "charts"}),
    "mcgv-1-fitted-seams": ("mcgv", {"gop": 5, "placement": "halves"}),
    "mcgv-1-h264": ("mcgv", {"gop": 5, "segment": 7, "placement": "tiles"}),
    "mcgv-1-jpeg": ("mcgv", {"clusters": 5, "image": "jpeg", "reorder": True, "placement": "halves"}),
    "mcgv-1-klt": ("mcgv", {"transform": "klt", "segment": 7, "reorder": True}),
    "mcgv-1-klt-10": ("mcgv", {"transform": "klt", "profile": "precise", "placement": "charts", "reorder": True}),
    "mcgv-1-now-seams": ("mcgv", {"gop": 5, "placement": "halves"}),
    "mcgv-1-order": ("mcgv", {"gop": 5, "placement": "halves"}),
    "mcgv-1-outliers": ("mcgv", {"prediction": "affine", "clusters": 1, "quality": 95, "gop": 5}),
    "mcgv-1-rigid": ("mcgv", {"segment": 20}),
    "mcgv-1-seams": ("mcgv", {"gop": 5, "placement": "halves"}),
    "mcgv-1-predicted": ("mcgv", {"placement": "halves"}),
    "mcgv-1-trellis": ("mcgv", {"gop": 5, "segment": 7, "placement": "tiles"}),
    "mcgv-1-still": ("mcgv", {"gop": 5, "segment": 7, "placement": "tiles"}),
    "pca-1-first": ("pca", {"quality": 85}),
    "pca-1-first-still": ("pca", {"quality": 90, "segment": 9}),
    "pca-1-graded": ("pca", {"quality": 90}),
    "pca-1-graded-still": ("pca", {"quality": 95}),
    "pca-1-kalman": ("pca", {"quantiser": "plain", "segment": 7}),
    "pca-1-lsp": ("pca", {"predictor": "lsp"}),
    "pca-1-navg": ("pca", {"predictor": "navg", "reorder": True}),
    "pca-1-order": ("pca", {"quantiser": "plain"}),
    "pca-1-rbf": ("pca", {"predictor": "rbf"}),
    "pca-1-seams": ("pca", {"quantiser": "plain"}),
    "pca-1-trends": ("pca", {"quality": 90}),
    "pca-1-trends-predicted": ("pca", {"quality": 95, "segment": 9}),  # 3: of other coefficients, too
    "pca-1-trends-still": ("pca", {"quality": 95, "segment": 9}),
    "pca-1-still": ("pca", {"quantiser": "plain", "segment": 7}),
    "pdct-1": ("pdct", {"clusters": 3, "segment": 5, "reorder": True}),
    "pdct-1-asset": ("pdct", {}),
    "pdct-1-now": ("pdct", {"clusters": 3, "segment": 5}),
    "pdct-1-live": ("pdct", {"clusters": 3, "segment": 5}),
    "pdct-1-seams": ("pdct", {"clusters": 3, "segment": 7, "kept": 0.3}),
    "pdct-1-still": ("pdct", {"clusters": 3, "segment": 7}),
}


@pytest.mark.parametrize("name", sorted({path.stem for path in GOLDEN.glob("*.mp4")} | set(CURRENT)))
def test_golden_file_decodes_to_the_same_positions(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    video, expected = GOLDEN / f"{name}.mp4", GOLDEN / f"{name}.npz"
    if request.config.getoption("--write-golden") and name in CURRENT and not video.exists():
        codec, settings = CURRENT[name]
        sequence = waving(8, 12)
        if name.endswith("-still"):
            sequence = held(partly_still(), [2, *[1] * 18, 3])
        elif name.endswith("-seams"):
            sequence = patched()
        elif name.endswith("-rigid"):
            sequence = held(rigid(), [4, *[1] * 59])
        elif name.endswith("-predicted"):
            sequence = waving(20, 24)
        elif name.endswith("-asset"):
            sequence = scene()
        if name.endswith("-live"):
            with gvpipe.open_live(tmp_path / "live.mp4", sequence.faces, sequence.fps, codec, **settings) as live:
                for frame in sequence.read(0, sequence.n_frames):
                    live.append(frame)
            gvpipe.restream(tmp_path / "live.mp4", video)  # to the plain layout
        else:
            gvpipe.encode(sequence, video, codec, **settings)
        assert f"{name}-".startswith(f"{codec}-{gvpipe.info(video).version}-")
        gvpipe.write(gvpipe.decode(video), expected)
    decoded, wanted = gvpipe.decode(video), gvpipe.read(expected)
    assert np.array_equal(decoded.faces, wanted.faces)
    assert decoded.fps == wanted.fps
    assert np.array_equal(np.asarray(decoded.positions), np.asarray(wanted.positions))
    for beside in ("parts", "materials", "images", "metadata"):
        assert getattr(decoded, beside) == getattr(wanted, beside)
    assert np.array_equal(np.asarray(decoded.polygons), np.asarray(wanted.polygons))
    assert (list(decoded.attributes), list(decoded.fields)) == (list(wanted.attributes), list(wanted.fields))
    for name, attribute in decoded.attributes.items():
        assert np.array_equal(np.asarray(attribute), np.asarray(wanted.attributes[name])), name
    for name, field in decoded.fields.items():
        assert np.allclose(field[:], wanted.fields[name][:], rtol=0, atol=1e-5), name


def test_golden_files_of_pca_have_contexts_of_every_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    from gvpipe.trajectory import coefficient_coding
    from gvpipe.trajectory.contexts import TREND_POWERS, context_inputs

    kinds: set[int] = set()

    def noted(*given: Any) -> Any:
        kinds.add(given[4])
        return context_inputs(*given)

    monkeypatch.setattr(coefficient_coding, "context_inputs", noted)
    for path in GOLDEN.glob("pca-1-trends*.mp4"):
        gvpipe.decode(path).read(0, 1)
    assert kinds == set(range(len(TREND_POWERS)))


LAYOUTS: dict[str, tuple[str, dict[str, Any]]] = {
    "bare-mcgv": ("mcgv", {"segment": 7, "bare": True}),
    "bare-pca": ("pca", {"bare": True}),
    "live-pdct": ("pdct", {"clusters": 3, "segment": 5}),
    "plain-mcgv": ("mcgv", {"gop": 5, "segment": 7, "placement": "tiles"}),
    "plain-pca": ("pca", {"segment": 7}),
    "stream-mcgv": ("mcgv", {"gop": 5, "segment": 7, "stream": True}),
    "stream-pca": ("pca", {"segment": 7, "stream": True}),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_golden_file_of_each_layout(name: str, request: pytest.FixtureRequest) -> None:
    """Each layout, and a file that is still being written; of the plain one, container version 2."""
    video, expected = GOLDEN / "layouts" / f"{name}.mp4", GOLDEN / "layouts" / f"{name}.npz"
    if request.config.getoption("--write-golden") and not video.exists():
        codec, settings = LAYOUTS[name]
        sequence = waving(8, 12)
        if name.startswith("live"):
            live = gvpipe.open_live(video, sequence.faces, sequence.fps, codec, **settings)
            for frame in sequence.read(0, 12):
                live.append(frame)
            unfinished = video.read_bytes()
            live.close()
            video.write_bytes(unfinished)
        else:
            gvpipe.encode(sequence, video, codec, **settings)
        gvpipe.write(gvpipe.decode(video), expected)
    decoded, wanted = gvpipe.decode(video), gvpipe.read(expected)
    assert gvpipe.info(video).layout == name.split("-")[0]
    assert np.array_equal(decoded.faces, wanted.faces)
    assert np.array_equal(np.asarray(decoded.positions), np.asarray(wanted.positions))


VOLUMES: dict[str, tuple[Callable[[], gvpipe.MeshSequence], dict[str, Any]]] = {
    "order": (lambda: sequence_of(*quadratic(26, (3, 3, 3), shuffled=False)), {}),
    "walk-ranked": (lambda: sequence_of(_shuffled(_tetrahedra((5, 5, 4))), lattice((5, 5, 4))), {"reorder": True}),
    "corners": (lambda: sequence_of(*quadratic(24, (3, 3, 3))), {}),
    "corners-reorder": (lambda: sequence_of(*quadratic(25, (3, 3, 3))), {"reorder": True}),
    "polyhedra": (lambda: sequence_of(*voronoi(12)), {}),
    "polyhedra-reorder": (lambda: sequence_of(*voronoi(12)), {"reorder": True}),
}


@pytest.mark.parametrize("name", VOLUMES)
def test_golden_file_of_each_way_to_code_cells(name: str, request: pytest.FixtureRequest) -> None:
    video, expected = GOLDEN / "volumes" / f"{name}.mp4", GOLDEN / "volumes" / f"{name}.npz"
    make, settings = VOLUMES[name]
    if request.config.getoption("--write-golden"):
        gvpipe.encode(make(), video, "pca", bare=True, **settings)
        np.savez_compressed(expected, **_arrays_of(gvpipe.read(video)))
    found, wanted = _arrays_of(gvpipe.read(video)), np.load(expected)
    assert set(found) == set(wanted)
    for key, values in found.items():
        assert values.dtype == wanted[key].dtype and np.allclose(values, wanted[key], rtol=0, atol=1e-5), key


def _tetrahedra(sizes: tuple[int, int, int]) -> Cells:
    hexahedra = structured_cells(sizes).nodes.reshape(-1, 8)
    return equal_cells(10, np.concatenate([hexahedra[:, list(split)] for split in SPLITS[24]]))


def _shuffled(cells: Cells) -> Cells:
    return cells.select(np.random.default_rng(3).permutation(len(cells.types)))


def _arrays_of(sequence: gvpipe.MeshSequence) -> dict[str, Any]:
    """What lies inside, as arrays."""
    volume = sequence.volume
    assert volume is not None
    made: dict[str, Any] = {"types": volume.cells.types, "offsets": volume.cells.offsets, "nodes": volume.cells.nodes}
    if volume.cells.polyhedra is not None:
        made |= {f"polyhedra_{key}": values for key, values in vars(volume.cells.polyhedra).items()}
    made |= {"points": np.asarray(volume.points[:])} | ({} if volume.order is None else {"order": volume.order})
    numbers = {**volume.point_fields, **volume.cell_fields}
    return made | {f"field_{key}": field[:] for key, field in numbers.items()}


PLAIN = """
import sys, warnings
import numpy as np
warnings.simplefilter("error")
import gvpipe
for path in sys.argv[1:]:
    expected = np.load(path.replace(".mp4", ".npz"))["vertices"]
    assert np.abs(gvpipe.open(path)[:] - expected).max() < 1e-5, path
"""


@pytest.mark.parametrize("names", ["pdct-1-live", pytest.param("*", marks=pytest.mark.slow)])
def test_kernels_that_are_not_compiled_decode_the_same(names: str) -> None:
    """By ``NUMBA_DISABLE_JIT``, where kernels are Python: a sound file is not called corrupt."""
    done = run_python(["-c", PLAIN, *map(str, sorted(GOLDEN.glob(f"{names}.mp4")))], {"NUMBA_DISABLE_JIT": "1"})
    assert done.status == 0, done.err
