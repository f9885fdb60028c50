"""Every script in tools/ says what it does."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest
from folders import ROOT

TOOLS = sorted((ROOT / "tools").glob("*.py"))
SCRIPTS = [  # those that measure are left to the slow run
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.stem.startswith("measure_") else []) for path in TOOLS
]


@pytest.mark.parametrize("script", SCRIPTS)
def test_help(script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    """It names the script and its first sentence, and nothing is measured or written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(script.parent)
    monkeypatch.setattr(sys, "argv", [str(script), "--help"])
    with pytest.raises(SystemExit) as stopped:
        runpy.run_path(str(script), run_name="__main__")
    out, err = capfd.readouterr()
    assert not stopped.value.code and err == ""
    assert out.startswith(f"usage: {script.name}")
    summary = script.read_text("utf-8").split('"""')[1].splitlines()[0]
    assert summary in out
    assert list(tmp_path.iterdir()) == []


def test_tables_of_data_sets_are_those_of_the_results() -> None:
    page = (ROOT / "docs" / "datasets.md").read_text("utf-8")
    results = ROOT / "docs" / "benchmarks" / "datasets"
    for line in runpy.run_path(str(ROOT / "tools" / "measure_datasets.py"))["tables"](results):
        assert line in page


def test_files_that_grew() -> None:
    """More than two percent, or no file at all; what the last release did not measure never fails."""
    tool = runpy.run_path(str(ROOT / "tools" / "compare_sizes.py"))
    released = [{"sequence": "cow", "codec": codec, "bytes": 1000} for codec in ("mcgv", "pca", "pdct")]
    rows = [
        {"sequence": "cow", "codec": "mcgv", "bytes": 1020},
        {"sequence": "cow", "codec": "pca", "bytes": 1021},
        {"sequence": "cow", "codec": "pdct", "bytes": None, "reason": "too many components"},
        {"sequence": "dog", "codec": "mcgv", "bytes": 9999},
    ]
    assert tool["find_grown"](rows, released) == ["cow pca", "cow pdct"]
    assert tool["find_grown"](rows, []) == []
    assert [row["bytes"] for row in tool["merged"](released, rows[1:2]).values()] == [1000, 1021, 1000]
    for path, sequence in zip(tool["find_sequences"](None, ["cloth", "flag"]), ("cloth", "flag"), strict=True):
        assert path.stem == sequence


def test_sizes_of_the_last_release_are_figures() -> None:
    tool = runpy.run_path(str(ROOT / "tools" / "compare_sizes.py"))
    rows = tool["read_rows"](tool["RELEASED"])
    assert rows and all(set(row) == {"sequence", "codec", "bytes", "bpvf", "kg", "seconds"} for row in rows)
    assert {row["codec"] for row in rows} <= set(tool["CODECS"])
    assert tool["find_grown"](rows, rows) == []


def test_curves_that_are_measured_again() -> None:
    """Those that a file lacks; and, with a commit, those of another."""
    tool = runpy.run_path(str(ROOT / "tools" / "measure_curves.py"))
    known = {"curves": [{"codec": "pca", "commit": "a"}, {"codec": "famc", "commit": "b"}], "refused": {"gv": "no surface"}}
    codecs = ("pca", "famc", "gv", "mcgv")
    assert [codec for codec in codecs if tool["is_wanted"](known, codec, None)] == ["mcgv"]
    assert [codec for codec in codecs if tool["is_wanted"](known, codec, "a")] == ["famc", "gv", "mcgv"]
    assert tool["is_own"]("pca:predictor=rbf")
