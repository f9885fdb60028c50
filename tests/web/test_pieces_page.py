"""A page of several geometry videos: they are shots of one file in it, which plays as one."""

from __future__ import annotations

import base64
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.foundation.errors import InputError

Run = Callable[..., Any]


@pytest.fixture(scope="module")
def pieces(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """Two runs of half a second, of other vertices."""
    folder = tmp_path_factory.mktemp("pieces")
    paths = [folder / "a-000.mp4", folder / "a-001.mp4"]
    for side, path in zip((5, 7), paths, strict=True):
        gvpipe.encode(waving(side, 6).with_fps(12.0), path, "pca", stream=side == 7)
    return paths


def held(page: Path) -> bytes:
    """The file in a page."""
    (text,) = re.findall(r'<script type="text/plain" id="video">(.*?)</script>', page.read_text("utf-8"))
    return base64.b64decode(text)


def test_files_are_shots_of_one_file(pieces: list[Path], tmp_path: Path, run: Run) -> None:
    page = tmp_path / "a.html"
    assert run("export-html", *pieces, page).status == 0
    assert "autoplay loop>" in page.read_text("utf-8")
    (tmp_path / "held.mp4").write_bytes(held(page))
    with gvpipe.open_capture(tmp_path / "held.mp4") as found:
        assert (found.lengths, found.fps) == ((6, 6), 12.0)
        for number, path in enumerate(pieces):
            assert np.array_equal(found.shots[number][2], gvpipe.open(path)[2])
    report = gvpipe.export_html(pieces[0], page)
    assert held(page) == pieces[0].read_bytes() and report.video_bytes == pieces[0].stat().st_size


def test_a_capture_goes_in_as_it_is(pieces: list[Path], tmp_path: Path) -> None:
    capture = gvpipe.Capture([gvpipe.open(path).sequence() for path in pieces], "both")
    gvpipe.encode(capture, tmp_path / "both.mp4", "pca")
    report = gvpipe.export_html(tmp_path / "both.mp4", tmp_path / "a.html")
    assert held(tmp_path / "a.html") == (tmp_path / "both.mp4").read_bytes() and not report.converted
    gvpipe.export_html(tmp_path / "both.mp4", tmp_path / "b.html", then=pieces[:1])
    (tmp_path / "held.mp4").write_bytes(held(tmp_path / "b.html"))
    assert gvpipe.open_capture(tmp_path / "held.mp4").lengths == (6, 6, 6)


def test_refusals(pieces: list[Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a-000\.mp4 is one of several, which are not converted; encode it for browsers"):
        gvpipe.export_html(pieces[0], tmp_path / "a.html", then=pieces[1:], convert=True)
    gvpipe.encode(waving(5, 3).with_fps(24.0), tmp_path / "fast.mp4", "pca")
    with pytest.raises(InputError, match=r"a-000\.mp4 plays at 12 frames per second and .* at 24; a page has one rate"):
        gvpipe.export_html(pieces[0], tmp_path / "a.html", then=[tmp_path / "fast.mp4"])
    assert not (tmp_path / "a.html").exists()
