"""Open files: geometry videos, and whatever else gvpipe reads, frame by frame.

Sources are kept by path and by the file's time and size, so that a file that is written again is opened again. No object of
Blender is kept: undo and loading replace all of them.
"""

from __future__ import annotations

import os
import re
from collections import OrderedDict
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

MOST_OPEN = 8
TURNS = {  # up axis of a file: which of its axes are Blender's x, y, z, and their signs
    "x": ((1, 2, 0), (1, 1, 1)),
    "y": ((0, 2, 1), (1, -1, 1)),
    "z": ((0, 1, 2), (1, 1, 1)),
}


@dataclass(frozen=True)
class Surface:
    """What of a shot one mesh shows.

    Args:
        first, stop: its vertices.
        sizes: ``(P,)`` corners of each polygon.
        corners: ``(L,)`` its vertices, counted from ``first``.
        corner_rows: ``(L,)`` the shot's corners that they are.
        triangles: ``(P,)`` the first triangle of each polygon, in the shot.
        parts: ``(P,)`` the part of each polygon; 0 where the shot has none.
    """

    first: int
    stop: int
    sizes: Any
    corners: Any
    corner_rows: Any
    triangles: Any
    parts: Any


class Source:
    """An open file of one shot or several.

    Raises:
        gvpipe.GvpipeError: it cannot be read.
    """

    def __init__(self, path: str) -> None:
        import gvpipe

        self.path = path
        self._video = gvpipe.open_capture(path) if path.lower().endswith(".mp4") else None
        self.capture = self._video.capture() if self._video else gvpipe.read_capture(path)
        self._shot: tuple[int, Any] = (0, self.capture.shots[0])
        self.first_shot = self._shot[1]
        self.surface = lru_cache(maxsize=1024)(self._surface)

    def __len__(self) -> int:
        return len(self.capture)

    @property
    def is_one_mesh(self) -> bool:
        """Whether all frames have the same triangles."""
        return len(self.capture.shots) == 1

    @property
    def has_sound(self) -> bool:
        """Whether something is to be heard with it, which the file has as a track."""
        return self._video is not None and self._video.sound is not None

    def shot(self, number: int) -> Any:
        """A shot as a `gvpipe.MeshSequence`."""
        if self._shot[0] != number:
            self._shot = (number, self.capture.shots[number])
        return self._shot[1]

    def positions(self, frame: int) -> tuple[int, int, Any]:
        """The shot of a frame, the frame's number in it, and its ``(V, 3) float32``, model units, from the origin of shot 0."""
        number, own = self.capture.locate(frame)
        points = self._video.shot(number)[own] if self._video else self.shot(number).read(own, own + 1)[0]
        shift = self.shot(number).origin - self.first_shot.origin
        return number, own, (points + shift).astype(np.float32) if shift.any() else points

    def turned(self, points: Any, up: str, scale: float) -> Any:
        """Points ``(..., 3)`` of the file in Blender's axes, Z up, times ``scale``."""
        axes, signs = TURNS[up or self.first_shot.metadata.up_axis or "y"]
        return np.ascontiguousarray(points[..., list(axes)] * np.asarray(signs, points.dtype) * points.dtype.type(scale))

    def _surface(self, shot: int, parts: tuple[int, ...]) -> Surface:
        """The polygons of some parts of a shot; of all, if none are given."""
        sequence = self.shot(shot)
        faces, sizes = np.asarray(sequence.faces), sequence.polygons
        sizes = np.full(len(faces), 3) if sizes is None else np.asarray(sizes, np.int64)
        triangles = np.cumsum(sizes - 2) - (sizes - 2)
        numbers = np.zeros(len(sizes), np.int64)
        if sequence.parts:
            ends = [part.triangles[1] for part in sequence.parts]
            numbers = np.searchsorted(ends, triangles, side="right")
        chosen = np.isin(numbers, parts) if parts else np.ones(len(sizes), bool)
        ranges = [sequence.parts[number].vertices for number in parts]
        first, stop = (min(a for a, _ in ranges), max(b for _, b in ranges)) if ranges else (0, sequence.n_vertices)
        owner, rows = _corner_rows(sizes, triangles)
        vertices = faces.reshape(-1)[rows]
        chosen &= ~_has_repeats(owner, vertices, len(sizes))
        kept = chosen[owner]
        return Surface(first, stop, sizes[chosen], vertices[kept] - first, rows[kept], triangles[chosen], numbers[chosen])


def _corner_rows(sizes: Any, triangles: Any) -> tuple[Any, Any]:
    """The polygon of each of its corners, and the row of that corner among the triangles' corners (fans, in order)."""
    owner = np.repeat(np.arange(len(sizes)), sizes)
    rank = np.arange(len(owner)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    start = triangles[owner]
    return owner, np.where(rank < 3, 3 * start + rank, 3 * (start + rank - 2) + 2)


def _has_repeats(owner: Any, vertices: Any, n_polygons: int) -> Any:
    """Which polygons have a vertex twice: Blender cannot hold them."""
    order = np.lexsort((vertices, owner))
    same = (owner[order][1:] == owner[order][:-1]) & (vertices[order][1:] == vertices[order][:-1])
    result = np.zeros(n_polygons, bool)
    result[owner[order][1:][same]] = True
    return result


_sources: OrderedDict[tuple[str, float, int], Source] = OrderedDict()


def opened(path: str) -> Source:
    """The source of an absolute path, or of a pattern such as ``frame_%04d.obj``; raises as `Source`."""
    try:
        found = os.stat(path)
        key = (path, found.st_mtime, found.st_size)
    except OSError:  # a pattern, or gvpipe says what is wrong
        key = (path, 0.0, 0)
    source = _sources.get(key) or Source(path)
    _sources[key] = source
    _sources.move_to_end(key)
    while len(_sources) > MOST_OPEN:
        _sources.popitem(last=False)
    return source


def close_all() -> None:
    """Let go of all files."""
    _sources.clear()


def with_its_frames(path: str) -> str:
    """The pattern of the numbered frames that a file is one of, such as ``a_%04d.obj`` for ``a_0001.obj``; else the path."""
    folder, name = os.path.split(path)
    stem, suffix = os.path.splitext(name)
    found = re.search(r"\d+$", stem)
    if not found or suffix.lower() not in (".obj", ".ply", ".stl", ".off"):
        return path
    head, width = stem[: found.start()], len(found.group())
    others = [each for each in os.listdir(folder or ".") if re.fullmatch(re.escape(head) + r"\d+" + re.escape(suffix), each)]
    is_padded = all(len(each) == len(name) for each in others)
    return os.path.join(folder, f"{head}%0{width}d{suffix}" if is_padded else f"{head}%d{suffix}") if len(others) > 1 else path
