"""Meshes that are not shown in some frames: there, all their vertices lie in one point.

A file of one mesh has no switch for its parts, and players, engines and other formats know none that all of them keep to. A
part without extent is shown by none of them. The point is the middle of what is hidden, so that the bounding box does not grow.
"""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Bool, Floats

HIDDEN = "{} hidden in some frames; there, their vertices lie in one point"


def collapse(positions: Floats, is_hidden: Bool) -> None:
    """Move the vertices of hidden frames to their middle.

    Args:
        positions: ``(n, V, 3)``, changed in place.
        is_hidden: ``(n,)``.
    """
    for frame in np.flatnonzero(is_hidden):
        block = positions[frame]
        if len(block):
            block[:] = (block.min(axis=0) + block.max(axis=0)) / 2


def hidden_note(n_meshes: int) -> tuple[str, ...]:
    """What to say of meshes that are hidden for a while."""
    return (HIDDEN.format(f"{n_meshes} meshes are" if n_meshes > 1 else "1 mesh is"),) if n_meshes else ()
