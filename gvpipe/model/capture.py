"""A capture: an animation whose vertices and triangles change now and then, as a row of sequences.

A *shot* is a run of frames of one connectivity: a `MeshSequence`. So all that is made for sequences works on a shot, and a
capture only knows which shot a frame lies in.
"""

from __future__ import annotations

import operator
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from itertools import accumulate
from typing import Any

from gvpipe.foundation.arguments import show
from gvpipe.foundation.errors import InputError
from gvpipe.foundation.notes import count
from gvpipe.media.sound import Sound
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.shown import ShownInNotebooks


class Capture(ShownInNotebooks):
    """A row of shots, one behind the other on one clock.

    Args:
        shots: the sequences, in order; a row that makes each when it is asked for will do, if ``lengths`` are given.
        name: where it came from, for messages.
        lengths: frames of each shot, and ``fps`` of all, of a row that should not be looked at yet.

        sound: what is heard with it; second 0 is frame 0. Sounds of shots are not.

    Raises:
        InputError: there is no shot, or they differ in frames per second.
        TypeError: a shot is no `MeshSequence`.

    Examples:
        >>> import numpy as np
        >>> flat = MeshSequence(np.zeros((2, 3, 3)), [[0, 1, 2]])
        >>> square = MeshSequence(np.zeros((1, 4, 3)), [[0, 1, 2], [0, 2, 3]])
        >>> capture = Capture([flat, square], name="both")
        >>> capture, capture.starts, capture.locate(2)
        (<Capture both: 3 frames in 2 shots, 30 fps>, (0, 2), (1, 0))
    """

    def __init__(
        self,
        shots: Sequence[MeshSequence],
        name: str = "capture",
        lengths: Sequence[int] | None = None,
        fps: float | None = None,
        sound: Sound | None = None,
    ) -> None:
        if not len(shots):
            raise InputError(f"{name} has no shots; one at least is needed")
        if lengths is None:
            for shot in shots:
                if not isinstance(shot, MeshSequence):
                    raise TypeError(f"a shot of {name} is {show(shot)}; a MeshSequence is needed")
                if shot.fps != shots[0].fps:
                    raise InputError(
                        f"shots of {name} have {shots[0].fps:g} and {shot.fps:g} fps; give them one rate (with_fps)"
                    )
            lengths = [len(shot) for shot in shots]
        self.sound = sound
        self.shots, self.name, self.fps = shots, name, shots[0].fps if fps is None else fps
        self.lengths: tuple[int, ...] = tuple(lengths)
        self.starts: tuple[int, ...] = (0, *accumulate(self.lengths[:-1]))

    def __len__(self) -> int:
        return self.starts[-1] + self.lengths[-1]

    def __repr__(self) -> str:
        return f"<Capture {self.name}: {count(len(self), 'frame')} in {count(len(self.shots), 'shot')}, {self.fps:g} fps>"

    def locate(self, frame: int) -> tuple[int, int]:
        """The number of a frame's shot, and the frame's own number in it; negative frames count from the end.

        Raises:
            IndexError: there is no such frame.
        """
        if not -len(self) <= frame < len(self):
            raise IndexError(f"frame {frame} of {self.name}: there are {len(self)}")
        frame %= len(self)
        number = bisect_right(self.starts, frame) - 1
        return number, frame - self.starts[number]

    def frame(self, frame: int) -> MeshSequence:
        """One frame, as a sequence of its own; raises IndexError."""
        number, own = self.locate(frame)
        return self.shots[number].part(own, own + 1)

    def spans(self, start: int = 0, stop: int | None = None) -> Iterator[tuple[int, int, int]]:
        """Each shot that has frames from ``start`` to ``stop``: its number, its own first frame and the one after the last.

        Raises:
            InputError: there are no such frames.
        """
        stop = len(self) if stop is None else stop
        if not 0 <= start < stop <= len(self):
            raise InputError(f"{self.name}: frames {start}:{stop} asked for; 0 <= start < stop <= {len(self)} is needed")
        for number, (begin, length) in enumerate(zip(self.starts, self.lengths, strict=True)):
            first, last = max(start - begin, 0), min(stop - begin, length)
            if first < last:
                yield number, first, last

    def _repr_html_(self) -> str:
        from gvpipe.model.notebook import card

        numbers = {"frames": str(len(self)), "shots": str(len(self.shots)), "frames per second": f"{self.fps:g}"}
        return card(self.name, numbers, self.shots[0])

    def part(self, start: int, stop: int | None = None) -> Capture:
        """Frames ``start`` to ``stop``; they still load when they are read. Raises `InputError`: there are no such frames."""
        spans = list(self.spans(start, stop))

        def made(number: int) -> MeshSequence:
            shot, first, last = spans[number]
            sequence = self.shots[shot]
            return sequence if (first, last) == (0, len(sequence)) else sequence.part(first, last)

        lengths = [last - first for _, first, last in spans]
        sound, end = self.sound, start + sum(lengths)
        if sound is not None:
            sound = sound.part(start / self.fps, None if end == len(self) else end / self.fps)
        return Capture(LazyShots(len(spans), made), self.name, lengths, self.fps, sound)

    def with_fps(self, fps: float) -> Capture:
        """The same shots at another rate; raises `InputError`: it is not above 0 and up to 100000."""
        shots = LazyShots(len(self.shots), lambda number: self.shots[number].with_fps(fps))
        return Capture(shots, self.name, self.lengths, fps, self.sound)


def one_frame(source: Any, frame: int) -> MeshSequence:
    """One frame of a sequence, a capture or a player of either, as a sequence of one.

    Raises:
        IndexError: there is no such frame.
    """
    if hasattr(source, "frame"):  # a capture, or its player
        made: MeshSequence = source.frame(frame)
        return made
    sequence: MeshSequence = source.sequence() if hasattr(source, "sequence") else source
    index = operator.index(frame)
    if not -len(sequence) <= index < len(sequence):
        raise IndexError(f"frame {index} of {sequence.name}: there are {len(sequence)}")
    return sequence.part(index % len(sequence), index % len(sequence) + 1)


def some_frames(capture: Capture, frames: tuple[int, int | None] | None, fps: float | None) -> Capture:
    """Some frames of a capture, at another rate."""
    capture = capture if frames is None else capture.part(*frames)
    return capture if fps is None else capture.with_fps(fps)


class LazyShots(Sequence[MeshSequence]):
    """Shots that are made when they are asked for, and not kept.

    Args:
        count: how many.
        make: returns the shot of a number.
    """

    def __init__(self, count: int, make: Callable[[int], MeshSequence]) -> None:
        self._count, self._make = count, make

    def __len__(self) -> int:
        return self._count

    def __getitem__(self, number: int) -> MeshSequence:  # type: ignore[override]
        if not -self._count <= number < self._count:
            raise IndexError(f"shot {number}: there are {self._count}")
        return self._make(number % self._count)
