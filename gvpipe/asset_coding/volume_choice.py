"""Whether a file carries what lies inside of a surface where nobody asked: if that costs less than a third more bytes.

Most volumes cost several times their surface. `times_the_surface` says so by counting, before anything inside is read. The
others are coded, and their bytes decide (`VolumeChoice`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import NamedTuple

from gvpipe.asset.field import Field
from gvpipe.io.left_behind import INNER_POINTS, VOLUME_CELLS, LeftBehind, count_of
from gvpipe.model.sequence import MeshSequence

MOST_BYTES = 1 / 3  # of all others
MOST_NUMBERS = 1.0  # of the surface's: inside, a number takes more than a third of the bytes of one on the surface


class VolumeChoice(NamedTuple):
    """Bytes of what lies inside of a surface, and of all else in a file; or why it cannot be coded."""

    inside: int = 0
    beside: int = 0
    problem: str = ""

    @property
    def is_carried(self) -> bool:
        """Whether it is less than a third more."""
        return not self.problem and self.inside < MOST_BYTES * self.beside

    @property
    def note(self) -> str:
        """What was chosen, for users."""
        if self.problem:
            return f"what lies inside is left out: {self.problem}"
        share = f"{100 * self.inside / max(self.beside, 1):.0f} %"
        sizes = f"{self.inside / 1000:.1f} kB beside {self.beside / 1000:.1f} kB ({share})"
        if self.is_carried:
            return f"what lies inside is carried, since it takes {sizes}; --no-volume leaves it out"
        return f"what lies inside is left out, since it would take {sizes}; --volume carries it"


def times_the_surface(sequence: MeshSequence) -> float | None:
    """How many numbers lie inside of a surface for each number on it, at least; None where there is nothing inside.

    Args:
        sequence: read without what lies inside, which ``not_carried`` counts.
    """
    n_cells, n_inner = (count_of(sequence.not_carried, name) for name in (VOLUME_CELLS, INNER_POINTS))
    if not n_cells:
        return None
    n_polygons = len(sequence.faces if sequence.polygons is None else sequence.polygons)
    per_point = 3 + _width(sequence.fields, "vertex")
    per_cell = _width(sequence.fields, "triangle")
    inside = per_point * n_inner + per_cell * max(0, n_cells - n_polygons)
    return inside / (per_point * sequence.n_vertices + per_cell * n_polygons)


def without_volume(sequence: MeshSequence) -> MeshSequence:
    """The surface alone; ``not_carried`` counts what was inside."""
    volume = sequence.volume
    if volume is None:
        return sequence
    left = LeftBehind()
    left.add(VOLUME_CELLS, len(volume.cells.types))
    left.add(INNER_POINTS, volume.n_points)
    return dataclasses.replace(sequence, volume=None, not_carried=(*sequence.not_carried, *left.names))


def count_note(times: float) -> str:
    """What was chosen where counting was enough."""
    return f"what lies inside is left out, since it has {times:.1f} times the surface's numbers; --volume carries it"


def _width(fields: Mapping[str, Field], domain: str) -> int:
    return sum(each.n_components for each in fields.values() if each.domain == domain)
