"""Segments of one sequence, coded by workers, which read its frames from where they lie.

What segments share is pickled without the sequence. Each worker opens that by its path, once. A sequence in memory is sent.
"""

from __future__ import annotations

import io
import pickle
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from gvpipe.foundation.errors import GvpipeError, InputError
from gvpipe.model.sequence import MeshSequence
from gvpipe.runtime.segment_map import Report
from gvpipe.tasks.executor import Executor, Outcome, Work, WorkerDied

PROTOCOL = 5  # of pickle
SEQUENCE = "sequence"  # its name in pickles
MUCH_WORK = 60.0  # seconds: it takes a second or two until processes code their first segment
REMEDY = "give workers more memory, or take fewer frames per segment (--segment)"


@dataclass(frozen=True)
class RemoteSegments:
    """Codes segments elsewhere, as `gvpipe.runtime.segment_map.SegmentMap`.

    Args:
        executor: the workers.
        sequence: what is encoded.
        reopen: opens the same sequence in a worker; it must pickle. None: the sequence itself is sent.
    """

    executor: Executor
    sequence: MeshSequence
    reopen: Callable[[], MeshSequence] | None

    def __call__(self, work: Callable[[Any, Any], Any], shared: Any, tasks: Sequence[Any], report: Report) -> list[Any]:
        """Return ``work(shared, task)`` of each task, in their order.

        Raises:
            InputError: a worker cannot read the sequence, or workers die of a task; the sequence cannot be sent.
        """
        if not tasks:
            return []
        report(0)
        results: list[Any] = [None] * len(tasks)
        for n_done, outcome in enumerate(self.executor.run(prepare, self._pickled(work, shared), tasks), 1):
            results[outcome.index] = _value(outcome, len(tasks))
            report(n_done / len(tasks))
        return results

    def _pickled(self, work: Callable[[Any, Any], Any], shared: Any) -> bytes:
        stream = io.BytesIO()
        pickler = _Pickler(stream, self.sequence if self.reopen else None)
        try:
            pickler.dump((work, shared))
        except (pickle.PicklingError, TypeError, AttributeError) as exc:
            raise InputError(f"{self.sequence.name}: its frames cannot be sent to workers; give its path instead") from exc
        return pickle.dumps((self.reopen, self.sequence.shape, stream.getvalue()), PROTOCOL)


@dataclass(frozen=True)
class SharedSegments:
    """Codes segments here, and shares them out once they prove to be much work; as `gvpipe.runtime.segment_map.SegmentMap`.

    Args:
        remote: codes them elsewhere.
        patience: seconds of work that are left at least when it does.
    """

    remote: RemoteSegments
    patience: float = MUCH_WORK

    def __call__(self, work: Callable[[Any, Any], Any], shared: Any, tasks: Sequence[Any], report: Report) -> list[Any]:
        """Return ``work(shared, task)`` of each task, in their order; where workers cannot, they are done here."""
        results: list[Any] = []
        started = time.perf_counter()
        for task in tasks:
            if self._is_much(time.perf_counter() - started, len(results), len(tasks)):
                break
            results.append(work(shared, task))
            report(len(results) / len(tasks))
        n_done, n_left = len(results), len(tasks) - len(results)
        if n_left:
            try:
                rest = self.remote(work, shared, tasks[n_done:], lambda done: report((n_done + done * n_left) / len(tasks)))
            except GvpipeError:  # nobody asked for workers: one may have too little memory, or not find the input
                rest = [work(shared, task) for task in tasks[n_done:]]
            results += rest
        return results

    def _is_much(self, seconds: float, n_done: int, n_tasks: int) -> bool:
        """Whether what is left takes long, judged by the tasks that are done."""
        return n_done > 0 and n_tasks - n_done > 1 and seconds / n_done * (n_tasks - n_done) > self.patience


def prepare(data: bytes) -> Work:
    """In a worker: open the sequence, and return what codes a segment of it."""
    reopen, shape, pickled = pickle.loads(data)
    sequence = None if reopen is None else reopen()
    if sequence is not None and sequence.shape != shape:
        found, wanted = (f"{frames} frames of {vertices} vertices" for frames, vertices, _ in (sequence.shape, shape))
        raise InputError(f"{sequence.name}: it has {found} there, {wanted} here; give workers the same files")
    work, shared = _Unpickler(io.BytesIO(pickled), sequence).load()
    return partial(work, shared)


class _Pickler(pickle.Pickler):
    """Leaves a sequence out."""

    def __init__(self, stream: io.BytesIO, sequence: MeshSequence | None) -> None:
        super().__init__(stream, PROTOCOL)
        self._sequence = sequence

    def persistent_id(self, obj: Any) -> str | None:
        """The name of the sequence, None for all else."""
        return SEQUENCE if obj is self._sequence and obj is not None else None


class _Unpickler(pickle.Unpickler):
    """Puts the worker's own in its place."""

    def __init__(self, stream: io.BytesIO, sequence: MeshSequence | None) -> None:
        super().__init__(stream)
        self._sequence = sequence

    def persistent_load(self, pid: Any) -> MeshSequence | None:
        """The sequence, by its name."""
        return self._sequence


def _value(outcome: Outcome, n_tasks: int) -> Any:
    error = outcome.error
    if error is None:
        return outcome.value
    if isinstance(error, WorkerDied):
        raise InputError(f"segment {outcome.index + 1} of {n_tasks}: {error}; {REMEDY}") from error
    if isinstance(error, GvpipeError):
        raise InputError(f"on a worker: {error}") from error
    raise error
