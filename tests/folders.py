"""Where the tests find the project's files and, if it is there, the folder of real sequences beside the project."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
GOLDEN = ROOT / "tests" / "golden"
SAMPLES = ROOT / "samples"
DATA = ROOT.parent / "shared" / "data"
