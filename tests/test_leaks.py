"""Players leave nothing behind: no thread, no memory, no descriptor, whoever lets go of them, and wherever."""

from __future__ import annotations

import gc
import os
import subprocess
import sys
import threading
import weakref
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from asset_scene import scene
from folders import GOLDEN, ROOT
from sequences import waving

import gvpipe

FILES = sorted(path for path in GOLDEN.glob("*.mp4"))
CYCLES = int(os.environ.get("GVPIPE_SOAK", "2000"))  # of the soak test, over all files
WARM_UP = 3  # rounds before memory is measured: caches fill
FLAT = 4 << 20  # bytes that memory may grow by in the second half: 4 KB a player of 2,000


def play(path: Path) -> gvpipe.Player:
    """Open a file, and read it as players do: in a row, backwards, at random, whole."""
    video = gvpipe.open(path)
    for k in (0, 1, 2, 3, len(video) - 1, len(video) - 2, len(video) - 3, len(video) - 4):
        video[k]
    video[:]
    assert all(len(attribute.values) for attribute in video.attributes.values())
    assert all(len(field[0:1]) for field in video.fields.values())
    return video


def own_threads() -> list[str]:
    """Names of the threads that play and decode."""
    return [thread.name for thread in threading.enumerate() if thread.name.startswith(("gvpipe", "ThreadPoolExecutor"))]


def resident() -> int:
    """Bytes of memory that the process holds."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.parametrize("name", ["laplacian-1-still", "mcgv-1-h264", "mcgv-1-klt", "pca-1-still", "pdct-1-asset"])
def test_closing_a_player_ends_its_threads_and_dropping_it_frees_it(name: str) -> None:
    before = own_threads()
    play(GOLDEN / f"{name}.mp4").close()  # compilers of kernels leave circles behind
    gc.collect()
    gc.disable()  # the last reference must do
    try:
        video = play(GOLDEN / f"{name}.mp4")
        video.close()
        assert set(own_threads()) <= set(before)
        assert len(video[0]) == video.shape[1]  # it stays usable
        video.close()
        kept: list[weakref.ref[Any]] = [
            weakref.ref(video),
            weakref.ref(video._reader),
            weakref.ref(video._cache),
            weakref.ref(video._asset),
        ]
        del video
        assert [each() for each in kept] == [None] * len(kept)
    finally:
        gc.enable()


def test_a_player_that_is_dropped_open_ends_its_threads(tmp_path: Path) -> None:
    gvpipe.encode(waving(8, 40), tmp_path / "a.mp4", gop=5, quality=95, prediction="affine", clusters=1)
    before = set(threading.enumerate())
    gc.disable()
    try:
        video = gvpipe.open(tmp_path / "a.mp4")
        for k in range(12):
            video[k]
        video[:]
        new = set(threading.enumerate()) - before
        assert new
        del video
        for thread in new:
            thread.join(10)
        assert not any(thread.is_alive() for thread in new)
    finally:
        gc.enable()


def test_fields_outlive_their_player(tmp_path: Path) -> None:
    gvpipe.encode(scene(), tmp_path / "a.mp4", "pdct")
    fields = gvpipe.open(tmp_path / "a.mp4").fields
    gc.collect()
    assert all(len(field[:]) for field in fields.values())


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_memory_threads_and_descriptors_stay_flat_over_thousands_of_players() -> None:
    """In a process whose C library gives all threads one arena: with many, memory grows by what each of them once held."""
    paths = os.pathsep.join([str(ROOT), str(ROOT / "codecs"), str(ROOT / "tests")])
    environment = {**os.environ, "MALLOC_ARENA_MAX": "1", "PYTHONPATH": paths}
    done = subprocess.run([sys.executable, __file__], capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    print(done.stdout)


def soak() -> None:
    """Open, play and close every golden file in turn, every other player in a thread that then ends."""

    def run(i: int) -> None:
        video = play(FILES[i % len(FILES)])
        if i % 3:
            video.close()

    for i in range(WARM_UP * len(FILES)):
        run(i)
    gc.collect()
    threads, descriptors = own_threads(), len(os.listdir("/proc/self/fd"))
    sizes = []
    for i in range(CYCLES):
        if i % 2:
            thread = threading.Thread(target=run, args=(i,))
            thread.start()
            thread.join()
        else:
            run(i)
        if i % 100 == 99:
            sizes.append(resident())
    gc.collect()
    assert len(own_threads()) <= len(threads) + 2  # those of the last players may still be ending
    assert len(os.listdir("/proc/self/fd")) <= descriptors + 2
    quarter = len(sizes) // 4
    grown = int(np.median(sizes[-quarter:]) - np.median(sizes[quarter : 2 * quarter]))
    assert grown < FLAT, sizes
    print(f"{CYCLES} players: {grown >> 10} KB more in the last quarter than in the second")


if __name__ == "__main__":
    soak()
