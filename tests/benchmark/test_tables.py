"""Tables name every curve."""

from __future__ import annotations

from gvpipe.benchmark.bd_rate import average_rate_difference
from gvpipe.benchmark.report import BenchReport
from gvpipe.benchmark.tables import tables


def test_tables_name_every_curve(report: BenchReport) -> None:
    parts = tables(report.curves).split("\n\n")
    assert [len(part.splitlines()) for part in parts] == [2 + 4, 2 + 2, 2 + 2]
    assert all(len({line.count("|") for line in part.splitlines()}) == 1 for part in parts)
    levels = tables(report.curves, {"kg": [0.5], "sted": [0.02, 0.01]}).split("\n\n")[1]
    assert levels.startswith("| sequence | codec | bpvf at KG 0.5 | bpvf at STED 0.02 | bpvf at STED 0.01 |")
    difference = average_rate_difference(report.curves[0].points, report.curves[1].points, "kg")
    assert f"| sheet | {difference:+.1f} % |" in parts[2] and f"| mean | {difference:+.1f} % |" in parts[2]
