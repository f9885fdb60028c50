"""How an Alembic mesh moves: its positions and the transforms above it, at a time.

Between two samples, positions and matrices are interpolated linearly; at a sample they are the sample's.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64
from gvpipe.io.alembic.archive import Node, sample_of
from gvpipe.io.alembic.numbers import as_matrix

CLOSE = 1e-6  # seconds within which a time is a sample's
DEFERRED, HIDDEN = -1, 0  # of visibility: as the parent, and hidden


class AlembicMotion:
    """How one mesh moves."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.name = node.path
        self._positions = node.schema.getPositionsProperty()
        self.moves = self._positions.getNumSamples() > 1 or any(parent.schema.getNumSamples() > 1 for parent in node.parents)
        self.flickers = any(held.getNumSamples() > 1 for held in node.hiding)
        self.moves = self.moves or self.flickers
        self._world: Float64 | None = None  # of transforms that stand still
        n_samples = self._positions.getNumSamples()
        self.n_vertices = len(_sample(self._positions, 0)) if n_samples else 0
        self.has_points = any(len(_sample(self._positions, number)) for number in range(n_samples))

    def count(self, time: float) -> int:
        """Vertices that it has at a time, seconds."""
        return len(_sample(self._positions, around(self._positions, time)[0]))

    def samples(self) -> Iterable[float]:
        """Times of all samples that move it or change its polygons, seconds."""
        mesh = self.node.schema
        topology = [each for each in (mesh.getFaceCountsProperty(), mesh.getFaceIndicesProperty()) if not each.isConstant()]
        for schema in (self._positions, *topology, *(parent.schema for parent in self.node.parents), *self.node.hiding):
            if schema.getNumSamples() > 1:
                sampling = schema.getTimeSampling()
                yield from (sampling.getSampleTime(i) for i in range(schema.getNumSamples()))

    def at(self, time: float) -> Array:
        """Positions ``(n, 3)`` in world space at a time in seconds."""
        low, high, part = around(self._positions, time)
        points = _sample(self._positions, low)
        if part:
            after = _sample(self._positions, high)
            if len(after) == len(points):
                points = points + part * (after - points)
        world = self.world(time)
        return points if (world == np.eye(4)).all() else np.asarray(points @ world[:3, :3] + world[3, :3])

    def is_hidden(self, time: float) -> bool:
        """Whether it is not shown at a time, seconds; one whose visibility never changes is shown."""
        for held in self.node.hiding if self.flickers else ():
            state = int(sample_of(held, held.getTimeSampling().getFloorIndex(time + CLOSE, held.getNumSamples())))
            if state != DEFERRED:
                return state == HIDDEN
        return False

    @property
    def is_never_shown(self) -> bool:
        """Whether it is hidden at all times."""
        if not self.flickers:
            return self.node.is_hidden
        moments = {held.getTimeSampling().getSampleTime(k) for held in self.node.hiding for k in range(held.getNumSamples())}
        return all(self.is_hidden(moment) for moment in moments)

    def world(self, time: float) -> Float64:
        """``(4, 4)`` from the mesh's space into the world's, applied to rows."""
        if self._world is not None:
            return self._world
        total = np.eye(4)
        for parent in self.node.parents:
            low, high, part = around(parent.schema, time)
            first = sample_of(parent.schema, low)
            matrix = as_matrix(first.getMatrix())
            if part:
                matrix += part * (as_matrix(sample_of(parent.schema, high).getMatrix()) - matrix)
            total = total @ matrix
            if not first.getInheritsXforms():
                break
        if all(parent.schema.getNumSamples() < 2 for parent in self.node.parents):
            self._world = total
        return np.asarray(total)


def _sample(positions: Any, number: int) -> Float64:
    return np.array(sample_of(positions, number), np.float64).reshape(-1, 3)


def around(schema: Any, time: float) -> tuple[int, int, float]:
    """The samples of a schema or a property before and after a time, and how far it is between them, 0 at a sample."""
    count = schema.getNumSamples()
    if count < 2:
        return 0, 0, 0.0
    sampling = schema.getTimeSampling()
    low, high = sampling.getFloorIndex(time, count), sampling.getCeilIndex(time, count)
    before, after = sampling.getSampleTime(low), sampling.getSampleTime(high)
    if abs(time - before) < CLOSE or high == low:
        return low, low, 0.0
    if abs(after - time) < CLOSE:
        return high, high, 0.0
    return low, high, min(max((time - before) / (after - before), 0.0), 1.0)
