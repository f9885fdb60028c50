"""Reports are read as they were written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gvpipe.benchmark.report import BenchReport
from gvpipe.foundation.errors import InputError

WRONG = {
    b"": "line 1 is no JSON",
    b'{\n"gvpipe"': "line 2 is no JSON",
    b"PK\x03\x04\xe6": "it is no text",
    b"[]": "the file is no object",
    b"{}": "the file has no gvpipe",
    b'{"gvpipe": "1", "machine": {}, "command": [], "curves": 1}': "the file has curves of another type",
    b'{"gvpipe": "1", "machine": {}, "command": [], "curves": [{}]}': "curve 0 has no sequence",
}


def test_reports_are_read_as_written(report: BenchReport, tmp_path: Path) -> None:
    report.write(tmp_path / "r.json")
    assert BenchReport.read(tmp_path / "r.json") == report
    values = json.loads((tmp_path / "r.json").read_text())
    assert set(values) == {"gvpipe", "machine", "command", "curves"}
    del values["curves"][0]["points"][0]["kg"]
    (tmp_path / "w.json").write_text(json.dumps(values))
    with pytest.raises(InputError, match="point 0 of curve 0 has no kg"):
        BenchReport.read(tmp_path / "w.json")
    with pytest.raises(InputError, match="cannot be read"):
        BenchReport.read(tmp_path / "none.json")


@pytest.mark.parametrize("content", WRONG)
def test_other_files_are_refused_in_plain_words(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "w.json").write_bytes(content)
    with pytest.raises(InputError, match=r"w\.json is not what `gvpipe bench --json` writes") as caught:
        BenchReport.read(tmp_path / "w.json")
    assert str(caught.value).endswith(f": {WRONG[content]}; give that file, or measure again")
