"""Frames that repeat the frame before them: coded once, whatever the codec.

What: clips rest in a pose at their start or end, are sampled twice as often as they were animated, or never move. Only
*distinct* frames, those that differ from the frame before, go through the codec and its corrections. The section ``holds``
has their run lengths: for how many frames each of them is shown::

    section = [varint] distinct frames D, [integers] D run lengths less 1

Why around the codecs and not inside them: repeated frames are then identical bit for bit in every codec, and cost nothing else.

A codec asks for it by a class attribute ``holds = True``. Where its frames are pictures of a video, that has D of them, and
other players run through these at the sequence's frame rate.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gvpipe.coding.codec import ClosableReader, FrameReader, GroupReader, LevelReader
from gvpipe.container.bitstream import MAX_FRAMES, Bitstream
from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float32, Int32, Int64
from gvpipe.model.sequence import MeshSequence

SECTION = "holds"
BYTES_PER_RUN, SECONDS_PER_RUN = 80, 0.2e-6


@dataclass(frozen=True)
class RepeatedFrames:
    """Run lengths: for how many frames each distinct frame is shown.

    Args:
        lengths: ``(D,)``, each 1 at least.

    Examples:
        >>> RepeatedFrames(np.array([2, 1, 3])).starts.tolist()
        [0, 2, 3, 6]
    """

    lengths: Int64

    @property
    def n_distinct(self) -> int:
        """D."""
        return len(self.lengths)

    @property
    def starts(self) -> Int64:
        """``(D + 1,)`` the frame at which each distinct frame is shown first, and F."""
        return np.concatenate([[0], np.cumsum(self.lengths)])

    def distinct(self, sequence: MeshSequence) -> MeshSequence:
        """The distinct frames of a sequence, which still load when they are read."""
        return MeshSequence(_Distinct(sequence, self.starts[:-1]), sequence.faces, sequence.fps, name=sequence.name)


def find_repeated_frames(sequence: MeshSequence) -> RepeatedFrames | None:
    """Compare each frame with the one before, coordinate by coordinate, exactly; None if no frame repeats another."""
    is_new = np.ones(sequence.n_frames, bool)
    last: Float32 | None = None
    for first, chunk in sequence.chunks():
        is_new[first + 1 : first + len(chunk)] = [bool((a != b).any()) for a, b in pairwise(chunk)]
        if last is not None:
            is_new[first] = bool((chunk[0] != last).any())
        last = chunk[-1].copy()
    if is_new.all():
        return None
    return RepeatedFrames(np.diff(np.flatnonzero(is_new), append=sequence.n_frames))


def add_repeated_frames(bitstream: Bitstream, repeated: RepeatedFrames) -> Bitstream:
    """Return the bitstream of the whole sequence, from that of its distinct frames.

    Args:
        bitstream: of the distinct frames.
        repeated: their run lengths.
    """
    section = varint(repeated.n_distinct) + encode_integers(repeated.lengths - 1)
    n_frames = int(repeated.lengths.sum())
    return dataclasses.replace(bitstream, n_frames=n_frames, sections={**bitstream.sections, SECTION: section})


def read_repeated_frames(bitstream: Bitstream) -> RepeatedFrames | None:
    """Mirror of `add_repeated_frames`, None without the section.

    Raises:
        CorruptFile: the run lengths do not add up to the header's number of frames.
    """
    if SECTION not in bitstream.sections:
        return None
    cursor = Cursor(bitstream.section(SECTION), SECTION)
    n_distinct = cursor.varint(min(bitstream.n_frames, MAX_FRAMES), "the number of distinct frames")
    bitstream.budget.keep(f"{n_distinct} distinct frames", BYTES_PER_RUN * n_distinct, SECONDS_PER_RUN * n_distinct)
    lengths = decode_integers(cursor.rest(), n_distinct, name=SECTION) + 1
    outside = lengths.min(initial=1) < 1 or lengths.max(initial=1) > bitstream.n_frames
    if outside or int(lengths.sum()) != bitstream.n_frames:
        raise cursor.corrupt(f"its runs do not add up to {bitstream.n_frames} frames")
    return RepeatedFrames(lengths)


class RepeatedFramesReader:
    """All frames, from a reader of the distinct ones; it offers what else that reader does.

    Args:
        distinct: the reader of the D distinct frames.
        repeated: for how long each is shown.
    """

    levels: list[int]
    level_faces: Callable[[int], Int32]
    level_points: Callable[[int], tuple[Int32, Int32]]
    group: Callable[[int], tuple[int, int]]
    close: Callable[[], None]

    def __init__(self, distinct: FrameReader, repeated: RepeatedFrames) -> None:
        self.distinct, self.repeated, self._starts = distinct, repeated, repeated.starts
        if isinstance(distinct, LevelReader):
            self.levels, self.level_faces, self.level_points = distinct.levels, distinct.level_faces, distinct.level_points
        if isinstance(distinct, GroupReader):
            self.group = functools.partial(_group, distinct.group, self._starts)  # not a method, which would refer to itself
        if isinstance(distinct, ClosableReader):
            self.close = distinct.close

    @property
    def n_frames(self) -> int:
        """F, the number of frames."""
        return int(self._starts[-1])

    @property
    def faces(self) -> Int32:
        """``(T, 3) int32`` triangles."""
        return self.distinct.faces

    def read(self, start: int, stop: int, lod: int = 0) -> Float32:
        """Return frames of a level: ``(stop - start, V, 3) float32``, model units."""
        shown = _shown(self._starts, np.arange(start, stop))
        first, end = (int(shown[0]), int(shown[-1]) + 1) if len(shown) else (0, 0)
        if lod and isinstance(self.distinct, LevelReader):
            frames = self.distinct.read(first, end, lod=lod)
        else:
            frames = self.distinct.read(first, end)
        return frames if len(frames) == len(shown) else frames[shown - first]


def _shown(starts: Int64, frames: Int64) -> Int64:
    """The distinct frame that each of ``frames`` shows, given the first frame of each distinct one."""
    return np.asarray(np.searchsorted(starts, frames, side="right") - 1)


def _group(group: Callable[[int], tuple[int, int]], starts: Int64, frame: int) -> tuple[int, int]:
    """``(start, stop)`` of the frames that show what is decoded together with a frame."""
    start, stop = group(int(_shown(starts, np.array([frame]))[0]))
    return int(starts[start]), int(starts[stop])


class _Distinct:
    """Some frames of another sequence, ascending."""

    def __init__(self, sequence: MeshSequence, frames: Int64) -> None:
        self._sequence, self._frames = sequence, frames
        self.shape: tuple[int, ...] = (len(frames), sequence.n_vertices, 3)

    def __getitem__(self, key: slice, /) -> Float32:
        frames = self._frames[slice(*key.indices(self.shape[0]))]
        stretches = np.split(frames, np.flatnonzero(np.diff(frames) != 1) + 1)  # no repeated frame is read
        blocks = [self._sequence.read(int(each[0]), int(each[-1]) + 1) for each in stretches if len(each)]
        return np.concatenate(blocks) if blocks else np.zeros((0, *self.shape[1:]), np.float32)
