"""Kernel of `gvpipe.connectivity.adaptive_order`: the rank of each vertex in a search from the vertex before it, coded.

The search is that of `gvpipe.connectivity.vertex_order`: breadth first, nearest first, over unvisited vertices. A number is
0 for "not found", else the rank plus 1. The contexts of a number (the *candidates* are the unvisited neighbours of the vertex
before, in the order of the search; rank 0 is the first of them):

0. how many candidates there are, and which of the first three are neighbours of the vertex before the last, too;
1. how many candidates there are, and how many visited neighbours the first three have, up to 3;
2. the last number, and which of the first three candidates are at the vertex' own point;
3. to 5. the last two, three and six numbers;
6. the number that followed when the last numbers were these before, and for how many it was right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.connectivity.visit_kernels import NeighbourLists, search_visits
from gvpipe.entropy.decision_kernels import Mixing, put, take
from gvpipe.entropy.number_kernels import code_number, mix_hash
from gvpipe.foundation.arrays import Bool, Int64, UInt8
from gvpipe.runtime.compiled import compiled

N_CONTEXTS = 7
N_GROUPS = 3  # by how long a repetition has been right
LOOKED_AT = 3  # candidates
MATCHED = 6  # numbers that a repetition must have had alike before it counts
MATCH_BITS = 16
MAX_RUN = 15
LONG_RUN = 8


class Memory(NamedTuple):
    """What coding of V vertices keeps; int64 but for who was visited.

    Args:
        search: of `search_visits`.
        around: ``(V,)`` visited neighbours of each vertex.
        left, position: ``(V,)`` the vertices not visited, in the order that removals by swapping leave; of each in that order.
        numbers: ``(MATCHED + V,)`` coded, behind zeros.
        latest: ``(2**MATCH_BITS,)`` by the last numbers, hashed, where they were last.
        contexts: ``(N_CONTEXTS,)``.
    """

    search: tuple[Bool, Int64, Int64]
    around: Int64
    left: Int64
    position: Int64
    numbers: Int64
    latest: Int64
    contexts: Int64


@compiled
def code_visits(
    lists: NeighbourLists, points: Int64, reach: int, mixing: Mixing, state: Int64, data: UInt8, decoding: bool, visits: Int64
) -> bool:
    """Code ``visits (V,)``, or fill them; False where a number names no vertex.

    Args:
        lists: neighbours of the vertices.
        points: ``(V,)`` the point of each vertex.
        reach: vertices that a search looks at.
        mixing, state, data, decoding: as of `code_number`.
        visits: the codec's vertex of each vertex of the user's.
    """
    n = len(visits)
    seen_by, queue = np.full(n, -1, np.int64), np.empty(min(reach, n) + 1, np.int64)
    memory = Memory(
        (np.zeros(n, np.bool_), seen_by, queue),
        np.zeros(n, np.int64),
        np.arange(n),
        np.arange(n),
        np.zeros(n + MATCHED, np.int64),
        np.full(1 << MATCH_BITS, -1, np.int64),
        np.empty(N_CONTEXTS, np.int64),
    )
    return _code(lists, points, reach, mixing, state, data, decoding, visits, memory)


@compiled
def _code(
    lists: NeighbourLists,
    points: Int64,
    reach: int,
    mixing: Mixing,
    state: Int64,
    data: UInt8,
    decoding: bool,
    visits: Int64,
    memory: Memory,
) -> bool:
    """As `code_visits`."""
    n_vertices = len(visits)
    search, around, left, position, numbers, latest, contexts = memory
    visited = search[0]
    first_left, match, run = 0, -1, 0
    for v in range(n_vertices):
        row = v + MATCHED
        _find_contexts(lists, points, visits, v, (visited, around), contexts)
        _add_history(numbers, row, contexts)
        contexts[6] = mix_hash(numbers[match] if match >= 0 else -1, run)
        number = 0
        if not decoding:
            number = 1 + search_visits(lists, reach, v, search, visits, first_left, visits[v], -1)[0]
        group = 0 if match < 0 else 1 if run < LONG_RUN else 2
        number = code_number(mixing, contexts, group, state, data, decoding, False, number)
        target = visits[v]
        if number == 0:
            place = code_index(state, data, decoding, position[target] if not decoding else 0, n_vertices - v)
            target = left[place]
        elif decoding:
            if number > reach:
                return False
            target = search_visits(lists, reach, v, search, visits, first_left, -1, number - 1)[1]
            if target < 0:
                return False
        visits[v] = target
        visited[target] = True
        for k in range(lists.starts[target], lists.starts[target + 1]):
            around[lists.neighbours[k]] += 1
        numbers[row] = number
        if match >= 0 and numbers[match] == number:
            match, run = match + 1, min(run + 1, MAX_RUN)
        else:
            match, run = -1, 0
        key = 0
        for k in range(MATCHED):
            key = mix_hash(key, numbers[row - k])
        place = key >> (32 - MATCH_BITS)
        if match < 0 and latest[place] >= 0:
            match = latest[place] + 1
        latest[place] = row
        last = left[n_vertices - 1 - v]
        left[position[target]], position[last] = last, position[target]
        while first_left < n_vertices and visited[first_left]:
            first_left += 1
    return True


@compiled
def _find_contexts(
    lists: NeighbourLists, points: Int64, visits: Int64, v: int, memory: tuple[Bool, Int64], contexts: Int64
) -> None:
    """Fill the first three contexts of vertex v."""
    visited, around = memory
    count, shared, crowded, twins = 0, 0, 0, 0
    if v > 0:
        before = visits[v - 1]
        for k in range(lists.starts[before], lists.starts[before + 1]):
            y = lists.neighbours[k]
            if visited[y]:
                continue
            if count < LOOKED_AT:
                is_shared = 0
                if v > 1:  # its list, not that of y: each vertex is the last but one once, so that hubs cost nothing
                    last = visits[v - 2]
                    for j in range(lists.starts[last], lists.starts[last + 1]):
                        if lists.neighbours[j] == y:
                            is_shared = 1
                            break
                shared = 2 * shared + is_shared
                crowded = 4 * crowded + min(around[y], 3)
                twins = 2 * twins + (1 if points[y] == points[before] else 0)
            count = min(count + 1, 8)
    contexts[0] = mix_hash(1 + count, shared)
    contexts[1] = mix_hash(11 + count, crowded)
    contexts[2] = mix_hash(21 + min(count, 3), twins)


@compiled
def _add_history(numbers: Int64, row: int, contexts: Int64) -> None:
    """Fill the contexts of numbers before the one at ``row``."""
    key = 0
    for k in range(1, MATCHED + 1):
        key = mix_hash(key, numbers[row - k])
        if k == 1:
            contexts[2] = mix_hash(contexts[2], key)
        elif k == 2:
            contexts[3] = key
        elif k == 3:
            contexts[4] = key
    contexts[5] = key


@compiled
def code_index(state: Int64, data: UInt8, decoding: bool, index: int, n: int) -> int:
    """Code an index, 0..n-1, all alike: halves of what is left."""
    low, high = 0, n
    while high - low > 1:
        middle = (low + high) >> 1
        chance = ((high - middle) << 16) // (high - low)
        if decoding:
            bit = take(state, data, chance)
        else:
            bit = 1 if index >= middle else 0
            put(state, data, chance, bit)
        if bit:
            low = middle
        else:
            high = middle
    return low
