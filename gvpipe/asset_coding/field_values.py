"""A field's frames, decoded when they are sliced."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gvpipe.asset_coding.directory import Listed
from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import corrupt_section, in_file
from gvpipe.runtime.forks import ForkLock

Decode = Callable[[int, int], Array]  # frames start..stop: (n, R, C)


class FieldValues:
    """Frames of a field, or of points inside of a surface.

    Args:
        read: decodes frames.
        shape: ``(F, R)`` or ``(F, R, C)``.
        listed: what the file says of it.
        lock: held while frames are decoded.
        path: of the file, for messages.
    """

    def __init__(self, read: Decode, shape: tuple[int, ...], listed: Listed, lock: ForkLock, path: str) -> None:
        self._read, self._lock, self._listed, self._path = read, lock, listed, path
        self.dtype = np.dtype(listed.type)
        self.shape: tuple[int, ...] = shape
        self.is_by_polygon = listed.reduced is not None and listed.reduced.polygons

    def __reduce__(self) -> tuple[Any, ...]:
        raise TypeError(
            f"field {self._listed.name!r} of {self._path or 'a geometry video'} cannot be pickled, since its frames are "
            "decoded when they are read; pickle the video (gvpipe.open), and take the field from it afterwards"
        )

    def __getitem__(self, key: slice, /) -> Array:
        start, stop, _ = key.indices(self.shape[0])
        with self._lock, in_file(self._path):
            block = self._read(start, max(start, stop))
            if block.shape[1:] != (self.shape[1], self._listed.components or 1) or block.dtype != self.dtype:
                raise corrupt_section(self._listed.section, "it does not hold what the file lists")
        return block if self._listed.components else block[:, :, 0]
