"""Cells of a grid <-> bytes: their types, their nodes, and the order of the grid's points.

Nodes are numbers of points as the grid has them, since neighbouring cells then have neighbouring numbers. Each node is coded as
its difference from the same node of the cell before, in byte planes, deflated::

    cells   = [varint] number of runs, runs: [8 bits] VTK's type, [varint] cells; then packed planes, run after run
    order   = [8 bits] 0: rows are in order; 1: packed bits, 1 for points of the surface; 2: packed planes of places
    packed  = deflated planes (`gvpipe.connectivity.planes`)
"""

from __future__ import annotations

import numpy as np

from gvpipe.connectivity.planes import from_planes, to_planes
from gvpipe.container.cursor import Cursor, varint
from gvpipe.container.deflated import deflated, inflated
from gvpipe.foundation.arrays import Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt_section
from gvpipe.grids.cells import SIZE_OF_TYPE, VOLUMES, Cells

BYTES_PER_NODE, SECONDS_PER_NODE = 40, 0.2e-6  # of decoding
IN_ORDER, BY_MASK, BY_PLACE = 0, 1, 2


def encode_cells(cells: Cells) -> bytes:
    """Return the section of cells whose types have a number of nodes of their own."""
    starts = np.flatnonzero(np.diff(cells.types, prepend=-1, append=-1))
    head, planes = [varint(len(starts) - 1)], []
    for first, stop in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
        kind = int(cells.types[first])
        head += [bytes([kind]), varint(stop - first)]
        nodes = cells.nodes[cells.offsets[first] : cells.offsets[stop]].reshape(-1, SIZE_OF_TYPE[kind])
        planes.append(to_planes(nodes))
    return b"".join(head) + deflated(b"".join(planes))


def decode_cells(data: bytes, n_cells: int, n_points: int, name: str, budget: Budget = UNLIMITED) -> Cells:
    """Mirror of `encode_cells`.

    Args:
        data: the section.
        n_cells: M.
        n_points: nodes are below.
        name: of the section, for messages.
        budget: of the file.

    Raises:
        CorruptFile: it holds other cells.
        OverBudget: it takes too much memory.
    """
    cursor = Cursor(data, name)
    runs = []
    for _ in range(cursor.varint(n_cells)):
        kind = cursor.take(1)[0]
        if kind not in VOLUMES or not SIZE_OF_TYPE[kind]:
            raise corrupt_section(name, f"it has cells of type {kind}")
        runs.append((kind, cursor.varint(n_cells)))
    if sum(count for _, count in runs) != n_cells:
        raise corrupt_section(name, f"it does not have {n_cells} cells")
    types = np.repeat([kind for kind, _ in runs], [count for _, count in runs]).astype(np.uint8)
    offsets = np.concatenate([np.zeros(1, np.int64), np.cumsum(SIZE_OF_TYPE[types])])
    n_nodes = int(offsets[-1])
    budget.ask(f"section {name!r}", BYTES_PER_NODE * n_nodes, SECONDS_PER_NODE * n_nodes)
    planes = inflated(cursor.rest(), 4 * n_nodes, name)
    parts, at = [np.zeros(0, np.int64)], 0
    for kind, count in runs:
        size = 4 * count * int(SIZE_OF_TYPE[kind])
        parts.append(from_planes(planes[at : at + size], count).reshape(-1))
        at += size
    nodes = np.concatenate(parts)
    if len(nodes) and not 0 <= int(nodes.min()) <= int(nodes.max()) < n_points:
        raise corrupt_section(name, f"a cell has a node that is none of {n_points} points")
    return Cells(types, offsets, nodes)


def encode_order(order: Int64 | None, n_surface: int) -> bytes:
    """Return the section of the places of a grid's points: the surface's rows first, then the others."""
    if order is None or np.array_equal(order, np.arange(len(order))):
        return bytes([IN_ORDER])
    if _rises(order[:n_surface]) and _rises(order[n_surface:]):
        is_surface = np.zeros(len(order), bool)
        is_surface[order[:n_surface]] = True
        return bytes([BY_MASK]) + deflated(np.packbits(is_surface).tobytes())
    return bytes([BY_PLACE]) + deflated(to_planes(order[:, None]))


def decode_order(data: bytes, n_surface: int, n_points: int, name: str, budget: Budget = UNLIMITED) -> Int64 | None:
    """Mirror of `encode_order`: ``(n_points,)``, or None where the points are in order; raises as `decode_cells`."""
    cursor = Cursor(data, name)
    kind = cursor.take(1)[0]
    if kind == IN_ORDER:
        return None
    budget.ask(f"section {name!r}", BYTES_PER_NODE * n_points)
    if kind == BY_MASK:
        bits = np.frombuffer(inflated(cursor.rest(), (n_points + 7) // 8, name), np.uint8)
        is_surface = np.unpackbits(bits)[:n_points].astype(bool)
        order = np.concatenate([np.flatnonzero(is_surface), np.flatnonzero(~is_surface)])
        if int(is_surface.sum()) != n_surface:
            raise corrupt_section(name, f"it has {int(is_surface.sum())} points of the surface; {n_surface} are needed")
        return order
    if kind != BY_PLACE:
        raise corrupt_section(name, f"it is of kind {kind}")
    order = from_planes(inflated(cursor.rest(), 4 * n_points, name), n_points)[:, 0]
    if not np.array_equal(np.sort(order), np.arange(n_points)):
        raise corrupt_section(name, "it does not have each place once")
    return order


def _rises(values: Int64) -> bool:
    return bool((np.diff(values) > 0).all())
