"""One key mesh, followed from frame to frame in one direction of time."""

from __future__ import annotations

from gvpipe.following.cage import Cage
from gvpipe.following.distance import SurfaceError, surface_error
from gvpipe.following.fit import Goal, MovedMesh
from gvpipe.following.stages import SURFACE
from gvpipe.following.surface import Moved, Surface
from gvpipe.foundation.arrays import Float64


class Track:
    """Where a mesh is in the frames seen so far.

    Args:
        mesh: what is moved.
        cage: a coarse mesh of some of its vertices.
        positions: ``(V, 3)`` at the key.
        diagonal: model units.
    """

    def __init__(self, mesh: MovedMesh, cage: Cage, positions: Float64, diagonal: float) -> None:
        self._mesh, self._cage, self._diagonal = mesh, cage, diagonal
        self._last, self._before = positions, positions

    def step(self, surface: Surface, limit: SurfaceError) -> tuple[Float64, SurfaceError] | None:
        """Positions ``(V, 3)`` at the next frame and their error, or None where they are not within the limit.

        The frame is expected where the last two lead to; where that fails, where the last one was.
        """
        if surface.is_empty:
            return None
        goal = Goal(surface)
        moves = self._last - self._before
        for expected in [self._last + moves, self._last] if moves.any() else [self._last]:
            found = self._mesh.fit(self._cage.carry(expected, self._last, goal), self._last, goal, SURFACE)
            error = surface_error(Moved(found, self._mesh.faces), surface, self._diagonal)
            if is_within(error, limit):
                self._last, self._before = found, self._last
                return found, error
        return None


def is_within(error: SurfaceError, limit: SurfaceError) -> bool:
    """Whether neither part is beyond the limit's."""
    return error.rms <= limit.rms and error.largest <= limit.largest
