"""EnSight Gold's files of geometry and variables, as text or in C binary, read entry by entry.

A binary file has texts of 80 bytes, and integers and floats of 4 bytes in either byte order. A file of several steps has
each between BEGIN TIME STEP and END TIME STEP.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.io.simulation.limits import check_bytes

TEXT = 80  # bytes of a text in a binary file
BEGIN, END = b"BEGIN TIME STEP", b"END TIME STEP"


class EnsightFile:
    """A file, or one step of it.

    Args:
        path: of the file.
        step: which of its steps; None: it has one.
        order: byte order of binary numbers, ``"<"`` or ``">"``, where another file of the case said so.

    Raises:
        ValueError: it has no such step.
    """

    def __init__(self, path: Path, step: int | None, order: str = "") -> None:
        data = path.read_bytes()
        if not data:
            raise ValueError(f"{path.name} is empty")
        self.is_binary = b"\0" in data[: 2 * TEXT] or data[:8] == b"C Binary" or b"\n" not in data[:TEXT]
        if b"Fortran Binary" in data[:TEXT]:
            raise ValueError(f"{path.name} is Fortran binary, which is not read; save it as C binary")
        self.name, self.order = path.name, order
        self._at = TEXT if data[:8] == b"C Binary" else 0
        self._data = data
        if step is not None:
            self._seek(step)
        self._lines = [] if self.is_binary else self._data[self._at :].decode("latin-1").splitlines()
        self._line = 0

    def _seek(self, step: int) -> None:
        for _ in range(step + 1):
            found = self._data.find(BEGIN, self._at)
            if found < 0:
                raise ValueError(f"{self.name} has no step {step}; the file is cut short")
            self._at = found + (TEXT if self.is_binary else len(BEGIN) + 1)
        end = self._data.find(END, self._at)
        self._data = self._data[: end if end >= 0 else None]

    def is_done(self) -> bool:
        """Whether nothing is left."""
        if self.is_binary:
            return self._at + TEXT > len(self._data)
        while self._line < len(self._lines) and not self._lines[self._line].strip():
            self._line += 1
        return self._line >= len(self._lines)

    def text(self) -> str:
        """The next text; raises `ValueError` at the end."""
        if self.is_binary:
            raw = self._data[self._at : self._at + TEXT]
            if len(raw) < TEXT:
                raise ValueError(f"{self.name} is cut short")
            self._at += TEXT
            return raw.split(b"\0")[0].decode("latin-1").strip()
        if self._line >= len(self._lines):
            raise ValueError(f"{self.name} is cut short")
        self._line += 1
        return self._lines[self._line - 1].strip()

    def word(self) -> str:
        """The next text that is not empty; raises `ValueError` at the end."""
        self.is_done()  # passes over empty lines
        return self.text()

    def integers(self, count: int) -> Array:
        """The next integers, ``(count,)``."""
        if self.is_binary:
            if not self.order:  # the first integer is a part's number, which is small
                self.order = min("<>", key=lambda order: int(np.frombuffer(self._peek(4), f"{order}u4")[0]))
            return self._binary("i4", count)
        return self._ascii(count, np.int64)

    def floats(self, count: int) -> Array:
        """The next floats, ``(count,)``."""
        return self._binary("f4", count) if self.is_binary else self._ascii(count, np.float64)

    def rows(self, count: int, width: int) -> Array:
        """``(count, width)`` integers, a line each in a text."""
        if self.is_binary:
            return self.integers(count * width).reshape(count, width)
        lines = self._take(count)
        words = [word for line in lines for word in line.split()]
        if len(words) != count * width:
            raise ValueError(f"{self.name} has {len(words)} of {count * width} numbers")
        return np.array(words, np.int64).reshape(count, width)

    def ragged(self, total: int, n_rows: int) -> Array:
        """``(total,)`` integers that stand in ``n_rows`` lines of a text."""
        if self.is_binary:
            return self.integers(total)
        words = [word for line in self._take(n_rows) for word in line.split()]
        if len(words) != total:
            raise ValueError(f"{self.name} has {len(words)} of {total} numbers")
        return np.array(words, np.int64)

    def place(self) -> tuple[int, int]:
        """Where the next entry starts, for `go_back`."""
        return self._at, self._line

    def go_back(self, place: tuple[int, int]) -> None:
        """Read on from a place."""
        self._at, self._line = place

    def skip(self, count: int) -> None:
        """Pass over integers."""
        self.integers(count)

    def _peek(self, size: int) -> bytes:
        raw = self._data[self._at : self._at + size]
        if len(raw) < size:
            raise ValueError(f"{self.name} is cut short")
        return raw

    def _binary(self, kind: str, count: int) -> Array:
        raw = self._peek(4 * count) if count >= 0 else b""
        if count < 0:
            raise ValueError(f"{self.name} has {count} numbers of a kind")
        self._at += 4 * count
        return np.frombuffer(raw, np.dtype((self.order or "<") + kind)).astype(kind)

    def _ascii(self, count: int, dtype: type[np.generic]) -> Array:
        """Numbers, one a line."""
        try:
            return np.array(self._take(count), np.float64).astype(dtype)
        except ValueError as exc:
            raise ValueError(f"{self.name} has a text where {count} numbers are needed") from exc

    def _take(self, count: int) -> list[str]:
        check_bytes((count,), 1, len(self._data), self.name)
        lines = self._lines[self._line : self._line + count]
        if len(lines) < count:
            raise ValueError(f"{self.name} has {len(lines)} of {count} lines; the file is cut short")
        self._line += count
        return lines
