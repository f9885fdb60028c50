"""Segments coded by workers: the same bytes, and one clear line for what cannot be."""

from __future__ import annotations

import pickle
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from sequences import held, partly_still, waving

import gvpipe
from gvpipe.cli.commands import cli
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.model.sequence import MeshSequence
from gvpipe.playback import files
from gvpipe.runtime.segment_map import map_segments, segments_mapped_by
from gvpipe.tasks.executor import Outcome, Prepare, WorkerDied
from gvpipe.tasks.segments import RemoteSegments, SharedSegments


class Here:
    """Does tasks in this process, the last one first; data and results are pickled on the way."""

    def __init__(self) -> None:
        self.n_tasks: list[int] = []

    def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
        self.n_tasks.append(len(tasks))
        work = prepare(data)
        for index in reversed(range(len(tasks))):
            task = pickle.loads(pickle.dumps(tasks[index]))
            yield Outcome(index, pickle.loads(pickle.dumps(work(task))))


def second(shared: Any, task: Any) -> Any:
    """Work for tests that never do it."""
    return task


def answering(error: Exception) -> Any:
    """An executor whose workers raise."""

    class Failing:
        def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
            yield Outcome(0, None, error)

    return Failing()


@pytest.mark.parametrize(
    ("codec", "kind"),
    [("pca", "moving"), ("pca", "held"), ("laplacian", "still"), ("laplacian", "held"), ("pdct", "moving"), ("pdct", "still")],
)
def test_same_bytes(codec: str, kind: str, tmp_path: Path) -> None:
    sequences = {"moving": waving(6, 12), "still": partly_still(), "held": held(waving(6, 6), [1, 3, 1, 2, 1, 1])}
    sequence = sequences[kind]
    gvpipe.write(sequence, tmp_path / "in.npz")
    gvpipe.encode(tmp_path / "in.npz", tmp_path / "here.mp4", codec=codec, segment=4)
    here = Here()
    elsewhere = RemoteSegments(here, given := gvpipe.read(tmp_path / "in.npz"), partial(gvpipe.read, tmp_path / "in.npz"))
    with segments_mapped_by(elsewhere):
        gvpipe.encode(given, tmp_path / "there.mp4", codec=codec, segment=4)
    assert (tmp_path / "there.mp4").read_bytes() == (tmp_path / "here.mp4").read_bytes()
    assert here.n_tasks and min(here.n_tasks) > 1


def test_processes_write_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a relative path; and from memory."""
    gvpipe.write(waving(6, 12), tmp_path / "in.npz")
    monkeypatch.chdir(tmp_path)
    for workers, target in ((None, "here.mp4"), (2, "there.mp4")):
        gvpipe.encode("in.npz", target, codec="pca", segment=4, workers=workers)
    sequence = gvpipe.read("in.npz")
    with segments_mapped_by(RemoteSegments(Here(), sequence, None)):
        gvpipe.encode(sequence, "memory.mp4", codec="pca", segment=4)
    files = [Path(name).read_bytes() for name in ("here.mp4", "there.mp4", "memory.mp4")]
    assert files[0] == files[1] == files[2]


@pytest.mark.parametrize("patience", [0.0, 1e9])
def test_much_work_is_shared_out(tmp_path: Path, patience: float) -> None:
    """The first segment is coded here, the others by workers if they take long enough; progress goes on."""
    gvpipe.write(waving(6, 20), tmp_path / "in.npz")
    given, here, told = gvpipe.read(tmp_path / "in.npz"), Here(), list[tuple[str, float]]()
    remote = RemoteSegments(here, given, partial(gvpipe.read, tmp_path / "in.npz"))
    gvpipe.encode(given, tmp_path / "here.mp4", codec="pca", segment=4)
    with segments_mapped_by(SharedSegments(remote, patience)):
        gvpipe.encode(given, tmp_path / "there.mp4", "pca", lambda stage, done: told.append((stage, done)), segment=4)
    assert (tmp_path / "there.mp4").read_bytes() == (tmp_path / "here.mp4").read_bytes()
    assert here.n_tasks == ([] if patience else [4])
    parts = [done for stage, done in told if stage == "segments"]
    assert parts == sorted(parts) and (not parts or parts[-1] == 1.0)


def test_work_is_done_here_where_workers_cannot(sequence: MeshSequence) -> None:
    """They were not asked for, so their errors are not the user's."""
    remote = RemoteSegments(answering(WorkerDied("it died")), sequence, None)
    told: list[float] = []
    assert SharedSegments(remote, 0.0)(second, None, [3, 4, 5], told.append) == [3, 4, 5]


def test_workers_by_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The command shares out much work; codecs that cannot and sequences in memory are coded here."""
    gvpipe.write(waving(6, 20), tmp_path / "in.npz")
    monkeypatch.setattr("gvpipe.api.count_cores", lambda: 2)
    monkeypatch.setattr(SharedSegments, "__call__", shared := Recorded())
    for codec in ("pca", "mcgv"):
        result = CliRunner().invoke(cli, ["encode", str(tmp_path / "in.npz"), str(tmp_path / f"{codec}.mp4"), "--codec", codec])
        assert result.exit_code == 0, result.output
    gvpipe.encode(gvpipe.read(tmp_path / "in.npz"), tmp_path / "own.mp4", "pca", workers="auto")
    assert shared.count == 1
    with pytest.raises(SettingError, match="workers is 'many'; an integer"):
        gvpipe.encode(tmp_path / "in.npz", tmp_path / "own.mp4", "pca", workers="many")


class Recorded:
    """Codes segments here, and counts how often it is asked."""

    count = 0

    def __call__(self, work: Any, shared: Any, tasks: Any, report: Any) -> list[Any]:
        self.count += 1
        return [work(shared, task) for task in tasks]


def test_codecs_that_fit_all_frames_together_are_refused(sequence: MeshSequence, tmp_path: Path) -> None:
    for codec in ("mcgv", "auto"):
        with pytest.raises(SettingError, match="codec mcgv fits all frames together.*laplacian or pca or pdct"):
            gvpipe.encode(sequence, tmp_path / "a.mp4", codec=codec, workers=2)
    assert list(tmp_path.iterdir()) == []


def test_errors_of_workers_are_one_line(sequence: MeshSequence) -> None:
    for error, words in (
        (WorkerDied("it died"), "segment 1 of 1.*it died.*--segment"),
        (InputError("no x"), "on a worker: no x"),
    ):
        with pytest.raises(InputError, match=words), segments_mapped_by(RemoteSegments(answering(error), sequence, None)):
            map_segments(second, None, [0], lambda done: None)


def test_another_file_there_is_refused(sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.write(sequence.part(0, 5), tmp_path / "in.npz")
    elsewhere = RemoteSegments(Here(), sequence, partial(files.read, tmp_path / "in.npz"))
    with pytest.raises(InputError, match="it has 5 frames of 72 vertices there, 11 frames of 72 vertices here"):
        elsewhere(second, None, [0], lambda done: None)


def test_frames_that_do_not_pickle_need_a_path() -> None:
    class Open:
        shape = (2, 3, 3)

        def __getitem__(self, key: slice) -> np.ndarray:
            return np.zeros((2, 3, 3), np.float32)[key]

    sequence = MeshSequence(Open(), np.array([[0, 1, 2]], np.int32))
    with pytest.raises(InputError, match="give its path"):
        RemoteSegments(Here(), sequence, None)(second, sequence, [0], lambda done: None)


def test_budgets_pickle() -> None:
    budget = Budget(1000)
    budget.keep("a step", memory=5)
    assert pickle.loads(pickle.dumps(budget)).memory_left == budget.memory_left
