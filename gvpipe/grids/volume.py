"""What lies inside of a sequence's surface: cells, the points that the surface has not, and numbers on both."""

from __future__ import annotations

import operator
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array, Floats, Frames, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import POLYHEDRON, SOLID, Cells


@dataclass(frozen=True, eq=False, repr=False)
class Volume:
    """The volume cells of a grid whose surface is a `gvpipe.MeshSequence` of V vertices and F frames.

    Args:
        cells: M cells of VTK's volume types. Their nodes are numbered: first the surface's vertices, then the I inner points.
        points: ``(F, I, 3) float32`` inner points, model units, relative to the sequence's origin; whatever slices by frame.
        order: ``(V + I,)`` the place of each of these in the grid's list of points; None: they follow each other.
        point_fields: numbers of the inner points, ``(F, I)`` or ``(F, I, C)``, by the names that they have on the surface's
            vertices; those of one frame stand still.
        cell_fields: numbers of all cells, ``(F, M)`` or ``(F, M, C)``, by the names that they have on the surface's triangles.
        blocks: names of runs of cells and how many each has; none: one run without a name.

    Raises:
        InputError: a node, a row or a number of frames that cannot be; a cell of another type.
    """

    cells: Cells
    points: Frames
    order: Int64 | None = None
    point_fields: Mapping[str, Field] = field(default_factory=dict)
    cell_fields: Mapping[str, Field] = field(default_factory=dict)
    blocks: tuple[tuple[str, int], ...] = ()

    def __post_init__(self) -> None:
        if not isinstance(self.points, np.ndarray | _Points):
            object.__setattr__(self, "points", _Points(self.points))
        if len(self.points.shape) != 3 or self.points.shape[2] != 3:
            raise InputError(f"a volume's points have shape {self.points.shape}; (frames, points, 3) is needed")
        strange = sorted(set(np.unique(self.cells.types).tolist()) - SOLID)
        if strange:
            raise InputError(f"a volume has cells of type {strange[0]}; volume cells of VTK are needed")
        if self.cells.polyhedra is None and (self.cells.types == POLYHEDRON).any():
            raise InputError("a volume has polyhedra without a list of their faces")
        if self.blocks and sum(count for _, count in self.blocks) != len(self.cells.types):
            raise InputError(f"a volume's blocks are not its {len(self.cells.types)} cells")
        for rows, fields in ((self.n_points, self.point_fields), (len(self.cells.types), self.cell_fields)):
            for name, each in fields.items():
                if each.shape[0] not in (1, self.points.shape[0]) or each.shape[1] != rows:
                    raise InputError(f"a volume's {name!r} has shape {each.shape}; a row for each of {rows} is needed")

    @property
    def n_points(self) -> int:
        """I, the number of inner points."""
        return int(self.points.shape[1])

    def __repr__(self) -> str:
        return f"<Volume of {len(self.cells.types)} cells and {self.n_points} inner points>"

    def check_surface(self, n_frames: int, n_vertices: int, where: str) -> None:
        """Raise `InputError` where it does not fit a surface of V vertices and F frames."""
        n_rows = n_vertices + self.n_points
        known = self.cells.polyhedra
        nodes = self.cells.nodes if known is None else np.concatenate([self.cells.nodes, known.nodes])
        if len(nodes) and not 0 <= int(nodes.min()) <= int(nodes.max()) < n_rows:
            raise InputError(f"{where}: a volume's cells have nodes {nodes.min()} to {nodes.max()}; there are {n_rows} points")
        if self.points.shape[0] != n_frames:
            raise InputError(f"{where}: a volume of {self.points.shape[0]} frames; the surface has {n_frames}")
        if self.order is not None and not np.array_equal(np.sort(self.order), np.arange(n_rows)):
            raise InputError(f"{where}: a volume's order does not have each of its {n_rows} points once")

    def part(self, start: int, stop: int) -> Volume:
        """Frames ``start`` to ``stop``; they still load when read."""

        def cut(fields: Mapping[str, Field]) -> dict[str, Field]:
            return {name: each if len(each) == 1 else each.part(start, stop) for name, each in fields.items()}

        points = _Points(_Span(self.points, start, stop))
        return replace(self, points=points, point_fields=cut(self.point_fields), cell_fields=cut(self.cell_fields))


class _Points:
    """Frames that index as arrays do."""

    def __init__(self, frames: Frames) -> None:
        self._frames = frames
        self.shape: tuple[int, ...] = tuple(frames.shape)
        self.dtype = np.dtype(np.float32)

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: int | slice, /) -> Floats:
        if isinstance(key, slice):
            start, stop, step = key.indices(len(self))
            if step == 1:
                return self._frames[start : max(start, stop)]
            return np.stack([self[k] for k in range(start, stop, step)])
        index = operator.index(key)
        if not -len(self) <= index < len(self):
            raise IndexError(f"frame {index} of a volume: there are {len(self)}")
        frame: Floats = self._frames[index % len(self) : index % len(self) + 1][0]
        return frame

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.asarray(self._frames[0 : len(self)], dtype)


class _Span:
    """Some frames of points."""

    def __init__(self, whole: Frames, start: int, stop: int) -> None:
        self._whole, self._start = whole, start
        self.shape: tuple[int, ...] = (stop - start, *whole.shape[1:])

    def __getitem__(self, key: slice, /) -> Floats:
        start, stop, _ = key.indices(self.shape[0])
        return self._whole[self._start + start : self._start + max(start, stop)]
