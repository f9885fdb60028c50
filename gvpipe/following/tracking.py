"""One key mesh, followed from frame to frame in one direction of time."""

from __future__ import annotations

from gvpipe.following.cage import Cage
from gvpipe.following.distance import SurfaceError, surface_error
from gvpipe.following.fit import Goal, MovedMesh
from gvpipe.following.stages import REPAIR, SURFACE
from gvpipe.following.surface import Moved, Surface
from gvpipe.foundation.arrays import Float64

HOPELESS = 3.0  # times the rms that is asked for: beyond it no repair is tried


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
            error = self._error(found, surface)
            if not is_within(error, limit) and error.rms < HOPELESS * limit.rms:
                found = self._mesh.fit(found, found, goal, REPAIR)
                error = self._error(found, surface)
            if is_within(error, limit):
                self._last, self._before = found, self._last
                return found, error
            if error.rms <= limit.rms:  # the motion was found; from elsewhere it would be found again
                break
        return None

    def _error(self, positions: Float64, surface: Surface) -> SurfaceError:
        return surface_error(Moved(positions, self._mesh.faces), surface, self._diagonal)


def is_within(error: SurfaceError, limit: SurfaceError) -> bool:
    """Whether neither part is beyond the limit's."""
    return error.rms <= limit.rms and error.largest <= limit.largest
