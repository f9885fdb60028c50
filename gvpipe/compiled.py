"""Compilation of loops that numpy cannot vectorise.

Importing a module that uses this decorator imports numba (0.3 s), so such modules hold kernels alone, and are imported by the
functions that call them, not at the top of a file. Machine code is cached beside the source.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile ``function`` when it is first called; its arrays and scalars must be of types that numba knows."""
    return cast(Function, numba.njit(cache=True, nogil=True)(function))
