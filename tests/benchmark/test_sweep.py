"""The sweep: points are those of encoding, settings are checked before the work."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import Finished

import gvpipe
from gvpipe.benchmark import sweep
from gvpipe.benchmark.report import BenchReport
from gvpipe.benchmark.tables import tables
from gvpipe.coding.registry import codec_ids
from gvpipe.foundation.errors import GvpipeError, InputError, SettingError

Run = Callable[..., Finished]


def test_points_are_what_encoding_gives(report: BenchReport, sheet: Path, tmp_path: Path) -> None:
    sequence = gvpipe.read(sheet)
    assert [(c.sequence, c.codec, c.vertices, c.frames) for c in report.curves] == [
        ("sheet", codec, 100, 12) for codec in ("pca", "pdct")
    ]
    for curve in report.curves:
        assert "quality" not in curve.settings and curve.settings["reorder"] is True
        assert curve.peak_mb is None or 20 < curve.peak_mb < 4000
        for point in curve.points:
            made = gvpipe.encode(sequence, tmp_path / "a.mp4", curve.codec, quality=point["quality"], reorder=True)
            values = gvpipe.compare(sequence, gvpipe.decode(tmp_path / "a.mp4"))
            assert (point["bytes"], point["bpvf"], point["sections"]) == (made.bytes, made.bpvf, made.sections)
            assert (point["kg"], point["max"], point["sted"]) == (values.kg, values.max, values.sted)
            assert point["encode_s"] > 0 and point["decode_s"] > 0 and point["frame_ms"] >= 0
            assert point["decode_fps"] == pytest.approx(12 / point["decode_s"])


def test_settings_are_checked_before_the_work(sheet: Path) -> None:
    with pytest.raises(SettingError, match="no codec"):
        sweep.run([str(sheet)], ["pca", "mp3"])
    with pytest.raises(SettingError, match="quality"):
        sweep.run([str(sheet)], ["pca"], (30, 130))
    with pytest.raises(InputError, match="none"):
        sweep.run(["none.npz"], ["pca"], (30,))


def test_a_reader_that_disagrees_with_itself_is_found(sheet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sequence = gvpipe.read(sheet)
    gvpipe.encode(sequence, tmp_path / "a.mp4", "pca")
    whole = gvpipe.decode(tmp_path / "a.mp4")
    shifted = dataclasses.replace(whole, positions=whole.positions[:] + 1)
    monkeypatch.setattr("gvpipe.api.decode", lambda path, **_: shifted)
    with pytest.raises(GvpipeError, match="alone is not"):
        sweep._verify(sequence, tmp_path / "a.mp4")


@pytest.mark.slow
def test_command_line(run: Run, sheet: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    target = tmp_path / "r.json"
    ended = run("bench", sheet, "--codecs", "pca", "--qualities", "40,70", "--json", target)
    assert (ended.status, ended.err) == (0, "")
    made = BenchReport.read(target)
    assert ended.out == tables(made.curves) + "\n"
    assert [p["quality"] for p in made.curves[0].points] == [40, 70]
    assert made.command[1] == "bench"
    drawn = run("plot", target, tmp_path / "plots")
    assert drawn.out.split() == [str(tmp_path / "plots" / "sheet.png")]
    assert json.loads(run("plot", target, tmp_path / "plots", "--json").out) == {"plots": drawn.out.split()}
    assert run("plot", target, "a", "b").status == 2
    printed = run("bench", sheet, "--codecs", "pca", "--qualities", "40", "--json")
    assert [point["quality"] for point in json.loads(printed.out)["curves"][0]["points"]] == [40]
    assert run("bench", "--json", sheet, sheet).status == 2 and sheet.read_bytes()[:2] == b"PK"
    for option in ("--qualities", "--kg", "--sted"):
        assert run("bench", sheet, option, "high").status == 2
    assert run("bench").status == 2
    assert run("bench", sheet, "--codecs", "mp3").status == 1


@pytest.mark.slow
def test_one_codec_with_several_settings(sheet: Path) -> None:
    made = sweep.run([str(sheet)], ["pca", "pca:segment=4"], [50.0])
    assert [(curve.codec, curve.settings["segment"] == 4) for curve in made.curves] == [("pca", False), ("pca:segment=4", True)]
    assert made.curves[0].points[0]["bytes"] != made.curves[1].points[0]["bytes"]
    for codec, missing in (("pca:segment", "ID:KEY=VALUE"), ("pca:segments=4", "segments"), ("pca:segment=0", "segment")):
        with pytest.raises(InputError, match=missing):
            sweep.run([str(sheet)], [codec])


@pytest.mark.slow
def test_every_codec_by_default(sheet: Path) -> None:
    assert set(codec_ids()) >= {"mcgv", "pca", "pdct"}
    named = sweep.default_codecs()
    assert {name.split(":")[0] for name in named} == set(codec_ids()) and len(named) == len(codec_ids()) + 2
    assert {"mcgv", "mcgv:transform=klt", "mcgv:prediction=affine"} <= set(named)
    assert {curve.codec for curve in sweep.run([str(sheet)], codec_ids(), (50,)).curves} == set(codec_ids())
