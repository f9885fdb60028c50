"""The frames of a field that is recorded: on disk as they come, and read again when the field is coded."""

from __future__ import annotations

import tempfile
import weakref
from typing import Any

import numpy as np

from gvpipe.asset.field import Field
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.atomic import output_error
from gvpipe.foundation.errors import InputError

TYPES = {"b": np.uint8, "f": np.float32}  # of what is kept; integers stay, in at most 32 bits


class FieldSpool:
    """One field, a frame at a time, in a file without a name.

    Args:
        name: of the field.
        first: frame 0, ``(R,)`` or ``(R, C)``.
        rows: how many rows each domain has.

    Raises:
        InputError: it has as many rows as no domain, or integers of more than 32 bits.
        OutputError: no file can be made.
    """

    def __init__(self, name: str, first: Array, rows: dict[str, int]) -> None:
        self._name, self._frame_shape = name, first.shape
        fitting = [domain for domain in ("vertex", "triangle") if first.ndim in (1, 2) and len(first) == rows[domain]]
        if not fitting:
            wanted = " or ".join(f"{rows[domain]} rows, one per {domain}" for domain in ("vertex", "triangle"))
            raise InputError(f"field {name!r} has shape {first.shape}; {wanted}, are needed")
        self.domain = fitting[0]
        self.dtype = np.dtype(TYPES.get(first.dtype.kind, np.int32))
        self.has_holes = False  # NaN
        self.n_frames = 0
        try:
            self._file = tempfile.TemporaryFile(prefix="gvpipe-")  # noqa: SIM115 - lives as long as self
        except OSError as exc:
            raise output_error(tempfile.gettempdir(), exc) from exc
        weakref.finalize(self, self._file.close)

    def checked(self, values: Array, frame: int) -> Array:
        """The next frame as it is kept; raises `InputError` for another shape, infinities, and what 32 bits cannot hold."""
        if values.shape != self._frame_shape:
            raise InputError(f"field {self._name!r} has shape {values.shape} in frame {frame}, and had {self._frame_shape}")
        with np.errstate(over="ignore"):
            kept = np.ascontiguousarray(values, self.dtype)
        wrong = np.isinf(kept) if self.dtype.kind == "f" else kept != values
        if wrong.any():
            place = tuple(np.argwhere(wrong)[0].tolist())
            where = f"field {self._name!r} is {values[place]} in frame {frame}, row {place[0]}"
            raise InputError(f"{where}; a number that {self.dtype} holds is needed")
        return kept

    def append(self, kept: Array) -> None:
        """Keep a frame that is `checked`; raises `OutputError`."""
        self.has_holes = self.has_holes or (self.dtype.kind == "f" and bool(np.isnan(kept).any()))
        try:
            self._file.seek(0, 2)
            self._file.write(kept.data)
        except OSError as exc:
            raise output_error(tempfile.gettempdir(), exc) from exc
        self.n_frames += 1

    @property
    def shape(self) -> tuple[int, ...]:
        """``(F, R)`` or ``(F, R, C)``."""
        return (self.n_frames, *self._frame_shape)

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.n_frames)
        count = max(0, stop - start)
        size = int(np.prod(self._frame_shape))
        self._file.seek(start * size * self.dtype.itemsize)
        data = self._file.read(count * size * self.dtype.itemsize)
        return np.frombuffer(data, self.dtype).reshape(count, *self._frame_shape)

    def field(self) -> Field:
        """All frames so far."""
        values: Any = self
        return Field(values, self.domain, name=f"field {self._name!r}")
