"""Sequences of frame files, loaded when they are read.

Parsing text is slow, and an encoder passes over the frames several times. So a parsed frame goes to a temporary file, and later
reads come from there.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gvpipe.arrays import Float32, Float64
from gvpipe.errors import InputError
from gvpipe.io.discovery import find_frames, order_list, sibling_note
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.mesh import Loader, Mesh
from gvpipe.io.spool import Spool
from gvpipe.notes import ASSUMED_FPS, DEFAULT_FPS, given_order
from gvpipe.origin import choose_origin, narrow, rounding
from gvpipe.sequence import MeshSequence, check_finite


class FrameFiles:
    """Positions of frame files, ``(F, V, 3) float32`` model units, loaded as they are sliced.

    They are relative to ``origin``, which is chosen for the first file's.

    Args:
        paths: the files in frame order, all of one format.

    Raises:
        InputError: here for the first file, when sliced for any other: unreadable, not finite, or of another
            connectivity than the first.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = list(paths)
        self._loader: Loader = FRAME_FORMATS[self._paths[0].suffix.lower()].loader()
        self.first: Mesh = load_mesh(self._loader, self._paths[0], 0)
        self.origin: Float64 = choose_origin(self.first.positions[None])
        self.rounding = 0.0  # what float32 moved a coordinate by at most, model units, in the frames loaded so far
        positions = self._narrow(self.first)
        self._spool = Spool(len(self._paths), positions.nbytes)
        self._spool.store(0, positions)

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, V, 3)``."""
        return (len(self._paths), *self.first.positions.shape)

    def __getitem__(self, key: slice) -> Float32:
        """Frames ``key``: ``(n, V, 3) float32``."""
        frames = range(*key.indices(len(self._paths)))
        block = np.empty((len(frames), *self.first.positions.shape), np.float32)
        for i, frame in enumerate(frames):
            if not self._spool.fetch(frame, block[i]):
                block[i] = self._load(frame)
                self._spool.store(frame, block[i])
        return block

    def _load(self, frame: int) -> Float32:
        path, first_path = self._paths[frame], self._paths[0]
        mesh = load_mesh(self._loader, path, frame)
        for noun, here, there in (
            ("vertices", len(mesh.positions), len(self.first.positions)),
            ("triangles", len(mesh.faces), len(self.first.faces)),
        ):
            if here != there:
                raise InputError(
                    f"{path.name} has {here} {noun}, {first_path.name} has {there}; "
                    "all frames need the same vertices and triangles in the same order"
                )
        if mesh.faces is not self.first.faces:
            differing = np.flatnonzero((mesh.faces != self.first.faces).any(axis=1))
            if len(differing):
                at = int(differing[0])
                raise InputError(
                    f"triangle {at} is {mesh.faces[at].tolist()} in {path.name}, "
                    f"but {self.first.faces[at].tolist()} in {first_path.name}; "
                    "all frames need the same triangles in the same order"
                )
        return self._narrow(mesh)

    def _narrow(self, mesh: Mesh) -> Float32:
        positions = narrow(mesh.positions[None], self.origin)
        self.rounding = max(self.rounding, rounding(mesh.positions[None], positions, self.origin))
        result: Float32 = positions[0]
        return result


def load_mesh(loader: Loader, path: Path, frame: int) -> Mesh:
    """Load one frame file and check that its positions are finite.

    Raises:
        InputError: it cannot be read; the message names the file and, for a coordinate, frame and vertex.
    """
    try:
        mesh = loader(path)
    except InputError:
        raise
    except Exception as exc:  # damaged files raise nearly anything inside NumPy, json and trimesh
        reason = getattr(exc, "strerror", None) or " ".join(str(exc).split())[:200] or type(exc).__name__
        raise InputError(f"{path} cannot be read as {path.suffix[1:].upper()}: {reason}; export this frame again") from exc
    check_finite(narrow(mesh.positions[None], np.zeros(3)), str(path), frame)
    return mesh


def read_frames(path: str | Sequence[str], fps: float | None = None) -> MeshSequence:
    """Read a folder, glob, pattern, list or single file of frames; attributes are those of the first.

    Raises:
        InputError: no frames, gaps, mixed formats, or a first frame that cannot be read.
    """
    noticed: tuple[str, ...] = ()
    if isinstance(path, str):
        files, name = find_frames(path), path
        if len(files) == 1 and os.path.isfile(path):
            noticed = sibling_note(Path(path))
    else:
        files, is_kept = order_list([Path(file) for file in path])
        name = f"{files[0]} and {len(files) - 1} more"
        noticed = (given_order(len(files)),) if is_kept else ()
    frames = FrameFiles(files)
    first = frames.first
    if fps is None and len(files) > 1:
        noticed = (*noticed, ASSUMED_FPS)
    rate = DEFAULT_FPS if fps is None else fps
    return MeshSequence(frames, first.faces, rate, first.attributes, name, frames.origin, (*noticed, *first.notes))
