"""Votes for candidates: what a walk over cells expects next, most votes first."""

from __future__ import annotations

from gvpipe.foundation.arrays import Int64
from gvpipe.runtime.compiled import compiled


@compiled
def vote(one: int, count: int, candidates: Int64, votes: Int64, n: int) -> int:
    """Count votes for a candidate; return how many candidates there are. There may be no room for another one."""
    for k in range(n):
        if candidates[k] == one:
            votes[k] += count
            return n
    if n < len(candidates):
        candidates[n], votes[n] = one, count
        n += 1
    return n


@compiled
def sort_votes(candidates: Int64, votes: Int64, n: int) -> None:
    """Most votes first; of equal ones the first found."""
    for k in range(1, n):
        one, count, at = candidates[k], votes[k], k
        while at > 0 and votes[at - 1] < count:
            candidates[at], votes[at] = candidates[at - 1], votes[at - 1]
            at -= 1
        candidates[at], votes[at] = one, count
