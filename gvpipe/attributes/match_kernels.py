"""Kernels that linear and octahedral prediction share: equal values nearby, and the context of a residual.

A *candidate* is a distinct value of an earlier entry at the same place, or of an earlier neighbour. Where seams split a
surface, or few values recur, its number replaces a residual.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gvpipe.entropy.serial_kernels import SerialCoder, code_value, refuse
from gvpipe.foundation.arrays import Int64
from gvpipe.mesh.entry_kernels import EntryOrder
from gvpipe.runtime.compiled import compiled

TWINS, NEIGHBOURS = 1, 2  # flags: which entries are candidates
MAX_CANDIDATES = 6
MAX_LOOKED = 12  # entries at one place that are compared
N_CLASSES = 8  # of magnitudes
N_COMPONENTS = 2  # kinds of components: the first one, later ones
N_RESIDUAL_CONTEXTS = N_CLASSES * N_COMPONENTS
N_MATCH_CONTEXTS = 9
NONE = -1


class Entries(NamedTuple):
    """What both directions know of the entries before their values.

    Args:
        order: in which they are coded.
        places: ``(N,)`` a number for each, equal for entries at one place.
        flags: which of them are candidates.
        shift: low bits of magnitudes that contexts ignore.
    """

    order: EntryOrder
    places: Int64
    flags: int
    shift: int


class History(NamedTuple):
    """What is remembered of entries done.

    Args:
        latest: ``(P,)`` the last entry done at each place; -1: none.
        before: ``(N,)`` of an entry done, the one before it at its place.
        matched: ``(N,)`` whether its value is that of a candidate.
        magnitudes: ``(N, C)`` of its residuals.
        candidates: ``(MAX_CANDIDATES,)`` of the present entry.
    """

    latest: Int64
    before: Int64
    matched: Int64
    magnitudes: Int64
    candidates: Int64


@compiled
def new_history(entries: Entries, n_components: int) -> History:
    """Memory before the first entry."""
    n = len(entries.places)
    n_places = 0
    for i in range(n):
        n_places = max(n_places, entries.places[i] + 1)
    return History(
        np.full(n_places, NONE, np.int64),
        np.full(n, NONE, np.int64),
        np.zeros(n, np.int64),
        np.zeros((n, n_components), np.int64),
        np.empty(MAX_CANDIDATES, np.int64),
    )


@compiled
def code_match(coder: SerialCoder, entries: Entries, history: History, i: int, codes: Int64) -> int:
    """Code which candidate entry i of the order equals; return that, -1 if none."""
    if not entries.flags:
        return NONE
    entry = entries.order.order[i]
    n, has_twin = _find_candidates(entries, history, i, codes)
    if n == 0:
        return NONE
    number = 0
    if coder.encodes:
        for k in range(n):
            if number == 0 and _are_equal(codes, history.candidates[k], entry):
                number = k + 1
    first = entries.order.starts[i]
    outcome = 2
    if has_twin:
        twin = history.candidates[0]
        outcome = history.matched[twin] if history.before[twin] >= 0 else 2
    if first < entries.order.starts[i + 1]:
        outcome = history.matched[entries.order.gates[first, 0]]
    context = N_RESIDUAL_CONTEXTS + min(n, 3) * 3 - 3 + outcome
    value = code_value(coder, context, -((number + 1) >> 1) if number & 1 else number >> 1)
    number = -2 * value - 1 if value < 0 else 2 * value
    if number > n:
        refuse(coder)
        return NONE
    return history.candidates[number - 1] if number > 0 else NONE


@compiled
def remember(entries: Entries, history: History, entry: int, is_match: bool) -> None:
    """Note that an entry is done."""
    place = entries.places[entry]
    history.before[entry] = history.latest[place]
    history.latest[place] = entry
    history.matched[entry] = 1 if is_match else 0


@compiled
def near_magnitude(entries: Entries, history: History, i: int, component: int) -> int:
    """Four times the mean magnitude of the residuals of the entries that predict entry i of the order."""
    total, n = 0, 0
    for g in range(entries.order.starts[i], entries.order.starts[i + 1]):
        for k in range(2):
            other = entries.order.gates[g, k]
            if other >= 0:
                total += history.magnitudes[other, component]
                n += 1
    if n == 0 and i > 0:
        total, n = history.magnitudes[entries.order.order[i - 1], component], 1
    return 4 * total // n if n else 0


@compiled
def residual_context(component: int, magnitude: int, least: int) -> int:
    """The context of a residual of which ``magnitude`` is expected, and of which the class is ``least`` at least."""
    bits = 0
    while magnitude > 0 and bits < N_CLASSES - 1:
        magnitude >>= 1
        bits += 1
    return max(bits, least) + (N_CLASSES if component > 0 else 0)


@compiled
def _find_candidates(entries: Entries, history: History, i: int, codes: Int64) -> tuple[int, bool]:
    """Fill the candidates of entry i of the order; return how many they are, and whether the first is at its place."""
    order = entries.order
    n = 0
    if entries.flags & TWINS:
        other = history.latest[entries.places[order.order[i]]]
        looked = 0
        while other >= 0 and n < MAX_CANDIDATES and looked < MAX_LOOKED:
            n = _add_candidate(history.candidates, n, other, codes)
            other = history.before[other]
            looked += 1
    has_twin = n > 0
    if entries.flags & NEIGHBOURS:
        for g in range(order.starts[i], min(order.starts[i + 1], order.starts[i] + MAX_LOOKED)):
            for k in range(3):
                if order.gates[g, k] >= 0 and n < MAX_CANDIDATES:
                    n = _add_candidate(history.candidates, n, order.gates[g, k], codes)
        if order.starts[i] == order.starts[i + 1] and i > 0 and n < MAX_CANDIDATES:
            n = _add_candidate(history.candidates, n, order.order[i - 1], codes)
    return n, has_twin


@compiled
def _add_candidate(candidates: Int64, n: int, entry: int, codes: Int64) -> int:
    for k in range(n):
        if _are_equal(codes, candidates[k], entry):
            return n
    candidates[n] = entry
    return n + 1


@compiled
def _are_equal(codes: Int64, a: int, b: int) -> bool:
    equal = True
    for c in range(codes.shape[1]):
        equal = equal and codes[a, c] == codes[b, c]
    return equal
