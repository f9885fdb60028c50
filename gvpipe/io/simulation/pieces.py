"""What grids of several pieces have twice: ghost cells, and points that pieces share.

- Cells that ``vtkGhostType`` marks as duplicate, refined or hidden are left out, as VTK's surface filter does, and cells
  of hidden points.
- Points of one number in ``GlobalNodeIds`` are one point, if they lie at one place. So no walls stand between pieces.

Source: Kitware, vtkDataSetAttributes, ghost types.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from gvpipe.foundation.arrays import Array, Floats, Int64
from gvpipe.io.simulation.dataset import DataArray, Dataset

GHOSTS = "vtkGhostType"
HIDING_CELLS = 1 | 8 | 32  # duplicate, refined, hidden
HIDING_POINTS = 2  # hidden
IDS = ("GlobalNodeIds", "GlobalNodeId")
SAME = 1e-5  # of the largest extent: points of one number that are farther apart at first stay two


class Welding:
    """Which points of a sequence's steps are one; those of the first step hold for all that have the same numbers."""

    def __init__(self) -> None:
        self.ids: Array | None = None
        self.is_own = np.zeros(0, bool)
        self.representative = np.zeros(0, np.int64)

    def find(self, ids: Array, points: Floats) -> None:
        """Look at a step's numbers ``(N,)`` and points ``(N, 3)``, unless the same numbers were there before."""
        if self.ids is not None and np.array_equal(self.ids, ids):
            return
        _, first, inverse = np.unique(ids, return_index=True, return_inverse=True)
        self.ids, self.representative = ids, first[inverse.reshape(-1)]
        apart = np.abs(points - points[self.representative]).max(axis=1, initial=0)
        is_far = apart > SAME * float(np.ptp(points, axis=0).max(initial=0))
        self.is_own = (self.representative == np.arange(len(points))) | is_far


def without_duplicates(step: Dataset, welding: Welding) -> Dataset:
    """A step without ghost cells, and with one point for each number; the step itself where it has neither.

    Args:
        step: of a sequence.
        welding: of that sequence.

    Raises:
        ValueError: an array has another number of rows than there are cells or points.
    """
    return _welded(_without_ghosts(step), welding)


def _without_ghosts(step: Dataset) -> Dataset:
    if GHOSTS not in step.cell_data and GHOSTS not in step.point_data:
        return step
    cells = step.cells()
    kept = np.ones(len(cells.types), bool)
    if GHOSTS in step.cell_data:
        kept &= (_flags(step.cell_data[GHOSTS], len(kept)) & HIDING_CELLS) == 0
    if GHOSTS in step.point_data:
        is_hidden = (_flags(step.point_data[GHOSTS]) & HIDING_POINTS) != 0
        if cells.nodes.max(initial=-1) >= len(is_hidden):
            raise ValueError(f"{GHOSTS!r} has {len(is_hidden)} rows, and a cell has point {int(cells.nodes.max())}")
        owner = np.repeat(np.arange(len(kept)), cells.sizes)
        kept[owner[is_hidden[cells.nodes]]] = False
    shown = replace(step, point_data=_without(step.point_data), cell_data=_without(step.cell_data))
    if kept.all():
        return shown
    rows = np.flatnonzero(kept)
    ends = np.cumsum([0, *(count for _, count in step.blocks)])
    blocks = tuple((name, int(kept[ends[k] : ends[k + 1]].sum())) for k, (name, _) in enumerate(step.blocks))
    some = cells.select(rows)
    said = f"{len(kept) - len(rows)} ghost cells are left out"
    return replace(shown, cells=lambda: some, cell_data=_rows(shown.cell_data, rows), blocks=blocks, notes=(*shown.notes, said))


def _welded(step: Dataset, welding: Welding) -> Dataset:
    named = next((name for name in IDS if name in step.point_data), None)
    if named is None:
        return step
    ids = np.asarray(step.point_data[named].read()).reshape(-1)
    points = step.points()
    if len(points) != len(ids):
        raise ValueError(f"{named!r} has {len(ids)} rows, and there are {len(points)} points")
    welding.find(ids, points)
    is_own, cells = welding.is_own, step.cells()
    if is_own.all():
        return step
    rows = np.flatnonzero(is_own)
    number = np.cumsum(is_own) - 1
    target = number[np.where(is_own, np.arange(len(points)), welding.representative)]
    if cells.nodes.min(initial=0) < 0 or cells.nodes.max(initial=-1) >= len(points):
        return step  # whoever makes the surface says which cell that is
    joined = cells.renumbered(target)
    kept = points[rows]
    return replace(step, points=lambda: kept, cells=lambda: joined, point_data=_rows(step.point_data, rows))


def _flags(one: DataArray, n_rows: int | None = None) -> Array:
    flags = np.asarray(one.read()).reshape(-1).astype(np.int64)
    if n_rows is not None and len(flags) != n_rows:
        raise ValueError(f"{GHOSTS!r} has {len(flags)} rows, and there are {n_rows} cells")
    return flags


def _without(data: Mapping[str, DataArray]) -> dict[str, DataArray]:
    return {name: one for name, one in data.items() if name != GHOSTS}


def _rows(data: Mapping[str, DataArray], rows: Int64) -> dict[str, DataArray]:
    def read(one: DataArray) -> Array:
        values = np.asarray(one.read())
        if len(values) <= int(rows.max(initial=-1)):
            raise ValueError(f"it has {len(values)} rows, which are too few")
        return np.asarray(values[rows])

    return {name: one._replace(read=partial(read, one)) for name, one in data.items()}
