"""An FBX scene as a `MeshSequence`: nodes with a mesh become parts in world space, frames are evaluated when they are read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gvpipe.asset.metadata import Metadata
from gvpipe.foundation.arrays import Array, Float64
from gvpipe.foundation.errors import InputError
from gvpipe.io.damage import reading, unknown_name
from gvpipe.io.fbx.answers import Described, Take
from gvpipe.io.fbx.materials import read_material
from gvpipe.io.fbx.meshes import scene_mesh, uv_names, world_positions
from gvpipe.io.fbx.textures import Textures
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.library.process import LibraryProcess
from gvpipe.io.options import ReadOptions
from gvpipe.io.scene.frames import SceneFrames, frame_times
from gvpipe.io.scene.layers import join_layers
from gvpipe.io.scene.mesh import join
from gvpipe.model.sequence import MeshSequence

DEFAULT_RATE = 24.0  # frames per second of a file that has none
EXPERIMENTAL = "FBX is read by ufbx, whose Python package is experimental"


class _Poses:
    """Positions of all meshes at the time that was asked for last."""

    def __init__(self, process: LibraryProcess) -> None:
        self._process = process
        self._time: float | None = None
        self._now: list[tuple[Array, bool]] = []

    def at(self, time: float) -> list[tuple[Array, bool]]:
        """Positions of each, and whether it is hidden."""
        if self._time != time:
            found = self._process.ask("positions", time)
            self._now, self._time = [(world_positions(posed), bool(posed.is_hidden)) for posed in found], time
        return self._now


class FbxMotion:
    """How one mesh moves; see `gvpipe.io.scene.frames.Motion`."""

    def __init__(self, poses: _Poses, number: int, name: str, n_vertices: int, moves: bool) -> None:
        self._poses, self._number = poses, number
        self.name, self.n_vertices, self.moves = name, n_vertices, moves

    def at(self, time: float) -> Array:
        """Positions ``(n, 3)`` in world space."""
        return self._poses.at(time)[self._number][0]

    def is_hidden(self, time: float) -> bool:
        """Whether it is not shown."""
        return self._poses.at(time)[self._number][1]


def read_by(process: LibraryProcess, path: Path, options: ReadOptions) -> MeshSequence:
    """Read the meshes of an FBX file, in the file's units and axes, with the world transforms of its nodes.

    Args:
        process: that runs `gvpipe.io.fbx.worker`.
        path: .fbx; textures and geometry caches beside it are read too.
        options: `clip` names a take, the first by default; `fps` samples it at that rate instead of the file's; `frames`.

    Raises:
        InputError: the file is damaged, it has no mesh, there is no such take, a position is not finite.
    """
    with reading(path, "FBX"):
        return _read_by(process, path, options)


def _read_by(process: LibraryProcess, path: Path, options: ReadOptions) -> MeshSequence:
    where = str(path)
    takes: list[Take] = process.ask("takes")
    take, take_notes = _take(takes, options.clip)
    if take is not None:
        process.prepare("choose", takes.index(take))
    held: Described = process.ask("describe", take.start if take else 0.0)
    if not held.meshes:
        raise InputError(f"{where} has no polygon mesh; a mesh with triangles is needed")
    names, textures = uv_names(held.meshes), Textures(path, held.contents)
    materials = tuple(read_material(each, textures, names) for each in held.materials)
    by_id = {each.id: number for number, each in enumerate(held.materials)}
    meshes = [scene_mesh(each, by_id) for each in held.meshes]
    fps = options.fps or (held.fps if np.isfinite(held.fps) and held.fps > 0 else DEFAULT_RATE)
    times = _times(take, fps, where)
    start, stop = options.span(len(times), where)
    times, poses = times[start:stop], _Poses(process)
    motions = [FbxMotion(poses, number, mesh.name, mesh.n_vertices, take is not None) for number, mesh in enumerate(meshes)]
    frames = SceneFrames(motions, times, where, "second")
    joined = join(meshes, where)
    attributes, layer_notes = join_layers(meshes, joined.fans, frames.first)
    hidden = (f"{held.n_hidden} meshes are hidden; they were left out",) if held.n_hidden else ()
    left = LeftBehind()
    for kind, count in held.others.items():
        left.add(kind, count)
    texts = {"fbx creator": held.creator} | ({"fbx take": take.name} if take else {})
    unit = held.unit if np.isfinite(held.unit) and held.unit > 0 else None
    return MeshSequence(
        frames,
        joined.faces,
        fps,
        attributes,
        where,
        frames.origin,
        (*hidden, *take_notes, *textures.notes, *layer_notes, EXPERIMENTAL),
        parts=joined.parts,
        polygons=joined.polygons,
        materials=materials,
        images=tuple(textures.images),
        metadata=Metadata(held.up, unit, float(times[0]), path.name, texts),
        not_carried=left.names,
    )


def _take(takes: list[Take], clip: str | None) -> tuple[Take | None, tuple[str, ...]]:
    """The take that is read, None if the file has none, and notes."""
    names = [take.name for take in takes]
    if clip is not None and clip not in names:
        raise unknown_name("clip", clip, names)
    if not takes:
        return None, ()
    number = 0 if clip is None else names.index(clip)
    others = [name for i, name in enumerate(names) if i != number]
    note = f"take {names[number]!r} was read; others are {', '.join(map(repr, others))} (clip, --clip)"
    return takes[number], (note,) if clip is None and others else ()


def _times(take: Take | None, fps: float, where: str) -> Float64:
    """Seconds of the frames."""
    if take is None:
        return np.zeros(1)
    if not (np.isfinite(take.start) and np.isfinite(take.stop)):
        raise InputError(f"{where}: take {take.name!r} runs from {take.start} to {take.stop} s; finite times are needed")
    return frame_times(take.start, max(take.start, take.stop), 1 / fps, where)
