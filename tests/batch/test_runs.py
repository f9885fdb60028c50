"""Many sequences: each becomes a file or a reason, and a second run does what is left."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from sequences import waving

import gvpipe
from gvpipe.batch import runs
from gvpipe.batch.encoding import hash_input
from gvpipe.batch.runs import encode_all
from gvpipe.datasets.entries import describe
from gvpipe.datasets.statistics import describe_positions
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.tasks.executor import Outcome, Prepare, WorkerDied

Run = Callable[..., Any]


class Here:
    """Does tasks in this process; those of an input called ``deadly.npz`` end their workers."""

    def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
        work = prepare(data)
        for index, task in enumerate(tasks):
            is_deadly = task.source.endswith("deadly.npz")
            yield Outcome(index, None, WorkerDied("its process was ended")) if is_deadly else Outcome(index, work(task))


class _Opened:
    def __enter__(self) -> Here:
        return Here()

    def __exit__(self, *error: object) -> None:
        pass


@pytest.fixture
def inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of three sequences, one of which is none."""
    for name in ("a", "more/b"):
        (tmp_path / "in" / name).parent.mkdir(parents=True, exist_ok=True)
        gvpipe.write(waving(4, 5), tmp_path / "in" / f"{name}.npz")
    (tmp_path / "in" / "bad.npz").write_text("no archive")
    monkeypatch.chdir(tmp_path)
    return tmp_path / "in"


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Workers are this process."""
    monkeypatch.setattr(runs, "open_executor", lambda scheduler, workers: _Opened())


def lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "manifest.jsonl").read_text().splitlines()]


@pytest.mark.usefixtures("here")
def test_failures_stop_nothing_and_the_rest_is_resumed(inputs: Path, tmp_path: Path) -> None:
    gvpipe.write(waving(4, 5), inputs / "deadly.npz")
    gvpipe.write(waving(4, 3), inputs / "frames" / "%02d.obj")
    out = tmp_path / "out"
    first = encode_all("in", "out", "pca", quality=50)
    assert (first.sequences, first.encoded, first.skipped) == (5, 3, 0)
    assert [("30 frames per second" in note, count) for note, count in first.notes.items()] == [(True, 1)]
    assert {Path(each["input"]).name: each["error"] for each in first.failed} == {
        "bad.npz": "in/bad.npz is not an .npz archive, or is cut short; write it again with numpy.savez",
        "deadly.npz": "its process was ended; give it more memory (fewer --workers), or fewer frames (--frames)",
    }
    entry = next(each for each in lines(out) if each["input"] == "in/more/b.npz")
    gvpipe.encode(inputs / "more" / "b.npz", tmp_path / "alone.mp4", "pca", quality=50)
    assert (out / "more" / "b.mp4").read_bytes() == (tmp_path / "alone.mp4").read_bytes()
    bitstream = gvpipe.open(tmp_path / "alone.mp4").bitstream
    assert {**entry, "seconds": 0} == {
        "input": "in/more/b.npz",
        "hash": hash_input("in/more/b.npz"),
        "output": "more/b.mp4",
        "error": None,
        "bytes": (tmp_path / "alone.mp4").stat().st_size,
        "seconds": 0,
        "gvpipe": gvpipe.__version__,
        "settings": {"codecs": [{"id": "pca", "quality": 50}]},
        "description": {**describe(bitstream), **describe_positions(bitstream)},
        "decided": "",
    }

    gvpipe.write(waving(4, 6), inputs / "a.npz")  # another input, a mended one, an output that has gone
    gvpipe.write(waving(4, 5), inputs / "bad.npz")
    before = (out / "more" / "b.mp4").stat().st_mtime_ns
    (inputs / "deadly.npz").unlink()
    again = encode_all("in", "out", "pca", quality=50)
    assert (again.encoded, again.skipped, again.failed, again.notes) == (2, 2, [], {})
    assert gvpipe.info(out / "a.mp4").frames == 6 and (out / "more" / "b.mp4").stat().st_mtime_ns == before
    (out / "bad.mp4").unlink()
    assert encode_all("in", "out", "pca", quality=50).encoded == 1 and (out / "bad.mp4").exists()


@pytest.mark.usefixtures("here", "inputs")
def test_refused_before_anything_runs(tmp_path: Path) -> None:
    for options, words in (
        ({"codec": "pcq"}, "no codec 'pcq'"),
        ({"quality": 101}, "quality is 101"),
        ({"target_kg": 1, "target_rmse": 1}, "more than one target"),
    ):
        with pytest.raises(SettingError, match=words):
            encode_all("in", "out", **options)
    assert not (tmp_path / "out").exists()
    with pytest.raises(SettingError, match="shorter segments save no memory"):
        encode_all("in", "out", "mcgv", memory=10**9)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_other_settings_are_refused_where_files_have_those(inputs: Path, tmp_path: Path) -> None:
    (tmp_path / "bad.npz").write_text("")
    assert encode_all("bad.npz", "out", "pca", workers=1).failed
    assert encode_all("bad.npz", "out", "pdct", workers=1).failed  # no file is of the first settings
    assert encode_all("in", "out", "pdct", workers=1).encoded
    with pytest.raises(InputError, match="other settings"):
        encode_all("in", "out", "pca", workers=1)


def test_hashes_cover_all_frames_and_the_mesh(tmp_path: Path) -> None:
    for number in range(2):
        (tmp_path / f"f_{number}.obj").write_text(str(number))
    one, other = str(tmp_path / "f_0.obj"), str(tmp_path / "f_1.obj")
    named = [(one, None), (str(tmp_path / "*.obj"), None), (one, other)]
    before = [hash_input(*each) for each in named]
    (tmp_path / "f_1.obj").write_text("changed")
    assert [hash_input(*each) == was for each, was in zip(named, before, strict=True)] == [True, False, False]
    with pytest.raises(InputError, match="no.npz: no such file"):
        hash_input(str(tmp_path / "no.npz"))


def test_command(inputs: Path, tmp_path: Path, run: Run) -> None:
    """In processes; what the first run did, the second skips."""
    options = ("--codec", "pca", "--workers", "1", "--set", "predictor=navg")
    first = run("encode-all", "in/**/*.npz", "out", *options, "--json")
    assert first.status == 1
    assert first.err == "Error: in/bad.npz is not an .npz archive, or is cut short; write it again with numpy.savez\n"
    report = json.loads(first.out)
    assert (report["sequences"], report["encoded"], len(report["failed"])) == (3, 2, 1)
    (inputs / "bad.npz").unlink()
    (inputs / "notes.txt").touch()
    second = run("encode-all", "in", "out", *options)
    assert (second.status, second.err) == (0, "Note: left out, of no format that gvpipe reads: 1 file\n")
    assert "2 sequences: 0 encoded, 2 were done, 0 failed" in second.out
    assert run("encode-all", "in", "out", "--codec", "pca", "--quality", "5").err.count("other settings") == 1


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="lists processes")
def test_killed_and_resumed(inputs: Path, tmp_path: Path) -> None:
    """A kill leaves whole files, whole lines and no process; the next run does the rest."""
    (inputs / "bad.npz").unlink()
    for number in range(12):
        gvpipe.write(waving(8, 30 + number), inputs / f"{number}.npz")
    command = [sys.executable, "-m", "gvpipe", "encode-all", "in", "out", "--codec", "pca", "--workers", "2", "--quiet"]
    process = subprocess.Popen(command)
    manifest = tmp_path / "out" / "manifest.jsonl"
    until = time.monotonic() + 120
    while time.monotonic() < until and not (manifest.exists() and manifest.stat().st_size):
        time.sleep(0.02)
    children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    process.send_signal(signal.SIGKILL)
    process.wait()
    n_done = len(lines(tmp_path / "out"))
    assert 0 < n_done < 14
    while time.monotonic() < until and any(map(_is_alive, children)):
        time.sleep(0.05)
    assert children == [] or not any(map(_is_alive, children))
    report = encode_all("in", "out", "pca", workers=2)
    assert report.skipped == n_done and report.encoded == 14 - n_done
    assert sorted(os.listdir(tmp_path / "out")) == sorted(
        [*(f"{number}.mp4" for number in range(12)), "a.mp4", "more", "manifest.jsonl"]
    )


def _is_alive(pid: str) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
