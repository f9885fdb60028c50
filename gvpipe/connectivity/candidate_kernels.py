"""Kernel of `gvpipe.connectivity.candidate_order`: which of a few candidates each vertex is, coded.

*Candidates* for the next vertex are not visited yet. Each is a neighbour of one of the last three vertices, or of a vertex
visited just before or after one of their neighbours. So rows of a grid, rings of a tube and corners of a triangle have their
successor among them. The *relations* of a candidate are bits, one for each way in which it was found. Candidates are tried in
the order of how often their relations were right, each by one decision. The contexts of a decision:

0. the relations;
1. these, how many candidates before have them, too (the *kind*), and the last kind that was right;
2. relations to the vertex before alone, and how many neighbours of the candidate are visited, how many are not;
3. all relations, and the same;
4. whether the kind is the expected one, how long a repetition has been right, and how many candidates were tried;
5. the kind, and the last three that were right;
6. relations to the vertex before alone, and the last kind that was right.

A vertex that is no candidate is coded by its rank in the search of `gvpipe.connectivity.vertex_order`, which leaves candidates
out. If that does not find it, it is a neighbour of an *open* vertex, one with neighbours not visited, counted from the newest.
Else it is an index among the vertices left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.order_kernels import code_index
from gvpipe.connectivity.visit_kernels import NeighbourLists, search_visits
from gvpipe.entropy.decision_kernels import SEEN_BITS, Mixing, code_decision
from gvpipe.entropy.number_kernels import SLOT_BITS, code_number, mix_hash
from gvpipe.foundation.arrays import Bool, Int32, Int64, UInt8, UInt32
from gvpipe.runtime.compiled import compiled, inlined

N_CONTEXTS = 7  # of a choice
N_GROUPS = 5  # of mixers of choices: no repetition; a short or a long one, which expects this kind or does not
NUMBER_CONTEXTS = 4
RANKS, AGES = 0, 1  # groups of mixers of numbers
NUMBER_GROUPS = 2
LATEST = 3  # vertices whose surroundings have candidates
STEPS = (1, 0, -1, 2, -2, 3)  # visits from that of a neighbour on; of the newest vertex
FEW_STEPS = 3  # of these, of the others
MOST = 40  # candidates
PLACE_BITS = 6  # of their places
LAST_PLACE = (1 << PLACE_BITS) - 1
HUB = 24  # neighbours; vertices with more are never open, so that they cost nothing
OLDEST = 256  # open vertices counted
MATCHED = 6  # kinds that a repetition must have had alike before it counts
MAX_RUN, LONG_RUN = 15, 8


class Front(NamedTuple):
    """The vertices visited so far, of V; all but ``visited`` int32.

    Args:
        visited: ``(V,)``.
        times: ``(V,)`` when each was visited; -1: not yet.
        around: ``(V,)`` visited neighbours of each vertex.
        unvisited: ``(E,)`` the other neighbours in their order, from where the lists of all begin; of hubs, no matter what.
        n_open: ``(V,)`` by time of a visit: neighbours not visited, 0 for a hub.
        older, newer: ``(V + 1,)`` by time: the open visit before and after it; V stands for both ends.
        left, position: ``(V,)`` the vertices not visited, in the order that removals by swapping leave; of each in that order.
    """

    visited: Bool
    times: Int32
    around: Int32
    unvisited: Int32
    n_open: Int32
    older: Int32
    newer: Int32
    left: Int32
    position: Int32


class Candidates(NamedTuple):
    """Candidates for one vertex, in the order in which they were found; all but ``keys`` and ``tried`` int32.

    Args:
        vertices, relations: ``(MOST,)``.
        keys: ``(MOST,)`` int64: the chance of the relations, and a place, the first highest; -1 of a candidate that was tried.
        tried: ``(MOST,)`` int64: the keys of those that were tried, in that order.
        places: ``(V,)`` of a vertex among candidates; -1: none.
        sources: ``(S,)`` times of visits whose neighbours are candidates, in the order in which they were found.
        marks: ``(V,)`` by time of a visit: relations that its neighbours have, 0 for no source.
        around: ``(HUB,)`` memory for times of neighbours.
    """

    vertices: Int32
    relations: Int32
    keys: Int64
    tried: Int64
    places: Int32
    sources: Int32
    marks: Int32
    around: Int32


class Others(NamedTuple):
    """How vertices that are no candidates are coded.

    Args:
        reach: vertices that a search looks at.
        search: of `search_visits`.
        numbers: of `new_number_mixing`, for `NUMBER_CONTEXTS` and `NUMBER_GROUPS`.
        contexts: ``(NUMBER_CONTEXTS,)`` memory.
        last: the last two ranks plus 1, 0 for "not found", the newest first; the last age.
    """

    reach: int
    search: tuple[Bool, Int64, Int64]
    numbers: Mixing
    contexts: Int64
    last: Int64


class Coder(NamedTuple):
    """A range coder, as of `code_number`, and what is coded.

    Args:
        state, data, decoding: of the coder.
        wanted: ``(1,)`` the vertex to be coded; -1 for a decoder.
    """

    state: Int64
    data: UInt8
    decoding: bool
    wanted: Int64


@compiled
def code_by_candidates(
    lists: NeighbourLists,
    points: Int64,
    reach: int,
    choices: Mixing,
    numbers: Mixing,
    state: Int64,
    data: UInt8,
    decoding: bool,
    visits: Int64,
) -> bool:
    """Code ``visits (V,)``, or fill them; False where a number names no vertex.

    Args:
        lists: neighbours of the vertices.
        points: ``(V,)`` the point of each vertex.
        reach: vertices that a search looks at.
        choices: of `new_number_mixing`, for `N_CONTEXTS` and `N_GROUPS`.
        numbers: of `new_number_mixing`, for `NUMBER_CONTEXTS` and `NUMBER_GROUPS`.
        state, data, decoding: as of `code_number`.
        visits: the codec's vertex of each vertex of the user's.
    """
    n = len(visits)
    count, time, number = np.zeros(n, np.int32), np.full(n + 1, n, np.int32), np.arange(n).astype(np.int32)
    front = Front(
        np.zeros(n, np.bool_),
        np.full(n, -1, np.int32),
        count,
        lists.neighbours.copy(),
        count.copy(),
        time,
        time.copy(),
        number,
        number.copy(),
    )
    n_sources = LATEST + HUB * (len(STEPS) + (LATEST - 1) * FEW_STEPS)
    candidates = Candidates(
        np.zeros(MOST, np.int32),
        np.zeros(MOST, np.int32),
        np.zeros(MOST, np.int64),
        np.zeros(MOST, np.int64),
        np.full(n, -1, np.int32),
        np.zeros(n_sources, np.int32),
        np.zeros(n, np.int32),
        np.zeros(HUB, np.int32),
    )
    search = front.visited, np.full(n, -1, np.int64), np.empty(min(reach, n) + 1, np.int64)
    others = Others(reach, search, numbers, np.empty(NUMBER_CONTEXTS, np.int64), np.zeros(3, np.int64))
    coder = Coder(state, data, decoding, np.full(1, -1, np.int64))
    return _code(lists, points, visits, front, candidates, choices, others, coder)


@compiled
def _code(
    lists: NeighbourLists,
    points: Int64,
    visits: Int64,
    front: Front,
    candidates: Candidates,
    choices: Mixing,
    others: Others,
    coder: Coder,
) -> bool:
    """As `code_by_candidates`."""
    n = len(visits)
    kinds, latest = np.zeros(n + MATCHED, np.int64), np.full(1 << SLOT_BITS, -1, np.int32)
    contexts = np.empty(N_CONTEXTS, np.uint32)
    first_left, match, run = 0, -1, 0
    for v in range(n):
        row = v + MATCHED
        if not coder.decoding:
            coder.wanted[0] = visits[v]
        count = _find(lists, points, visits, v, front, candidates)
        expected = kinds[match] if match >= 0 else -1
        history = (kinds[row - 1], kinds[row - 2], kinds[row - 3], expected, run)
        chosen, kind = _choose(lists, front.around, candidates, count, history, choices, contexts, coder)
        if chosen >= 0:
            target = candidates.vertices[chosen]
        else:
            target = _code_other(
                lists, visits, v, first_left, front, candidates.vertices[:count], kinds[row - 1], others, coder
            )
            if target < 0:
                return False
        for i in range(count):
            candidates.places[candidates.vertices[i]] = -1
            candidates.relations[i] = 0
        visits[v] = target
        _visit(lists, target, v, front)
        while first_left < n and front.visited[first_left]:
            first_left += 1
        kinds[row] = kind
        if match >= 0 and expected == kind:
            match, run = match + 1, min(run + 1, MAX_RUN)
        else:
            match, run = -1, 0
        key = 0
        for k in range(MATCHED):
            key = mix_hash(key, kinds[row - k])
        place = key >> (32 - SLOT_BITS)
        if match < 0 and latest[place] >= 0:
            match = latest[place] + 1
        latest[place] = row
    return True


@compiled
def _find(lists: NeighbourLists, points: Int64, visits: Int64, v: int, front: Front, candidates: Candidates) -> int:
    """Fill the candidates for vertex v, and return how many there are.

    A visit is found in several ways. So all relations of its neighbours are known before they are looked at, once.
    """
    n_sources = 0
    for back in range(1, min(LATEST, v) + 1):
        begin, end = lists.starts[visits[v - back]], lists.starts[visits[v - back] + 1]
        if end - begin > HUB:
            continue
        shift, n_around = 8 * (back - 1), 0
        n_sources = _mark(candidates, n_sources, v - back, 1 << shift)
        for k in range(begin, end):
            time = front.times[lists.neighbours[k]]
            candidates.around[n_around] = time
            n_around += 1 if time >= 0 else 0
        for j in range(len(STEPS) if back == 1 else FEW_STEPS):
            for k in range(n_around):
                time = candidates.around[k] + STEPS[j]
                if 0 <= time < v - 1:
                    n_sources = _mark(candidates, n_sources, time, 4 << (shift + j))
    count = 0
    for i in range(n_sources):
        time = candidates.sources[i]
        begin, relation = lists.starts[visits[time]], candidates.marks[time]
        candidates.marks[time] = 0
        for k in range(begin, begin + front.n_open[time]):
            count = _add(candidates, count, front.unvisited[k], relation)
    for back in range(1, min(LATEST, v) + 1):
        near = visits[v - back]
        for k in range(lists.starts[near], lists.starts[near] + front.n_open[v - back]):
            y = front.unvisited[k]
            if points[y] == points[near] and candidates.places[y] >= 0:
                candidates.relations[candidates.places[y]] |= 2 << (8 * (back - 1))
    return count


@inlined
def _mark(candidates: Candidates, n_sources: int, time: int, relation: int) -> int:
    """Note a relation of a visit's neighbours; return how many sources there are then."""
    before = candidates.marks[time]
    candidates.marks[time] = before | relation
    candidates.sources[n_sources] = time
    return n_sources + (1 if before == 0 else 0)


@inlined
def _add(candidates: Candidates, count: int, y: int, relation: int) -> int:
    """Note relations of vertex y; return how many candidates there are then."""
    known = candidates.places[y]
    if known < 0 and count == MOST:
        return count
    place = known if known >= 0 else count
    candidates.vertices[place], candidates.places[y] = y, place
    candidates.relations[place] |= relation
    return count + (1 if known < 0 else 0)


@compiled
def _choose(
    lists: NeighbourLists,
    around: Int32,
    candidates: Candidates,
    count: int,
    history: tuple[int, int, int, int, int],
    choices: Mixing,
    slots: UInt32,
    coder: Coder,
) -> tuple[int, int]:
    """Code which candidate it is; return its place and its kind, -1 and 0 if it is none.

    ``history``: the last three kinds, the newest first; the expected one; how long the repetition is.
    """
    before, second, third, expected, run = history
    state, data, decoding, wanted = coder.state, coder.data, coder.decoding, coder.wanted[0]
    longer = mix_hash(mix_hash(before, second), third)
    for i in range(count):
        slot = mix_hash(1, candidates.relations[i]) >> (32 - SLOT_BITS)
        candidates.keys[i] = np.int64(choices.chances[0, slot] >> SEEN_BITS) << PLACE_BITS | (LAST_PLACE - i)
    for i in range(count):
        highest = candidates.keys[0]
        for j in range(1, count):
            highest = max(highest, candidates.keys[j])
        place = LAST_PLACE - (highest & LAST_PLACE)
        candidates.keys[place] = -1
        y, relation = candidates.vertices[place], candidates.relations[place]
        alike, j = 0, i - 1  # those with the same relations have the same chance
        while j >= 0 and candidates.tried[j] >> PLACE_BITS == highest >> PLACE_BITS:
            alike += 1 if candidates.relations[LAST_PLACE - (candidates.tried[j] & LAST_PLACE)] == relation else 0
            j -= 1
        candidates.tried[i] = highest
        kind = mix_hash(mix_hash(8, relation), alike)
        is_expected = 1 if kind == expected else 0
        shape = 8 * min(around[y], 7) + min(lists.starts[y + 1] - lists.starts[y] - around[y], 7)
        slots[0] = mix_hash(1, relation)
        slots[1] = mix_hash(mix_hash(2, kind), before)
        slots[2] = mix_hash(mix_hash(3, relation & 15), shape)
        slots[3] = mix_hash(mix_hash(4, relation), shape)
        slots[4] = mix_hash(mix_hash(5, is_expected), 32 * run + min(i, 31))
        slots[5] = mix_hash(mix_hash(6, kind), longer)
        slots[6] = mix_hash(mix_hash(7, relation & 15), before)
        for k in range(N_CONTEXTS):
            slots[k] >>= 32 - SLOT_BITS
        group = 0 if expected < 0 else 1 + is_expected if run < LONG_RUN else 3 + is_expected
        if code_decision(choices, slots, N_GROUPS * (relation & 3) + group, state, data, decoding, 1 if y == wanted else 0):
            return place, kind
    return -1, 0


@compiled
def _code_other(
    lists: NeighbourLists,
    visits: Int64,
    v: int,
    first_left: int,
    front: Front,
    tried: Int32,
    before: int,
    others: Others,
    coder: Coder,
) -> int:
    """Code vertex v, none of the candidates ``tried``; return it, -1 if there is none. ``before``: the last kind."""
    contexts, last = others.contexts, others.last
    contexts[0], contexts[1] = mix_hash(1, min(len(tried), 3)), mix_hash(2, before)
    contexts[2], contexts[3] = mix_hash(3, last[0]), mix_hash(mix_hash(4, last[0]), last[1])
    for y in tried:
        front.visited[y] = True
    rank, target = 0, -1
    if not coder.decoding:
        target = coder.wanted[0]
        rank = 1 + search_visits(lists, others.reach, v, others.search, visits, first_left, target, -1)[0]
    rank = code_number(others.numbers, contexts, RANKS, coder.state, coder.data, coder.decoding, False, rank)
    if coder.decoding and 0 < rank <= others.reach:
        target = search_visits(lists, others.reach, v, others.search, visits, first_left, -1, rank - 1)[1]
    for y in tried:
        front.visited[y] = False
    last[1], last[0] = last[0], rank
    if rank > 0:
        return target
    contexts[0], contexts[1] = 5, mix_hash(6, before)
    contexts[2], contexts[3] = mix_hash(7, _length(last[2])), 8
    age = 0 if coder.decoding else _age(lists, target, front)
    age = code_number(others.numbers, contexts, AGES, coder.state, coder.data, coder.decoding, False, age)
    last[2] = age
    if age == 0:
        place = 0 if coder.decoding else front.position[target]
        return int(front.left[code_index(coder.state, coder.data, coder.decoding, place, len(visits) - v)])
    if age > OLDEST:
        return -1
    time = len(visits)
    for _ in range(age):
        time = front.older[time]
        if time == len(visits):
            return -1
    return _code_neighbour(lists, visits[time], front, front.n_open[time], target, coder)


@compiled
def _age(lists: NeighbourLists, target: int, front: Front) -> int:
    """How many open vertices, up to `OLDEST`, are at least as new as the newest open neighbour; 0: there is none, or more."""
    newest = -1
    for k in range(lists.starts[target], lists.starts[target + 1]):
        time = front.times[lists.neighbours[k]]
        if time > newest and front.n_open[time] > 0:
            newest = time
    if newest < 0:
        return 0
    time, age = front.older[len(front.times)], 1
    while time != newest:
        if age == OLDEST:
            return 0
        time, age = front.older[time], age + 1
    return age


@compiled
def _code_neighbour(lists: NeighbourLists, near: int, front: Front, count: int, target: int, coder: Coder) -> int:
    """Code which of the ``count`` neighbours of vertex ``near`` that are not visited it is, and return it."""
    begin, place = lists.starts[near], 0
    if not coder.decoding:
        while place + 1 < count and front.unvisited[begin + place] != target:
            place += 1
    return int(front.unvisited[begin + code_index(coder.state, coder.data, coder.decoding, place, count)])


@compiled
def _visit(lists: NeighbourLists, target: int, v: int, front: Front) -> None:
    """Visit a vertex at time v."""
    n = len(front.times)
    begin, end = lists.starts[target], lists.starts[target + 1]
    for k in range(begin, end):
        y = lists.neighbours[k]
        _remove(lists, target, y, front)
        front.around[y] += 1
        time = front.times[y]
        if time >= 0 and front.n_open[time] > 0:
            front.n_open[time] -= 1
            if front.n_open[time] == 0:
                older, newer = front.older[time], front.newer[time]
                front.newer[older], front.older[newer] = newer, older
    front.visited[target], front.times[target] = True, v
    if end - begin <= HUB and front.around[target] < end - begin:
        front.n_open[v] = end - begin - front.around[target]
        newest = front.older[n]
        front.older[v], front.newer[v], front.newer[newest], front.older[n] = newest, n, v, v
    last = front.left[n - 1 - v]
    front.left[front.position[target]], front.position[last] = last, front.position[target]


@inlined
def _remove(lists: NeighbourLists, target: int, y: int, front: Front) -> None:
    """Take a vertex out of the list of neighbours of y that are not visited."""
    begin, end = lists.starts[y], lists.starts[y + 1]
    if end - begin <= HUB:
        place = begin
        for k in range(begin, end - front.around[y]):
            front.unvisited[place] = front.unvisited[k]
            place += 0 if front.unvisited[k] == target else 1


@compiled
def _length(number: int) -> int:
    """How many bits a number has."""
    length = 0
    while number >> length:
        length += 1
    return length
