"""A small sequence, and the bench's report of two codecs on it."""

from __future__ import annotations

from pathlib import Path

import pytest
from sequences import waving

import gvpipe
from gvpipe.benchmark import sweep
from gvpipe.benchmark.report import BenchReport


@pytest.fixture(scope="session")
def sheet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bench") / "sheet.npz"
    gvpipe.write(waving(10, 12), path)
    return path


@pytest.fixture(scope="session")
def report(sheet: Path) -> BenchReport:
    return sweep.run([str(sheet)], ["pca", "pdct"], (30, 80), {"reorder": "true"})
