"""Kernels of `gvpipe.connectivity.polyhedral_cells`: cells one after the other, each face by face, as lists of points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.vote_kernels import sort_votes, vote
from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled

MOST_CANDIDATES = 48
STEPS_PER_CORNER, STEPS_LEAST = 400, 1 << 24  # looks at open faces and edges that a grid may take
N_TYPES = 32
TYPES, COUNTS, FACES, OTHER_FACES = 0, N_TYPES + 1, N_TYPES + 2, N_TYPES + 2 + 128  # first contexts
TURNS, SIZES = OTHER_FACES + 2, OTHER_FACES + 2 + 32
POINTS, OTHER_POINTS, REST = SIZES + 4, SIZES + 4 + 128, SIZES + 4 + 128 + 1
N_CONTEXTS = REST + 1
NOT_CODED = -1  # the first type that an encoder returns for grids that take too many steps


class Shapes(NamedTuple):
    """Faces of each type of cells, by its number; none for polyhedra. int64.

    Args:
        firsts: ``(n + 1,)`` first face of each type.
        starts: ``(f + 1,)`` first place of each face.
        places: nodes of the faces, by their places in the cell.
        sizes: ``(n,)`` nodes of a cell.
    """

    firsts: Int64
    starts: Int64
    places: Int64
    sizes: Int64


class Faces(NamedTuple):
    """Faces of cells, in order; of a decoder those to come. int64.

    Args:
        types: ``(M,)`` numbers of types.
        counts: ``(M,)`` faces.
        sizes: ``(S,)`` corners.
        nodes: ``(K,)`` points.
        rest: ``(R,)`` nodes that no face has.
    """

    types: Int64
    counts: Int64
    sizes: Int64
    nodes: Int64
    rest: Int64


class Open(NamedTuple):
    """Faces that have a cell on one side. int64.

    Args:
        starts: ``(n + 1,)`` first corner of each face.
        is_open: ``(n,)``.
        nodes: corners, one after the other.
        owners: the face of each corner.
        heads: ``(N,)`` first corner of each point's list of open faces; -1: none.
        nexts: the corner after each in its list.
        counts: ``(4,)`` faces made, points known, steps taken, steps allowed.
    """

    starts: Int64
    is_open: Int64
    nodes: Int64
    owners: Int64
    heads: Int64
    nexts: Int64
    counts: Int64


class Cell(NamedTuple):
    """The cell that is being coded. int64.

    Args:
        marks: ``(N,)`` the last cell, counted from 1, that each point is a node of.
        local: points by place, -1 where not known.
        ends: ``(e, 2)`` edges.
        uses: ``(e,)`` faces at each.
        face: corners of the face that is being coded, -1 where not known.
        about: ``(3,)`` number of edges, of the cell from 1, of the face's corners.
    """

    marks: Int64
    local: Int64
    ends: Int64
    uses: Int64
    face: Int64
    about: Int64


@compiled
def code_polyhedra(
    coder: SerialCoder, shapes: Shapes, source: Faces, made: Faces, seeds: tuple[Int64, Int64], limits: tuple[int, int, int]
) -> Int64:
    """Code all cells in order, into ``made``.

    Args:
        coder: that notes or reads.
        shapes: the tables.
        source: of an encoder.
        made: arrays of the sizes that the result has.
        seeds: corners of the surface's polygons, one after the other, and ``(P + 1,)`` where each starts.
        limits: V points of the surface, which come first, N points, and the most corners of a cell's faces.

    Returns:
        ``(N,)`` the source's point of each point.
    """
    n_surface, n_points, most = limits
    n_faces, n_corners = len(seeds[1]) - 1 + len(made.sizes), len(seeds[0]) + len(made.nodes)
    front = Open(
        np.zeros(n_faces + 1, np.int64),
        np.zeros(n_faces, np.int64),
        np.zeros(n_corners, np.int64),
        np.zeros(n_corners, np.int64),
        np.full(n_points, -1, np.int64),
        np.full(n_corners, -1, np.int64),
        np.zeros(4, np.int64),
    )
    front.counts[1], front.counts[3] = n_surface, STEPS_LEAST + STEPS_PER_CORNER * n_corners
    cell = Cell(
        np.zeros(n_points, np.int64),
        np.full(max(most, 32), -1, np.int64),
        np.zeros((most, 2), np.int64),
        np.zeros(most, np.int64),
        np.zeros(most, np.int64),
        np.zeros(3, np.int64),
    )
    names, points = np.full(n_points, -1, np.int64), np.full(n_points, -1, np.int64)
    for i in range(n_surface):
        names[i] = points[i] = i
    for p in range(len(seeds[1]) - 1):
        _open_face(front, seeds[0], seeds[1][p], seeds[1][p + 1] - seeds[1][p])
    memory = np.zeros(MOST_CANDIDATES, np.int64), np.zeros(MOST_CANDIDATES, np.int64)
    face_at, corner_at, rest_at, last, last_count = 0, 0, 0, N_TYPES, 0
    for c in range(len(made.types)):
        kind = code_value(coder, TYPES + last, source.types[c] if coder.encodes else 0)
        if not 0 <= kind < len(shapes.sizes) or front.counts[2] > front.counts[3]:
            return _given_up(coder, made, points)
        last = kind
        is_free = shapes.sizes[kind] == 0
        count = shapes.firsts[kind + 1] - shapes.firsts[kind]
        if is_free:
            count = last_count + code_value(coder, COUNTS, source.counts[c] - last_count if coder.encodes else 0)
            last_count = count
        if not 0 <= count <= len(made.sizes) - face_at:
            return _given_up(coder, made, points)
        made.types[c], made.counts[c] = kind, count
        cell.about[0], cell.about[1] = 0, c + 1
        first_corner = corner_at
        for i in range(shapes.sizes[kind]):
            cell.local[i] = -1
        for slot in range(count):
            shape = -1 if is_free else shapes.firsts[kind] + slot
            size, n_known = 0, 0
            if not is_free:
                size = shapes.starts[shape + 1] - shapes.starts[shape]
                for i in range(min(size, most)):
                    cell.face[i] = cell.local[shapes.places[shapes.starts[shape] + i]]
                    n_known += cell.face[i] >= 0
            wanted = source.nodes[corner_at : corner_at + source.sizes[face_at]] if coder.encodes else source.nodes
            room = min(len(made.nodes) - corner_at, most - (corner_at - first_corner))
            place = (slot, count - 1 - slot, size, n_known, room)
            size = _code_face(coder, front, cell, place, wanted, (names, points), memory)
            if size < 0 or front.counts[2] > front.counts[3]:
                return _given_up(coder, made, points)
            for i in range(size):
                if front.counts[2] > front.counts[3]:
                    return _given_up(coder, made, points)
                made.nodes[corner_at + i] = cell.face[i]
                cell.marks[cell.face[i]] = c + 1
                _count_edge(front, cell, cell.face[i], cell.face[(i + 1) % size])
                if not is_free:
                    cell.local[shapes.places[shapes.starts[shape] + i]] = cell.face[i]
            made.sizes[face_at] = size
            face_at, corner_at = face_at + 1, corner_at + size
        for i in range(shapes.sizes[kind]):
            if cell.local[i] < 0:
                if rest_at >= len(made.rest):
                    return _given_up(coder, made, points)
                target = source.rest[rest_at] if coder.encodes else -1
                found = _code_rest(coder, front, target, (names, points))
                if found < 0:
                    return _given_up(coder, made, points)
                made.rest[rest_at] = found
                rest_at += 1
    if face_at != len(made.sizes) or corner_at != len(made.nodes) or rest_at != len(made.rest):
        return _given_up(coder, made, points)
    return points


@compiled
def _given_up(coder: SerialCoder, made: Faces, points: Int64) -> Int64:
    if not coder.encodes:
        refuse(coder)
    made.types[0] = NOT_CODED
    return points


@compiled
def _code_face(
    coder: SerialCoder,
    front: Open,
    cell: Cell,
    place: tuple[int, int, int, int, int],
    wanted: Int64,
    renamed: tuple[Int64, Int64],
    memory: tuple[Int64, Int64],
) -> int:
    """Code a face into ``cell.face`` and return its corners; -1 if there is no such face.

    Args:
        coder, front, cell: as they are.
        place: faces of the cell before, and behind; corners, 0 if they are not known; how many of these are; room for them.
        wanted: the source's corners, of an encoder.
        renamed: the new number of each of the source's points, and the other way round.
        memory: for candidates and their votes.
    """
    slot, left, size, n_known, room = place
    if size > room:
        return -1
    if size and n_known == size:  # all corners are those of earlier faces
        same = _find_open(front, cell.face, size)
        if same >= 0:
            _close_face(front, same)
        else:
            _open_face(front, cell.face, 0, size)
        return size
    candidates, votes = memory
    n = _near_faces(front, cell, size, candidates, votes)
    same, turn = -1, -1
    if coder.encodes:
        same = _find_source(front, wanted, renamed[0])
        if same >= 0:
            turn = _turn_of(front, cell, same, size, wanted, renamed[0])
            same = same if turn >= 0 else -1
    value = 0
    if same >= 0:
        value = n + 1
        for k in range(n):
            if candidates[k] == same:
                value = k + 1
                break
    best = min(votes[0], 7) if n else 0
    context = FACES + ((min(slot, 3) * 2 + (left == 0)) * 8 + best) * 2 + (n > 1)
    value = code_value(coder, context, value)
    if value < 0:
        return -1
    if value == 0:
        return _code_new_face(coder, front, cell, place, wanted, renamed, memory)
    if value <= n:
        same = candidates[value - 1]
    else:
        back = code_value(coder, OTHER_FACES + min(slot, 1), front.counts[0] - 1 - same)
        same = front.counts[0] - 1 - back
        if not 0 <= same < front.counts[0] or not front.is_open[same]:
            return -1
    length = front.starts[same + 1] - front.starts[same]
    if length > room or (size and length != size):
        return -1
    n_turns, only = _count_turns(front, cell, same, size)
    if n_turns == 0:
        return -1
    if n_turns == 1:
        turn = only
    else:
        turn = code_value(coder, TURNS + min(length, 15) + 16 * (size > 0), turn)
        if not 0 <= turn < 2 * length or not _fits(front, cell, same, size, turn):
            return -1
    for i in range(length):
        cell.face[i] = _turned(front, same, turn, i)
    _close_face(front, same)
    return int(length)


@compiled
def _code_new_face(
    coder: SerialCoder,
    front: Open,
    cell: Cell,
    place: tuple[int, int, int, int, int],
    wanted: Int64,
    renamed: tuple[Int64, Int64],
    memory: tuple[Int64, Int64],
) -> int:
    """Code the corners of a face that no cell before has; as of `_code_face`."""
    slot, left, size, _, room = place
    is_free = size == 0
    if is_free:
        size = code_value(coder, SIZES + 2 * (slot > 0) + (left == 0), len(wanted))
        if not 3 <= size <= room:
            return -1
        for i in range(size):
            cell.face[i] = -1
    cell.about[2] = size
    for i in range(size):
        if cell.face[i] >= 0:
            continue
        if front.counts[2] > front.counts[3]:
            return -1
        target = wanted[i] if coder.encodes else -1
        found = _code_point(coder, front, cell, i, target, renamed, memory)
        if found < 0:
            return -1
        cell.face[i] = found
    _open_face(front, cell.face, 0, size)
    return int(size)


@compiled
def _code_point(
    coder: SerialCoder, front: Open, cell: Cell, i: int, wanted: int, renamed: tuple[Int64, Int64], memory: tuple[Int64, Int64]
) -> int:
    """Code corner ``i`` of a new face; -1 if there is no such point."""
    candidates, votes = memory
    names = renamed[0]
    size, n = cell.about[2], 0
    if i == 0:
        n = _near_points(front, cell, -1, candidates, votes, n)
    for k in range(2):
        at = cell.face[(i + size - 1) % size if k == 0 else (i + 1) % size]
        if at >= 0:
            n = _near_points(front, cell, at, candidates, votes, n)
    sort_votes(candidates, votes, n)
    value = 0
    if coder.encodes and names[wanted] >= 0:
        value = n + 1
        for k in range(n):
            if candidates[k] == names[wanted]:
                value = k + 1
                break
    best = min(votes[0], 15) if n else 0
    value = code_value(coder, POINTS + (min(i, 3) * 2 + (n > 1)) * 16 + best, value)
    if value == 0:
        return _new_point(front, wanted, renamed)
    if 0 < value <= n:
        return int(candidates[value - 1])
    number = code_value(coder, OTHER_POINTS, front.counts[1] - 1 - names[wanted] if coder.encodes else 0)
    number = front.counts[1] - 1 - number
    return int(number) if 0 <= number < front.counts[1] else -1


@compiled
def _code_rest(coder: SerialCoder, front: Open, wanted: int, renamed: tuple[Int64, Int64]) -> int:
    """Code a node that no face has; -1 if there is no such point."""
    known = 0
    if coder.encodes and renamed[0][wanted] >= 0:
        known = front.counts[1] - renamed[0][wanted]
    value = code_value(coder, REST, known)
    if value == 0:
        return _new_point(front, wanted, renamed)
    number = front.counts[1] - value
    return int(number) if 0 <= number < front.counts[1] else -1


@compiled
def _new_point(front: Open, wanted: int, renamed: tuple[Int64, Int64]) -> int:
    names, points = renamed
    number = front.counts[1]
    if number >= len(points):
        return -1
    front.counts[1] += 1
    if wanted >= 0:
        names[wanted], points[number] = number, wanted
    return int(number)


@compiled
def _near_faces(front: Open, cell: Cell, size: int, candidates: Int64, votes: Int64) -> int:
    """Open faces at edges that one face of the cell has, by how many of these; those of ``size`` corners, or all if 0."""
    n = 0
    for e in range(cell.about[0]):
        front.counts[2] += 1
        if cell.uses[e] != 1:
            continue
        a, b = cell.ends[e, 0], cell.ends[e, 1]
        here = front.heads[a]
        while here >= 0 and front.counts[2] <= front.counts[3]:
            front.counts[2] += 1
            g, at, here = front.owners[here], here, front.nexts[here]
            start, length = front.starts[g], front.starts[g + 1] - front.starts[g]
            after = front.nodes[start + (at - start + 1) % length]
            before = front.nodes[start + (at - start + length - 1) % length]
            if (after != b and before != b) or (size and (length != size or _count_turns(front, cell, g, size)[0] == 0)):
                continue
            n = vote(g, 1, candidates, votes, n)
    sort_votes(candidates, votes, n)
    return n


@compiled
def _near_points(front: Open, cell: Cell, at: int, candidates: Int64, votes: Int64, n: int) -> int:
    """Points that may follow ``at`` around a face: along edges of the cell, and of open faces; -1: ends of the cell's edges."""
    long = cell.about[2] >> 6  # a vote looks at all corners of the face
    for e in range(cell.about[0]):
        front.counts[2] += 1
        if cell.uses[e] != 1:
            continue
        a, b = cell.ends[e, 0], cell.ends[e, 1]
        front.counts[2] += long
        if at < 0:
            n = _vote_point(cell, b, 1, candidates, votes, _vote_point(cell, a, 1, candidates, votes, n))
        elif at == a:
            n = _vote_point(cell, b, 8, candidates, votes, n)
        elif at == b:
            n = _vote_point(cell, a, 8, candidates, votes, n)
    if at < 0:
        return n
    here = front.heads[at]
    while here >= 0 and front.counts[2] <= front.counts[3]:
        front.counts[2] += 1 + long
        g, corner, here = front.owners[here], here, front.nexts[here]
        start, length = front.starts[g], front.starts[g + 1] - front.starts[g]
        for step in (1, length - 1):
            other = front.nodes[start + (corner - start + step) % length]
            n = _vote_point(cell, other, 2 if cell.marks[other] == cell.about[1] else 1, candidates, votes, n)
    return n


@compiled
def _vote_point(cell: Cell, point: int, count: int, candidates: Int64, votes: Int64, n: int) -> int:
    for i in range(cell.about[2]):
        if cell.face[i] == point:
            return n
    return vote(point, count, candidates, votes, n)


@compiled
def _turned(front: Open, g: int, turn: int, i: int) -> int:
    """Corner ``i`` of an open face that is turned by ``turn >> 1``, and mirrored if that is odd."""
    start, length = front.starts[g], front.starts[g + 1] - front.starts[g]
    step = length - i if turn & 1 else i
    return int(front.nodes[start + ((turn >> 1) + step) % length])


@compiled
def _fits(front: Open, cell: Cell, g: int, size: int, turn: int) -> bool:
    """Whether an open face so turned has the corners that are known."""
    fits = True
    for i in range(size):
        fits &= cell.face[i] < 0 or cell.face[i] == _turned(front, g, turn, i)
    return bool(fits)


@compiled
def _count_turns(front: Open, cell: Cell, g: int, size: int) -> tuple[int, int]:
    """How many turns fit, and the last of them; all do if no corners are known."""
    length = front.starts[g + 1] - front.starts[g]
    if size == 0:
        return 2 * int(length), 0
    count, last = 0, 0
    for turn in range(2 * length):
        if _fits(front, cell, g, size, turn):
            count, last = count + 1, turn
    front.counts[2] += length
    return count, last


@compiled
def _turn_of(front: Open, cell: Cell, g: int, size: int, wanted: Int64, names: Int64) -> int:
    """The turn in which an open face is the source's; -1 for none."""
    for turn in range(2 * len(wanted)):
        is_same = True
        for i in range(len(wanted)):
            is_same &= names[wanted[i]] == _turned(front, g, turn, i)
        if is_same:
            return turn
    return -1


@compiled
def _find_source(front: Open, wanted: Int64, names: Int64) -> int:
    """The open face with the source's corners; -1 for none."""
    renamed = np.zeros(len(wanted), np.int64)
    for i in range(len(wanted)):
        renamed[i] = names[wanted[i]]
        if renamed[i] < 0:
            return -1
    return _find_open(front, renamed, len(wanted))


@compiled
def _find_open(front: Open, nodes: Int64, size: int) -> int:
    """The open face with these corners, in any order, opened last; -1 for none."""
    here = front.heads[nodes[0]]
    while here >= 0 and front.counts[2] <= front.counts[3]:
        front.counts[2] += 1
        g, here = front.owners[here], front.nexts[here]
        start = front.starts[g]
        if front.starts[g + 1] - start != size:
            continue
        n_same = 0
        for i in range(size):
            for k in range(size):
                if front.nodes[start + k] == nodes[i]:
                    n_same += 1
                    break
            front.counts[2] += 1
            if n_same <= i:
                break
        if n_same == size:
            return int(g)
    return -1


@compiled
def _open_face(front: Open, nodes: Int64, first: int, size: int) -> None:
    g = front.counts[0]
    front.counts[0] += 1
    start = front.starts[g]
    front.starts[g + 1], front.is_open[g] = start + size, 1
    for i in range(size):
        point = nodes[first + i]
        front.nodes[start + i], front.owners[start + i] = point, g
        front.nexts[start + i] = front.heads[point]
        front.heads[point] = start + i


@compiled
def _close_face(front: Open, g: int) -> None:
    front.is_open[g] = 0
    for entry in range(front.starts[g], front.starts[g + 1]):
        at = front.nodes[entry]
        before, here = -1, front.heads[at]
        while here != entry:
            before, here = here, front.nexts[here]
            front.counts[2] += 1
        if before < 0:
            front.heads[at] = front.nexts[entry]
        else:
            front.nexts[before] = front.nexts[entry]


@compiled
def _count_edge(front: Open, cell: Cell, a: int, b: int) -> None:
    """Count a face of the cell at one of its edges."""
    low, high = min(a, b), max(a, b)
    n = cell.about[0]
    for e in range(n):
        front.counts[2] += 1
        if cell.ends[e, 0] == low and cell.ends[e, 1] == high:
            cell.uses[e] += 1
            return
    cell.ends[n, 0], cell.ends[n, 1], cell.uses[n] = low, high, 1
    cell.about[0] += 1
