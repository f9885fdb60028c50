"""Kernels of `gvpipe.connectivity.cell_traversal`: cells one after the other, each on a face of those before."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.cell_poses import Poses
from gvpipe.connectivity.vote_kernels import sort_votes, vote
from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

MOST_CANDIDATES = 48
N_RANKS = 256
STEPS_PER_CELL, STEPS_LEAST = 400, 100_000  # looks at open faces that a grid may take
TYPES, POSES, EXPLICIT, NODES = 0, 5, 13, 14  # first contexts
N_CONTEXTS = NODES + 4 * 4 * 2 * 16
SCATTER = 0x9E3779B1  # an odd multiplier
NOT_REGULAR = -1  # what an encoder returns for grids that it cannot traverse


class Source(NamedTuple):
    """What an encoder knows; of a decoder empty. int64.

    Args:
        kinds: ``(M,)`` indices into `gvpipe.connectivity.cell_poses.KINDS`.
        nodes: ``(M, 8)`` of the cells.
        across: ``(M, 6)`` the cell behind each face, -1 for none.
        behind: ``(P,)`` the cell behind each seed.
    """

    kinds: Int64
    nodes: Int64
    across: Int64
    behind: Int64


class Front(NamedTuple):
    """Open faces: those that have a cell on one side.

    Args:
        nodes: ``(n, 4)``, seen from outside of the cell to come.
        sizes: ``(n,)`` corners; 0 once it is closed.
        behind: ``(n,)`` the cell to come, of an encoder.
        heads: ``(N,)`` first entry of each point's list of open faces; an entry is 4 times the face and the corner. -1: none.
        nexts: ``(4 n,)`` the entry after each.
        counts: ``(4,)`` faces made, a number that is not used, points known, steps taken.
        keys, cells: ``(2^b,)`` a table of edges, -1 where it is free, and how many cells each has by now.
        ranks: ``(n,)`` of open faces, -1 of others; all 0 if faces are taken in the order in which they were made.
        befores, afters: ``(n,)`` open faces of the same rank, -1 at the ends.
        ends: ``(2, 256)`` first and last open face of each rank, -1 for none.
    """

    nodes: Int64
    sizes: Int64
    behind: Int64
    heads: Int64
    nexts: Int64
    counts: Int64
    keys: Int64
    cells: Int64
    ranks: Int64
    befores: Int64
    afters: Int64
    ends: Int64


@compiled
def code_cells(
    coder: SerialCoder,
    poses: Poses,
    source: Source,
    seeds: Int64,
    sizes: Int64,
    counts: tuple[int, int, int],
    keeps: bool,
    is_ranked: bool,
) -> tuple[Int64, Int64, Int64, Int64]:
    """Code all cells from the surface inwards.

    Args:
        coder: that notes or reads.
        poses: the tables.
        source: of an encoder.
        seeds, sizes: ``(P, 4)`` and ``(P,)`` polygons of the surface with a cell behind them, seen from outside.
        counts: V points of the surface, which are known and come first, all N points, M cells.
        keeps: whether cells keep their own numbers of nodes; else any that mean the same cell.
        is_ranked: whether the open face at whose edges most cells are is taken first; else the one that was made first.

    Returns:
        Kinds ``(M,)``, nodes ``(M, 8)``, source cells ``(M,)`` and source points ``(N,)`` in the order of coding. An encoder
        that cannot go on returns `NOT_REGULAR` as the first kind.
    """
    n_surface, n_points, n_cells = counts
    n_seeds = len(seeds)
    most = n_seeds + 6 * n_cells
    front = Front(
        np.zeros((most, 4), np.int64),
        np.zeros(most, np.int64),
        np.full(most, -1, np.int64),
        np.full(n_points, -1, np.int64),
        np.full(4 * most, -1, np.int64),
        np.zeros(4, np.int64),
        np.full(_table_size(n_cells), -1, np.int64),
        np.zeros(_table_size(n_cells), np.int64),
        np.full(most, -1, np.int64),
        np.full(most, -1, np.int64),
        np.full(most, -1, np.int64),
        np.full((2, N_RANKS), -1, np.int64),
    )
    front.counts[2] = n_surface
    kinds, nodes, cells = np.zeros(n_cells, np.int64), np.zeros((n_cells, 8), np.int64), np.full(n_cells, -1, np.int64)
    names, points = np.full(n_points, -1, np.int64), np.full(n_points, -1, np.int64)
    for i in range(n_surface):
        names[i] = points[i] = i
    for s in range(n_seeds):
        _open(front, seeds[s], sizes[s], source.behind[s] if coder.encodes else -1)
    local, known = np.zeros(8, np.int64), np.zeros(8, np.int64)
    candidates, votes = np.zeros(MOST_CANDIDATES, np.int64), np.zeros(MOST_CANDIDATES, np.int64)
    last = 4
    for done in range(n_cells):
        f = _next_face(front)
        if f < 0 or front.counts[3] > STEPS_LEAST + STEPS_PER_CELL * (done + 1):
            if coder.encodes:
                kinds[0] = NOT_REGULAR
            else:
                refuse(coder)
            return kinds, nodes, cells, points
        size, cell = front.sizes[f], front.behind[f]
        if coder.encodes and cell < 0:
            kinds[0] = NOT_REGULAR
            return kinds, nodes, cells, points
        kind = code_value(coder, TYPES + last, source.kinds[cell] if coder.encodes else 0)
        pose, n_poses = 0, 0
        if 0 <= kind < 4:
            n_poses = poses.counts[kind, size - 3]
        if coder.encodes:
            for i in range(poses.sizes[kind]):
                known[i] = names[source.nodes[cell, i]]
            pose = _find_pose(front.nodes[f], known, poses.nodes[kind, size - 3], n_poses, size)
            if pose < 0:
                kinds[0] = NOT_REGULAR
                return kinds, nodes, cells, points
        own = pose
        if coder.encodes and not keeps:
            pose = 2 * poses.alike[kind, size - 3, pose >> 1] + (pose & 1)
        pose = code_value(coder, POSES + 2 * min(max(kind, 0), 3) + size - 3, pose)
        if not coder.encodes:
            own = pose
            if not 0 <= kind < 4 or not 0 <= pose < 2 * n_poses:
                refuse(coder)
                return kinds, nodes, cells, points
        last = kind
        is_mirrored = pose & 1
        for i in range(size):
            local[i] = front.nodes[f, (size - i) % size if is_mirrored else i]
        for i in range(size, poses.sizes[kind]):
            wanted = source.nodes[cell, poses.nodes[kind, size - 3, own >> 1, i]] if coder.encodes else -1
            place = (kind, pose >> 1, size, i, f)
            found = _code_node(coder, front, poses, place, local, (candidates, votes), wanted, (names, points))
            if found < 0:
                refuse(coder)
                return kinds, nodes, cells, points
            local[i] = found
        kinds[done], cells[done] = kind, cell
        for i in range(poses.sizes[kind]):
            nodes[done, poses.nodes[kind, size - 3, pose >> 1, i]] = local[i]
        _close(front, f)
        _count_edges(front, poses, kind, nodes[done])
        for j in range(6):
            n = poses.face_sizes[kind, j]
            is_front = n == size and _has_all(front.nodes[f], nodes[done], poses.faces[kind, j], n)
            if n and not is_front:
                beyond = -1
                if coder.encodes:
                    beyond = _beyond(source, poses, cell, kind, names, nodes[done], j, n)
                _meet(front, nodes[done], poses.faces[kind, j], n, is_mirrored, beyond)
        if is_ranked:
            _rank_faces(front, poses, kind, nodes[done])
    return kinds, nodes, cells, points


@compiled
def _find_pose(face: Int64, nodes: Int64, poses: Int64, n_poses: int, size: int) -> int:
    """Twice the pose in which a cell stands on a face, and 1 if it is mirrored; -1 for none."""
    for p in range(n_poses):
        same, turned = True, True
        for i in range(size):
            same &= nodes[poses[p, i]] == face[i]
            turned &= nodes[poses[p, i]] == face[(size - i) % size]
        if same or turned:
            return 2 * p + (0 if same else 1)
    return -1


@compiled
def _next_face(front: Front) -> int:
    """The open face of the highest rank that has it for the longest; -1 for none."""
    for rank in range(N_RANKS - 1, -1, -1):
        if front.ends[0, rank] >= 0:
            return int(front.ends[0, rank])
    return -1


@compiled
def _list_face(front: Front, f: int, rank: int) -> None:
    """Put an open face behind the others of a rank."""
    last = front.ends[1, rank]
    front.ranks[f], front.befores[f], front.afters[f] = rank, last, -1
    if last < 0:
        front.ends[0, rank] = f
    else:
        front.afters[last] = f
    front.ends[1, rank] = f


@compiled
def _unlist_face(front: Front, f: int) -> None:
    """Take an open face out of the others of its rank."""
    rank, before, after = front.ranks[f], front.befores[f], front.afters[f]
    if before < 0:
        front.ends[0, rank] = after
    else:
        front.afters[before] = after
    if after < 0:
        front.ends[1, rank] = before
    else:
        front.befores[after] = before


@compiled
def _rank_faces(front: Front, poses: Poses, kind: int, nodes: Int64) -> None:
    """Rank the open faces at the edges of a new cell: by the two edges that have most cells by now."""
    for i in range(poses.sizes[kind]):
        here = front.heads[nodes[i]]
        while here >= 0:
            front.counts[3] += 1
            g, here = here >> 2, front.nexts[here]
            high, second = 0, 0
            for k in range(front.sizes[g]):
                count = min(_cells_at(front, front.nodes[g, k], front.nodes[g, (k + 1) % front.sizes[g]]), 15)
                if count > high:
                    high, second = count, high
                elif count > second:
                    second = count
            if front.ranks[g] != 16 * high + second:
                _unlist_face(front, g)
                _list_face(front, g, 16 * high + second)


@compiled
def _open(front: Front, nodes: Int64, size: int, behind: int) -> None:
    f = front.counts[0]
    front.counts[0] += 1
    front.sizes[f], front.behind[f] = size, behind
    _list_face(front, f, 0)
    for i in range(size):
        front.nodes[f, i] = nodes[i]
        front.nexts[4 * f + i] = front.heads[nodes[i]]
        front.heads[nodes[i]] = 4 * f + i


@compiled
def _close(front: Front, f: int) -> None:
    for i in range(front.sizes[f]):
        entry, at = 4 * f + i, front.nodes[f, i]
        before, here = -1, front.heads[at]
        while here != entry:
            before, here = here, front.nexts[here]
            front.counts[3] += 1
        if before < 0:
            front.heads[at] = front.nexts[entry]
        else:
            front.nexts[before] = front.nexts[entry]
    _unlist_face(front, f)
    front.sizes[f] = 0


@compiled
def _meet(front: Front, nodes: Int64, face: Int64, size: int, is_mirrored: int, beyond: int) -> None:
    """Close the open face that a cell's face meets; else open one to the cell beyond."""
    here = front.heads[nodes[face[0]]]
    while here >= 0:
        front.counts[3] += 1
        g = here >> 2
        if front.sizes[g] == size and _has_all(front.nodes[g], nodes, face, size):
            _close(front, g)
            return
        here = front.nexts[here]
    turned = np.zeros(4, np.int64)
    for i in range(size):  # seen from the other side
        turned[i] = nodes[face[i if is_mirrored else size - 1 - i]]
    _open(front, turned, size, beyond)


@compiled
def _has_all(one: Int64, nodes: Int64, face: Int64, size: int) -> bool:
    for i in range(size):
        is_there = False
        for k in range(size):
            is_there |= one[k] == nodes[face[i]]
        if not is_there:
            return False
    return True


@compiled
def _beyond(source: Source, poses: Poses, cell: int, kind: int, names: Int64, nodes: Int64, face: int, size: int) -> int:
    """The source's cell behind a face of a coded cell, whose own numbers of nodes may be others."""
    for j in range(6):
        if poses.face_sizes[kind, j] != size:
            continue
        n_same = 0
        for i in range(size):
            name = names[source.nodes[cell, poses.faces[kind, j, i]]]
            for k in range(size):
                n_same += name == nodes[poses.faces[kind, face, k]]
        if n_same == size:
            return int(source.across[cell, j])
    return -1


@compiled
def _code_node(
    coder: SerialCoder,
    front: Front,
    poses: Poses,
    place: tuple[int, int, int, int, int],
    local: Int64,
    memory: tuple[Int64, Int64],
    wanted: int,
    renamed: tuple[Int64, Int64],
) -> int:
    """Code one of a cell's other nodes; -1 if there is no such point.

    Args:
        coder, front, poses: as of `code_cells`.
        place: kind, pose, corners of the face, which node, and the face.
        local: the nodes before it, in the order of the pose.
        memory: for candidates and their votes.
        wanted: the source's point, of an encoder.
        renamed: the new number of each of the source's points, and the other way round.
    """
    kind, pose, size, i, f = place
    candidates, votes = memory
    names, points = renamed
    n, best = 0, 0
    own = poses.nodes[kind, size - 3, pose, i]
    for j in range(i):
        if not poses.edges[kind, own, poses.nodes[kind, size - 3, pose, j]]:
            continue
        here = front.heads[local[j]]
        while here >= 0:
            front.counts[3] += 1
            g, corner, here = here >> 2, here & 3, front.nexts[here]
            if g == f:
                continue
            count = front.sizes[g]
            a, b = front.nodes[g, (corner + 1) % count], front.nodes[g, (corner + count - 1) % count]
            has_a, has_b = _is_among(a, local, i), _is_among(b, local, i)
            if not (has_a or has_b):  # it touches the cell in one point
                n = vote(b, 1, candidates, votes, vote(a, 1, candidates, votes, n))
            if has_a == has_b:
                continue
            shared = a if has_a else b
            n = vote(b if has_a else a, 8 + min(_cells_at(front, local[j], shared), 7), candidates, votes, n)
    sort_votes(candidates, votes, n)
    if n:
        best = min(votes[0] >> 2, 15)
    value = 0
    if coder.encodes and names[wanted] >= 0:
        value = n + 1
        for k in range(n):
            if candidates[k] == names[wanted]:
                value = k + 1
                break
    context = NODES + 32 * (4 * kind + min(i - size, 3)) + 16 * min(n, 1) + best
    value = code_value(coder, context, value)
    if value == 0:
        number = front.counts[2]
        if number >= len(points):
            return -1
        front.counts[2] += 1
        if coder.encodes:
            names[wanted], points[number] = number, wanted
        return int(number)
    if 0 < value <= n:
        return int(candidates[value - 1])
    number = code_value(coder, EXPLICIT, front.counts[2] - 1 - names[wanted] if coder.encodes else 0)
    number = front.counts[2] - 1 - number
    return int(number) if 0 <= number < front.counts[2] else -1


@compiled
def _table_size(n_cells: int) -> int:
    size = 64
    while size < 16 * n_cells:
        size *= 2
    return size


@compiled
def _slot(front: Front, a: int, b: int) -> int:
    """Where an edge is in the table, or where it belongs."""
    key = (min(a, b) << 31) | max(a, b)
    mask = len(front.keys) - 1
    slot = ((key ^ (key >> 29)) * SCATTER >> 7) & mask
    while front.keys[slot] >= 0 and front.keys[slot] != key:
        slot = (slot + 1) & mask
        front.counts[3] += 1
    return int(slot)


@compiled
def _cells_at(front: Front, a: int, b: int) -> int:
    """How many cells an edge has by now."""
    slot = _slot(front, a, b)
    return int(front.cells[slot]) if front.keys[slot] >= 0 else 0


@compiled
def _count_edges(front: Front, poses: Poses, kind: int, nodes: Int64) -> None:
    """Count a cell at each of its edges."""
    for i in range(poses.sizes[kind]):
        for k in range(i):
            if poses.edges[kind, i, k]:
                slot = _slot(front, nodes[i], nodes[k])
                front.keys[slot] = (min(nodes[i], nodes[k]) << 31) | max(nodes[i], nodes[k])
                front.cells[slot] += 1


@compiled
def _is_among(point: int, points: Int64, count: int) -> bool:
    found = False
    for i in range(count):
        found |= points[i] == point
    return bool(found)


@compiled
def order_seeds(starts: Int64, others: Int64) -> Int64:
    """Polygons ``(P,)`` in the order of a walk over the surface, from the first of each piece outwards.

    Args:
        starts, others: ``(P + 1,)`` bounds of each polygon's neighbours in ``others``.
    """
    n = len(starts) - 1
    order, is_taken = np.zeros(n, np.int64), np.zeros(n, np.bool_)
    count = 0
    for first in range(n):
        if is_taken[first]:
            continue
        is_taken[first] = True
        order[count] = first
        at = count
        count += 1
        while at < count:
            for k in range(starts[order[at]], starts[order[at] + 1]):
                other = others[k]
                if not is_taken[other]:
                    is_taken[other] = True
                    order[count] = other
                    count += 1
            at += 1
    return order
