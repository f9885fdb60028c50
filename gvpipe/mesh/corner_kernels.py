"""Kernels that go around a triangle: corner ``3 t + k`` is vertex k of triangle t."""

from __future__ import annotations

from gvpipe.compiled import compiled


@compiled
def next_corner(corner: int) -> int:
    """The corner after it in its triangle."""
    return corner + 1 if corner % 3 < 2 else corner - 2


@compiled
def previous_corner(corner: int) -> int:
    """The corner before it in its triangle."""
    return corner - 1 if corner % 3 > 0 else corner + 2
