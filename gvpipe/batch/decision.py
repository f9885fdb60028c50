"""One codec for many sequences: a few of them, evenly spaced, are encoded with all candidates, and their choice counts for all.

To let each sequence choose takes all candidates' encodes of each, for files that are a few per cent smaller.
"""

from __future__ import annotations

import os
import pickle
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from gvpipe.batch.inputs import Job
from gvpipe.coding.codec import Codec
from gvpipe.foundation.atomic import temporary_folder
from gvpipe.rate_control.purposes import describe, own_settings
from gvpipe.tasks.executor import Executor, Work

FEW = 3  # sequences that are tried; where there are no more, each chooses


@dataclass(frozen=True)
class Decision:
    """A codec for all sequences.

    Args:
        codec: of the candidates.
        reason: a line for the user.
    """

    codec: Codec
    reason: str


def decide(
    executor: Executor, jobs: Sequence[Job], candidates: Sequence[Codec], keywords: Mapping[str, Any]
) -> Decision | None:
    """Let a few sequences choose, and return what most of them chose; of equally many, what the larger files chose.

    Args:
        executor: whose workers encode them, into files that are not kept.
        jobs: all sequences, more than `FEW`.
        candidates: to choose from.
        keywords: of `gvpipe.api.encode`.

    Returns:
        None if none of these sequences could be encoded.
    """
    places = [round(k * (len(jobs) - 1) / (FEW - 1)) for k in range(FEW)]
    sources = [os.path.abspath(jobs[place].source) for place in places]
    votes, n_bytes = Counter[int](), Counter[int]()
    for outcome in executor.run(prepare, pickle.dumps(dict(keywords)), sources):
        if outcome.error is None and outcome.value is not None:
            number, size = outcome.value
            votes[number] += 1
            n_bytes[number] += size
    if not votes:
        return None
    best = max(votes, key=lambda number: (votes[number], n_bytes[number]))
    name = describe(candidates[best])
    counts = f"{votes[best]} of {sum(votes.values())} sequences that were tried, of {len(jobs)}"
    return Decision(candidates[best], f"codec {name} for all, the choice of {counts}; --each lets each choose")


def find_decided(candidates: Sequence[Codec], name: str) -> Codec | None:
    """The candidate that an earlier run decided on, by its description; None if it is none of them."""
    return next((codec for codec in candidates if describe(codec) == name), None)


def prepare(data: bytes) -> Work:
    """In a worker: what lets sequences choose, given keywords of `gvpipe.api.encode`, pickled."""
    return partial(choose, pickle.loads(data))


def choose(keywords: dict[str, Any], source: str) -> tuple[int, int] | None:
    """Encode a sequence; return the number of the candidate that it chose, and the bytes of its file.

    None if it cannot be encoded: the run that follows says why.
    """
    from gvpipe import api

    try:
        with temporary_folder() as folder:
            report = api.encode(source, os.path.join(folder, "a.mp4"), **keywords)
    except Exception:  # whatever it is, it comes again
        return None
    return _number_of(keywords["codec"], report.codec, report.settings), report.bytes


def _number_of(candidates: Sequence[Codec], codec: str, settings: Mapping[str, Any]) -> int:
    """The candidate of a codec that has most settings of its own in common with what was chosen."""

    def likeness(number: int) -> tuple[bool, bool, int]:
        own = own_settings(candidates[number])
        same = [name for name, value in own.items() if settings.get(name) == value]
        return candidates[number].id == codec, len(same) == len(own), len(same)

    return max(range(len(candidates)), key=likeness)
