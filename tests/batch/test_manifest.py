"""Manifests: lines that last, one that a kill cut short, and those of other runs."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import pytest

from gvpipe.batch.manifest import NAME, Entry, open_manifest
from gvpipe.foundation.errors import InputError

SETTINGS = {"codecs": [{"id": "pca", "quality": 75.0}]}
ENTRY = Entry("in/a.npz", "ab", "a.mp4", None, 5, 0.1, "0.1.0", SETTINGS)
LINE = json.dumps(dataclasses.asdict(ENTRY)) + "\n"


def test_the_last_line_of_an_output_counts(tmp_path: Path) -> None:
    failed = dataclasses.replace(ENTRY, error="no", hash=None, bytes=0)
    for entry in (failed, ENTRY):
        with open_manifest(tmp_path, SETTINGS) as manifest:
            manifest.add(entry)
            assert (tmp_path / NAME).read_text().endswith(json.dumps(dataclasses.asdict(entry)) + "\n")
    with open_manifest(tmp_path, SETTINGS) as manifest:
        assert manifest.entries == {"a.mp4": ENTRY}
    assert len((tmp_path / NAME).read_text().splitlines()) == 2


@pytest.mark.parametrize("length", [1, 10, len(LINE) - 1])
def test_a_line_cut_short_is_dropped(length: int, tmp_path: Path) -> None:
    (tmp_path / NAME).write_text(LINE + LINE[:length])
    with open_manifest(tmp_path, SETTINGS) as manifest:
        assert manifest.entries == {"a.mp4": ENTRY}
        manifest.add(ENTRY)
    assert (tmp_path / NAME).read_text() == LINE * 2


def changed(**values: Any) -> str:
    return json.dumps({**dataclasses.asdict(ENTRY), **values}) + "\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("hello\n", "line 1: it is no JSON"),
        (LINE + "[1]\n", r"line 2: it is \[1\]"),
        ('{"input": "a"}\n', "line 1: hash is missing"),
        (changed(bytes="5"), "bytes is '5'"),
        (changed(settings={"codecs": [], "target_kg": 0.1}), "other settings: codecs is .* there, .* here"),
        (changed(settings={**SETTINGS, "target_kg": 0.1}), "target_kg is 0.1 there, not given here"),
        (LINE + "hello", "its end is no line"),
        (LINE[:-1].replace("}", "\x00") + "\n", "no JSON"),
    ],
)
def test_other_manifests_are_refused(text: str, words: str, tmp_path: Path) -> None:
    (tmp_path / NAME).write_text(text)
    with pytest.raises(InputError, match=words) as raised, open_manifest(tmp_path, SETTINGS):
        pass
    assert str(tmp_path / NAME) in str(raised.value) and "remove the manifest" in str(raised.value)
    assert (tmp_path / NAME).read_text() == text


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_one_run_at_a_time(tmp_path: Path) -> None:
    with open_manifest(tmp_path, SETTINGS), pytest.raises(InputError, match="another gvpipe"):
        open_manifest(tmp_path, SETTINGS).__enter__()
