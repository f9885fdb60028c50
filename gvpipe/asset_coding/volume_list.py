"""Section ``volume``: what lies inside of a surface, as deflated JSON that lists the sections which hold it.

``volume.cells`` is a byte and what `gvpipe.connectivity.cells` or `gvpipe.connectivity.cell_traversal` writes; ``volume.order``
is that of `gvpipe.connectivity.cells`; ``volume.points``, ``volume.point.i`` and
``volume.cell.i`` are fields (`gvpipe.fields`) of one frame or of all. Their rows are the inner points, or the inner cells, of
which no face is a polygon of the surface. The other cells have the surface's numbers (`gvpipe.asset_coding.volume_rows`).
"""

from __future__ import annotations

from dataclasses import dataclass

from gvpipe.asset.field import VOLUME_DOMAINS
from gvpipe.asset_coding.directory import MOST, Listed, listed_values, read_listed
from gvpipe.container.json_object import pack_json, unpack_json
from gvpipe.foundation.budget import UNLIMITED, Budget

SECTION, CELLS, ORDER, POINTS = "volume", "volume.cells", "volume.order", "volume.points"
VERSION, PLAIN_VERSION = 2, 1  # newest; of cells that are coded by the first two ways
IN_ORDER, BY_WALK, BY_CORNERS, AS_POLYHEDRA = 0, 1, 2, 3  # first byte of `CELLS`: how they are coded
MAX_BYTES = 1 << 24
MOST_CELLS = 1 << 30
MOST_POINTS = 1 << 24


@dataclass(frozen=True)
class VolumeList:
    """What a file has inside of its surface.

    Args:
        cells: M.
        points: I, the number of inner points.
        bound: on each coordinate of an inner point, model units; 0: exact.
        blocks: names of runs of cells and how many each has.
        numbers: of points and of cells; those whose name is in ``unmoved`` have one frame.
        unmoved: domains and names.
        version: of the section.
        has_polyhedra: whether cells are coded as lists of faces.
    """

    cells: int
    points: int
    bound: float = 0.0
    blocks: tuple[tuple[str, int], ...] = ()
    numbers: tuple[Listed, ...] = ()
    unmoved: frozenset[tuple[str, str]] = frozenset()
    version: int = PLAIN_VERSION
    has_polyhedra: bool = False


def pack_volume(listed: VolumeList) -> bytes:
    """Return the section."""
    return pack_json(
        {
            "version": listed.version,
            "cells": listed.cells,
            "points": listed.points,
            "bound": listed.bound,
            **({"polyhedra": True} if listed.has_polyhedra else {}),
            "blocks": [{"name": name, "cells": count} for name, count in listed.blocks],
            "numbers": [
                {**listed_values(each), "moves": (each.domain, each.name) not in listed.unmoved} for each in listed.numbers
            ],
        }
    )


def unpack_volume(data: bytes, budget: Budget = UNLIMITED) -> VolumeList:
    """Mirror of `pack_volume`; raises `CorruptFile` or `OverBudget`."""
    values = unpack_json(data, SECTION, MAX_BYTES, budget)
    version = values.integer("version", 1, 1 << 16)
    if version > VERSION:
        return VolumeList(0, 0, version=version)
    n_cells = values.integer("cells", 0, MOST_CELLS)
    blocks = tuple((each.text("name"), each.integer("cells", 0, n_cells)) for each in values.objects("blocks", MOST))
    if blocks and sum(count for _, count in blocks) != n_cells:
        raise values.wrong("blocks", f"{n_cells} cells in all")
    numbers, unmoved = [], set()
    for each in values.objects("numbers", MOST):
        numbers.append(read_listed(each, VOLUME_DOMAINS))
        if not each.flag("moves"):
            unmoved.add((numbers[-1].domain, numbers[-1].name))
    if len({(each.domain, each.name) for each in numbers}) != len(numbers):
        raise values.corrupt("two numbers of points or of cells have one name")
    points, bound = values.integer("points", 0, MOST_POINTS), values.number("bound", 0, 3.5e38)
    return VolumeList(n_cells, points, bound, blocks, tuple(numbers), frozenset(unmoved), version)
