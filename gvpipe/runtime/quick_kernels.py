"""Kernels compiled by parts of numba that are private to it: arguments are borrowed, and machine code lies in files of ours."""

from __future__ import annotations

import functools
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


def quick(function: Callable[..., Any], *, inline: bool = False, on_miss: Callable[[], None] = note_miss) -> Any:
    """A kernel that is compiled when it is first called.

    Args:
        function: in Python.
        inline: its code becomes part of each kernel that calls it.
        on_miss: called when there is no code for some types.
    """
    options = {**OPTIONS, "forceinline": True} if inline else OPTIONS
    kernel: Any = numba.njit(pipeline_class=BorrowingCompiler, **options)(function)
    kernel._cache = MachineCode(function, options, on_miss, announce_no_folder)  # `cache=True` sets numba's own
    kernel.get_call_template = functools.partial(_find_overload, kernel.get_call_template)
    return kernel


def _find_overload(find: Callable[..., Any], arguments: Iterable[Any], keywords: Mapping[str, Any]) -> Any:
    """What a call by another kernel finds: numba alone compiles a version for each constant argument, here one serves all."""
    types = numba.types
    return find(tuple(map(types.unliteral, arguments)), {name: types.unliteral(kind) for name, kind in keywords.items()})
