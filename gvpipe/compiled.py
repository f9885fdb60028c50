"""Compilation of loops that numpy cannot vectorise.

Importing a module that uses this decorator imports numba (0.3 s). So such modules hold kernels alone, and functions import them
where they call them, not at the top of a file.

numba compiles a kernel when it is first called with arguments of some types, and caches the machine code beside the source
(``NUMBA_CACHE_DIR`` names another folder). The cache only saves time: code that it cannot load is compiled again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import FunctionCache
from numba.core.sigutils import normalize_signature

Function = TypeVar("Function", bound=Callable[..., Any])


class TolerantCache(FunctionCache):  # type: ignore[misc]  # numba has no types
    """numba's cache of one function, with misses where numba's own raises an error or returns wrong code.

    - An index pickles the classes of arguments. It raises an error once such a class has moved, as an upgrade may do.
    - A damaged file raises an error.
    - Two processes that compile at once number their files alike, so an index may name the code of other types.
    - A folder may be read-only, a disk full.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compile result for argument types, None if there is none that fits."""
        try:
            found = super().load_overload(sig, target_context)
        except Exception:  # unpickling may raise any
            self._forget()
            return None
        fits = found is not None and tuple(found.signature.args) == tuple(normalize_signature(sig)[0])
        return found if fits else None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compile result, if the folder takes it."""
        try:
            super().save_overload(sig, data)
        except OSError:
            self.disable()

    def _forget(self) -> None:
        try:
            self.flush()
        except OSError:
            self.disable()


def compiled(function: Function) -> Function:
    """Compile ``function`` when it is first called; its arrays and scalars must be of types that numba knows."""
    kernel: Any = numba.njit(nogil=True)(function)
    if kernel is not function:  # NUMBA_DISABLE_JIT leaves it as it is
        with contextlib.suppress(RuntimeError):  # no folder takes files: the code stays in memory
            kernel._cache = TolerantCache(function)  # what `cache=True` sets, to numba's own class
    return cast(Function, kernel)
