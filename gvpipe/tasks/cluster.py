"""A Dask cluster that does tasks: a bounded number of them is in flight, and those of a worker that dies go to others.

dask and distributed are the extra ``cluster``. Workers need this gvpipe, and what tasks name: files at the same paths.
"""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
import warnings
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from gvpipe.foundation.errors import InputError
from gvpipe.tasks.executor import Outcome, Prepare, Work, WorkerDied

PACKAGE = "gvpipe"
EXTRA = "a scheduler needs the packages dask and distributed: pip install 'gvpipe[cluster]'"
TIMEOUT = 10.0  # seconds until a scheduler answers, and until it has a worker
AHEAD = 2  # tasks in flight for each thread of the cluster, so that none waits for this process
LARGE = "1 TiB"  # of a task graph, before Dask warns; ours hold what segments share, once
CONFIG = {"distributed.admin.large-graph-warning-threshold": LARGE}


class Cluster:
    """A scheduler with workers.

    Args:
        client: of ``distributed``, connected.
        address: of the scheduler, for messages.
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client, self._address = client, address

    def run(self, prepare: Prepare, data: bytes, tasks: Sequence[Any]) -> Iterator[Outcome]:
        """Do tasks; see `gvpipe.tasks.executor.Executor`."""
        from distributed import as_completed

        # as a task, not scattered: Dask makes it anew where the worker that held it dies
        held = self._client.submit(_hold, data, pure=False)
        own = version(PACKAGE)
        numbers: dict[Any, int] = {}
        waiting = iter(enumerate(tasks))
        running = as_completed(loop=self._client.loop)

        def submit_next() -> None:
            for index, task in waiting:
                future = self._client.submit(_do, own, prepare, held, task, pure=False)
                numbers[future] = index
                running.add(future)
                return

        try:
            for _ in range(AHEAD * max(1, sum(self._client.nthreads().values()))):
                submit_next()
            for future in running:
                submit_next()
                yield self._outcome(numbers.pop(future), future)
        finally:
            self._client.cancel([*numbers, held])
            with contextlib.suppress(Exception):  # the cluster may have gone
                self._client.run(_forget, on_error="ignore")

    def _outcome(self, index: int, future: Any) -> Outcome:
        """What became of a task; raises `InputError` if the scheduler has gone."""
        from distributed.scheduler import KilledWorker

        if future.status in ("cancelled", "lost"):
            raise InputError(f"the scheduler at {self._address} has gone, or gave the work up; start it again")
        error = future.exception()
        if error is None:
            return Outcome(index, future.result())
        if isinstance(error, KilledWorker):
            return Outcome(index, None, WorkerDied("workers died of it one after the other; their logs say how"))
        if isinstance(error, ImportError):
            raise InputError(
                f"a worker of {self._address} lacks {error.name or error}; install the same gvpipe there"
            ) from error
        return Outcome(index, None, error)


@contextlib.contextmanager
def connect(address: str) -> Iterator[Cluster]:
    """Connect to a scheduler, whose workers must have this gvpipe.

    Raises:
        InputError: the extra is not installed, no scheduler is at the address, it has no workers, or one of another version.
    """
    try:
        import dask
        from distributed import Client
    except ImportError as exc:
        raise InputError(EXTRA) from exc
    with _quiet(), dask.config.set(CONFIG):
        try:
            _knock(address)  # a Client that cannot connect leaves threads that may lock up the next one
            client = Client(address, timeout=TIMEOUT, set_as_default=False)
        except Exception as exc:  # it depends on the address what is raised
            said = "nothing answers there" if isinstance(exc, OSError) else " ".join(str(exc).split())
            raise InputError(f"scheduler {address}: {said}; start it with `dask scheduler`, or check the address") from exc
        with client:
            _check_workers(client, address)
            yield Cluster(client, address)


def _knock(address: str) -> None:
    """Raise ValueError for what is no address, OSError where no port is open."""
    from distributed.comm.addressing import get_address_host_port

    host, port = get_address_host_port(address)
    socket.create_connection((host, port), TIMEOUT).close()


def _check_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=TIMEOUT)
    except TimeoutError as exc:
        raise InputError(f"scheduler {address}: it has no workers; start some with `dask worker {address}`") from exc
    own = version(PACKAGE)
    versions = client.run(version, PACKAGE, on_error="return")  # Python's own function, which all can load
    for worker, found in sorted(versions.items()):
        if isinstance(found, PackageNotFoundError):
            raise InputError(f"worker {worker} has no gvpipe; install gvpipe {own} there")
        if found != own:
            raise InputError(f"worker {worker} has gvpipe {found}, this is {own}; install the same on both")


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask from logging what becomes one line here."""
    loggers = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    heard = [logger for logger in loggers if not logger.disabled]
    for logger in heard:
        logger.disabled = True
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger in heard:
            logger.disabled = False


# in workers

_prepared: dict[int, tuple[bytes, Work]] = {}  # by thread: sequences are read by one thread at a time


def _hold(data: bytes) -> bytes:
    return data


def _do(wanted: str, prepare: Prepare, data: bytes, task: Any) -> Any:
    """Do a task on one BLAS thread; workers have as many threads as cores."""
    from threadpoolctl import threadpool_limits

    if version(PACKAGE) != wanted:  # the worker came later than `_check_workers`
        raise InputError(f"it has gvpipe {version(PACKAGE)}, the client {wanted}; install the same on both")
    threadpool_limits(1, user_api="blas")  # for good: other threads of this worker may be at work
    thread = threading.get_ident()
    if thread not in _prepared or _prepared[thread][0] != data:
        _prepared[thread] = data, prepare(data)
    return _prepared[thread][1](task)


def _forget() -> None:
    """Give back what the last run needed."""
    _prepared.clear()
