"""Plots from the report alone, with the points of other codecs."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import pytest

from gvpipe.benchmark.plots import draw, read_peers
from gvpipe.benchmark.report import BenchReport
from gvpipe.foundation.errors import InputError

PEERS = "seq,codec,bpvf,kg,rmse_rel\nsheet,other,4.0,0.5,1e-3\nsheet,other,9.0,0.05,1e-4\nsheet,exact,96,0,0\n,,x,,\n"


@pytest.mark.slow
def test_plots_need_the_report_alone(report: BenchReport, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "peers.csv").write_text(PEERS)
    peers = read_peers(tmp_path / "peers.csv")
    assert peers["sheet"]["other"][0] == {"bpvf": 4.0, "kg": 0.5, "rmse_diag": 1e-3}
    (alone,) = draw(report, tmp_path / "a" / "b")
    (beside,) = draw(report, tmp_path / "c", peers)
    assert alone.name == beside.name == "sheet.png"
    assert alone.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and alone.read_bytes() != beside.read_bytes()
    with pytest.raises(InputError, match="no curve"):
        draw(dataclasses.replace(report, curves=[]), tmp_path)
    (tmp_path / "peers.csv").write_text("seq,codec\n")
    with pytest.raises(InputError, match="bpvf, kg, rmse_rel"):
        read_peers(tmp_path / "peers.csv")


def test_plots_name_the_package_that_they_need(report: BenchReport, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)  # as if it were not installed
    with pytest.raises(InputError, match=r"pip install 'gvpipe\[plot\]'"):
        draw(report, tmp_path / "plots")
    assert not (tmp_path / "plots").exists()
