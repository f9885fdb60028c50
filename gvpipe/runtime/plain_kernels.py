"""Kernels compiled by numba's public interface alone, and kept by its own cache.

numba names its files by the source file of a kernel, and by the time of that file. It knows nothing of the kernels that are
called. So the files lie in a folder that is named by all sources of gvpipe and its codecs, within the private one
(`gvpipe.runtime.code_folder`): numba pickles what it keeps. Where there is no such folder, nothing is kept.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numba

from gvpipe.runtime.code_folder import own_folder

PACKAGES = ("gvpipe", "gvcodecs")


def plain(function: Callable[..., Any]) -> Any:
    """A kernel that is compiled when it is first called."""
    with _cache_folder() as is_kept, contextlib.suppress(RuntimeError):  # numba keeps no function that has no file
        return numba.njit(nogil=True, cache=is_kept)(function)
    return numba.njit(nogil=True)(function)


@contextlib.contextmanager
def _cache_folder() -> Iterator[bool]:
    """Have numba keep what it compiles in our folder; False if there is none."""
    folder = own_folder()
    if folder is None:
        yield False
        return
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(folder / "plain" / _sources())
    try:
        yield True
    finally:
        numba.config.CACHE_DIR = before


@functools.cache
def _sources() -> str:
    """A name that changes with any source file."""
    found = hashlib.sha256()
    for package in PACKAGES:
        spec = find_spec(package)
        for root in (spec.submodule_search_locations or ()) if spec else ():
            for path in sorted(Path(root).rglob("*.py")):
                state = path.stat()
                found.update(f"{path} {state.st_size} {state.st_mtime_ns}\n".encode())
    return found.hexdigest()[:16]
