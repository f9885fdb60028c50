"""The bench: real sweeps of small sequences, curves against each other, plots from the report alone."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import Finished
from hypothesis import given
from hypothesis import strategies as st
from sequences import waving

import gvpipe
from gvpipe.benchmark import sweep
from gvpipe.benchmark.bd_rate import average_rate_difference, rate_at
from gvpipe.benchmark.plots import draw, read_peers
from gvpipe.benchmark.report import BenchReport
from gvpipe.benchmark.tables import tables
from gvpipe.cli.breakdown import group_sections
from gvpipe.errors import GvpipeError, InputError, SettingError
from gvpipe.registry import codec_ids

Run = Callable[..., Finished]
PEERS = "seq,codec,bpvf,kg,rmse_rel\nsheet,other,4.0,0.5,1e-3\nsheet,other,9.0,0.05,1e-4\nsheet,exact,96,0,0\n,,x,,\n"


@pytest.fixture(scope="module")
def sheet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bench") / "sheet.npz"
    gvpipe.write(waving(10, 12), path)
    return path


@pytest.fixture(scope="module")
def report(sheet: Path) -> BenchReport:
    return sweep.run([str(sheet)], ["pca", "pdct"], (30, 80), {"reorder": "true"})


def power_law(scale: float, power: float, errors: tuple[float, ...]) -> list[dict[str, Any]]:
    return [{"bpvf": scale * e**-power, "kg": e} for e in errors]


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
    monkeypatch.setattr(sweep.api, "decode", lambda path: shifted)
    with pytest.raises(GvpipeError, match="alone is not"):
        sweep._verify(sequence, tmp_path / "a.mp4")


@given(st.floats(0.2, 5), st.floats(0.2, 3), st.floats(0.2, 2))
def test_known_differences(factor: float, scale: float, power: float) -> None:
    """Twice the rate at every error is 100 % more, wherever the points lie; the other way round, the inverse."""
    a = power_law(scale, power, (1.0, 0.31, 0.1))
    b = power_law(factor * scale, power, (2.0, 0.5, 0.22, 0.03))
    found, back = average_rate_difference(a, b, "kg"), average_rate_difference(b, a, "kg")
    assert found is not None and back is not None
    assert found == pytest.approx(100 * (factor - 1), abs=1e-6)
    assert (1 + found / 100) * (1 + back / 100) == pytest.approx(1)
    at = rate_at(b, "kg", 0.4)
    assert at == pytest.approx(factor * scale * 0.4**-power)


def test_nothing_is_extrapolated() -> None:
    a, b = power_law(1, 1, (1.0, 0.5)), power_law(1, 1, (0.4, 0.1))
    assert average_rate_difference(a, b, "kg") is None
    assert rate_at(a, "kg", 0.4) is None and rate_at(a, "kg", 1.1) is None
    assert average_rate_difference(a, [], "kg") is None
    assert average_rate_difference(a, [{"bpvf": 3.0, "kg": None}, {"bpvf": 3.0, "kg": 0.0}], "kg") is None


def test_points_that_others_beat_do_not_count() -> None:
    """A coarser file that is larger says nothing of what the codec can do."""
    points = power_law(1, 1, (1.0, 0.5, 0.25))
    assert rate_at([*points, {"bpvf": 9.0, "kg": 0.7}], "kg", 0.7) == rate_at(points, "kg", 0.7)


def test_tables_name_every_curve(report: BenchReport) -> None:
    parts = tables(report.curves).split("\n\n")
    assert [len(part.splitlines()) for part in parts] == [2 + 4, 2 + 2, 2 + 2]
    assert all(len({line.count("|") for line in part.splitlines()}) == 1 for part in parts)
    levels = tables(report.curves, {"kg": [0.5], "sted": [0.02, 0.01]}).split("\n\n")[1]
    assert levels.startswith("| sequence | codec | bpvf at KG 0.5 | bpvf at STED 0.02 | bpvf at STED 0.01 |")
    difference = average_rate_difference(report.curves[0].points, report.curves[1].points, "kg")
    assert f"| sheet | {difference:+.1f} % |" in parts[2] and f"| mean | {difference:+.1f} % |" in parts[2]


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


def test_one_codec_with_several_settings(sheet: Path) -> None:
    made = sweep.run([str(sheet)], ["pca", "pca:segment=4"], [50.0])
    assert [(curve.codec, curve.settings["segment"] == 4) for curve in made.curves] == [("pca", False), ("pca:segment=4", True)]
    assert made.curves[0].points[0]["bytes"] != made.curves[1].points[0]["bytes"]
    for codec, missing in (("pca:segment", "ID:KEY=VALUE"), ("pca:segments=4", "segments"), ("pca:segment=0", "segment")):
        with pytest.raises(InputError, match=missing):
            sweep.run([str(sheet)], [codec])


def test_sections_of_segments_are_one_bar() -> None:
    sections = {"mesh": 5, "basis.0": 1, "coefficients.0": 7, "basis.1": 2, "video": 3, "clip.0": 4}
    assert group_sections(sections) == {"mesh": 5, "basis x 2": 3, "coefficients.0": 7, "video": 3, "clip.0": 4}


def test_bars_are_as_long_as_their_share(run: Run, tmp_path: Path) -> None:
    """In the encode report and in info alike; a whole file would be 40 characters."""
    gvpipe.write(waving(10, 30), tmp_path / "w.npz")
    encoded = run("encode", tmp_path / "w.npz", tmp_path / "w.mp4", "--codec", "pca", "--segment", 10)
    told = run("info", tmp_path / "w.mp4")
    rows = [line for line in told.out.splitlines() if " bytes " in line]
    assert rows == [line for line in encoded.out.splitlines() if " bytes " in line and " bpvf" in line]
    assert any(line.strip().startswith("basis x 3") for line in rows)
    size = (tmp_path / "w.mp4").stat().st_size
    total = 0.0
    for line in rows:
        count, bpvf = int(line.split(" bytes")[0].split()[-1]), float(line.split(" bpvf")[0].split()[-1])
        assert bpvf == pytest.approx(8 * count / 3000, abs=1e-4)
        length = len(line.partition(" bpvf")[2].strip())
        assert math.isclose(length, 40 * count / size, abs_tol=1.01)
        total += bpvf
    assert total == pytest.approx(8 * size / 3000, abs=1e-3)


def test_every_codec_by_default(sheet: Path) -> None:
    assert set(codec_ids()) >= {"mcgv", "pca", "pdct"}
    named = sweep.default_codecs()
    assert {name.split(":")[0] for name in named} == set(codec_ids()) and len(named) == len(codec_ids()) + 2
    assert {"mcgv", "mcgv:transform=klt", "mcgv:prediction=affine"} <= set(named)
    assert {curve.codec for curve in sweep.run([str(sheet)], codec_ids(), (50,)).curves} == set(codec_ids())
