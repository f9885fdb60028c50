"""An input whose topology changes, as several sequences: one for each run of frames with the same vertices and triangles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from gvpipe.foundation.errors import TopologyChange
from gvpipe.model.sequence import MeshSequence

ReadFrames = Callable[[tuple[int, int | None]], MeshSequence]


@dataclass(frozen=True)
class Run:
    """Frames ``start`` to ``stop`` of an input, which have one topology."""

    start: int
    stop: int
    sequence: MeshSequence


def find_runs(read: ReadFrames, frames: tuple[int, int | None] | None = None) -> list[Run]:
    """Return the runs of an input, in order.

    Readers may meet a later change first, so a run is read again until nothing changes in it. Runs of one frame, which have no
    rate of their own, get that of the longest.

    Args:
        read: reads some frames; it, or reading positions, raises `TopologyChange`.
        frames: the first frame, and the one after the last (None: all that follow).

    Raises:
        InputError: the input cannot be read.
    """
    start, end = frames or (0, None)
    runs: list[Run] = []
    is_last = False
    while not is_last:
        sequence, stop = _read_run(read, start, end)
        is_last = stop == end
        runs.append(Run(start, start + len(sequence), sequence))
        start += len(sequence)
    longest = max(runs, key=lambda run: len(run.sequence)).sequence
    return [run if len(run.sequence) > 1 else replace(run, sequence=run.sequence.with_fps(longest.fps)) for run in runs]


def _read_run(read: ReadFrames, start: int, end: int | None) -> tuple[MeshSequence, int | None]:
    """The frames from ``start`` to the next change or the end, and the one after the last."""
    stop = end
    while True:
        try:
            sequence = read((start, stop))
            for _ in sequence.chunks():  # most frames are compared when they are read
                pass
            return sequence, stop
        except TopologyChange as exc:
            if not start < exc.frame or (stop is not None and exc.frame >= stop):
                raise
            stop = exc.frame
