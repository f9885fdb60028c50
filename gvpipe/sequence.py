"""The mesh animation that every part of gvpipe works on.

A `MeshSequence` has constant connectivity and moving vertices. Its positions may be an array in memory, a memory
map or frames that load when they are read, so nothing here touches more frames than it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gvpipe.errors import InputError

CHUNK_BYTES = 16 << 20  # positions handed out at a time by `chunks`: large enough to vectorise, small beside any budget

Float32 = NDArray[np.float32]
Int32 = NDArray[np.int32]


class Frames(Protocol):
    """What positions must offer: a shape, and slices of frames as arrays."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    def __getitem__(self, key: slice, /) -> NDArray[np.floating]: ...


@dataclass(frozen=True)
class MeshSequence:
    """A triangle-mesh animation with constant connectivity.

    Args:
        positions: ``(F, V, 3) float32``, model units; an array, or anything of that shape that slices by frame.
        faces: ``(T, 3) int32``, counter-clockwise seen from outside.
        fps: frames per second.
        attributes: static arrays by name: ``uv (V, 2)``, ``normal (V, 3)``, ``color (V, 4) uint8`` per vertex, or the
            same per corner with first dimension ``3 T``.
        name: where the sequence came from, for messages.

    Raises:
        InputError: a wrong shape, no frame, no vertex, an index out of range, an fps that is not a positive number, a
            position in memory that is not finite (frames that load later are checked when they load).
    """

    positions: Frames
    faces: Int32
    fps: float = 30.0
    attributes: Mapping[str, NDArray[np.generic]] = field(default_factory=dict)
    name: str = "sequence"

    def __post_init__(self) -> None:
        if isinstance(self.positions, np.ndarray):
            object.__setattr__(self, "positions", _as_positions(self.positions, self.name))
        shape = tuple(self.positions.shape)
        if len(shape) != 3 or shape[2] != 3 or shape[0] < 1 or shape[1] < 1:
            raise InputError(f"{self.name}: positions have shape {shape}; (frames >= 1, vertices >= 1, 3) is needed")
        object.__setattr__(self, "faces", _as_faces(self.faces, shape[1], self.name))
        if not (np.isfinite(self.fps) and 0 < self.fps <= 100_000):
            raise InputError(f"{self.name}: fps is {self.fps}; a number above 0 and up to 100000 is needed")
        for key, values in self.attributes.items():
            if len(values) not in (shape[1], 3 * len(self.faces)):
                raise InputError(
                    f"{self.name}: attribute {key!r} has {len(values)} rows; one per vertex ({shape[1]}) or per corner "
                    f"({3 * len(self.faces)}) is needed"
                )

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return int(self.positions.shape[0])

    @property
    def n_vertices(self) -> int:
        """V, the number of vertices."""
        return int(self.positions.shape[1])

    def __len__(self) -> int:
        return self.n_frames

    def read(self, start: int, stop: int) -> Float32:
        """Frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units.

        Raises:
            InputError: a position is NaN or infinite; the message names frame and vertex.
        """
        block = np.asarray(self.positions[start:stop], dtype=np.float32)
        if type(self.positions) is not np.ndarray:
            check_finite(block, self.name, start)
        return block

    def reordered(self, permutation: NDArray[np.integer], faces: Int32) -> MeshSequence:
        """Return the sequence whose vertex i is this one's vertex ``permutation[i]``; frames still load when read."""
        return MeshSequence(_Permuted(self, permutation), faces, self.fps, name=self.name)

    def part(self, start: int, stop: int) -> MeshSequence:
        """Return frames ``start`` to ``stop`` as a sequence; they still load when read."""
        return MeshSequence(_Part(self, start, stop), self.faces, self.fps, name=self.name)

    def chunks(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, Float32]]:
        """Yield ``(first frame, (n, V, 3) float32)`` over all frames, a bounded number of bytes at a time."""
        stop = self.n_frames if stop is None else stop
        step = max(1, CHUNK_BYTES // (12 * self.n_vertices))
        for first in range(start, stop, step):
            yield first, self.read(first, min(first + step, stop))

    def sample(self, most: int, vertices: NDArray[np.integer] | slice = slice(None)) -> NDArray[np.float64]:
        """Vertices of at most so many frames, evenly spaced from the first to the last: ``(n, vertices, 3)``, model units."""
        picked = np.unique(np.linspace(0, self.n_frames - 1, most).astype(int))
        return np.concatenate([self.read(i, i + 1)[:, vertices] for i in picked]).astype(np.float64)


class _Permuted:
    """Positions of another sequence in another vertex order."""

    def __init__(self, sequence: MeshSequence, permutation: NDArray[np.integer]) -> None:
        self._sequence, self._permutation = sequence, permutation

    @property
    def shape(self) -> tuple[int, ...]:
        return (self._sequence.n_frames, len(self._permutation), 3)

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self._sequence.n_frames)
        return self._sequence.read(start, stop)[:, self._permutation]


class _Part:
    """Some frames of another sequence."""

    def __init__(self, sequence: MeshSequence, start: int, stop: int) -> None:
        self._sequence, self._start = sequence, start
        self.shape: tuple[int, ...] = (stop - start, sequence.n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        return self._sequence.read(self._start + start, self._start + stop)


def check_finite(block: Float32, name: str, first_frame: int = 0) -> None:
    """Raise `InputError` naming frame and vertex if ``block (n, V, 3)`` holds a NaN or an infinity."""
    with np.errstate(invalid="ignore"):
        extremes = (block.min(initial=0), block.max(initial=0))  # a NaN shows in both, an infinity in one
    if not np.isfinite(extremes).all():
        frame, vertex = np.argwhere(~np.isfinite(block).all(axis=2))[0]
        raise InputError(
            f"{name}: frame {first_frame + frame}, vertex {vertex} is {block[frame, vertex].tolist()}; every coordinate "
            "must be a finite number that float32 can hold"
        )


def _as_positions(positions: NDArray[np.generic], name: str) -> NDArray[np.float32]:
    if positions.dtype.kind not in "fiu":
        raise InputError(f"{name}: positions have type {positions.dtype}; numbers are needed")
    if isinstance(positions, np.memmap) and positions.dtype == np.float32:
        return positions  # checked as it is read, so that it need not fit in memory
    with np.errstate(over="ignore"):
        result = np.ascontiguousarray(positions, dtype=np.float32)
    if result.ndim == 3:
        check_finite(result, name)
    return result


def _as_faces(faces: NDArray[np.integer], n_vertices: int, name: str) -> Int32:
    faces = np.asarray(faces)
    if faces.size == 0:
        faces = np.zeros((0, 3), np.int32)
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise InputError(f"{name}: faces have shape {faces.shape} and type {faces.dtype}; (triangles, 3) integers are needed")
    out = np.flatnonzero(((faces < 0) | (faces >= n_vertices)).any(axis=1))
    if len(out):
        raise InputError(
            f"{name}: triangle {out[0]} is {faces[out[0]].tolist()}; vertex indices must lie in 0..{n_vertices - 1}"
        )
    return np.ascontiguousarray(faces, dtype=np.int32)
