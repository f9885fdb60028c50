"""The first encode after an installation: other processes compile the kernels that it is about to need.

A first encode or decode compiles about 200 kernels, one after the other, 0.3 s each. `first_kernels.json` lists them for each
codec (`tools/list_first_kernels.py`). Once one is missing, a process for each further core goes through the list from
its end, while the caller begins at the start. Each leaves out what is there, and what another has claimed
(`gvpipe.runtime.claims`). So no kernel compiles twice, and a list that is out of date costs time alone.

The processes end with the caller.
"""

from __future__ import annotations

import atexit
import contextlib
import functools
import json
import os
import sys
import threading
from collections.abc import Iterator
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any

from gvpipe.foundation.cores import count_cores
from gvpipe.foundation.isolation.python import Process, start_python
from gvpipe.runtime.announcements import announce_compiling
from gvpipe.runtime.claims import claims_in
from gvpipe.runtime.code_folder import own_folder

LIST = Path(__file__).with_suffix(".json")
HELPERS = "helpers"  # a claim: one process at a time has some
VARIABLE = "GVPIPE_COMPILES_ALONE"  # set where no process may start others
MOST = 7  # helpers; more find little left to do
LOOKED_AT, LEAST = 20, 10  # kernels of the list's start, and how many of these must be missing to be worth a process

_expected: list[str] = []  # the codec whose kernels are needed next


def expect(codec: str) -> None:
    """Say which codec is about to work in this process; once a kernel is missing, `note_miss` has its list compiled."""
    _expected[:] = [codec]


def note_miss() -> None:
    """A kernel of this process is missing: say so, and start processes that compile what else is."""
    announce_compiling()
    if _expected and not os.environ.get(VARIABLE):
        _compile_beside(_expected[0])


@functools.cache  # once in a process
def _compile_beside(codec: str) -> None:
    n_helpers, folder = min(MOST, count_cores() - 1), own_folder()
    if n_helpers < 1 or folder is None or codec not in _listed():
        return
    missing = sum(_is_wanted(*kernel) for kernel in islice(_kernels(codec), LOOKED_AT))
    if missing < LEAST or not claims_in(folder).take(HELPERS, 0):
        return
    alone = {VARIABLE: "1", "GVPIPE_KERNELS": "quick"}
    helpers = [start_python(["-m", __name__, codec, str(i), str(n_helpers)], alone) for i in range(n_helpers)]
    atexit.register(_end, helpers)


def _end(helpers: list[Process[bytes]]) -> None:
    for helper in helpers:
        helper.kill()
        helper.communicate()


@functools.cache
def _listed() -> dict[str, Any]:
    listed: dict[str, Any] = json.loads(LIST.read_text("utf-8"))
    return listed


def _kernels(codec: str) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    """Each kernel of a codec's list with the types of its arguments; what is out of date is left out."""
    from gvpipe.runtime.code_file import type_of_text

    for module, name, types in _listed()[codec]:
        with contextlib.suppress(ImportError, AttributeError, KeyError, TypeError, ValueError):
            kernel: Any = getattr(import_module(module), name)
            if hasattr(kernel, "_cache"):  # else another function has taken its name
                yield kernel, tuple(type_of_text(_listed()["types"][each]) for each in types)


def _is_wanted(kernel: Any, types: tuple[Any, ...]) -> bool:
    return bool(kernel._cache.is_wanted(types, kernel.targetctx))


def _help(codec: str, number: int, n_helpers: int) -> None:
    """Compile what is missing, from the end of the list on; each helper has its own kernels first."""
    kernels = list(_kernels(codec))[::-1]
    mine = kernels[number::n_helpers]
    for kernel, types in [*mine, *(each for i in range(n_helpers) if i != number for each in kernels[i::n_helpers])]:
        with contextlib.suppress(Exception):  # numba raises any, for a list that is out of date
            if _is_wanted(kernel, types):
                kernel.compile(types)


def _end_with_caller() -> None:
    sys.stdin.buffer.read()  # until the caller ends
    os._exit(0)  # files are written as a whole or not at all


if __name__ == "__main__":
    threading.Thread(target=_end_with_caller, daemon=True).start()
    _help(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
