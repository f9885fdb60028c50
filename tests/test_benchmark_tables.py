"""The tables of the benchmark pages are those that the committed results give."""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import pytest
from folders import ROOT

from gvpipe.benchmark.report import BenchReport

TOOL: dict[str, Any] = runpy.run_path(str(ROOT / "tools" / "benchmark_tables.py"))
BENCHMARKS = ROOT / "docs" / "benchmarks"
OF_BENCH = sorted(path for path in BENCHMARKS.glob("*.json") if path.stem != "sizes")  # that is of another tool
RESULTS = [*OF_BENCH, *sorted((BENCHMARKS / "curves").glob("*.json"))]


@pytest.mark.parametrize("page", TOOL["PAGES"], ids=lambda page: page.name)
def test_tables_are_made_from_results(page: Path) -> None:
    text = page.read_text("utf-8")
    assert TOOL["fill"](text) == text, "run python tools/benchmark_tables.py"


def test_every_table_stands_on_a_page() -> None:
    names = [found[1] for page in TOOL["PAGES"] for found in TOOL["MARKED"].findall(page.read_text("utf-8"))]
    assert set(names) == set(TOOL["TABLES"])


@pytest.mark.parametrize("path", RESULTS, ids=lambda path: path.stem)
def test_results_are_reports_of_bench(path: Path) -> None:
    report = BenchReport.read(path)
    names = [(curve.sequence, curve.codec) for curve in report.curves]
    assert len(set(names)) == len(names)
    for curve in report.curves:
        for point in curve.points:
            if point["bytes"]:
                assert point["bpvf"] == pytest.approx(8 * point["bytes"] / (curve.vertices * curve.frames), abs=1e-4)
