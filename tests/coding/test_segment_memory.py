"""Segments as short as a given memory needs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from sequences import waving

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.coding.registry import make_codec
from gvpipe.coding.segment_memory import FIXED, PER_POSITION, PER_VERTEX, fit_segments
from gvpipe.foundation.errors import SettingError


@pytest.mark.parametrize("codec", ["pca", "laplacian", "pdct"])
def test_segments_are_as_long_as_fits(codec: str) -> None:
    settings: Any = make_codec(codec, {"segment": 300})
    v = 100_000
    for n_frames in (1, 17, 299):
        memory = int(FIXED + PER_VERTEX * v + settings.memory_factor * PER_POSITION * v * (n_frames + 0.5))
        fitted: Any = fit_segments(settings, v, memory)
        assert fitted.segment == n_frames and fitted.quality == settings.quality
    assert fit_segments(settings, v, 10**12) == settings  # never longer than asked for


def test_clips_of_pdct_are_shortened_too() -> None:
    fitted: Any = fit_segments(make_codec("pdct", {"clip": 80}), 1_000_000, 2_000_000_000)
    assert fitted.clip == fitted.segment == 10


def test_too_little_memory_names_what_is_needed() -> None:
    with pytest.raises(
        SettingError, match=r"500 MB of memory are too little for 1000000 vertices.*about 1160 MB for one frame"
    ):
        fit_segments(make_codec("pca", {}), 1_000_000, 500_000_000)
    with pytest.raises(SettingError, match="codec mcgv fits all frames.*leave memory out, or choose laplacian or pca or pdct"):
        fit_segments([make_codec("mcgv", {})], 1000, 10**9)


def test_of_several_those_that_can_are_shortened() -> None:
    several = [make_codec(name, {}) for name in ("pca", "mcgv", "pdct")]
    fitted: Any = fit_segments(several, 1_000_000, 2_000_000_000)
    assert [each.id for each in fitted] == ["pca", "pdct"]


def test_files_have_such_segments(tmp_path: Path) -> None:
    sheet = waving(8, 40)
    gvpipe.write(sheet, tmp_path / "sheet.npz")
    memory = int(FIXED + sheet.n_vertices * (PER_VERTEX + 5 * PER_POSITION * 10.5))
    report = gvpipe.encode(sheet, tmp_path / "a.mp4", "pca", memory=memory)
    assert report.settings["segment"] == 10 and gvpipe.info(tmp_path / "a.mp4").settings["segments"] == 4
    words = ["encode", str(tmp_path / "sheet.npz"), str(tmp_path / "b.mp4"), "--codec", "pca", "--memory"]
    assert CliRunner().invoke(cli, [*words, f"{memory / 1000:f}kB"]).exit_code == 0
    assert (tmp_path / "b.mp4").read_bytes() == (tmp_path / "a.mp4").read_bytes()
    refused = CliRunner().invoke(cli, [*words, "much"])
    assert refused.exit_code == 2 and "--memory much: a number of bytes is needed, such as --memory 500MB" in refused.stderr
