"""One codec for many sequences: a few choose for all, and later runs keep to it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from sequences import waving

import gvpipe
from gvpipe.batch import decision, runs
from gvpipe.batch.decision import choose
from gvpipe.batch.runs import encode_all
from gvpipe.coding.registry import codec_class
from gvpipe.foundation.errors import InputError
from gvpipe.tasks.executor import Outcome, Prepare


class Here:
    """Does tasks in this process."""

    def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
        work = prepare(data)
        return (Outcome(index, work(task)) for index, task in enumerate(tasks))

    def __enter__(self) -> Here:
        return self

    def __exit__(self, *error: object) -> None:
        pass


@pytest.fixture
def inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of five sequences, encoded in this process."""
    (tmp_path / "in").mkdir()
    for k in range(5):
        gvpipe.write(waving(4 + k, 3), tmp_path / "in" / f"s{k}.npz")
    monkeypatch.setattr(runs, "open_executor", lambda scheduler, workers: Here())
    return tmp_path / "in"


def _lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]


CANDIDATES = [codec_class("pca").from_texts({}), codec_class("pdct").from_texts({})]


def test_three_choose_for_all(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tried: list[str] = []

    def chosen(keywords: dict[str, Any], source: str) -> tuple[int, int] | None:
        tried.append(Path(source).stem)
        return (1 if source.endswith(("s2.npz", "s4.npz")) else 0), 100

    monkeypatch.setattr(decision, "choose", chosen)
    report = encode_all(inputs, tmp_path / "out", CANDIDATES)
    assert tried == ["s0", "s2", "s4"] and report.encoded == 5
    assert report.decided == (
        "codec pdct for all, the choice of 2 of 3 sequences that were tried, of 5; --each lets each choose"
    )
    assert {line["decided"] for line in _lines(tmp_path / "out")} == {"pdct"}
    assert {gvpipe.info(path).codec for path in (tmp_path / "out").glob("*.mp4")} == {"pdct"}
    gvpipe.write(waving(9, 3), inputs / "t.npz")
    monkeypatch.setattr(decision, "choose", lambda *_: pytest.fail("decided twice"))
    again = encode_all(inputs, tmp_path / "out", CANDIDATES)
    assert (again.encoded, again.skipped) == (1, 5) and "as an earlier run decided" in again.decided
    with pytest.raises(InputError, match="other settings: each"):
        encode_all(inputs, tmp_path / "out", CANDIDATES, each=True)


def test_each_chooses(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision, "choose", lambda *_: pytest.fail("decided for all"))
    assert encode_all(inputs, tmp_path / "each", CANDIDATES, each=True).decided == ""
    assert _lines(tmp_path / "each")[0]["settings"]["each"] is True
    for path in sorted(inputs.iterdir())[3:]:
        path.unlink()
    assert encode_all(inputs, tmp_path / "few", CANDIDATES).decided == ""
    assert encode_all(inputs, tmp_path / "one", "pca", each=True).decided == ""  # nothing to choose


def test_where_no_sequence_can_be_tried(inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision, "choose", lambda *_: None)
    report = encode_all(inputs, tmp_path / "out", CANDIDATES)
    assert report.decided == "" and report.encoded == 5


def test_a_sequence_chooses(inputs: Path) -> None:
    found = choose({"codec": CANDIDATES, "bare": True}, str(inputs / "s4.npz"))
    assert found is not None
    gvpipe.encode(inputs / "s4.npz", inputs.parent / "a.mp4", CANDIDATES, bare=True)
    video = gvpipe.info(inputs.parent / "a.mp4")
    assert CANDIDATES[found[0]].id == video.codec and found[1] == video.bytes
    assert choose({"codec": CANDIDATES}, str(inputs / "none.npz")) is None
