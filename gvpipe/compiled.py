"""Compilation of loops that numpy cannot vectorise.

Importing a module that uses this decorator imports numba (0.3 s). So such modules hold kernels alone, and functions import them
where they call them, not at the top of a file.

numba compiles a kernel when it is first called with arguments of some types, and caches the machine code beside the source
(``NUMBA_CACHE_DIR`` names another folder). The cache only saves time: code that it cannot load is compiled again.

Compiling all kernels of an encode takes about 20 s. So the logger of this module says once per process that it begins, at
level INFO, which is silent unless someone listens. The command line does.
"""

from __future__ import annotations

import contextlib
import functools
import logging
import os
import sys
from collections.abc import Callable, Iterator
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache
from numba.core.sigutils import normalize_signature

LOGGER = logging.getLogger(__name__)
ONCE = "compiling kernels, once after installation; the first commands take up to half a minute longer"
EVERY_TIME = "compiling kernels in every run, since no folder takes machine code; set NUMBA_CACHE_DIR to one that does"

PACKAGES = ("gvpipe.", "gvcodecs.")

Sources = frozenset[tuple[str, float]]  # modules, and when each was changed

Function = TypeVar("Function", bound=Callable[..., Any])


class TolerantCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """numba's cache of one function, with misses where numba's own raises an error or returns wrong code.

    - An index pickles the classes of arguments. It raises an error once such a class has moved, as an upgrade may do.
    - A damaged file raises an error.
    - Two processes that compile at once number their files alike, so an index may name the code of other types, or lose an
      entry. Here they save in turn where the system can lock a folder.
    - A folder may be read-only, a disk full.
    - numba asks for the age of the kernel's own file alone. Here the files of what it calls count, too.
    """

    def __init__(self, function: Any, sources: Sources) -> None:
        super().__init__(function)
        stamp = (*self._cache_file._source_stamp, *sorted(sources))
        self._source_stamp = self._cache_file._source_stamp = stamp

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compile result for argument types, None if there is none that fits."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # unpickling may raise any
            self._forget()
            found = None
        fits = found is not None and tuple(found.signature.args) == tuple(normalize_signature(sig)[0])
        if not fits:
            _announce(ONCE)
        return found if fits else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compile result, if the folder takes it."""
        try:
            self._impl.locator.ensure_cache_path()
            with _alone_in(self.cache_path):
                super().save_overload(sig, data)
        except OSError:
            self.disable()

    def _forget(self) -> None:
        try:
            self.flush()
        except OSError:
            self.disable()


@contextlib.contextmanager
def _alone_in(folder: str) -> Iterator[None]:
    """Keep other processes that save there waiting; where the system cannot, keep none."""
    if sys.platform == "win32":
        yield
        return
    import fcntl

    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with contextlib.suppress(OSError):  # of file systems without locks
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


def compiled(function: Function) -> Function:
    """Compile ``function`` when it is first called; its arrays and scalars must be of types that numba knows."""
    kernel: Any = numba.njit(nogil=True)(function)
    if kernel is not function:  # NUMBA_DISABLE_JIT leaves it as it is
        try:
            kernel.sources = _sources(function)
            kernel._cache = TolerantCache(function, kernel.sources)  # what `cache=True` sets, to numba's own class
        except RuntimeError:  # no folder takes files: the code stays in memory
            _announce(EVERY_TIME)
    return cast(Function, kernel)


def _sources(function: Callable[..., Any]) -> Sources:
    """The files that a kernel's machine code depends on: its own, and those of what it may call."""
    found = {_changed(function.__module__)}
    for value in list(function.__globals__.values()):
        module = getattr(value, "__module__", None)
        if isinstance(module, str) and module.startswith(PACKAGES):
            found |= {_changed(module), *getattr(value, "sources", ())}
    return frozenset(found)


@functools.cache
def _changed(module: str) -> tuple[str, float]:
    """A module, and when its file was changed, seconds; 0 if it has none."""
    file = getattr(sys.modules.get(module), "__file__", None)
    try:
        return module, os.stat(file).st_mtime if file else 0.0
    except OSError:
        return module, 0.0


@functools.cache
def _announce(message: str) -> None:
    LOGGER.info(message)
