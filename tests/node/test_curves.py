"""The plots of the documentation show the points of the committed results."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from folders import ROOT

from gvpipe.benchmark.report import BenchReport

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
DOCS = ROOT / "docs"
RESULTS = sorted((DOCS / "benchmarks" / "curves").glob("*.json"))


def shown(path: Path, metric: str) -> dict[str, Any]:
    """What the page makes of a file of results."""
    script = Path(__file__).with_name("run_curves.mjs")
    command = ["node", str(script), str(DOCS / "curve-points.js"), str(path), metric]
    made: dict[str, Any] = json.loads(subprocess.run(command, capture_output=True, check=True, timeout=60).stdout)
    return made


@pytest.mark.parametrize("path", RESULTS, ids=lambda path: path.stem)
def test_points_are_those_of_the_results(path: Path) -> None:
    curves = BenchReport.read(path).curves
    made = shown(path, "sted")
    wanted = [(curve.codec, p["quality"], p["bytes"], p["bpvf"], p["sted"]) for curve in curves for p in curve.points]
    assert sorted(map(tuple, made["points"])) == sorted(point for point in wanted if point[-1])
    assert all(metric in point for curve in curves for point in curve.points for metric in made["metrics"])


def test_axes_and_descriptions() -> None:
    made = shown(RESULTS[0], "kg")
    assert all(0 <= place <= 100 for place in made["places"]) and sorted(made["places"], reverse=True) == made["places"]
    assert len(made["ticks"]) >= 2
    curve = next(one for one in BenchReport.read(RESULTS[0]).curves if one.codec == made["lines"][0])
    point = min(curve.points, key=lambda one: float(one["bpvf"]))
    assert made["lines"][1] == f"quality {point['quality']:g}"
    assert f"{point['bytes']:,} bytes" in made["lines"][2] and str(point["kg"]) in made["lines"][3]
    assert all(f"{key} " in made["lines"][4] for key in curve.settings)


@pytest.mark.parametrize("name", ["curve-points.js", "curves.js"])
def test_scripts_are_well_formed(name: str) -> None:
    subprocess.run(["node", "--check", str(DOCS / name)], check=True, timeout=60)
