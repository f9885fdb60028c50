"""A page of several geometry videos: each is in it, and they play one after the other, again and again."""

from __future__ import annotations

import base64
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import browsers
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
        gvpipe.encode(waving(side, 6).with_fps(12.0), path, "pca")
    return paths


def test_all_files_are_in_the_page(pieces: list[Path], tmp_path: Path, run: Run) -> None:
    page = tmp_path / "a.html"
    assert run("export-html", *pieces, page).status == 0
    held = re.findall(r'<script type="text/plain" id="video(\d*)">(.*?)</script>', page.read_text("utf-8"))
    assert [number for number, _ in held] == ["", "1"]
    assert [base64.b64decode(text) for _, text in held] == [path.read_bytes() for path in pieces]
    assert "autoplay>" in page.read_text("utf-8")
    report = gvpipe.export_html(pieces[0], page)
    assert "autoplay loop>" in page.read_text("utf-8") and report.video_bytes == pieces[0].stat().st_size


def test_files_that_need_a_conversion_are_refused(pieces: list[Path], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"a-000\.mp4 is one of several, which are not converted"):
        gvpipe.export_html(pieces[0], tmp_path / "a.html", then=pieces[1:], convert=True)


@pytest.mark.slow
@pytest.mark.skipif(bool(browsers.missing()), reason=browsers.missing())
def test_files_play_one_after_the_other(pieces: list[Path], tmp_path: Path, browser: Any) -> None:
    gvpipe.export_html(pieces[0], tmp_path / "a.html", then=pieces[1:])
    browser.get((tmp_path / "a.html").as_uri())
    look = "const e = document.querySelector('geometry-video'); return [e.getAttribute('src'), e.video?.vertexCount ?? 0]"
    met: list[str] = []
    end = time.monotonic() + 40
    while met[:3] != ["#video", "#video1", "#video"] and time.monotonic() < end:
        source, _ = browser.execute_script(look)
        met += [source] if not met or met[-1] != source else []
        time.sleep(0.05)
    assert met[:3] == ["#video", "#video1", "#video"]
    assert np.isfinite(browser.execute_script("return document.querySelector('geometry-video').currentTime"))
