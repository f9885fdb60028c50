"""Sequences of frame files, loaded when they are read.

An encoder passes over the frames several times and parsing text is slow, so a parsed frame goes to a temporary file
and later reads come from there.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from gvpipe.errors import InputError
from gvpipe.io.discovery import find_frames
from gvpipe.io.formats import FRAME_FORMATS
from gvpipe.io.mesh import Loader, Mesh
from gvpipe.io.spool import Spool
from gvpipe.sequence import Float32, MeshSequence, check_finite

DEFAULT_FPS = 30.0


class FrameFiles:
    """Positions of frame files, ``(F, V, 3) float32`` model units, loaded as they are sliced.

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
        self._spool = Spool(len(self._paths), self.first.positions.nbytes)
        self._spool.store(0, self.first.positions)

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
        return mesh.positions


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
    check_finite(mesh.positions[None], str(path), frame)
    return mesh


def read_frames(path: str, fps: float | None = None) -> MeshSequence:
    """Read a folder, glob, pattern or single file of frames; attributes are those of the first.

    Raises:
        InputError: no frames, gaps, mixed formats, or a first frame that cannot be read.
    """
    frames = FrameFiles(find_frames(path))
    first = frames.first
    return MeshSequence(frames, first.faces, DEFAULT_FPS if fps is None else fps, first.attributes, path)
