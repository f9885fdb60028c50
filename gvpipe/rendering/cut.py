"""A mesh cut by a plane, and what the plane shows of its inside.

Triangles are cut where they cross the plane. Volume cells are taken as tetrahedra, whose cuts are triangles and pairs of them;
so the section of a grid is filled, with the numbers of its points or cells.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Array, Bool, Float64, Int32, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import POLYHEDRON, VOLUMES, Cells
from gvpipe.grids.polyhedra import Polyhedra, ranges

FORM = re.compile(r"(-?)([xyz])=([-+0-9.eE]+)(%?)")
MEANT = re.compile(r"-?[a-z]=.*")
AXES = "xyz"


@dataclass(frozen=True)
class Cut:
    """A plane across an axis, and which side of it is left out.

    Args:
        axis: 0, 1 or 2.
        place: along the axis, model units, origin included; a part of the first frame's box if ``is_part``.
        is_part: which of both.
        sign: 1: what lies above is left out; -1: what lies below.
    """

    axis: int
    place: float
    is_part: bool = False
    sign: int = 1

    def at(self, frame: Float64, origin: Float64) -> float:
        """Where the plane is, relative to the origin, for a sequence whose first frame is ``frame (V, 3)``."""
        if not self.is_part:
            return self.place - float(origin[self.axis])
        low, high = frame[:, self.axis].min(), frame[:, self.axis].max()
        return float(low + self.place * (high - low))


def parse_cut(text: str) -> Cut:
    """A plane by ``x=0.3`` (model units), ``x=30%`` (of the first frame's box) or ``-x=0.3`` (the other half is left out).

    Raises:
        InputError: it is none.

    Examples:
        >>> parse_cut("-z=25%")
        Cut(axis=2, place=0.25, is_part=True, sign=-1)
    """
    found = FORM.fullmatch(text)
    try:
        if found is None:
            raise ValueError(text)
        sign, axis, number, percent = found.groups()
        place = float(number)
        if not math.isfinite(place):
            raise ValueError(text)
    except ValueError as exc:
        raise InputError(f"a plane {text!r}; x=0.3, y=30% or -z=0.3 is needed") from exc
    return Cut(AXES.index(axis), place / 100 if percent else place, bool(percent), -1 if sign else 1)


def is_cut(text: str | None) -> bool:
    """Whether a text is meant as a plane, as ``-y=`` is, too."""
    return text is not None and MEANT.fullmatch(text) is not None


class Piece(NamedTuple):
    """Triangles ``faces (n, 3)`` over new points, each between points ``ends (m, 2)`` at ``parts (m,)`` of the way; and the
    triangle or cell that each comes from."""

    ends: Int64
    parts: Float64
    faces: Int32
    sources: Int64

    def blend(self, values: Float64) -> Float64:
        """Numbers of the new points, of numbers ``(N, ...)`` of all points."""
        a, b = values[self.ends[:, 0]], values[self.ends[:, 1]]
        part = self.parts.reshape(-1, *(1,) * (values.ndim - 1))
        return np.asarray(a + part * (b - a))


def cut_triangles(faces: Int32, height: Float64) -> Piece:
    """What lies below of triangles ``(T, 3)``; ``height (N,)`` of the points above the plane."""
    is_low = height[faces] <= 0
    count = is_low.sum(axis=1)
    whole = np.flatnonzero(count == 3)
    corners = [np.stack([faces[whole], faces[whole]], axis=2).astype(np.int64).reshape(-1, 3, 2)]
    sources = [whole]
    for wanted in (1, 2):  # corners below
        some = np.flatnonzero(count == wanted)
        first = np.argmax(is_low[some] == (wanted == 1), axis=1)  # the one that is alone on its side
        a, b, c = (faces[some, (first + k) % 3].astype(np.int64) for k in range(3))
        ab, ac = np.stack([a, b], axis=1), np.stack([a, c], axis=1)
        if wanted == 1:
            corners.append(np.stack([np.stack([a, a], axis=1), ab, ac], axis=1))
            sources.append(some)
        else:
            bb, cc = np.stack([b, b], axis=1), np.stack([c, c], axis=1)
            corners += [np.stack([ab, bb, cc], axis=1), np.stack([ab, cc, ac], axis=1)]
            sources += [some, some]
    return _piece(np.concatenate(corners), np.concatenate(sources), height)


def section(cells: Cells, height: Float64) -> Piece:
    """The cut of volume cells by the plane."""
    tetrahedra, owners = _crossing(cells, height)
    is_low = height[tetrahedra] <= 0
    count = is_low.sum(axis=1)
    corners, sources = [np.zeros((0, 3, 2), np.int64)], [np.zeros(0, np.int64)]
    for wanted in (1, 3):
        some = np.flatnonzero(count == wanted)
        own = tetrahedra[some]
        alone = np.argmax(is_low[some] == (wanted == 1), axis=1)
        a = own[np.arange(len(some)), alone]
        others = [own[np.arange(len(some)), (alone + k) % 4] for k in (1, 2, 3)]
        corners.append(np.stack([np.stack([a, each], axis=1) for each in others], axis=1))
        sources.append(owners[some])
    some = np.flatnonzero(count == 2)
    order = np.argsort(~is_low[some], axis=1, kind="stable")  # two below, then two above
    a, b, c, d = np.take_along_axis(tetrahedra[some], order, axis=1).T
    quad = [np.stack(pair, axis=1) for pair in ((a, c), (a, d), (b, d), (b, c))]
    corners += [np.stack([quad[0], quad[1], quad[2]], axis=1), np.stack([quad[0], quad[2], quad[3]], axis=1)]
    sources += [owners[some], owners[some]]
    return _piece(np.concatenate(corners), np.concatenate(sources), height)


def _crossing(cells: Cells, height: Float64) -> tuple[Int64, Int64]:
    """Tetrahedra ``(n, 4)`` of the cells that the plane crosses, and the cell of each: fans of faces around a first node."""
    made, owners = [np.zeros((0, 4), np.int64)], [np.zeros(0, np.int64)]
    for kind, faces in VOLUMES.items():
        at = np.flatnonzero(cells.types == kind)
        if not len(at):
            continue
        used = sorted({node for face in faces for node in face})
        nodes = cells.nodes[cells.offsets[at, None] + np.arange(max(used) + 1)]
        sides = height[nodes[:, used]] <= 0
        crosses: Bool = sides.any(axis=1) & ~sides.all(axis=1)
        nodes, at = nodes[crosses], at[crosses]
        for face in faces:
            if used[0] in face:
                continue
            for i in range(1, len(face) - 1):
                made.append(nodes[:, [used[0], face[0], face[i], face[i + 1]]])
                owners.append(at)
    if cells.polyhedra is not None:
        fans, of_fan = _crossing_polyhedra(cells, cells.polyhedra, height)
        made.append(fans)
        owners.append(of_fan)
    return np.concatenate(made), np.concatenate(owners)


def _crossing_polyhedra(cells: Cells, known: Polyhedra, height: Float64) -> tuple[Int64, Int64]:
    """As `_crossing`, of polyhedra: fans of faces around the first corner of the first face."""
    at = np.flatnonzero(cells.types == POLYHEDRON)
    sizes = np.repeat(cells.types == POLYHEDRON, cells.sizes)
    owner = np.repeat(np.arange(len(at)), cells.sizes[at])
    low = np.bincount(owner, height[cells.nodes[sizes]] <= 0, len(at))
    some = np.flatnonzero((low > 0) & (low < cells.sizes[at]))
    own = known.select(some)
    of_face = np.repeat(np.arange(len(some)), own.counts)
    starts = np.cumsum(own.sizes) - own.sizes
    apexes = own.nodes[starts[np.cumsum(own.counts) - own.counts]][of_face]
    n_fans = own.sizes - 2
    first, second = np.repeat(starts, n_fans), ranges(starts + 1, n_fans)
    fans = np.stack([np.repeat(apexes, n_fans), own.nodes[first], own.nodes[second], own.nodes[second + 1]], axis=1)
    is_solid = (fans[:, 1:] != fans[:, :1]).all(axis=1)
    return fans[is_solid], at[some][np.repeat(of_face, n_fans)][is_solid]


def _piece(corners: Int64, sources: Int64, height: Float64) -> Piece:
    """Triangles of corners ``(n, 3, 2)`` that lie between two points each, or at one."""
    flat = np.sort(corners.reshape(-1, 2), axis=1)
    ends, number = np.unique(flat, axis=0, return_inverse=True)
    low, high = height[ends[:, 0]], height[ends[:, 1]]
    span = np.where(low == high, 1.0, low - high)
    parts = np.where(ends[:, 0] == ends[:, 1], 0.0, np.clip(low / span, 0.0, 1.0))
    return Piece(ends, parts, number.reshape(-1, 3).astype(np.int32), sources)


def joined(pieces: list[tuple[Array, Int32]]) -> tuple[Array, Int32]:
    """Points and triangles of several pieces as one."""
    starts = np.cumsum([0, *(len(points) for points, _ in pieces)])
    faces = [own + start for (_, own), start in zip(pieces, starts, strict=False)]
    return np.concatenate([points for points, _ in pieces]), np.concatenate(faces).astype(np.int32)
