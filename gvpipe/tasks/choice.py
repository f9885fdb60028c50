"""The executor that is asked for."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

from gvpipe.foundation.errors import SettingError
from gvpipe.tasks.executor import Executor

MOST_WORKERS = 1024
AUTO_WORKERS = "auto"


@contextlib.contextmanager
def open_executor(scheduler: str | None, workers: int | str | None) -> Iterator[Executor | None]:
    """Give what does work elsewhere: a cluster, processes of this machine, or None where neither is asked for.

    Args:
        scheduler: address of a Dask scheduler, such as ``tcp://host:8786``.
        workers: number of processes.

    Raises:
        SettingError: both are given, or no such number of processes.
        InputError: the scheduler cannot be used.
    """
    if scheduler is not None and workers is not None:
        raise SettingError("workers are processes of this machine, and a scheduler has its own; give one of the two")
    if workers is not None and (isinstance(workers, bool) or not isinstance(workers, int) or not 1 <= workers <= MOST_WORKERS):
        raise SettingError(f"workers is {workers!r}; an integer in 1..{MOST_WORKERS}, or {AUTO_WORKERS!r}, is needed")
    if scheduler is not None:
        from gvpipe.tasks.cluster import connect

        with connect(scheduler) as cluster:
            yield cluster
    elif workers is not None:
        from gvpipe.tasks.processes import Processes

        with Processes(workers) as processes:
            yield processes
    else:
        yield None
