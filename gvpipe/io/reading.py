"""Reading a mesh sequence, by the extension of its file. NumPy is not imported here: a library's process starts before it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from gvpipe.container.sources import check_source, is_stored
from gvpipe.foundation.errors import InputError
from gvpipe.io.cut_pictures import cut_notes
from gvpipe.io.damage import check_file, reading
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.options import ReadOptions, RunMemory
from gvpipe.io.scene_formats import (
    GLTF,
    HAVE_CLIPS,
    IN_PROCESSES,
    MARKERS,
    OPENVAT,
    POINT_CACHES,
    SCENES,
    SIMULATIONS,
    scene_readers,
)

if TYPE_CHECKING:
    from gvpipe.model.sequence import MeshSequence


def read(
    path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    fps: float | None = None,
    clip: str | None = None,
    mesh: str | os.PathLike[str] | None = None,
    frames: tuple[int, int | None] | None = None,
    unlimited: bool = False,
    real_time: bool = False,
    volume: bool = False,
    memory: RunMemory | None = None,
) -> MeshSequence:
    """Read a mesh sequence.

    Args:
        path: an ``.npz``, a scene (animated ``.glb`` or ``.gltf``, ``.usd``, ``.usda``, ``.usdc``, ``.usdz``, ``.abc``,
            ``.fbx``), a simulation (``.pvd``, ``.vtkhdf``, ``.xdmf``, ``.exo``, ``.case``), a point cache (``.pc2``, ``.mdd``,
            ``.npy``), or frame files as a folder, a glob (``walk/*.obj``), a pattern (``walk/%04d.obj``, ``walk/####.obj``,
            ``walk/$F4.obj``), one file or a list of files.
        fps: frames per second; overrides the file's. Frame files, and archives without one, have 30 by default. An animated
            glTF file is sampled at it; by default at the rate of its keys.
        clip: name of the animation to read, of a file that has several; None: the first.
        mesh: a file with the triangles of a point cache.
        frames: first frame that is read, and the one after the last (None: all that follow).
        unlimited: whether OpenUSD may take any memory (`gvpipe.io.usd.worker`).
        real_time: whether steps of a simulation keep their clock, however many there are a second; else the film has a rate
            that a person can watch (`gvpipe.io.simulation.times`).
        volume: whether what lies inside of a simulation's surface is read, too (`gvpipe.Volume`).
        memory: given, the result may end before vertices or triangles change; ``changes_at`` of its positions says where.

    Raises:
        InputError: the path or what it holds cannot be used. Frame files after the first are read, and may raise it,
            when their positions are.
    """
    options = ReadOptions(fps, clip, mesh, frames, unlimited, real_time, volume, memory)
    if isinstance(path, str) and is_stored(path):
        from gvpipe.io.store_files import read_stored

        sequence = read_stored(path, lambda copy: _read(copy, options))
    else:
        sequence = _read(path, options)
    from gvpipe.foundation.notes import NO_VOLUME, left_behind
    from gvpipe.model.warp import warp_hint

    if volume and sequence.volume is None:
        sequence = replace(sequence, notes=(*sequence.notes, NO_VOLUME))
    said = (*cut_notes(sequence.images), *warp_hint(sequence), *left_behind(sequence.not_carried))
    return replace(sequence, notes=(*sequence.notes, *said)) if said else sequence


def _read(path: str | os.PathLike[str] | Sequence[str | os.PathLike[str]], options: ReadOptions) -> MeshSequence:
    if not isinstance(path, str | os.PathLike):
        _refuse_clip(options.clip, "a list of files")
        _refuse_mesh(options.mesh, "a list of files")
        for file in path:
            check_source(file)
        return _read_frames([os.fspath(file) for file in path], options)
    path = os.fspath(path)
    check_source(path)
    suffix = Path(path).suffix.lower()
    if suffix not in HAVE_CLIPS or not os.path.isfile(path):
        _refuse_clip(options.clip, path)
    if suffix not in POINT_CACHES:
        _refuse_mesh(options.mesh, path)
    if suffix == OPENVAT:
        raise InputError(f"{path}: vertex animation textures are written, not read; give what they were made of")
    reader = READERS.get(suffix)
    # a pattern of frames may end in .glb, too
    if reader is not None and (os.path.isfile(path) or (suffix not in FRAME_FORMATS and not os.path.isdir(path))):
        if suffix not in MARKERS or not os.path.isfile(path):
            check_file(Path(path))
        with contextlib.nullcontext() if suffix in IN_PROCESSES else reading(Path(path), ""):
            sequence = reader(Path(path), options)
        if sequence is not None:
            has_span = suffix in (*SIMULATIONS, *SCENES) or (suffix in GLTF and options.memory is not None)
            return sequence if has_span else _span(sequence, options.frames)
    return _read_frames(path, options)


def _read_frames(path: str | list[str], options: ReadOptions) -> MeshSequence:
    from gvpipe.io.frames.reader import read_frames

    return read_frames(path, options)


READERS = scene_readers(read)


def _span(sequence: MeshSequence, frames: tuple[int, int | None] | None) -> MeshSequence:
    """Some frames of a sequence; formats whose topology may change take theirs before it is compared."""
    return sequence if frames is None else sequence.part(*ReadOptions(frames=frames).span(len(sequence), sequence.name))


def _refuse_clip(clip: str | None, name: str) -> None:
    if clip is not None:
        raise InputError(f"{name} has no clips; clip={clip!r} is for a single {' or '.join(HAVE_CLIPS)}")


def _refuse_mesh(mesh: str | os.PathLike[str] | None, name: str) -> None:
    if mesh is not None:
        raise InputError(f"{name} has triangles of its own; mesh={os.fspath(mesh)!r} is for {', '.join(POINT_CACHES)} (--mesh)")
