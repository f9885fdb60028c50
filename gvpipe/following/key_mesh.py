"""The mesh that is followed: a frame's own surface with fewer triangles, fitted to it again."""

from __future__ import annotations

import numpy as np

from gvpipe.following.distance import SurfaceError, surface_error
from gvpipe.following.surface import Surface

TRIALS = 5  # decimations at most
CLOSE = 0.88  # a key whose error is this part of the wanted one, or more, is coarse enough
AIM = 0.95  # part of the wanted error that trials aim at
LEAST = 8  # vertices


def key_mesh(surface: Surface, diagonal: float, limit: SurfaceError, n_vertices: int | None) -> Surface:
    """A surface of about ``n_vertices``, or of so few that its distance, both ways, is within a limit.

    Args:
        surface: not empty; it is returned itself where nothing can be left out.
        diagonal: model units.
        limit: parts of ``diagonal``.
        n_vertices: asks for a number instead.
    """
    if n_vertices is not None:
        trial = decimated(surface, n_vertices) if n_vertices < len(surface.positions) else surface
        return surface if trial.is_empty else trial
    best, low, high = surface, 0.0, float(len(surface.positions))
    n = high / 3
    for _ in range(TRIALS):
        trial = decimated(surface, max(LEAST, round(n)))
        error = SurfaceError(np.inf, np.inf) if trial.is_empty else surface_error(trial, surface, diagonal)
        if error.is_within(limit):
            best, high = trial, n
            if error.rms >= CLOSE * limit.rms:
                break
        else:
            low = n
        guess = n * error.rms / (AIM * limit.rms)  # the error falls about as the number grows
        n = guess if low < guess < high else (low + high) / 2
        if high - low < 1 or n < LEAST:
            break
    return best


def decimated(surface: Surface, n_vertices: int) -> Surface:
    """The surface with about ``n_vertices``: edges collapse where that costs least (quadric error), borders stay."""
    import pyfqmr

    simplifier = pyfqmr.Simplify()
    simplifier.setMesh(surface.positions, surface.faces)
    excess = 2 * len(surface.positions) - len(surface.faces)  # by Euler's formula about the same afterwards
    simplifier.simplify_mesh(
        target_count=max(4, 2 * n_vertices - max(excess, 0)), aggressiveness=5, preserve_border=True, verbose=False
    )
    positions, faces, _ = simplifier.getMesh()
    return Surface(np.asarray(positions, dtype=np.float64), np.asarray(faces, dtype=np.int32))
