"""Kernels compiled by parts of numba that are private to it: arguments are borrowed, and machine code lies in files of ours."""

from __future__ import annotations

import functools
import gc
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numba

from gvpipe.runtime.announcements import announce_no_folder
from gvpipe.runtime.borrowing import BorrowingCompiler
from gvpipe.runtime.first_kernels import note_miss
from gvpipe.runtime.machine_code import MachineCode

OPTIONS = {
    "nogil": True,
    "no_cfunc_wrapper": True,
}  # nothing calls kernels by C pointers, and their wrappers take a tenth of compiling
RARELY = 20_000  # objects made between two searches for garbage while a kernel is compiled; Python's own are 700 to 10,000


class _Compiler(BorrowingCompiler):
    """Compiling makes millions of objects, nearly all of which stay until its end: searching for garbage took a sixth of it."""

    def compile_extra(self, func: Callable[..., Any]) -> Any:
        """Compile a function; numba's lock lets one thread at a time do so."""
        often, *others = gc.get_threshold()
        gc.set_threshold(max(often, RARELY) if often else 0, *others)  # 0: whoever runs this wants no searches
        try:
            return super().compile_extra(func)
        finally:
            gc.set_threshold(often, *others)


def quick(function: Callable[..., Any], *, inline: bool = False, on_miss: Callable[[], None] = note_miss) -> Any:
    """A kernel that is compiled when it is first called.

    Args:
        function: in Python.
        inline: its code becomes part of each kernel that calls it.
        on_miss: called when there is no code for some types.
    """
    options = {**OPTIONS, "forceinline": True} if inline else OPTIONS
    kernel: Any = numba.njit(pipeline_class=_Compiler, **options)(function)
    kernel._cache = MachineCode(function, options, on_miss, announce_no_folder)  # `cache=True` sets numba's own
    kernel.get_call_template = functools.partial(_find_overload, kernel.get_call_template)
    return kernel


def _find_overload(find: Callable[..., Any], arguments: Iterable[Any], keywords: Mapping[str, Any]) -> Any:
    """What a call by another kernel finds: numba alone compiles a version for each constant argument, here one serves all."""
    types = numba.types
    return find(tuple(map(types.unliteral, arguments)), {name: types.unliteral(kind) for name, kind in keywords.items()})
