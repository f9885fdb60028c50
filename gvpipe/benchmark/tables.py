"""A benchmark's results as tables in Markdown."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

from gvpipe.benchmark.bd_rate import average_rate_difference, rate_at
from gvpipe.benchmark.report import Curve

KG_LEVELS = (1.0, 0.3, 0.1)


def tables(curves: Sequence[Curve], levels: Mapping[str, Sequence[float]] | None = None) -> str:
    """Three tables in Markdown: every point; rates at levels of measures; average rate differences to the first codec."""
    made = (_points(curves), _levels(curves, levels or {"kg": KG_LEVELS}), _differences(curves))
    return "\n\n".join(["\n".join(lines) for lines in made if lines])


def _points(curves: Sequence[Curve]) -> list[str]:
    measures = ("bpvf", "KG", "rmse_diag", "max_diag", "STED", "encode s", "decode fps", "frame ms", "peak MB")
    lines = _head(("sequence", "codec", "quality", *measures))
    for curve in curves:
        for p in curve.points:
            numbers = (
                _text(p["bpvf"], ".3f"),
                _text(p["kg"], ".3f"),
                _text(p["rmse_diag"], ".2e"),
                _text(p["max_diag"], ".2e"),
                _text(p["sted"], ".4f"),
                _text(p["encode_s"], ".1f"),
                _text(p["decode_fps"], ".0f"),
                _text(p.get("frame_ms"), ".1f"),
                _text(curve.peak_mb, ".0f"),
            )
            lines.append(_row((curve.sequence, curve.codec, _text(p["quality"], "g"), *numbers)))
    return lines


def _levels(curves: Sequence[Curve], levels: Mapping[str, Sequence[float]]) -> list[str]:
    columns = [(measure, level) for measure, values in levels.items() for level in values]
    lines = _head(("sequence", "codec", *(f"bpvf at {measure.upper()} {level:g}" for measure, level in columns)))
    for curve in curves:
        rates = (_text(rate_at(curve.points, measure, level), ".3f") for measure, level in columns)
        lines.append(_row((curve.sequence, curve.codec, *rates)))
    return lines


def _differences(curves: Sequence[Curve]) -> list[str]:
    codecs = list(dict.fromkeys(curve.codec for curve in curves))
    if len(codecs) < 2:
        return []
    by_name = {(curve.sequence, curve.codec): curve.points for curve in curves}
    lines = _head(("sequence", *(f"{codec} against {codecs[0]}" for codec in codecs[1:])))
    columns: dict[str, list[float]] = {codec: [] for codec in codecs[1:]}
    for name in dict.fromkeys(curve.sequence for curve in curves):
        cells = []
        for codec in codecs[1:]:
            found = average_rate_difference(by_name.get((name, codecs[0]), []), by_name.get((name, codec), []), "kg")
            cells.append(_text(found, "+.1f", " %"))
            if found is not None:
                columns[codec].append(math.log1p(found / 100))
        lines.append(_row((name, *cells)))
    means = [100 * math.expm1(sum(c) / len(c)) if c else None for c in columns.values()]
    lines.append(_row(("mean", *(_text(mean, "+.1f", " %") for mean in means))))
    return lines


def _head(names: Sequence[str]) -> list[str]:
    return [_row(names), "|---" * len(names) + "|"]


def _row(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _text(value: float | None, form: str, unit: str = "") -> str:
    return "-" if value is None else f"{value:{form}}{unit}"
