"""Seed files: golden files, the samples in all codecs and profiles, and meshes in all formats. Made once, kept in a folder."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from fuzz.captures import split_capture
from fuzz.live import split_live
from fuzz.mesh_files import CACHES, MESH
from fuzz.parts import Parts, Seed
from fuzz.streams import split_stream
from fuzz.videos import split_video
from gvpipe.model.sequence import MeshSequence

ROOT = Path(__file__).resolve().parent.parent
TESTS = ROOT / "tests"
FOLDER = ROOT / "build" / "fuzz" / "seeds"
LARGEST = 60_000  # bytes of a seed: larger ones take too long a case
N_FRAMES = 6  # of samples
SOUND_SECONDS = 0.3
N_VERTICES = 120  # of the flag, whose first ones are taken
FAST = {"preset": "ultrafast", "gop": 4, "clusters": 3}
PROFILES: dict[str, tuple[str, dict[str, Any]]] = {
    "mcgv": ("mcgv", FAST),
    "mcgv-affine": ("mcgv", {**FAST, "prediction": "affine", "placement": "charts"}),
    "mcgv-charts": ("mcgv", {**FAST, "prediction": "blended", "placement": "charts", "profile": "precise"}),
    "mcgv-halves": ("mcgv", {**FAST, "placement": "halves", "reorder": True}),
    "mcgv-jpeg": ("mcgv", {"image": "jpeg", "clusters": 3}),
    "mcgv-klt": ("mcgv", {**FAST, "transform": "klt"}),
    "mcgv-bound": ("mcgv", {**FAST, "max_error": "0.1%"}),
    "pca": ("pca", {}),
    "pca-lsp": ("pca", {"predictor": "lsp", "reorder": True}),
    "pca-bound": ("pca", {"max_error": "0.2%"}),
    "laplacian": ("laplacian", {}),
    "laplacian-tutte": ("laplacian", {"operator": "tutte", "delta_prediction": "none"}),
    "pdct": ("pdct", {}),
    "pdct-bound": ("pdct", {"clusters": 3, "max_error": "0.1%", "segment": 4}),
}


def load_seeds(
    folder: Path, more: Path | None = None
) -> tuple[tuple[Seed, ...], tuple[Seed, ...], dict[str, tuple[Seed, ...]]]:
    """Geometry videos in the plain layout, in the stream layout, and files of meshes by format.

    Args:
        folder: of seeds that were made before; what is missing there is made.
        more: a folder of further mesh files, each alone or in a folder of its own with what belongs to it.
    """
    if not (folder / "done").exists():
        make_seeds(folder)
    videos = [*sorted((TESTS / "golden").glob("*.mp4")), *sorted((folder / "videos").glob("*.mp4"))]
    seeds = tuple(Seed(path.stem, split_video(path.read_bytes())) for path in videos)
    streams = tuple(Seed(path.stem, split_stream(path.read_bytes())) for path in sorted((folder / "streams").glob("*.mp4")))
    formats: dict[str, tuple[Seed, ...]] = {}
    for group in sorted((folder / "meshes").iterdir()):
        formats[group.name] = tuple(Seed(case.name, _files(case)) for case in sorted(group.iterdir()))
    for path in sorted(more.rglob("*")) if more else ():
        kind = path.suffix[1:].lower()
        if kind in formats and path.is_file() and path.stat().st_size <= LARGEST:
            formats[kind] = (*formats[kind], Seed(path.name, {f"a{path.suffix.lower()}": path.read_bytes()}))
    return seeds, streams, formats


def load_captures(folder: Path) -> tuple[Seed, ...]:
    """Captures whose shots share a picture; made there if they are missing."""
    folder = folder / "captures"
    if not folder.exists():
        folder.mkdir(parents=True)
        picture = gvpipe.Image("noise", "image/png", b"\x89PNG\r\n\x1a\n" + bytes(range(200)))
        for codec in ("pca", "pdct"):
            shots = [replace(each, fps=24.0, images=(picture,)) for each in _samples().values()]
            gvpipe.encode(gvpipe.Capture(shots, "samples"), folder / f"{codec}.mp4", codec)
    return tuple(Seed(path.stem, split_capture(path.read_bytes())) for path in sorted(folder.glob("*.mp4")))


def load_live(folder: Path) -> tuple[Seed, ...]:
    """Files that are still written; made there if they are missing."""
    folder = folder / "live"
    if not folder.exists():
        folder.mkdir(parents=True)
        for sample, sequence in _samples().items():
            with gvpipe.open_live(folder / f"{sample}.mp4", sequence.faces, sequence.fps, segment=2) as live:
                for frame in sequence.read(0, N_FRAMES):
                    live.append(frame)
                data = (folder / f"{sample}.mp4").read_bytes()
            (folder / f"{sample}.mp4").write_bytes(data)  # as it was before it was finished
    return tuple(Seed(path.stem, split_live(path.read_bytes())) for path in sorted(folder.glob("*.mp4")))


def make_seeds(folder: Path) -> None:
    """Write all seeds."""
    (folder / "videos").mkdir(parents=True, exist_ok=True)
    for sample, sequence in _samples().items():
        for name, (codec, settings) in PROFILES.items():
            gvpipe.encode(sequence, folder / "videos" / f"{sample}-{name}.mp4", codec, **settings)
    voice = gvpipe.read_sound(ROOT / "samples" / "voice.wav").part(0, SOUND_SECONDS)
    gvpipe.encode(_samples()["flag"], folder / "videos" / "flag-sound.mp4", "pdct", audio=voice)
    for sample, sequence in _scenes().items():
        for name in ("mcgv", "pca", "mcgv-affine"):
            codec, settings = PROFILES[name]
            gvpipe.encode(sequence, folder / "videos" / f"{sample}-{name}.mp4", codec, **settings)
    (folder / "streams").mkdir(exist_ok=True)
    for path in sorted((folder / "videos").glob("*.mp4")):
        gvpipe.restream(path, folder / "streams" / path.name, "stream")
    _make_meshes(folder / "meshes")
    (folder / "done").write_text("")


def _samples() -> dict[str, MeshSequence]:
    """A few frames of two samples, one of them cut small; of the other, every second frame is held."""
    flag = gvpipe.read(ROOT / "samples" / "flag.npz")
    faces = flag.faces[(flag.faces < N_VERTICES).all(axis=1)]
    ball = gvpipe.read(ROOT / "samples" / "ball_frames").part(0, N_FRAMES)
    held = np.repeat(np.asarray(ball.positions[: N_FRAMES // 2]), 2, axis=0)
    return {
        "flag": MeshSequence(np.asarray(flag.positions[:N_FRAMES])[:, :N_VERTICES], faces, flag.fps),
        "ball": MeshSequence(held, ball.faces, ball.fps),
    }


def _scenes() -> dict[str, MeshSequence]:
    """A scene with all that files hold, and its parts alone, whose cases take less time."""
    scene: MeshSequence = _of_tests("asset_scene.py").scene(N_FRAMES)
    cells, grids = _of_tests("asset_coding/test_reduction.py"), _of_tests("cell_grids.py")
    by_polygon = gvpipe.Field(np.repeat(cells.by_cell(), 2, axis=1).astype(np.float64) + 1e7, "triangle")
    return {
        "cells": cells.quads(cells=by_polygon).part(0, N_FRAMES),
        "corners": grids.sequence_of(*grids.quadratic(24, (3, 3, 3))),
        "polyhedra": grids.sequence_of(*grids.voronoi(12)),
        "volume": _of_tests("io/simulation/test_volumes.py").block("mixed", shuffled=True).part(0, 3),
        "scene": scene,
        "layers": replace(scene, fields={}),
        "fields": MeshSequence(scene.positions, scene.faces, scene.fps, fields=scene.fields),
    }


def _make_meshes(folder: Path) -> None:
    scene, sequences = _of_tests("scenes.py").scene(), _of_tests("sequences.py")
    quads = _of_tests("io/simulation/test_hdf.py").sequence_of_quads()
    plain = sequences.waving(4, 3)
    one = plain.part(0, 1)
    for suffix in ("obj", "ply", "off", "stl", "vtp"):
        _write(folder, suffix, "frame", lambda path: gvpipe.write(one, path))
        _write(folder, suffix, "scene", lambda path: gvpipe.write(scene.part(0, 1), path))
    for suffix in ("npz", "glb", "usda", "usdc", "usdz", "abc", "vtkhdf", "pvd"):
        for name, sequence in (("plain", plain), ("scene", scene), ("quads", quads)):
            _write(folder, suffix, name, partial(gvpipe.write, sequence))
    for suffix in CACHES:
        _write(folder, suffix[1:], "cache", lambda path: (gvpipe.write(plain, path), gvpipe.write(one, path.with_name(MESH))))
    for suffix, name, make in _made_by_tests():
        _write(folder, suffix, name, make)


def _made_by_tests() -> list[tuple[str, str, Callable[[Path], Any]]]:
    files, hdf = _of_tests("io/simulation/test_files.py"), _of_tests("io/simulation/test_hdf.py")
    gltf, fbx = _of_tests("gltf_files.py"), _of_tests("io/fbx/test_fbx.py")
    boxes = _of_tests("io/simulation/test_meshio_files.py").boxes()  # volumes with numbers per point and cell
    bare = type(boxes)(boxes.points, boxes.cells)
    heat = np.arange(8, dtype=np.float32)

    def write_vtu(form: str) -> Callable[[Path], Any]:
        return lambda path: path.write_text(files.vtu(files.POINTS, heat, form))

    def write_legacy(form: str) -> Callable[[Path], Any]:
        values = {
            "points": files.POINTS,
            "cells": np.array([8, *range(8)]),
            "types": np.array([12]),
            "heat": heat,
            "speed": files.POINTS,
        }

        def encoded(each: Any) -> str:
            if form == "ASCII":
                return str(files.inline(each, "ascii"))
            return bytes(each.astype(">f4" if each.dtype.kind == "f" else ">i4").tobytes()).decode("latin-1")

        text = files.LEGACY.format(form=form, **{name: encoded(each) for name, each in values.items()})
        return lambda path: path.write_bytes(text.encode("latin-1"))

    def write_xdmf(path: Path) -> None:
        hdf.xdmf(path)
        hdf.xdmf_numbers(path.with_name("a.h5"))

    return [
        *(("vtu", form, write_vtu(form)) for form in ("ascii", "base64", "zlib")),
        *(("vtk", form, write_legacy(form)) for form in ("ASCII", "BINARY")),
        ("xdmf", "function", write_xdmf),
        ("e", "exodus", files.exodus),
        ("case", "ensight", _write_ensight),
        ("fbx", "text", lambda path: path.write_text(fbx.FBX)),
        ("gltf", "text", lambda path: _write_gltf(gltf, path)),
        ("msh", "binary", partial(boxes.write, file_format="gmsh")),
        ("msh", "text", partial(bare.write, file_format="gmsh", binary=False)),
        *((suffix, "boxes", boxes.write) for suffix in ("inp", "avs")),
        ("ply", "text", lambda path: path.write_text(PLY)),
        ("stl", "text", lambda path: path.write_text(STL)),
        ("obj", "text", lambda path: (path.write_text(OBJ), path.with_name("a.mtl").write_text(MTL))),
    ]


PLY = """ply
format ascii 1.0
comment made here
element vertex 4
property float x
property float y
property double z
property uchar red
property uchar green
property uchar blue
property float heat
element face 2
property list uchar int vertex_indices
property int group
end_header
0 0 0 1 2 3 0.5
1 0 0 1 2 3 1.5
1 1 0 1 2 3 2.5
0 1 0 9 9 9 3.5
3 0 1 2 7
4 0 1 2 3 8
"""
STL = (
    "solid made\n"
    + "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n" * 2
    + "endsolid\n"
)
OBJ = """mtllib a.mtl
o one
v 0 0 0 0.5 0.5 0.5
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vn 0 0 1
usemtl red
g left
s 1
f 1/1/1 2/2/1 3/3/1
o two
usemtl blue
f -4//1 -2//1 -1//1
l 1 2
"""
MTL = "newmtl red\nKd 1 0 0\nKs 0.5 0.5 0.5\nNs 100\nd 0.5\nmap_Kd -s 1 2 1 a.png\nnewmtl blue\nKe 0 0 1\nPr 0.5\nPm 1\n"


CASE = """FORMAT
type: ensight gold
GEOMETRY
model: a.geo
VARIABLE
scalar per node: 1 heat a.heat**
TIME
time set: 1
number of steps: 2
filename start number: 3
filename increment: 1
time values: 0 0.5
"""


def _write_ensight(path: Path) -> None:
    points = "\n".join(f"{x:12.5e}" for x in np.arange(24.0))
    path.write_text(CASE)
    path.with_name("a.geo").write_text(
        f"a\nb\nnode id off\nelement id off\npart\n1\nbox\ncoordinates\n8\n{points}\nhexa8\n1\n1 2 3 4 5 6 7 8\n"
    )
    for step in (3, 4):
        values = "\n".join(str(k + 10.0 * step) for k in range(8))
        path.with_name(f"a.heat{step:02d}").write_text(f"heat\npart\n1\ncoordinates\n{values}\n")


def _write_gltf(gltf: Any, path: Path) -> None:
    """A square that a clip moves, its numbers in the text."""
    import base64
    import json

    file = gltf.File()
    node = file.add("nodes", {"mesh": file.mesh(file.square())})
    file.clip((node, "translation", [0.0, 1.0], [[0.0, 0, 0], [1, 2, 3]], "LINEAR"))
    file.add("scenes", {"nodes": [node]})
    uri = "data:application/octet-stream;base64," + base64.b64encode(file.blob).decode()
    path.write_text(json.dumps({**file.tree, "buffers": [{"byteLength": len(file.blob), "uri": uri}]}))


def _write(folder: Path, suffix: str, name: str, make: Callable[[Path], Any]) -> None:
    place = folder / suffix / name
    place.mkdir(parents=True, exist_ok=True)
    make(place / f"a.{suffix}")


def _files(folder: Path) -> Parts:
    """A seed's files by name, the main one first."""
    main = f"a.{folder.parent.name}"
    names = sorted((path for path in folder.rglob("*") if path.is_file()), key=lambda path: (path.name != main, path.name))
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in names}


def _of_tests(name: str) -> Any:
    """A module of the tests, which make files too."""
    if str(TESTS) not in sys.path:
        sys.path.append(str(TESTS))
    spec = importlib.util.spec_from_file_location(f"fuzz_{Path(name).stem}", TESTS / name)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(TESTS / name)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
