"""What files of one connectivity have in common, decoded once: triangles, hierarchy, order. Data sets give it to their files.

A part is known by the bytes that it follows from, so that a file can get nothing but what its own bytes decode to.
"""

from __future__ import annotations

import hashlib
import threading
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, TypeVar, cast

from gvpipe.runtime.forks import renew_after_fork

MOST = 32  # parts
MOST_BYTES = 1 << 18  # of all that they follow from: parts of large meshes take hundreds of times as much
Part = TypeVar("Part")


class SharedParts:
    """The last parts that were made; thread-safe, goes on in a forked process, pickles empty.

    Args:
        most: how many are kept, at most; fewer of large meshes (`MOST_BYTES`), but always the last.

    Examples:
        >>> shared = SharedParts()
        >>> shared("squares", (b"ab", b"c"), lambda: [1, 4]) is shared("squares", (b"ab", b"c"), lambda: [1, 4])
        True
        >>> shared("squares", (b"a", b"bc"), lambda: [9])
        [9]
    """

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self._parts: OrderedDict[tuple[str, bytes], tuple[Any, int]] = OrderedDict()  # each with the bytes that it follows from
        self._lock = threading.Lock()
        renew_after_fork(self)

    def __call__(self, kind: str, sources: tuple[bytes, ...], make: Callable[[], Part]) -> Part:
        """Return the part of a kind that follows from ``sources``; ``make()`` if it is not kept. It must not be changed."""
        digest = hashlib.sha256()
        for source in sources:
            digest.update(len(source).to_bytes(8, "little") + source)
        key = kind, digest.digest()
        with self._lock:
            if key in self._parts:
                self._parts.move_to_end(key)
                return cast("Part", self._parts[key][0])
        part = make()  # two threads may make the same
        with self._lock:
            self._parts[key] = part, sum(map(len, sources))
            while len(self._parts) > 1 and (len(self._parts) > self._most or self._n_bytes() > MOST_BYTES):
                self._parts.popitem(last=False)
        return part

    def _n_bytes(self) -> int:
        return sum(n_bytes for _, n_bytes in self._parts.values())

    def after_fork(self) -> None:
        """Go on in a forked child (`gvpipe.runtime.forks`), with nothing that another thread was changing."""
        if self._lock.locked():
            self._parts = OrderedDict()
        self._lock = threading.Lock()

    def __reduce__(self) -> tuple[type[SharedParts], tuple[int]]:
        return type(self), (self._most,)
