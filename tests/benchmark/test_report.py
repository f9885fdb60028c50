"""Reports are read as they were written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gvpipe.benchmark.report import BenchReport
from gvpipe.errors import InputError


def test_reports_are_read_as_written(report: BenchReport, tmp_path: Path) -> None:
    report.write(tmp_path / "r.json")
    assert BenchReport.read(tmp_path / "r.json") == report
    values = json.loads((tmp_path / "r.json").read_text())
    assert set(values) == {"gvpipe", "machine", "command", "curves"}
    for wrong in ("", "{}", "[]", '{"gvpipe": "1", "machine": {}, "command": [], "curves": [{}]}'):
        (tmp_path / "w.json").write_text(wrong)
        with pytest.raises(InputError, match=r"w\.json"):
            BenchReport.read(tmp_path / "w.json")
    del values["curves"][0]["points"][0]["kg"]
    (tmp_path / "w.json").write_text(json.dumps(values))
    with pytest.raises(InputError, match="kg"):
        BenchReport.read(tmp_path / "w.json")
    with pytest.raises(InputError, match="cannot be read"):
        BenchReport.read(tmp_path / "none.json")
