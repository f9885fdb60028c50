"""Which of the numbers beside positions change from frame file to frame file: those become fields, the others attributes.

1. A few files are compared with the first. What differs is a field.
2. Normals that are the surface's own in these files are an attribute, the first file's: each frame's follow from its positions.
3. If anything is left, all files are compared, for what is the same in all. They are parsed once, for later reads too.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gvpipe.arrays import Array
from gvpipe.asset.attribute import Attribute, guess_kind
from gvpipe.asset.field import Field
from gvpipe.io.frame_files import FrameFiles
from gvpipe.io.mesh import FrameValues

SAMPLES = 3  # files that are compared with the first before all are


@dataclass(frozen=True)
class Columns:
    """Attributes and fields that frame files have beside their positions."""

    attributes: dict[str, Attribute] = field(default_factory=dict)
    fields: dict[str, Field] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


class FrameColumn:
    """One column of frame files, ``(F, R)`` or ``(F, R, C)``, loaded as it is sliced."""

    def __init__(self, frames: FrameFiles, name: str) -> None:
        self._frames, self._name = frames, name
        first = frames.values(frames.first, name, 0)
        self.shape: tuple[int, ...] = (len(frames.paths), *first.shape)
        self.dtype: Any = first.dtype

    def __getitem__(self, key: slice, /) -> Array:
        return self._frames.column(self._name, range(*key.indices(self.shape[0])))


def split_columns(frames: FrameFiles) -> Columns:
    """Find out what moves.

    Raises:
        InputError: a file cannot be read, or lacks what the first one has.
    """
    given = {name: make() for name, make in frames.first.animated.items()}
    fields = {name: one for name, one in given.items() if _has_holes(one.values)}
    for name in fields:
        frames.keep(name)
    n_frames = len(frames.paths)
    looked_at = np.unique(np.linspace(1, n_frames - 1, SAMPLES).astype(int)).tolist() if n_frames > 1 else []
    rest = [frame for frame in range(1, n_frames) if frame not in looked_at]
    for frame in [*looked_at, *rest]:
        if len(fields) == len(given):
            break
        mesh = frames.load(frame)
        for name, one in given.items():
            if name not in fields and not np.array_equal(frames.values(mesh, name, frame), one.values):
                fields[name] = one
                frames.keep(name)
    where = frames.paths[0].parent
    return Columns(
        {name: _attribute(name, one) for name, one in given.items() if name not in fields},
        {
            name: Field(FrameColumn(frames, name), one.domain, one.kind, one.unit, name=f"{where}: field {name!r}")
            for name, one in given.items()
            if name in fields
        },
    )


def _attribute(name: str, one: FrameValues) -> Attribute:
    """What is the same in all frames; its kind is guessed where the file does not say."""
    return Attribute(one.values, one.domain, one.kind or guess_kind(name, one.values), None, one.unit, name)


def _has_holes(values: Array) -> bool:
    """Whether numbers are missing: an attribute has none, a field may."""
    return values.dtype.kind == "f" and not bool(np.isfinite(values).all())
