"""What a claim is: a number of a paper, how it is measured here, and the rule by which ours agrees with it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from gvpipe.benchmark.bd_rate import average_rate_difference, logarithms, rate_at
from gvpipe.benchmark.reproduction.lab import Lab, Missing

CLOSE = 0.15  # part by which "about" may differ

ABOUT, AT_MOST, AT_LEAST = "about", "at most", "at least"
HOLDS, FAILS, NOT_RUN = "holds", "does not hold", "not run"


@dataclass(frozen=True)
class Claim:
    """A number of a paper.

    Args:
        id: for JSON and for ``--only``.
        where: table, figure or section.
        text: what the paper says, in our words.
        paper: its number; None where the text at hand has none.
        unit: of both numbers.
        rule: `ABOUT`, `AT_MOST` or `AT_LEAST` the paper's number.
        measure: our number; None where it is not run.
        note: what differs from the paper's experiment, or why it is not run.
    """

    id: str
    where: str
    text: str
    paper: float | None
    unit: str
    rule: str = ABOUT
    measure: Callable[[Lab], float | None] | None = None
    note: str = ""


@dataclass(frozen=True)
class Outcome:
    """A claim with our number, None if it was not run, its state, and why."""

    claim: Claim
    ours: float | None
    state: str
    why: str

    @property
    def ratio(self) -> float | None:
        """Our number by the paper's."""
        paper = self.claim.paper
        return None if self.ours is None or not paper else self.ours / paper

    def to_json(self) -> dict[str, Any]:
        """The outcome as JSON values."""
        claim = self.claim
        return {
            "id": claim.id,
            "where": claim.where,
            "claim": claim.text,
            "rule": claim.rule,
            "unit": claim.unit,
            "paper": claim.paper,
            "ours": self.ours,
            "ratio": self.ratio,
            "state": self.state,
            "why": self.why,
        }


def judge(claim: Claim, lab: Lab) -> Outcome:
    """Measure a claim; what it needs and the lab lacks makes it one that is not run."""
    if claim.measure is None:
        return Outcome(claim, None, NOT_RUN, claim.note)
    try:
        ours = claim.measure(lab)
    except Missing as exc:
        return Outcome(claim, None, NOT_RUN, str(exc))
    if ours is None:
        return Outcome(claim, None, NOT_RUN, "the curves do not reach that error or rate")
    if claim.paper is None:
        return Outcome(claim, ours, NOT_RUN, claim.note)
    return Outcome(claim, ours, HOLDS if agrees(claim.rule, claim.paper, ours) else FAILS, claim.note)


def agrees(rule: str, paper: float, ours: float) -> bool:
    """Whether our number agrees with the paper's.

    Examples:
        >>> agrees("about", 1.0, 1.1), agrees("at most", 1.0, 1.1), agrees("at least", 30, 42)
        (True, False, True)
    """
    if rule == AT_MOST:
        return ours <= paper
    if rule == AT_LEAST:
        return ours >= paper
    return abs(ours - paper) <= CLOSE * abs(paper)


def rate(sequence: str, codec: str, measure: str, level: float) -> Callable[[Lab], float | None]:
    """Bits per vertex and frame at an error."""
    return lambda lab: rate_at(lab.points(sequence, codec), measure, level)


def less_rate(sequence: str, codec: str, other: str, measure: str, level: float) -> Callable[[Lab], float | None]:
    """By how many percent a codec's rate at an error is below another's."""

    def measured(lab: Lab) -> float | None:
        ours, theirs = (rate_at(lab.points(sequence, name), measure, level) for name in (codec, other))
        return None if ours is None or theirs is None else 100 * (1 - ours / theirs)

    return measured


def less_error(sequence: str, codec: str, other: str, measure: str, at: float) -> Callable[[Lab], float | None]:
    """By how many percent a codec's error at a rate, bits per vertex and frame, is below another's."""

    def measured(lab: Lab) -> float | None:
        ours, theirs = (error_at(lab.points(sequence, name), measure, at) for name in (codec, other))
        return None if ours is None or theirs is None else 100 * (1 - ours / theirs)

    return measured


def less_rate_overall(sequence: str, codec: str, other: str, measure: str) -> Callable[[Lab], float | None]:
    """By how many percent a codec's rate is below another's, averaged over the errors that both reach."""

    def measured(lab: Lab) -> float | None:
        found = average_rate_difference(lab.points(sequence, other), lab.points(sequence, codec), measure)
        return None if found is None else -found

    return measured


def error_at(points: list[dict[str, Any]], measure: str, rate: float) -> float | None:
    """The error at a rate, straight between the logarithms of points; None where the curve does not reach."""
    errors, rates = logarithms(points, measure)  # errors rise, rates fall
    if not len(rates) or not rates[-1] <= math.log(rate) <= rates[0]:
        return None
    pairs = sorted(zip(rates.tolist(), errors.tolist(), strict=True))
    for (low, a), (high, b) in pairwise(pairs):
        if low <= math.log(rate) <= high:
            return math.exp(a + (b - a) * (math.log(rate) - low) / (high - low))
    return math.exp(pairs[0][1])


def time_of(sequence: str, codec: str, key: str) -> Callable[[Lab], float | None]:
    """Milliseconds of an encode or a decode (``encode_s``, ``decode_s``) at quality 75, or the nearest that was measured."""

    def measured(lab: Lab) -> float | None:
        points = lab.points(sequence, codec)
        return 1000.0 * float(min(points, key=lambda point: abs(point["quality"] - 75))[key])

    return measured


def fewer_bytes(sequence: str, codec: str, other: str, section: str = "", quality: float = 75) -> Callable[[Lab], float | None]:
    """By how many percent a codec's sections of a name, or whole files, are smaller than another's at one quality."""

    def measured(lab: Lab) -> float | None:
        ours, theirs = (_bytes(lab.point(sequence, name, quality), section) for name in (codec, other))
        return 100 * (1 - ours / theirs)

    return measured


def _bytes(point: dict[str, Any], section: str) -> float:
    sizes: dict[str, int] = point["sections"]
    return sum(size for name, size in sizes.items() if name.startswith(section)) if section else float(point["bytes"])
