"""Compilation of loops that numpy cannot vectorise.

Importing a module that uses this decorator imports numba (0.3 s). So such modules hold kernels alone, and functions import them
where they call them, not at the top of a file.

numba compiles a kernel when it is first called with arguments of some types, and what it makes is kept in files
(`gvpipe.runtime.kernel_form`). They only save time: code that is not found or does not load is compiled again.

Compiling all kernels of an encode takes up to a minute, on slow machines two. So a logger says once per process that it begins
(`gvpipe.runtime.announcements`), at level INFO, which is silent unless someone listens. The command line does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from gvpipe.runtime.kernel_form import Form, kernel_form

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile ``function`` when it is first called; its arrays and scalars must be of types that numba knows."""
    return cast(Function, _compile(function, inline=False))


def inlined(function: Function) -> Function:
    """As `compiled`, for a small function: its code becomes part of each kernel that calls it."""
    return cast(Function, _compile(function, inline=True))


def _compile(function: Callable[..., Any], inline: bool) -> Any:
    form = kernel_form()
    if form is Form.QUICK:
        from gvpipe.runtime.quick_kernels import quick

        return quick(function, inline=inline)
    if form is Form.PLAIN:
        from gvpipe.runtime.plain_kernels import plain

        return plain(function)
    return function
