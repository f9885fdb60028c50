"""Distances between two surfaces, both ways: at samples, and at all vertices of both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.following.surface import Surface
from gvpipe.metrics.surface import Scale, measure

LEAST_SAMPLES, MOST_SAMPLES = 40_000, 100_000  # of each surface; between them, one for each triangle of the finer one


class SurfaceError(NamedTuple):
    """Parts of a diagonal, of both ways the larger.

    Args:
        rms: root mean square at samples and vertices.
        largest: at samples and vertices.
    """

    rms: float
    largest: float

    def is_within(self, limit: SurfaceError) -> bool:
        """Whether neither part is beyond the limit's."""
        return self.rms <= limit.rms and self.largest <= limit.largest


def surface_error(one: Surface, other: Surface, diagonal: float) -> SurfaceError:
    """The distance between two surfaces, neither of them empty, as parts of ``diagonal``, which is in model units."""
    n = min(max(LEAST_SAMPLES, len(one.faces), len(other.faces)), MOST_SAMPLES)
    found = measure(one.measured, other.measured, Scale(diagonal, np.zeros(3), diagonal), samples=n, grid=0)
    return SurfaceError(found.rms / diagonal, found.max / diagonal)
