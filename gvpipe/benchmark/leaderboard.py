"""Curves of many codecs on many sequences against each other: rates, average differences of rates, and who leads.

Means over sequences are of logarithms, over those sequences where both codecs have errors in common. All tables are Markdown.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from gvpipe.benchmark.bd_rate import average_rate_difference, rate_at
from gvpipe.benchmark.report import Curve

LEADERS = 3
Points = list[dict[str, Any]]


def points_by(curves: Sequence[Curve]) -> dict[str, dict[str, Points]]:
    """Points by sequence and codec."""
    found: dict[str, dict[str, Points]] = {}
    for curve in curves:
        found.setdefault(curve.sequence, {})[curve.codec] = curve.points
    return found


def mean_difference(found: Mapping[str, Mapping[str, Points]], anchor: str, codec: str, measure: str) -> float | None:
    """How much more rate a codec takes than another, percent, averaged over errors and sequences; None without any."""
    logarithms = []
    for codecs in found.values():
        difference = average_rate_difference(codecs.get(anchor, []), codecs.get(codec, []), measure)
        if difference is not None:
            logarithms.append(math.log1p(difference / 100))
    return 100 * math.expm1(sum(logarithms) / len(logarithms)) if logarithms else None


def ranked(found: Mapping[str, Mapping[str, Points]], anchor: str, measure: str) -> list[str]:
    """All codecs, that with the least rate on average first; those without a difference last."""
    codecs = dict.fromkeys(codec for codecs in found.values() for codec in codecs)
    means = {codec: mean_difference(found, anchor, codec, measure) for codec in codecs}
    return sorted(codecs, key=lambda codec: (means[codec] is None, means[codec]))


def rates(found: Mapping[str, Mapping[str, Points]], anchor: str, measure: str, level: float) -> list[str]:
    """Bits per vertex and frame at an error: a row for each codec, a column for each sequence."""
    rows = []
    for codec in ranked(found, anchor, measure):
        cells = [rate_at(codecs.get(codec, []), measure, level) for codecs in found.values()]
        rows.append([f"`{codec}`", *("-" if cell is None else f"{cell:.3f}" for cell in cells)])
    return _table(["codec", *found], rows)


def differences(found: Mapping[str, Mapping[str, Points]], anchor: str, measure: str) -> list[str]:
    """Average differences of rate to an anchor: a row for each codec, a column for each sequence, and the mean."""
    rows = []
    for codec in ranked(found, anchor, measure):
        each = [average_rate_difference(codecs.get(anchor, []), codecs.get(codec, []), measure) for codecs in found.values()]
        each.append(mean_difference(found, anchor, codec, measure))
        rows.append([f"`{codec}`", *(_percent(value) for value in each)])
    return _table(["codec", *found, "mean"], rows)


def matrix(found: Mapping[str, Mapping[str, Points]], anchor: str, measure: str) -> list[str]:
    """How much more rate each codec (row) takes than each (column), percent, averaged; columns have the rows' numbers."""
    codecs = ranked(found, anchor, measure)
    rows = []
    for i, codec in enumerate(codecs):
        means = [None if other == codec else mean_difference(found, other, codec, measure) for other in codecs]
        rows.append([f"{i + 1}. `{codec}`", *(_percent(mean, "") for mean in means)])
    return _table(["%", *(str(i + 1) for i in range(len(codecs)))], rows)


def leaders(found: Mapping[str, Mapping[str, Points]], anchor: str, measures: Mapping[str, str]) -> list[str]:
    """The codecs with the least rate of each sequence, by measure: average differences to the anchor."""
    rows = []
    for name, codecs in found.items():
        cells = []
        for measure in measures:
            each = {codec: average_rate_difference(codecs.get(anchor, []), points, measure) for codec, points in codecs.items()}
            best = sorted((value, codec) for codec, value in each.items() if value is not None)[:LEADERS]
            cells.append(", ".join(f"`{codec}` {_percent(value)}" for value, codec in best))
        rows.append([name, *cells])
    return _table(["sequence", *measures.values()], rows)


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    lines = [f"| {' | '.join(cells)} |" for cells in (heads, *rows)]
    return [lines[0], "|---" * len(heads) + "|", *lines[1:]]


def _percent(value: float | None, unit: str = " %") -> str:
    """A whole number with its sign; 0 has a plus."""
    return "-" if value is None else f"{round(value):+d}{unit}"
