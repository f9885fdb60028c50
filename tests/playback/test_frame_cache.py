"""Any access pattern, from any thread, gives the frames asked for, within bounds of memory."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import CorruptFile
from gvpipe.playback import frame_cache
from gvpipe.playback.frame_cache import FrameCache

N_FRAMES = 60
GROUP = 8


class Reader:
    """Frames that know their number, in groups of eight; counts what is read."""

    def __init__(self, n_vertices: int = 5) -> None:
        self.n_vertices = n_vertices
        self.reads: list[tuple[int, int]] = []
        self.threads: set[int] = set()
        self.lock = threading.Lock()

    def read(self, start: int, stop: int) -> Float32:
        with self.lock:
            self.reads.append((start, stop))
            self.threads.add(threading.get_ident())
            numbers = np.arange(start, stop, dtype=np.float32)
            return np.broadcast_to(numbers[:, None, None], (stop - start, self.n_vertices, 3)).copy()

    def group(self, frame: int) -> tuple[int, int]:
        start = frame - frame % GROUP
        return start, min(start + GROUP, N_FRAMES)

    def cache(self) -> FrameCache:
        return FrameCache(self.read, self.group, N_FRAMES, 12 * self.n_vertices)


ORDERS: dict[str, Callable[[], list[int]]] = {
    "forwards": lambda: list(range(N_FRAMES)),
    "backwards": lambda: list(range(N_FRAMES))[::-1],
    "random": lambda: np.random.default_rng(3).integers(0, N_FRAMES, 200).tolist(),
    "to and fro": lambda: [abs((k % 40) - 20) + 20 for k in range(120)],
    "one": lambda: [7] * 30,
}


@pytest.mark.parametrize("name", ORDERS)
def test_every_order_gives_the_frames_asked_for(name: str) -> None:
    reader = Reader()
    cache = reader.cache()
    for k in ORDERS[name]():
        assert (cache.frame(k) == k).all()
    cache.close()
    assert len(reader.reads) == len(set(reader.reads)), "a group was decoded twice although all fit"


@pytest.mark.parametrize("frames", [range(N_FRAMES), range(N_FRAMES - 1, -1, -1)])
def test_playing_either_way_decodes_ahead_on_another_thread(frames: range) -> None:
    reader = Reader()
    cache = reader.cache()
    for k in frames:
        cache.frame(k)
    cache.close()
    assert len(reader.threads) == 2
    assert sorted(reader.reads) == [(k, min(k + GROUP, N_FRAMES)) for k in range(0, N_FRAMES, GROUP)]


def test_jumps_decode_only_their_groups() -> None:
    reader = Reader()
    cache = reader.cache()
    for k in (17, 18, 40, 3, 4, 59):
        cache.frame(k)
    cache.close()
    assert reader.reads == [(16, 24), (40, 48), (0, 8), (56, 60)]


def test_memory_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_cache, "CACHE_BYTES", 3 * GROUP * 12 * 5)
    reader = Reader()
    cache = reader.cache()
    for k in [*range(N_FRAMES), *range(0, N_FRAMES, 5)]:
        assert (cache.frame(k) == k).all()
        assert sum(stop - start for start, stop in cache._groups) <= 5 * GROUP  # the cache, and what is on its way
    monkeypatch.setattr(frame_cache, "CACHE_BYTES", GROUP * 12 * 5)
    cache.close()
    reader.reads.clear()
    assert (cache.frame(11) == 11).all()
    assert reader.reads == [(11, 12)], "a group that does not fit is read frame by frame"


def test_an_error_reaches_the_frame_it_belongs_to_and_is_not_kept() -> None:
    reader = Reader()
    broken = {3}

    def read(start: int, stop: int) -> Float32:
        if start // GROUP in broken:
            raise CorruptFile("group 3")
        return reader.read(start, stop)

    cache = FrameCache(read, reader.group, N_FRAMES, 60)
    for k in range(24):
        assert (cache.frame(k) == k).all()
    for _ in range(2):
        with pytest.raises(CorruptFile, match="group 3"):
            cache.frame(24)
    broken.clear()
    assert (cache.frame(24) == 24).all()
    cache.close()
    assert (cache.frame(25) == 25).all()


def test_a_frame_is_the_callers_own() -> None:
    cache = Reader().cache()
    cache.frame(5)[:] = -1
    assert (cache.frame(5) == 5).all()


def test_many_threads_share_a_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_cache, "CACHE_BYTES", 3 * GROUP * 12 * 5)
    cache = Reader().cache()

    def visit(seed: int) -> bool:
        starts = np.random.default_rng(seed).integers(0, N_FRAMES - 6, 40)
        return all((cache.frame(int(k) + i) == k + i).all() for k in starts for i in range(6))

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(visit, range(16)))
    cache.close()
