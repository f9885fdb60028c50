"""Bytes and surface errors of captures: followed and coded, against Draco and gltfpack frame by frame.

    python tools/measure_following.py dancer/ thomas/ collision/ --kg 0.1 0.15 0.2 --bits 9 10 11 --gltfpack 'npx gltfpack'

A folder has one OBJ file for each frame. Draco and gltfpack code it as it came, and decimated. Errors are parts of the diagonal
of the first frame's box: the mean over frames of the root mean square and of the 99 % quantile, and the largest of all
(`gvpipe.metrics.surface`). Bytes are of whole files, one for each run. Seconds are of processor time for a frame: following
alone, or coding by the others (gltfpack with its start). gltfpack writes a GLB for each frame: `-cc`, positions of as many
bits; a server may deflate it further.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import DracoPy
import numpy as np

import gvpipe
from gvpipe.following import Run, follow
from gvpipe.following.distance import SurfaceError
from gvpipe.following.key_mesh import key_mesh
from gvpipe.following.surface import Surface
from gvpipe.foundation.arrays import Array, Float64, Int32
from gvpipe.metrics.surface import Scale, SurfaceErrors, measure
from gvpipe.metrics.surface import Surface as Measured

Mesh = tuple[Float64, Int32]
CORNER = re.compile(r"(\d+)\S*")
STILL_ERROR = 1e-4  # largest error of a run of one frame, part of the diagonal


class ObjFolder:
    """The frames of a folder, read when they are asked for."""

    def __init__(self, folder: Path) -> None:
        self._paths = sorted(folder.glob("*.obj"), key=lambda path: (len(path.name), path.name))

    def __len__(self) -> int:
        return len(self._paths)

    def __getitem__(self, frame: int) -> Mesh:
        points: list[list[float]] = []
        faces: list[list[int]] = []
        for line in self._paths[frame].read_text().splitlines():
            if line.startswith("v "):
                points.append([float(word) for word in line.split()[1:4]])
            elif line.startswith("f "):
                corners = [int(corner) - 1 for corner in CORNER.findall(line[2:])]
                faces.extend([corners[0], corners[k], corners[k + 1]] for k in range(1, len(corners) - 1))
        return np.array(points), np.array(faces, np.int32).reshape(-1, 3)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path)
    parser.add_argument("--rms", type=float, default=0.0004, help="of following")
    parser.add_argument("--max-error", type=float, default=0.01, help="of following")
    parser.add_argument("--codec", default="pca")
    parser.add_argument("--kg", nargs="*", type=float, default=[0.1, 0.15, 0.2], help="Karni-Gotsman errors of runs")
    parser.add_argument("--bits", nargs="*", type=int, default=[9, 10, 11], help="of Draco")
    parser.add_argument("--gltfpack", metavar="COMMAND", type=shlex.split, help="such as 'npx gltfpack'; else it is left out")
    chosen = parser.parse_args()
    coders: list[tuple[str, Callable[[Mesh, int], bytes], Callable[[bytes], Mesh]]] = [("Draco", _draco, _decode_draco)]
    if chosen.gltfpack:
        coders.append(("gltfpack", partial(_gltfpack, chosen.gltfpack), _decode_glb))
    print(
        "| capture | method | bytes a frame | rms | 99 % | largest | seconds a frame |\n|---|---|---|---|---|---|---|",
        flush=True,
    )
    for folder in chosen.folders:
        frames = ObjFolder(folder)
        points = frames[0][0]
        scale = Scale(float(np.linalg.norm(np.ptp(points, axis=0))), points.min(axis=0), 1.0)
        begin = _seconds()
        runs = list(follow(frames, rms=chosen.rms, max_error=chosen.max_error))
        seconds = (_seconds() - begin) / len(frames)
        _row(folder.name, f"followed: {_describe(runs)}", np.nan, _errors(_meshes(runs), frames, scale), seconds)
        for kg in chosen.kg:
            size, decoded = _code(runs, chosen.codec, kg)
            _row(folder.name, f"`{chosen.codec}`, KG {kg:g}", size / len(frames), _errors(decoded, frames, scale), seconds)
        for name, encode, decode in coders:
            for words, share in ((name, 0.0), (f"{name}, decimated", 0.75)):
                for bits in chosen.bits:
                    begin = _seconds()
                    meshes = (_decimated(frames[k], share * chosen.rms, scale.diagonal) for k in range(len(frames)))
                    coded = [encode(mesh, bits) for mesh in meshes]
                    seconds = (_seconds() - begin) / len(frames)
                    n_bytes = sum(map(len, coded)) / len(frames)
                    _row(folder.name, f"{words}, {bits} bits", n_bytes, _errors(map(decode, coded), frames, scale), seconds)


def _describe(runs: list[Run]) -> str:
    vertices = [run.positions.shape[1] for run in runs]
    kept = sum(run.key is None for run in runs)
    return f"{len(runs)} runs of {min(vertices)} to {max(vertices)} vertices, {kept} kept as they came"


def _meshes(runs: list[Run]) -> Iterable[Mesh]:
    for run in runs:
        for k in range(run.positions.shape[0]):
            yield np.asarray(run.positions[k : k + 1][0], np.float64), run.faces


def _code(runs: list[Run], codec: str, kg: float) -> tuple[int, list[Mesh]]:
    size, decoded = 0, []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mp4"
        for run in runs:
            positions = np.asarray(run.positions[0 : run.positions.shape[0]])
            sequence = gvpipe.MeshSequence(positions, run.faces, 30.0)
            diagonal = float(np.linalg.norm(np.ptp(positions[0], axis=0)))
            if len(positions) > 1:
                gvpipe.encode(sequence, path, codec=codec, reorder=True, target_kg=kg)
            else:
                gvpipe.encode(sequence, path, codec=codec, reorder=True, target_rmse=STILL_ERROR * diagonal)
            size += path.stat().st_size
            shot = gvpipe.decode(path)
            assert isinstance(shot, gvpipe.MeshSequence)
            faces = np.asarray(shot.faces)
            decoded += [(shot.read(k, k + 1)[0] + shot.origin, faces) for k in range(len(shot))]
    return size, decoded


def _decimated(mesh: Mesh, rms: float, diagonal: float) -> Mesh:
    """A mesh with as few triangles as lie within ``rms``, part of the diagonal; the mesh itself for 0."""
    if not rms:
        return mesh
    surface = key_mesh(Surface(*mesh), diagonal, SurfaceError(rms, np.inf), None)
    return surface.positions, surface.faces


def _draco(mesh: Mesh, bits: int) -> bytes:
    coded: bytes = DracoPy.encode(*mesh, quantization_bits=bits, compression_level=10)
    return coded


def _decode_draco(coded: bytes) -> Mesh:
    mesh = DracoPy.decode(coded)
    return np.asarray(mesh.points, np.float64), np.asarray(mesh.faces, np.int32)


def _gltfpack(command: list[str], mesh: Mesh, bits: int) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        given, packed = Path(folder) / "frame.glb", Path(folder) / "packed.glb"
        points, faces = mesh
        gvpipe.write(gvpipe.MeshSequence(points[None].astype(np.float32), faces, 30.0), given)
        options = ["-cc", "-vp", str(bits), "-i", str(given), "-o", str(packed)]
        subprocess.run([*command, *options], check=True, stdout=subprocess.DEVNULL)
        return packed.read_bytes()


def _decode_glb(coded: bytes) -> Mesh:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "frame.glb"
        path.write_bytes(coded)
        mesh = gvpipe.read(path)
        return mesh.read_absolute(0, 1)[0], np.asarray(mesh.faces)


def _seconds() -> float:
    """Seconds of processor time, with programs that were started."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _errors(meshes: Iterable[Mesh], frames: ObjFolder, scale: Scale) -> list[SurfaceErrors]:
    """The errors of each frame."""
    return [
        measure(Measured(*mesh, "a frame"), Measured(*frames[k], "its original"), scale, samples=50_000, grid=0)
        for k, mesh in enumerate(meshes)
    ]


def _row(capture: str, method: str, size: float, errors: list[SurfaceErrors], seconds: float) -> None:
    values: Array = np.array([[each.rms_diag, each.p99_diag, each.max_diag] for each in errors], float)
    rms, p99 = values[:, :2].mean(axis=0)
    shown = "" if np.isnan(size) else f"{size:,.0f}"
    print(f"| {capture} | {method} | {shown} | {rms:.5f} | {p99:.4f} | {values[:, 2].max():.4f} | {seconds:.2f} |", flush=True)


if __name__ == "__main__":
    main()
