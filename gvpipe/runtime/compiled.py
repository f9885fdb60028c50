"""Compilation of loops that numpy cannot vectorise.

Importing a module that uses this decorator imports numba (0.3 s). So such modules hold kernels alone, and functions import them
where they call them, not at the top of a file.

numba compiles a kernel when it is first called with arguments of some types. `gvpipe.runtime.machine_code` keeps what it makes
in files. They only save time: code that is not found or does not load is compiled again.

Compiling all kernels of an encode takes up to a minute, on slow machines two. So the logger of this module says once per
process that it begins, at level INFO, which is silent unless someone listens. The command line does.
"""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar, cast

import numba

from gvpipe.runtime.borrowing import BorrowingCompiler
from gvpipe.runtime.code_folder import why_none
from gvpipe.runtime.machine_code import MachineCode

LOGGER = logging.getLogger(__name__)
ONCE = "compiling kernels, once after installation; the first commands take up to a minute longer, on slow machines two"
EVERY_TIME = (
    "compiling kernels in every run, since no safe folder takes machine code ({}); set NUMBA_CACHE_DIR to one of your own"
)

OPTIONS = {
    "nogil": True,
    "no_cfunc_wrapper": True,
}  # nothing calls kernels by C pointers, and their wrappers take a tenth of compiling

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile ``function`` when it is first called; its arrays and scalars must be of types that numba knows."""
    return _compiled(function, OPTIONS)


def inlined(function: Function) -> Function:
    """As `compiled`, for a small function: its code becomes part of each kernel that calls it."""
    return _compiled(function, {**OPTIONS, "forceinline": True})


def _compiled(function: Function, options: dict[str, bool]) -> Function:
    kernel: Any = numba.njit(pipeline_class=BorrowingCompiler, **options)(function)
    if kernel is not function:  # NUMBA_DISABLE_JIT leaves it as it is
        on_miss, on_refusal = functools.partial(_announce, ONCE), lambda: _announce(EVERY_TIME.format(why_none()))
        kernel._cache = MachineCode(function, options, on_miss, on_refusal)  # what `cache=True` sets, to numba's own class
        kernel.get_call_template = functools.partial(_find_overload, kernel.get_call_template)
    return cast(Function, kernel)


def _find_overload(find: Callable[..., Any], arguments: Iterable[Any], keywords: Mapping[str, Any]) -> Any:
    """What a call by another kernel finds: numba alone compiles a version for each constant argument, here one serves all."""
    types = numba.types
    return find(tuple(map(types.unliteral, arguments)), {name: types.unliteral(kind) for name, kind in keywords.items()})


@functools.cache
def _announce(message: str) -> None:
    LOGGER.info(message)
