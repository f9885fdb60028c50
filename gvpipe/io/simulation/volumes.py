"""What lies inside of a simulation's surface, as a `gvpipe.Volume` whose frames load when they are read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Bool, Float32, Float64, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.grids.cells import HIGHER_ORDER, POLYHEDRON, SIZE_OF_TYPE, SOLID, Cells, listed_cells
from gvpipe.grids.volume import Volume
from gvpipe.io.formats import BY_MESHIO
from gvpipe.io.simulation.dataset import Dataset, surface_values
from gvpipe.io.simulation.frame_loader import dataset_loader
from gvpipe.io.simulation.meshio_files import MeshioLoader
from gvpipe.io.simulation.step_frames import StepColumn, StepFrames, is_still
from gvpipe.model.origin import narrow

LINEAR = {71: 10, 78: 10, 72: 12, 79: 12, 73: 13, 80: 13, 74: 14, 81: 14}  # of cells of higher order, whose corners are kept


class FileSteps:
    """Files of one time step each as the steps of one simulation.

    Args:
        files: in the order of time, of one format.
        times: ``(F,)`` seconds, or None.
    """

    def __init__(self, files: Sequence[Path], times: Float64 | None) -> None:
        self._files, self.times, self.n_steps = files, times, len(files)
        suffix = files[0].suffix.lower()
        self._load: Callable[[Path], Dataset] = MeshioLoader() if suffix in BY_MESHIO else dataset_loader(suffix)

    def open(self, step: int) -> Dataset:
        """A step; its numbers are read when they are called for."""
        return self._load(self._files[step])


class InnerPoints:
    """Points that the surface has not, ``(F, I, 3) float32`` model units, relative to the surface's origin.

    Raises:
        InputError: when sliced: a frame cannot be read, or a coordinate is not finite.
    """

    def __init__(self, frames: StepFrames, rows: Int64) -> None:
        self._frames, self._rows = frames, rows
        self.shape: tuple[int, ...] = (frames.shape[0], len(rows), 3)

    def __getitem__(self, key: slice, /) -> Float32:
        frames = range(*key.indices(self.shape[0]))
        block = np.empty((len(frames), *self.shape[1:]), np.float32)
        for i, frame in enumerate(frames):
            exact = self._frames.points(frame)[None, self._rows]
            block[i] = narrow(exact, self._frames.origin)[0]
            bad = np.flatnonzero(~np.isfinite(block[i]).all(axis=1))
            if len(bad):
                raise InputError(
                    f"{self._frames.path}: frame {frame}, point {self._rows[bad[0]]} inside is {exact[0, bad[0]].tolist()}; "
                    "every coordinate must be a finite number that float32 can hold"
                )
        return block


def read_volume(frames: StepFrames, names: Sequence[str]) -> Volume | None:
    """Return what lies inside of the surface of ``frames``; None where there are no volume cells.

    Args:
        frames: of the surface.
        names: of the surface's attributes and fields, whose numbers inside are read.
    """
    cells, surface = frames.cells, frames.surface
    is_solid = np.isin(cells.types, list(SOLID))
    solid = np.flatnonzero(is_solid)
    if not len(solid):
        return None
    own = _as_carried(cells.select(solid))
    inner = np.setdiff1d(own.nodes, surface.points)
    rows = np.concatenate([surface.points, inner])
    number = np.full(int(rows.max()) + 1, -1, np.int64)
    number[rows] = np.arange(len(rows))
    order = np.argsort(np.argsort(rows))
    inside = replace(surface, points=inner, cells=solid)
    point_fields: dict[str, Field] = {}
    cell_fields: dict[str, Field] = {}
    for name, read in surface_values(frames.first, inside).items():
        if name not in names:
            continue
        first = frames.guarded(0, read)
        domain = "point" if first.domain == "vertex" else "cell"
        if domain == "point" and not len(inner):
            continue
        still = is_still(frames, name, first.values, inside)
        values = first.values[None] if still else StepColumn(frames, name, first.values, inside)
        kind = "vector" if first.kind == "normal" else first.kind
        made = Field(values, domain, kind, first.unit, name=f"{frames.path}: field {name!r}")
        (point_fields if domain == "point" else cell_fields)[name] = made
    return Volume(
        own.renumbered(number),
        InnerPoints(frames, inner),
        order,
        point_fields,
        cell_fields,
        _solid_blocks(frames.first, is_solid),
    )


def _as_carried(cells: Cells) -> Cells:
    """Polyhedra with the points that their faces have, and cells of arbitrary order as linear ones."""
    cells = _corners_of_higher_order(cells)
    if cells.polyhedra is None:
        return cells
    return listed_cells(cells.types, cells.polyhedra, cells.nodes[np.repeat(cells.types != POLYHEDRON, cells.sizes)])


def _corners_of_higher_order(cells: Cells) -> Cells:
    """Cells of arbitrary order as linear ones."""
    if not np.isin(cells.types, list(HIGHER_ORDER)).any():
        return cells
    types = np.array([LINEAR.get(kind, kind) for kind in range(256)], np.uint8)[cells.types]
    sizes = cells.sizes
    kept = np.where(types == cells.types, sizes, SIZE_OF_TYPE[types])
    place = np.arange(len(cells.nodes)) - np.repeat(cells.offsets[:-1], sizes)
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(kept)])
    return Cells(types, offsets, cells.nodes[place < np.repeat(kept, sizes)], cells.polyhedra)


def _solid_blocks(step: Dataset, is_solid: Bool) -> tuple[tuple[str, int], ...]:
    """The blocks of volume cells, and how many each has."""
    ends = np.cumsum([0, *(count for _, count in step.blocks)])
    counts = [int(is_solid[ends[k] : ends[k + 1]].sum()) for k in range(len(step.blocks))]
    return tuple((name, count) for (name, _), count in zip(step.blocks, counts, strict=True) if count)
