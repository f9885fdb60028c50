"""Decoded frames, kept and fetched ahead, so that playing and scrubbing seldom wait for a decoder.

What is fetched is a *group*: the frames that a codec decodes together (`gvpipe.coding.codec.GroupReader`). Groups are kept in
the order of their last use, up to a number of bytes. Once a few frames were asked for in a row, forwards or backwards, the
groups that come next are decoded on another thread. Jumps about cost what they ask for and nothing more.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor

import numpy as np

from gvpipe.foundation.arrays import Float32
from gvpipe.runtime.forks import renew_after_fork

CACHE_BYTES = 64 << 20  # of decoded positions
AHEAD_FRAMES = 8  # fetched ahead at least, in whole groups
STEADY = 3  # frames in a row that count as playing

Span = tuple[int, int]


class FrameCache:
    """Frames of one reader; thread-safe if ``read`` is.

    Args:
        read: ``read(start, stop) -> (stop - start, V, 3) float32``.
        group: ``group(frame) -> (start, stop)`` of the frames that are decoded together with a frame.
        n_frames: F.
        frame_bytes: bytes of a decoded frame. A group of more than half the cache counts as single frames.
    """

    def __init__(
        self, read: Callable[[int, int], Float32], group: Callable[[int], Span], n_frames: int, frame_bytes: int
    ) -> None:
        self._read, self._group, self._n_frames, self._frame_bytes = read, group, n_frames, frame_bytes
        self._groups: OrderedDict[Span, Future[Float32]] = OrderedDict()
        self._lock = threading.Lock()
        self._worker: ThreadPoolExecutor | None = None
        self._last, self._direction, self._run = -1, 0, 0
        renew_after_fork(self)

    def after_fork(self) -> None:
        """Begin anew in a forked child: threads that would fill the groups are not there."""
        self._lock = threading.Lock()
        self._worker = None
        self._groups = OrderedDict()
        self._run = 0

    def frame(self, index: int) -> Float32:
        """A copy of one frame ``(V, 3)``; raises what ``read`` raises."""
        with self._lock:
            span = self._span(index)
            ahead = self._upcoming(index, span)
            future = self._groups.get(span)
            if future is not None and future.cancel():  # waits in the queue: faster done here
                future = None
            mine = future is None
            if future is None:
                future = self._groups[span] = Future()
                future.set_running_or_notify_cancel()
            self._groups.move_to_end(span)
            for later in ahead:
                self._fetch(later)
            self._shrink(keep={span, *ahead})
        if mine:
            self._fill(future, span)
        try:
            return np.array(future.result()[index - span[0]])
        except CancelledError:  # dropped between two threads' steps
            return np.array(self._read(index, index + 1)[0])
        except Exception:
            with self._lock:
                if self._groups.get(span) is future:
                    del self._groups[span]  # asked for again, it is tried again
            raise

    def close(self) -> None:
        """Drop all frames and end the thread; both come back when they are needed."""
        with self._lock:
            worker, self._worker = self._worker, None
            for future in self._groups.values():
                future.cancel()
            self._groups.clear()
            self._run = 0
        if worker is not None:
            worker.shutdown()

    def _span(self, index: int) -> Span:
        start, stop = self._group(index)
        return (start, stop) if 2 * (stop - start) * self._frame_bytes <= CACHE_BYTES else (index, index + 1)

    def _upcoming(self, index: int, span: Span) -> list[Span]:
        """Note that a frame is asked for; return the groups after its own if frames are being played, nearest first."""
        step = index - self._last
        self._run = self._run + 1 if step in (1, -1) and step == self._direction else 1 if step else self._run
        self._last, self._direction = index, step if step else self._direction
        if self._run < STEADY:
            return []
        spans: list[Span] = []
        n_frames = 0
        while n_frames < AHEAD_FRAMES and (n_frames + span[1] - span[0]) * self._frame_bytes < CACHE_BYTES // 2:
            following = span[1] if self._direction > 0 else span[0] - 1
            if not 0 <= following < self._n_frames:
                break
            span = self._span(following)
            spans.append(span)
            n_frames += span[1] - span[0]
        return spans

    def _fetch(self, span: Span) -> None:
        if span in self._groups:
            self._groups.move_to_end(span)
            return
        if self._worker is None:
            self._worker = ThreadPoolExecutor(1, "gvpipe-read-ahead")
        self._groups[span] = self._worker.submit(self._read, *span)

    def _fill(self, future: Future[Float32], span: Span) -> None:
        try:
            future.set_result(self._read(*span))
        except BaseException as exc:
            future.set_exception(exc)

    def _shrink(self, keep: set[Span]) -> None:
        """Forget the groups that were used longest ago until the rest fits."""
        size = sum(stop - start for start, stop in self._groups) * self._frame_bytes
        for span in [span for span in self._groups if span not in keep]:
            if size <= CACHE_BYTES:
                break
            self._groups.pop(span).cancel()
            size -= (span[1] - span[0]) * self._frame_bytes
