"""A point of a mesh that a user clicked on, with the numbers that it has there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64
from gvpipe.notebook.prepared import Prepared


@dataclass(frozen=True, eq=False)
class Pick:
    """What was clicked on.

    Args:
        vertex: the nearest one.
        triangle: that was met; None of a mesh without triangles.
        part: its name, or None.
        frame: that was shown.
        position: ``(3,) float64`` of the vertex in that frame, model units, with the origin added.
        values: every field's value there, by name: a number, or an array ``(C,)`` of vectors.
    """

    vertex: int
    triangle: int | None
    part: str | None
    frame: int
    position: Float64
    values: Mapping[str, float | Array]


def read_pick(prepared: Prepared, message: Mapping[str, Any]) -> Pick | None:
    """The pick that a page tells of; None if the video has no such vertex, triangle or frame."""
    vertex, triangle, shown = (message.get(name) for name in ("vertex", "triangle", "frame"))
    if not isinstance(shown, int) or not 0 <= shown < prepared.n_frames:
        return None
    player, frame = prepared.at(shown)
    sizes = player.shape[1], len(player.faces)
    for value, size in zip((vertex, 0 if triangle is None else triangle), sizes, strict=True):
        if not isinstance(value, int) or not 0 <= value < max(1, size):
            return None
    assert isinstance(vertex, int)
    rows = {"vertex": vertex, "triangle": triangle}
    values: dict[str, float | Array] = {}
    for name, field in player.fields.items():
        row = rows.get(field.domain)
        if row is not None:
            value = np.asarray(field[frame])[row]
            values[name] = value if np.ndim(value) else float(value)
    part = next((part.name for part in player.parts if part.vertices[0] <= vertex < part.vertices[1]), None)
    return Pick(vertex, triangle, part, shown, player[frame][vertex] + player.origin, values)
