"""Kernels: in which order the unknowns of a sparse symmetric system are eliminated, and what its factor will cost.

Eliminating an unknown couples all its neighbours with each other. The minimum-degree heuristic takes the unknown with the
fewest neighbours next. The graph is kept as a *quotient graph*: an eliminated unknown becomes an element, the list of the
unknowns that it coupled. Unknowns with the same neighbours become one, of a weight. Degrees are upper bounds, which are cheap.
Everything is an integer, so that encoder and decoder, and every machine, find one order.

The factor's size follows from the weights of the elements. So a search stops as soon as a limit is passed, before
anything is factored.

Source: Amestoy, Davis and Duff, "An approximate minimum degree ordering algorithm", 1996, for bounds of degrees and elements.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Int32, Int64
from gvpipe.mesh.sorting_kernels import sort_numbers, sort_order
from gvpipe.runtime.compiled import compiled

NONE = -1


class QuotientGraph(NamedTuple):
    """Unknowns and elements, both numbered 0..n-1; an element has the number of the unknown that made it.

    Args:
        start: ``(n,)`` where the list of an unknown or element begins.
        n_elements: ``(n,)`` elements of an unknown, first in its list.
        size: ``(n,)`` length of the list: elements and unknowns of an unknown, unknowns of an element.
        weight: ``(n,)`` how many unknowns it stands for; 0 where it stands for none any more.
        degree: ``(n,)`` of an unknown: a bound of its neighbours' weight; of an element: its own, or 0.
        parent: ``(n,)`` the unknown that it is eliminated with, or NONE.
        outside: ``(n,)`` of an element: weight that the present element lacks, if ``seen`` is the present stamp.
        seen, mark, tag: ``(n,)`` stamps.
        head: ``(n + 1,)`` first unknown of each degree; after, before: ``(n,)`` its chain.
    """

    start: Int64
    n_elements: Int64
    size: Int64
    weight: Int64
    degree: Int64
    parent: Int64
    outside: Int64
    seen: Int64
    mark: Int64
    tag: Int64
    head: Int64
    after: Int64
    before: Int64


@compiled
def order_unknowns(starts: Int64, columns: Int32, most_products: int, most_steps: int) -> tuple[Int32, int, int, int]:
    """Return an order of elimination ``(n,)``, the most entries (below its diagonal) and products of the factor, and steps.

    A search that passes a limit ends there; the order is then empty, and the numbers are those so far.

    Args:
        starts, columns: the matrix' pattern by rows, symmetric, with or without the diagonal.
        most_products: the limit of products.
        most_steps: the limit of steps: lengths of the lists that the search goes through. A hub's is long, and comes often.
    """
    n = len(starts) - 1
    graph, lists, end = _open_graph(starts, columns)
    pivots = np.empty(n, np.int32)
    n_pivots, n_left, lowest, entries, products, steps = 0, n, 0, 0, 0, 0
    while n_left > 0:
        while graph.head[lowest] == NONE:
            lowest += 1
        pivot = graph.head[lowest]
        _unlink(graph, pivot)
        lists = _with_room(lists, end, _bound_of_element(graph, lists, pivot))
        end = _make_element(graph, lists, pivot, end)
        for k in range(graph.start[pivot], end):
            steps += graph.size[lists[k]]
        if steps > most_steps:
            return np.empty(0, np.int32), entries, products, steps
        _compare_elements(graph, lists, pivot, n_pivots)
        _update_unknowns(graph, lists, pivot)
        _join_alike(graph, lists, pivot, n_pivots)
        lowest = min(lowest, _close_element(graph, lists, pivot, n_left))
        weight, degree = graph.weight[pivot], graph.degree[pivot]
        for k in range(weight):
            entries += degree + k
            products += (degree + k) * (degree + k + 1) // 2
        if products > most_products:
            return np.empty(0, np.int32), entries, products, steps
        n_left -= weight
        graph.weight[pivot] = 0
        pivots[n_pivots] = pivot
        n_pivots += 1
    return _expand(pivots[:n_pivots], graph.parent), entries, products, steps


@compiled
def factor_pattern(starts: Int64, rows: Int32, n_entries: int) -> tuple[Int64, Int32]:
    """Bounds of columns ``(n + 1,)``, and rows, of the factor of a matrix.

    Args:
        starts, rows: columns of the matrix, entries below the diagonal alone.
        n_entries: of the factor, below the diagonal, at most.
    """
    n = len(starts) - 1
    bounds, found = np.zeros(n + 1, np.int64), np.empty(n_entries, np.int32)
    child, sibling = np.full(n, NONE, np.int64), np.full(n, NONE, np.int64)  # columns whose first row is a column
    mark = np.full(n, NONE, np.int64)
    end = 0
    for j in range(n):
        first = end
        mark[j] = j
        for k in range(starts[j], starts[j + 1]):
            mark[rows[k]] = j
            found[end] = rows[k]
            end += 1
        c = child[j]
        while c != NONE:
            for k in range(bounds[c] + 1, bounds[c + 1]):
                if mark[found[k]] != j:
                    mark[found[k]] = j
                    found[end] = found[k]
                    end += 1
            c = sibling[c]
        sort_numbers(found[first:end])
        if end > first:
            sibling[j] = child[found[first]]
            child[found[first]] = j
        bounds[j + 1] = end
    return bounds, found[:end]


@compiled
def _open_graph(starts: Int64, columns: Int32) -> tuple[QuotientGraph, Int32, int]:
    """The graph before the first elimination, the lists, and their end."""
    n = len(starts) - 1
    graph = QuotientGraph(
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.zeros(n, np.int64),
        np.ones(n, np.int64),
        np.zeros(n, np.int64),
        np.full(n, NONE, np.int64),
        np.zeros(n, np.int64),
        np.full(n, NONE, np.int64),
        np.full(n, NONE, np.int64),
        np.full(n, NONE, np.int64),
        np.full(n + 1, NONE, np.int64),
        np.full(n, NONE, np.int64),
        np.full(n, NONE, np.int64),
    )
    lists = np.empty(2 * len(columns) + n + 1, np.int32)
    end = 0
    for i in range(n):
        graph.start[i] = end
        for k in range(starts[i], starts[i + 1]):
            if columns[k] != i:
                lists[end] = columns[k]
                end += 1
        graph.size[i] = end - graph.start[i]
        graph.degree[i] = graph.size[i]
    for i in range(n - 1, -1, -1):
        _link(graph, i)
    return graph, lists, end


@compiled
def _bound_of_element(graph: QuotientGraph, lists: Int32, pivot: int) -> int:
    """How many unknowns the element of a pivot has at most."""
    start = graph.start[pivot]
    bound: int = graph.size[pivot]
    for k in range(start, start + graph.n_elements[pivot]):
        bound += graph.size[lists[k]]
    return bound


@compiled
def _with_room(lists: Int32, end: int, n_more: int) -> Int32:
    """The lists, or a longer copy with room for ``n_more`` after ``end``."""
    if end + n_more <= len(lists):
        return lists
    longer = np.empty(2 * (end + n_more), np.int32)
    for k in range(end):
        longer[k] = lists[k]
    return longer


@compiled
def _make_element(graph: QuotientGraph, lists: Int32, pivot: int, end: int) -> int:
    """Append the element of a pivot to the lists, absorb the pivot's elements; return the new end."""
    start, n_elements, size = graph.start[pivot], graph.n_elements[pivot], graph.size[pivot]
    first = end
    graph.mark[pivot] = pivot
    for k in range(start, start + size):
        if k >= start + n_elements:
            end = _append(graph, lists, lists[k], pivot, end)
            continue
        element = lists[k]
        for j in range(graph.start[element], graph.start[element] + graph.size[element]):
            end = _append(graph, lists, lists[j], pivot, end)
        graph.degree[element] = 0
    graph.start[pivot], graph.size[pivot] = first, end - first
    total = 0
    for k in range(first, end):
        total += graph.weight[lists[k]]
        _unlink(graph, lists[k])
    graph.degree[pivot] = total
    return end


@compiled
def _append(graph: QuotientGraph, lists: Int32, unknown: int, pivot: int, end: int) -> int:
    """Append an unknown, unless it is gone or there already; return the new end."""
    if graph.weight[unknown] == 0 or graph.mark[unknown] == pivot:
        return end
    graph.mark[unknown] = pivot
    lists[end] = unknown
    return end + 1


@compiled
def _compare_elements(graph: QuotientGraph, lists: Int32, pivot: int, stamp: int) -> None:
    """For every element that shares unknowns with the pivot's, find the weight of those that it does not share."""
    for k in range(graph.start[pivot], graph.start[pivot] + graph.size[pivot]):
        i = lists[k]
        for j in range(graph.start[i], graph.start[i] + graph.n_elements[i]):
            element = lists[j]
            if graph.degree[element] == 0:
                continue
            if graph.seen[element] != stamp:
                graph.seen[element] = stamp
                graph.outside[element] = graph.degree[element]
            graph.outside[element] -= graph.weight[i]
    for k in range(graph.start[pivot], graph.start[pivot] + graph.size[pivot]):
        i = lists[k]
        for j in range(graph.start[i], graph.start[i] + graph.n_elements[i]):
            if graph.seen[lists[j]] == stamp and graph.outside[lists[j]] == 0:
                graph.degree[lists[j]] = 0  # the pivot's element has all of it


@compiled
def _update_unknowns(graph: QuotientGraph, lists: Int32, pivot: int) -> None:
    """Put the pivot's element into the lists of its unknowns, and bound their degrees."""
    for k in range(graph.start[pivot], graph.start[pivot] + graph.size[pivot]):
        i = lists[k]
        start, n_elements, size = graph.start[i], graph.n_elements[i], graph.size[i]
        end, beside = start, 0
        for j in range(start, start + n_elements):
            if graph.degree[lists[j]] > 0:
                beside += graph.outside[lists[j]]
                lists[end] = lists[j]
                end += 1
        n_kept = end - start
        for j in range(start + n_elements, start + size):
            if graph.weight[lists[j]] > 0 and graph.mark[lists[j]] != pivot:
                beside += graph.weight[lists[j]]
                lists[end] = lists[j]
                end += 1
        # the pivot, or an element that is gone, left a place
        lists[end] = lists[start + n_kept] if end > start + n_kept else pivot
        lists[start + n_kept] = pivot
        graph.n_elements[i], graph.size[i] = n_kept + 1, end + 1 - start
        within = graph.degree[pivot] - graph.weight[i]
        graph.degree[i] = min(graph.degree[i] + within, beside + within)
        if end == start:  # it has no other neighbours: it goes with the pivot
            graph.parent[i] = pivot
            graph.weight[pivot] += graph.weight[i]
            graph.degree[pivot] -= graph.weight[i]
            graph.weight[i] = 0


@compiled
def _join_alike(graph: QuotientGraph, lists: Int32, pivot: int, stamp: int) -> None:
    """Make unknowns of the pivot's element one that have the same lists; those that may have share a key."""
    first, n = graph.start[pivot], graph.size[pivot]
    keys = np.full(n, NONE, np.int64)
    for k in range(n):
        i = lists[first + k]
        if graph.weight[i] > 0:
            keys[k] = graph.size[i]
            for j in range(graph.start[i], graph.start[i] + graph.size[i]):
                keys[k] += lists[j] * (lists[j] % 1021 + 1)
    order = sort_order(keys)
    for a in range(n):
        i = lists[first + order[a]]
        if graph.weight[i] == 0 or a + 1 == n or keys[order[a + 1]] != keys[order[a]]:
            continue
        tag = stamp * len(graph.tag) + i
        for k in range(graph.start[i], graph.start[i] + graph.size[i]):
            graph.tag[lists[k]] = tag
        for b in range(a + 1, n):
            if keys[order[b]] != keys[order[a]]:
                break
            j = lists[first + order[b]]
            if graph.weight[j] > 0 and graph.size[j] == graph.size[i] and _all_tagged(graph, lists, j, tag):
                graph.weight[i] += graph.weight[j]
                graph.degree[i] -= graph.weight[j]
                graph.weight[j] = 0
                graph.parent[j] = i


@compiled
def _all_tagged(graph: QuotientGraph, lists: Int32, j: int, tag: int) -> bool:
    """Whether all that is in the list of unknown j has the tag."""
    n_tagged = 0
    for k in range(graph.start[j], graph.start[j] + graph.size[j]):
        n_tagged += graph.tag[lists[k]] == tag
    return bool(n_tagged == graph.size[j])


@compiled
def _close_element(graph: QuotientGraph, lists: Int32, pivot: int, n_left: int) -> int:
    """Take what is gone out of the pivot's element, and chain the others by degree; return the lowest degree."""
    first = graph.start[pivot]
    end, lowest = first, len(graph.head) - 1
    n_left -= graph.weight[pivot]
    for k in range(first, first + graph.size[pivot]):
        i = lists[k]
        if graph.weight[i] > 0:
            lists[end] = i
            end += 1
            graph.degree[i] = min(graph.degree[i], n_left - graph.weight[i])
            _link(graph, i)
            lowest = min(lowest, graph.degree[i])
    graph.size[pivot] = end - first
    return lowest


@compiled
def _link(graph: QuotientGraph, i: int) -> None:
    """Put an unknown first in the chain of its degree."""
    follower = graph.head[graph.degree[i]]
    graph.after[i], graph.before[i] = follower, NONE
    if follower != NONE:
        graph.before[follower] = i
    graph.head[graph.degree[i]] = i


@compiled
def _unlink(graph: QuotientGraph, i: int) -> None:
    """Take an unknown out of the chain of its degree."""
    after, before = graph.after[i], graph.before[i]
    if before != NONE:
        graph.after[before] = after
    else:
        graph.head[graph.degree[i]] = after
    if after != NONE:
        graph.before[after] = before


@compiled
def _expand(pivots: Int32, parent: Int64) -> Int32:
    """All unknowns: after each pivot those that are eliminated with it, ascending."""
    n = len(parent)
    rank = np.empty(n, np.int64)  # of an unknown's pivot
    for k in range(len(pivots)):
        rank[pivots[k]] = k
    counts = np.zeros(len(pivots) + 1, np.int64)
    for i in range(n):
        pivot = i
        while parent[pivot] != NONE:
            if parent[parent[pivot]] != NONE:
                parent[pivot] = parent[parent[pivot]]
            pivot = parent[pivot]
        rank[i] = rank[pivot]
        counts[rank[i] + 1] += 1
    for k in range(len(pivots)):
        counts[k + 1] += counts[k]
    order = np.empty(n, np.int32)
    for i in range(n):
        order[counts[rank[i]]] = i
        counts[rank[i]] += 1
    return order
