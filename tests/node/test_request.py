"""Requests of the web player: answers that are too long, or that take too long, end in one line."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from file_server import serving
from folders import ROOT

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node")
SOURCE = ROOT / "gvpipe/web/src/format/request.js"


def ask(url: str, *options: object) -> str:
    """What comes of a request: how many bytes, or the message."""
    command = ["node", str(Path(__file__).with_name("run_request.mjs")), str(SOURCE), url, *map(str, options)]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout.strip()


@pytest.mark.parametrize("has_length", [False, True])
def test_more_bytes_than_are_asked_for(has_length: bool) -> None:
    with serving(bytes(100_000)) as (url, served):
        served.has_length = has_length
        assert ask(url, 100_000) == "100000"
        assert ask(url, 99_999) == f"{url} has more than 99999 bytes, which is all that a page takes of it; open it in Python"


@pytest.mark.slow
def test_an_answer_that_takes_too_long() -> None:
    with serving(bytes(1000)) as (url, served):
        served.drip = 0.05
        assert "it comes too slowly" in ask(url, 1000, 1)
