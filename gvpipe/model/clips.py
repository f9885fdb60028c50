"""Several animations of one mesh as one sequence, its clips after each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import InputError
from gvpipe.model.sequence import MeshSequence


class Clip(NamedTuple):
    """An animation's name, its first frame, and the one after its last."""

    name: str
    start: int
    stop: int


class Joined:
    """The frames of sequences of one mesh, one sequence after the other."""

    def __init__(self, sequences: Sequence[MeshSequence]) -> None:
        self._sequences = sequences
        self._starts = np.cumsum([0, *(each.n_frames for each in sequences)])
        self.shape: tuple[int, ...] = (int(self._starts[-1]), sequences[0].n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Float32:
        start, stop, _ = key.indices(self.shape[0])
        found = [np.zeros((0, *self.shape[1:]), np.float32)]
        for first, each in zip(self._starts, self._sequences, strict=False):
            own = max(start - first, 0), min(stop - first, each.n_frames)
            if own[0] < own[1]:
                found.append(each.read(*own))
        return np.concatenate(found)


def join_clips(named: Sequence[tuple[str, MeshSequence]]) -> tuple[MeshSequence, tuple[Clip, ...]]:
    """One sequence of all frames, with what the first has beside them but for fields; and where each clip is.

    Args:
        named: names of the clips and their sequences, at least one.

    Raises:
        InputError: they differ in triangles, frame rate or origin.
    """
    first = named[0][1]
    for name, each in named:
        if each.n_vertices != first.n_vertices or not np.array_equal(each.faces, first.faces):
            raise InputError(f"clip {name!r} of {each.name} has other triangles than {named[0][0]!r}; convert one at a time")
        if each.fps != first.fps or not np.array_equal(each.origin, first.origin):
            raise InputError(f"clip {name!r} of {each.name} has another frame rate or origin than {named[0][0]!r}; give --fps")
    starts = np.cumsum([0, *(each.n_frames for _, each in named)]).tolist()
    clips = tuple(Clip(name, start, stop) for (name, _), start, stop in zip(named, starts[:-1], starts[1:], strict=True))
    images = tuple(image.frame(0) for image in first.images)
    return replace(first, positions=Joined([each for _, each in named]), fields={}, volume=None, images=images), clips
