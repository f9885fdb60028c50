"""What repeats inside of a field and is coded once: the rows of a polygon's triangles, equal components, a large offset."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.asset.attribute import MAX_COMPONENTS
from gvpipe.asset.polygons import polygon_starts
from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.arrays import Array, Int32

LARGEST_OFFSET = 3.5e38  # float32's largest number is below


@dataclass(frozen=True)
class Reduction:
    """How the numbers of a field become those that its section holds.

    Args:
        polygons: whether there is a row per polygon, which all of its triangles have.
        columns: ``(C,)`` the coded component of each component; none: all C are coded.
        offsets: what was subtracted from each coded component, which is float64 then; none: nothing.
    """

    polygons: bool = False
    columns: tuple[int, ...] = ()
    offsets: tuple[float, ...] = ()

    def reduce(self, block: Array, polygons: Int32 | None) -> Array:
        """Numbers ``(n, R, C)`` as the section has them; ``polygons (P,)`` are the mesh's, in the order of the rows."""
        if self.polygons and polygons is not None:
            block = block[:, polygon_starts(polygons.astype(np.int64))]
        if self.columns:
            block = block[:, :, [self.columns.index(k) for k in range(max(self.columns) + 1)]]
        if self.offsets:
            block = (block - np.array(self.offsets)).astype(np.float32)
        return block

    def restore(self, block: Array, polygons: Int32 | None) -> Array:
        """Mirror of `reduce`."""
        if self.offsets:
            block = block + np.array(self.offsets)
        if self.columns:
            block = block[:, :, list(self.columns)]
        if self.polygons and polygons is not None:
            block = np.repeat(block, polygons - 2, axis=1)
        return block

    def n_coded(self, n_components: int) -> int:
        """Components that the section has, of a field of C."""
        return max(self.columns, default=n_components - 1) + 1

    def values(self) -> dict[str, object]:
        """It as JSON, for section ``asset``."""
        members = {"polygons": self.polygons, "columns": list(self.columns), "offsets": list(self.offsets)}
        return {name: value for name, value in members.items() if value}


NO_REDUCTION = Reduction()


def read_reduction(values: JsonObject, n_components: int, domain: str) -> Reduction:
    """Mirror of `Reduction.values`; raises `CorruptFile`.

    Args:
        values: the member.
        n_components: C of the field.
        domain: of the field.
    """
    by_polygon = values.flag("polygons")
    if by_polygon and domain != "triangle":
        raise values.wrong("polygons", "false where rows are vertices")
    columns = values.integers("columns", n_components, 0, MAX_COMPONENTS - 1) if "columns" in values else ()
    n_coded = Reduction(columns=columns).n_coded(n_components)
    if columns and sorted(set(columns)) != list(range(n_coded)):
        raise values.wrong("columns", "numbers from 0 on")
    offsets = values.numbers("offsets", n_coded, -LARGEST_OFFSET, LARGEST_OFFSET) if "offsets" in values else ()
    return Reduction(by_polygon, columns, offsets)


class Repeats:
    """Which rows and components of a field's frames are the same, block by block.

    Args:
        n_components: C.
        polygons: ``(P,)`` of the mesh whose triangles the rows are; None: rows are vertices, or all polygons are triangles.
    """

    def __init__(self, n_components: int, polygons: Int32 | None) -> None:
        self._polygons = polygons
        self._is_even = polygons is not None
        self._earlier = [set(range(c)) for c in range(n_components)]  # components that may equal this one

    def look_at(self, block: Array) -> None:
        """Look at frames ``(n, R, C)``; two numbers are the same if their bits are."""
        bits = np.ascontiguousarray(block).view(f"u{block.dtype.itemsize}")
        if self._is_even and self._polygons is not None:
            counts = self._polygons.astype(np.int64)
            firsts = np.repeat(polygon_starts(counts), counts - 2)
            self._is_even = all(np.array_equal(frame, frame[firsts]) for frame in bits)
        for c, earlier in enumerate(self._earlier):
            earlier.intersection_update([j for j in earlier if np.array_equal(bits[:, :, c], bits[:, :, j])])

    @property
    def is_even(self) -> bool:
        """Whether all triangles of each polygon have the same numbers in all frames."""
        return self._is_even

    @property
    def columns(self) -> tuple[int, ...]:
        """As of `Reduction`."""
        columns: list[int] = []
        for earlier in self._earlier:
            columns.append(columns[min(earlier)] if earlier else max(columns, default=-1) + 1)
        return tuple(columns) if max(columns) + 1 < len(columns) else ()
