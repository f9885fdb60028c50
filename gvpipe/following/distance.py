"""Distances between two surfaces, both ways: at samples, and at all vertices of both."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.following.surface import Surface

LEAST_SAMPLES, MOST_SAMPLES = 10_000, 100_000
PER_TRIANGLE = 1  # samples for each triangle of the finer surface, within these bounds


class SurfaceError(NamedTuple):
    """Parts of a diagonal.

    Args:
        rms: root mean square at samples, of the worse direction.
        largest: at samples and vertices, in both directions.
    """

    rms: float
    largest: float


def surface_error(one: Surface, other: Surface, diagonal: float) -> SurfaceError:
    """The distance between two surfaces, neither of them empty, as parts of ``diagonal``, which is in model units."""
    n = min(max(LEAST_SAMPLES, PER_TRIANGLE * max(len(one.faces), len(other.faces))), MOST_SAMPLES)
    rms, largest = 0.0, 0.0
    for a, b in ((one, other), (other, one)):
        samples = b.closest.find(a.sample(n).of(a.positions, a.faces)).distances
        vertices = b.closest.find(a.positions).distances
        rms = max(rms, float(np.sqrt(np.mean(samples**2))))
        largest = max(largest, float(samples.max()), float(vertices.max()))
    return SurfaceError(rms / diagonal, largest / diagonal)
