"""What a file may cost before it is refused or shows its first frame: memory and work that follow from its size.

Few bytes can claim a lot: zeros may cost no bits, and deflate packs a thousand bytes into one. So each reader says what it is
about to allocate and to compute, before it does. It estimates both from counts: of vertices, frames, pixels, values. A file of
n bytes is refused where the sum exceeds::

    memory = max(64 MiB, 2000 n)
    work   = max(2 s, n x 20 us)   on two cores

What stays in memory while the file is open is kept; what a segment or a group of frames takes is asked for. A reader that was
told to trust the file has no budget (`UNLIMITED`). `docs/format.md` has the promise.
"""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from typing import Any

from gvpipe.foundation.errors import OverBudget

LEAST_BYTES = 64 << 20
BYTES_PER_BYTE = 2000
LEAST_SECONDS = 2.0
SECONDS_PER_BYTE = 20e-6
ALLOW = "if you trust its source, allow more by --unlimited (Python: unlimited=True)"


class Budget:
    """Memory and work for one file; thread-safe.

    Examples:
        >>> Budget(1000).ask("a picture", memory=1 << 20)
        >>> Budget(1000).ask("a picture", memory=1 << 30)
        Traceback (most recent call last):
        ...
        gvpipe.foundation.errors.OverBudget: a picture takes about 1.1 GB of memory; a file of 1 kB ...

    Args:
        n_bytes: n, of the file; None: whatever it takes.
        is_spare: whether work may run side by side where that takes more memory.
    """

    def __init__(self, n_bytes: int | None, is_spare: bool = True) -> None:
        self.n_bytes, self.is_spare = n_bytes, is_spare
        self.memory = float("inf") if n_bytes is None else max(LEAST_BYTES, BYTES_PER_BYTE * n_bytes)
        self.seconds = float("inf") if n_bytes is None else max(LEAST_SECONDS, SECONDS_PER_BYTE * n_bytes)
        self._kept_memory, self._kept_seconds = 0.0, 0.0
        self._lock = threading.Lock()

    def __getstate__(self) -> dict[str, Any]:
        """All but the lock, which no other process can have."""
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._lock = threading.Lock()

    def grow(self, n_bytes: int) -> None:
        """Allow what a file of ``n_bytes`` may take, for a file that comes by and by; never less than before."""
        if self.n_bytes is not None and n_bytes > self.n_bytes:
            with self._lock:
                self.n_bytes = n_bytes
                self.memory = max(LEAST_BYTES, BYTES_PER_BYTE * n_bytes)
                self.seconds = max(LEAST_SECONDS, SECONDS_PER_BYTE * n_bytes)

    @property
    def is_limited(self) -> bool:
        """Whether anything is ever refused."""
        return self.n_bytes is not None

    @property
    def memory_left(self) -> float:
        """Bytes that may still be asked for."""
        return max(0.0, self.memory - self._kept_memory)

    @property
    def memory_beside(self) -> float:
        """Bytes that work side by side may take, all of it together."""
        return self.memory_left if self.is_spare else 0.0

    @property
    def seconds_left(self) -> float:
        """Seconds of work that may still be asked for."""
        return max(0.0, self.seconds - self._kept_seconds)

    def ask(self, what: str, memory: float = 0, seconds: float = 0) -> None:
        """Check that there is room for a step, beside what is kept.

        Args:
            what: the step, for the message.
            memory: bytes, at its peak.
            seconds: of work.

        Raises:
            OverBudget: there is not.
        """
        memory, seconds = memory + self._kept_memory, seconds + self._kept_seconds
        if memory > self.memory:
            raise self._refused(what, f"{_bytes(memory)} of memory", _bytes(self.memory))
        if seconds > self.seconds:
            raise self._refused(what, f"{seconds:.1f} s of work", f"{self.seconds:.1f} s")

    def keep(self, what: str, memory: float = 0, seconds: float = 0) -> None:
        """As `ask`, for what stays as long as the file is open."""
        with self._lock:
            self.ask(what, memory, seconds)
            self._kept_memory += memory
            self._kept_seconds += seconds

    @contextlib.contextmanager
    def releasing(self) -> Iterator[None]:
        """Let go of the memory that is kept inside, at the end; work stays done. For one thread, while a file is opened."""
        before = self._kept_memory
        yield
        self._kept_memory = before

    def _refused(self, what: str, asked: str, allowed: str) -> OverBudget:
        size = _bytes(self.n_bytes or 0)
        refused = OverBudget(f"{what} takes about {asked}; a file of {size} may take {allowed}", ALLOW)
        refused.asked = f"{what} takes about {asked}"
        return refused


UNLIMITED = Budget(None)
THRIFTY = Budget(None, is_spare=False)  # for an encoder that reads its own file, and has much in memory itself


def _bytes(count: float) -> str:
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if count >= size:
            return f"{count / size:.3g} {unit}"
    return f"{count:.0f} bytes"
