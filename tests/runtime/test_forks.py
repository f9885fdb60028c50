"""Videos in use go on in forked and spawned processes, as in PyTorch's data loaders."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import InputError
from gvpipe.io.frames.spool import Spool
from gvpipe.playback.player import Player
from gvpipe.runtime.forks import ForkLock

WAIT = 60  # seconds: a child that hangs is ended then

forks = [
    pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork"),
    pytest.mark.filterwarnings("ignore:This process.*is multi-threaded:DeprecationWarning"),
]


def in_child(method: str, work: Callable[..., Any], *arguments: Any) -> Any:
    """What a function returns in a child process; fails if the child hangs."""
    context = multiprocessing.get_context(method)
    receiving, sending = context.Pipe(duplex=False)
    child: Any = context.Process(target=send, args=(sending, work, arguments))  # type: ignore[attr-defined]
    child.start()
    sending.close()
    try:
        if not receiving.poll(WAIT):
            pytest.fail("the child hangs")
        return receiving.recv()
    finally:
        child.kill()
        child.join()
        receiving.close()


def send(sending: Any, work: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
    """Run in the child."""
    sending.send(work(*arguments))


def all_frames(video: Player) -> Float32:
    """Frame by frame, so that they are read ahead, and as a block, whose groups are decoded on threads."""
    return np.concatenate([np.stack(list(video)), video[:]])


@pytest.fixture
def used(tmp_path: Path) -> Player:
    """A video with pictures that has played, so that it has threads."""
    path = tmp_path / "a.mp4"
    gvpipe.encode(waving(8, 40), path, preset="ultrafast", clusters=3, gop=4, prediction="affine", placement="halves")
    video = gvpipe.open(path)
    for k in range(12):
        video[k]
    video[:]
    return video


@pytest.mark.parametrize("method", [pytest.param("fork", marks=forks), "spawn"])
def test_a_used_video_plays_on_in_a_child(used: Player, method: str) -> None:
    np.testing.assert_array_equal(in_child(method, all_frames, used), all_frames(used))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:This process.*is multi-threaded:DeprecationWarning")
def test_a_fork_while_another_thread_decodes(used: Player, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = all_frames(used)
    used.close()
    read, begun, go_on = used._reader.read, threading.Event(), threading.Event()

    def slow(start: int, stop: int) -> Float32:
        begun.set()
        go_on.wait(WAIT)
        return read(start, stop)

    monkeypatch.setattr(used._reader, "read", slow)
    thread = threading.Thread(target=lambda: used[0])
    thread.start()
    begun.wait(WAIT)
    np.testing.assert_array_equal(in_child("fork", all_frames, used), expected)
    go_on.set()
    thread.join()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:This process.*is multi-threaded:DeprecationWarning")
def test_parsed_frames_in_two_processes() -> None:
    spool, values = Spool(2, 8), np.zeros(1)
    spool.store(1, np.array([1.5]))
    assert in_child("fork", store_and_fetch, spool) == (False, True, 2.5)  # it would share the position in the parent's file
    assert spool.fetch(1, values) and values[0] == 1.5


def store_and_fetch(spool: Spool) -> tuple[bool, bool, float]:
    """Run in the child."""
    values = np.zeros(1)
    is_held = spool.fetch(1, values)
    spool.store(1, np.array([2.5]))
    return is_held, spool.fetch(1, values), float(values[0])


def test_a_pickled_video_is_opened_again(used: Player, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    data = pickle.dumps(gvpipe.open("a.mp4"))
    assert len(data) < 1000  # its path, not its frames
    monkeypatch.chdir("/")
    np.testing.assert_array_equal(pickle.loads(data)[7], used[7])
    np.testing.assert_array_equal(copy.deepcopy(used)[7], used[7])
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(used.sequence())).read(3, 5), used[3:5])
    os.remove(used.path)
    with pytest.raises(InputError, match="no such file"):
        pickle.loads(data)


def test_a_level_of_detail_is_pickled(tmp_path: Path) -> None:
    gvpipe.encode(waving(16, 5), tmp_path / "a.mp4", codec="pca")
    level = gvpipe.open(tmp_path / "a.mp4").level(1)
    again = pickle.loads(pickle.dumps(level))
    np.testing.assert_array_equal(again.read(0, 5), level.read(0, 5))
    np.testing.assert_array_equal(again.faces, level.faces)


def test_a_field_says_why_it_is_not_pickled(tmp_path: Path) -> None:
    sequence = waving(4, 5)
    stress = np.arange(5 * sequence.n_vertices, dtype=np.float32).reshape(5, -1)
    source = gvpipe.MeshSequence(sequence.read(0, 5), sequence.faces, fields={"stress": stress})
    gvpipe.encode(source, tmp_path / "a.mp4", codec="pdct")
    with pytest.raises(TypeError, match="'stress' of .*a.mp4 cannot be pickled.*pickle the video"):
        pickle.dumps(gvpipe.open(tmp_path / "a.mp4").fields["stress"])


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
@pytest.mark.filterwarnings("ignore:This process.*is multi-threaded:DeprecationWarning")
def test_a_lock_is_free_in_a_child() -> None:
    lock, held, release = ForkLock(), threading.Event(), threading.Event()

    def hold() -> None:
        with lock:
            held.set()
            release.wait(WAIT)

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait(WAIT)
    assert in_child("fork", is_free, lock)
    release.set()
    thread.join()


def is_free(lock: ForkLock) -> bool:
    """Run in the child."""
    with lock, lock:
        return True


@pytest.mark.slow
@pytest.mark.parametrize("method", [pytest.param("fork", marks=forks), "spawn"])
def test_a_data_loader(used: Player, method: str) -> None:
    data = pytest.importorskip("torch.utils.data")
    loader = data.DataLoader(used, batch_size=4, num_workers=2, multiprocessing_context=method, timeout=WAIT)
    np.testing.assert_array_equal(np.concatenate([batch.numpy() for batch in loader]), used[:])
