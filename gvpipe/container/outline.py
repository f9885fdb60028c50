"""What a file says of its mesh, so that `gvpipe.info` need not decode it. Readers of frames do not look at it.

It is the header's key ``outline``, in all layouts but the bare; what is empty is left out::

    {"box": [smallest x, y, z, largest x, y, z], "levels": [vertices of level 1, of level 2, ...],
     "triangles": [of each part], "polygons": [corners, how many, corners, how many, ...]}
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.arrays import Floats

KEY = "outline"
LARGEST = 3.5e38  # above float32's largest number
MAX_LEVELS = 64
MOST = 1 << 14  # parts, or kinds of polygons: of more, a file says nothing, since headers are limited


@dataclass(frozen=True)
class Outline:
    """What a file says of its mesh.

    Args:
        box: frame 0's smallest and largest x, y and z, model units, relative to the origin: of the source, before coding.
        levels: vertex counts of the levels of detail from level 1 on.
        part_triangles: triangles of each part.
        polygons: how many faces have each number of corners, least corners first; empty: all are triangles.
    """

    box: tuple[float, ...]
    levels: tuple[int, ...] = ()
    part_triangles: tuple[int, ...] = ()
    polygons: Mapping[int, int] = field(default_factory=dict)

    @classmethod
    def around(cls, positions: Floats, levels: tuple[int, ...] = ()) -> Outline:
        """The outline of a mesh whose frame 0 is ``positions (V, 3) float32``."""
        corners = (*positions.min(axis=0), *positions.max(axis=0))
        return cls(tuple(float(str(corner)) for corner in corners), levels)  # as few digits as float32 needs

    @classmethod
    def of(cls, values: JsonObject, n_vertices: int, n_triangles: int) -> Outline:
        """Mirror of `to_json`, of a mesh of that size; raises `CorruptFile`."""
        box = values.numbers("box", 6, -LARGEST, LARGEST)
        if any(low > high for low, high in zip(box[:3], box[3:], strict=True)):
            raise values.wrong("box", "smallest before largest corners")
        pairs = values.integers_up_to("polygons", 2 * MOST, 1, n_triangles + 2)
        if len(pairs) % 2:
            raise values.wrong("polygons", "pairs of numbers")
        return cls(
            box,
            values.integers_up_to("levels", MAX_LEVELS, 1, n_vertices),
            values.integers_up_to("triangles", MOST, 0, n_triangles),
            dict(zip(pairs[::2], pairs[1::2], strict=True)),
        )

    @property
    def is_short(self) -> bool:
        """Whether it goes into a header."""
        return max(len(self.part_triangles), len(self.polygons)) <= MOST

    def to_json(self) -> dict[str, Any]:
        """The value of the header's key."""
        lists = {
            "levels": list(self.levels),
            "triangles": list(self.part_triangles),
            "polygons": list(itertools.chain.from_iterable(self.polygons.items())),
        }
        return {"box": list(self.box), **{name: values for name, values in lists.items() if values}}
