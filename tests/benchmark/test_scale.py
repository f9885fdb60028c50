"""How costs grow with size: the meshes, the points, their report and pictures."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from gvpipe.benchmark import growth, own_process, scale
from gvpipe.benchmark.scale_plots import draw, row_of
from gvpipe.benchmark.scale_report import ScalePoint, ScaleReport, table
from gvpipe.benchmark.torus import make_torus
from gvpipe.cli.commands import cli
from gvpipe.foundation.errors import InputError

POINTS = [
    ScalePoint("pca", n, 16, 10 * n, 16, n / 1000, n / 1000, 300 + n / 100, n / 2000, n / 2000, 200 + n / 100)
    for n in (1000, 10_000, 100_000)
]
LONG = [ScalePoint("pca", 1000, n, 10 * n, min(n, 500), n / 100, n / 100, 300.0) for n in (10, 100)]
REPORT = ScaleReport("1", {}, ["gvpipe", "bench", "--scale"], POINTS + LONG)


@pytest.mark.parametrize("wanted", [1, 9, 1000, 4099])
def test_a_torus_of_any_size(wanted: int) -> None:
    torus = make_torus(wanted, 7)
    assert 9 <= torus.n_vertices <= max(wanted, 9) and torus.n_vertices >= wanted - math.isqrt(wanted)
    assert len(torus.faces) == 2 * torus.n_vertices  # closed, of genus 1
    edges = np.sort(torus.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    frames = torus.read(0, 7)
    assert np.array_equal(frames[3:5], torus.read(3, 5))
    assert (np.abs(np.diff(frames, axis=0)).max(axis=2) > 0).all()  # no vertex rests


def test_reports_are_read_as_written(tmp_path: Path) -> None:
    REPORT.write(tmp_path / "r.json")
    assert ScaleReport.read(tmp_path / "r.json") == REPORT
    values = json.loads((tmp_path / "r.json").read_text())
    values["scale"][1]["encode_s"] = "long"
    (tmp_path / "w.json").write_text(json.dumps(values))
    with pytest.raises(InputError, match="point 1 has encode_s of another type"):
        ScaleReport.read(tmp_path / "w.json")


def test_growth() -> None:
    assert growth.exponents(POINTS, "encode_s") == pytest.approx([1, 1])
    assert growth.exponents(LONG, "decode_s") == []
    fixed = [dataclasses.replace(point, encode_s=2 + (point.encode_s or 0)) for point in POINTS]
    assert growth.fit_line(fixed, "encode_s") == pytest.approx((2, 1 / 16_000, 1), rel=1e-3)
    line = growth.fit_line([dataclasses.replace(POINTS[0], encode_s=4.0), *POINTS[1:]], "encode_s")
    assert line and 1.1 < line.factor < 4
    assert growth.fit_line(LONG, "encode_s") is None
    assert row_of(REPORT.scale, "vertices") == POINTS and row_of(REPORT.scale, "frames") == [LONG[0], POINTS[0], LONG[1]]
    assert row_of(POINTS, "frames") == []
    assert "| pca | 100,000 | 16 | 1,000 | 100 | 100 | 1,300 | 50.0 | 50.0 | 1,200 |" in table(POINTS)
    assert table(LONG).endswith("| 1.0 | 1.0 | 300 | - | - | - |")


@pytest.mark.slow
def test_pictures(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    paths = draw(REPORT, tmp_path / "plots")
    assert [path.name for path in paths] == ["scale-vertices.png", "scale-frames.png"]
    assert all(path.read_bytes()[:4] == b"\x89PNG" for path in paths)
    with pytest.raises(InputError, match="no curve"):
        draw(dataclasses.replace(REPORT, scale=POINTS[:1]), tmp_path)
    REPORT.write(tmp_path / "r.json")
    drawn = CliRunner().invoke(cli, ["plot", str(tmp_path / "r.json"), str(tmp_path / "again"), "--json"])
    assert drawn.exit_code == 0 and len(json.loads(drawn.stdout)["plots"]) == 2


@pytest.mark.parametrize(
    ("words", "message"),
    {
        (): "a sequence is needed, or --scale",
        ("a.npz", "--vertices", "10"): "--vertices is for --scale alone",
        ("a.npz", "--scale"): "leave a.npz out",
        ("--scale", "--set", "segment=3"): "--set is not for --scale",
        ("--scale", "--frames", "0,10"): "sizes start at 1",
        ("--scale", "--vertices", "many"): "numbers with commas between",
        ("--scale", "--limit", "0"): "--limit",
    }.items(),
)
def test_options_that_do_not_fit(words: tuple[str, ...], message: str) -> None:
    refused = CliRunner().invoke(cli, ["bench", *words])
    assert refused.exit_code == 2 and message in refused.stderr


def test_a_command_that_fails_says_why() -> None:
    with pytest.raises(InputError, match=r"gvpipe info none\.mp4 failed: Error: none\.mp4: no such file"):
        own_process.measure_command(["info", "none.mp4"])


@pytest.mark.slow
def test_points_are_what_commands_take() -> None:
    made = scale.run(["pdct:segment=5"], [100], [12])
    assert [(p.codec, p.vertices, p.frames) for p in made.scale] == [("pdct:segment=5", 100, 16), ("pdct:segment=5", 992, 12)]
    assert made.scale[-1].segment_frames == 4  # 12 frames in three clips
    for point in made.scale:
        assert point.bytes and point.encode_s and point.decode_s
        if point.encode_peak_mb and point.decode_peak_mb:
            assert point.segment_mb < point.decode_peak_mb < 1000 and point.encode_peak_mb < 1000
    late = scale.run(["pca"], [100, 200], [10], limit=0.01).scale
    assert [(p.vertices, p.encode_s, p.bytes) for p in late] == [(100, None, None), (992, None, None)]
