"""Kernels that go around a triangle: corner ``3 t + k`` is vertex k of triangle t."""

from __future__ import annotations

import numpy as np

from gvpipe.foundation.arrays import Integers
from gvpipe.runtime.compiled import compiled


@compiled
def next_corner(corner: int) -> int:
    """The corner after it in its triangle."""
    return corner + 1 if corner % 3 < 2 else corner - 2


@compiled
def previous_corner(corner: int) -> int:
    """The corner before it in its triangle."""
    return corner - 1 if corner % 3 > 0 else corner + 2


@compiled
def turn_smallest_first(faces: Integers) -> Integers:
    """``faces (T, 3)``, each turned so that its smallest index leads, the first one of equals."""
    turned = np.empty_like(faces)
    for t in range(len(faces)):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        if b < a and b <= c:
            a, b, c = b, c, a
        elif c < a and c < b:
            a, b, c = c, a, b
        turned[t, 0], turned[t, 1], turned[t, 2] = a, b, c
    return turned
