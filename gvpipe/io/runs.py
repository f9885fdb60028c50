"""An input whose topology changes, as several sequences: one for each run of frames with the same vertices and triangles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from gvpipe.foundation.errors import TopologyChange
from gvpipe.model.sequence import MeshSequence

ReadFrames = Callable[[tuple[int, int | None] | None], MeshSequence]


@dataclass(frozen=True)
class Run:
    """Frames ``start`` to ``stop`` of an input, which have one topology."""

    start: int
    stop: int
    sequence: MeshSequence


def find_runs(read: ReadFrames, frames: tuple[int, int | None] | None = None) -> list[Run]:
    """Return the runs of an input, in order.

    Most readers end a run where they meet a change, and say where it is: ``changes_at`` of the positions. Others may meet a
    later change first, so a run of theirs is read again until nothing changes in it. Runs of one frame, which have no rate of
    their own, get that of the longest.

    Args:
        read: reads some frames, None: all; it, or reading positions, may raise `TopologyChange`.
        frames: the first frame, and the one after the last (None: all that follow).

    Raises:
        InputError: the input cannot be read.
    """
    start, end = frames or (0, None)
    runs: list[Run] = []
    is_last = False
    while not is_last:
        sequence, stop = _read_run(read, None if not runs and frames is None else (start, end), end)
        is_last = stop == end
        begin = start if stop is None else stop - len(sequence)  # steps without cells may be left out at first
        runs.append(Run(begin, begin + len(sequence), sequence))
        start = begin + len(sequence)
    longest = max(runs, key=lambda run: len(run.sequence)).sequence
    return [run if len(run.sequence) > 1 else replace(run, sequence=run.sequence.with_fps(longest.fps)) for run in runs]


def at_one_rate(runs: Sequence[Run]) -> list[MeshSequence]:
    """The sequences of runs at the rate of the longest; those of another rate keep the times of their frames."""
    fps = max(runs, key=lambda run: len(run.sequence)).sequence.fps
    return [run.sequence if run.sequence.fps == fps else _timed(run.sequence, fps) for run in runs]


def _timed(sequence: MeshSequence, fps: float) -> MeshSequence:
    times = tuple(sequence.times.tolist())
    return replace(sequence.with_fps(fps), metadata=replace(sequence.metadata, times=times))


def _read_run(read: ReadFrames, span: tuple[int, int | None] | None, end: int | None) -> tuple[MeshSequence, int | None]:
    """The frames from the span's first to the next change or the end, and the one after the last."""
    start, stop = span or (0, end)
    while True:
        try:
            sequence = read(span)
            for _ in sequence.chunks():  # a change of vertices alone shows when they are read
                pass
            changes_at = getattr(sequence.positions, "changes_at", None)
            return sequence, stop if changes_at is None else changes_at
        except TopologyChange as exc:
            if not start < exc.frame or (stop is not None and exc.frame >= stop):
                raise
            stop = exc.frame
            span = (start, stop)
