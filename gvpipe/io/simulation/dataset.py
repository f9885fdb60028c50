"""One time step of a simulation: points, cells and named numbers on them; and what its surface has of those."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gvpipe.asset.attribute import MAX_COMPONENTS, WIDTHS
from gvpipe.asset.part import Part
from gvpipe.foundation.arrays import Array, Floats
from gvpipe.grids.cells import Cells
from gvpipe.io.left_behind import LeftBehind
from gvpipe.io.mesh import FrameValues
from gvpipe.io.simulation.surface import Surface


class DataArray(NamedTuple):
    """Named numbers of a step.

    Args:
        read: returns ``(rows,)`` or ``(rows, C)``; called when the numbers are needed.
        kind, unit: as of `gvpipe.Attribute`, where the file says so; else ``""``.
    """

    read: Callable[[], Array]
    kind: str = ""
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Dataset:
    """One time step.

    Args:
        points: returns ``(N, 3)``; called when they are needed.
        cells: returns the cells; the same object where a file has them once for all steps.
        point_data, cell_data: numbers by name, a row per point or per cell.
        blocks: names of runs of cells and how many each has; none: one run without a name.
        notes: what the reader did that the user should know, a line each.
        not_carried: what the file has and the data set has not, by name.
    """

    points: Callable[[], Floats]
    cells: Callable[[], Cells]
    point_data: Mapping[str, DataArray] = field(default_factory=dict)
    cell_data: Mapping[str, DataArray] = field(default_factory=dict)
    blocks: tuple[tuple[str, int], ...] = ()
    notes: tuple[str, ...] = ()
    not_carried: tuple[str, ...] = ()


USUAL_NAMES = {"uv": "uv", "normal": "normal", "color": "color"}
NORMAL_NAMES = ("normals", "normal")
UV_NAMES = ("uv", "texture coordinates", "tcoords", "texturecoordinates")


def surface_values(step: Dataset, surface: Surface) -> dict[str, Callable[[], FrameValues]]:
    """What the surface's vertices and triangles have of a step's numbers, by name; each is read when it is called for.

    A triangle has the numbers of the cell that it came from. Numbers of cells that share a name with some of points are
    called ``cell_NAME``.
    """
    values: dict[str, Callable[[], FrameValues]] = {}
    for domain, data, rows in (("vertex", step.point_data, surface.points), ("triangle", step.cell_data, surface.cells)):
        for name, one in data.items():
            one = one._replace(kind="normal") if name.lower() in NORMAL_NAMES and not one.kind else one
            given = USUAL_NAMES.get(one.kind, "") if domain == "vertex" else ""
            label = given if given and given not in step.point_data else name
            label = label if label not in values else f"cell_{label}"
            # what has another name than `normal` is a vector: a mesh has one normal
            values[label] = _reader(
                name, one if label == "normal" or one.kind != "normal" else one._replace(kind="vector"), domain, rows
            )
    return values


def _reader(name: str, one: DataArray, domain: str, rows: Array) -> Callable[[], FrameValues]:
    def read() -> FrameValues:
        values = np.asarray(one.read())
        if values.ndim > 2:
            values = values.reshape(len(values), -1)
        if values.ndim == 2 and values.shape[1] == 1:
            values = values[:, 0]
        if len(values) <= int(rows.max(initial=0)):
            raise ValueError(f"{name!r} has {len(values)} rows, which are fewer than its {domain} numbers need")
        values = plain_numbers(values[rows])
        return FrameValues(values, domain, one.kind if _fits(one.kind, values) else guess(name, values), one.unit)

    return read


def join_arrays(found: Sequence[Mapping[str, DataArray]], parts: str, left: LeftBehind) -> dict[str, DataArray]:
    """Arrays that all parts of a step have, one part after the other; names of others are left behind.

    Args:
        found: of each part, by name.
        parts: what they are called, such as ``"blocks"``.
        left: takes what only some have.
    """

    def read(name: str) -> Array:
        arrays = [np.asarray(data[name].read()) for data in found]
        return np.concatenate([each.reshape(len(each), math.prod(each.shape[1:])) for each in arrays])

    every = dict.fromkeys(name for data in found for name in data)
    shared = [name for name in every if all(name in data for data in found)]
    left.add_all(f"numbers {name!r} of some {parts}" for name in every if name not in shared)
    return {name: DataArray(partial(read, name), found[0][name].kind, found[0][name].unit) for name in shared}


def text_array(name: str) -> str:
    """What is said of an array of texts."""
    return f"text array {name!r}"


def field_data(name: str) -> str:
    """What is said of an array that belongs to the whole step, not to its points or cells."""
    return f"field data {name!r}"


def plain_numbers(values: Array) -> Array:
    """Integers of 64 bits as 32 where they fit; all in the machine's byte order."""
    values = values.astype(values.dtype.newbyteorder("="), copy=False)
    if values.dtype.kind == "b":
        return values.astype(np.uint8)
    if values.dtype.kind == "f":
        return values
    if values.dtype.itemsize == 8:
        fits = values.size == 0 or (int(values.min()) >= -(1 << 31) and int(values.max()) < 1 << 31)
        return values.astype(np.int32) if fits else values
    return values


def guess(name: str, values: Array) -> str:
    """The kind that a name and an array suggest; texture coordinates only by their exact name."""
    plain = name.lower()
    width = values.shape[1] if values.ndim == 2 else 1
    if values.dtype.kind == "f" and width == 2 and plain in UV_NAMES:
        return "uv"
    if values.dtype == np.uint8 and width in WIDTHS["color"]:
        return "color"
    if width > 1:
        return "vector"
    return "label" if values.dtype.kind in "iu" else "scalar"


def _fits(kind: str, values: Array) -> bool:
    """Whether numbers can be of a kind that the file names."""
    width = values.shape[1] if values.ndim == 2 else 1
    return (
        bool(kind)
        and width in WIDTHS.get(kind, range(1, MAX_COMPONENTS + 1))
        and (kind == "color") == (values.dtype == np.uint8)
    )


def block_parts(step: Dataset, surface: Surface) -> tuple[Part, ...]:
    """A part for each block that has triangles, with a range of vertices of its own where no two blocks share any."""
    if not step.blocks:
        return ()
    ends = np.cumsum([count for _, count in step.blocks])
    stops = np.searchsorted(surface.cells, ends, side="left").tolist()
    parts, start = [], 0
    for (name, _), stop in zip(step.blocks, stops, strict=True):
        if stop > start:
            parts.append(Part(name, (0, len(surface.points)), (start, stop)))
        start = stop
    ranges = _own_ranges([part.triangles for part in parts], surface)
    return tuple(replace(part, vertices=each) for part, each in zip(parts, ranges, strict=True)) if ranges else tuple(parts)


def _own_ranges(triangles: list[tuple[int, int]], surface: Surface) -> list[tuple[int, int]]:
    """A range of vertices for each range of triangles, one after the other; none where these share vertices or take turns.

    Vertices that no triangle has belong to the range before them.
    """
    starts = np.array([start for start, _ in triangles], np.int64)
    if not len(starts):
        return []
    low = np.minimum.reduceat(surface.faces.min(axis=1), starts)
    high = np.maximum.reduceat(surface.faces.max(axis=1), starts)
    if (low[1:] <= high[:-1]).any():
        return []
    edges = [0, *low[1:].tolist(), len(surface.points)]
    return list(pairwise(edges))
