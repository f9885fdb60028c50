"""The library ufbx: imported when it is needed, its objects held, its errors as one line."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gvpipe.arrays import Array
from gvpipe.errors import InputError

_keep = ctypes.pythonapi.Py_IncRef
_keep.argtypes, _keep.restype = [ctypes.py_object], None


def import_ufbx(path: Path) -> Any:
    """The library; raises `InputError` with the command that installs it."""
    try:
        import ufbx
    except ImportError as exc:
        raise InputError(f"{path} needs ufbx; install it with: pip install 'gvpipe[fbx]'") from exc
    return ufbx


def hold(found: Any) -> Any:
    """Return an object of the library with a reference that is never taken back.

    ufbx 0.0.5 gives out its objects without a reference of their own, so that the second look at a node frees it and the
    process dies. What is held here are small wrappers; `free` returns the memory of a scene itself.
    """
    if found is not None:
        _keep(found)
    return found


def listed(found: Any) -> list[Any]:
    """The elements of one of its lists, each held."""
    hold(found)
    return [hold(found[number]) for number in range(len(found))]


def numbers(found: Any, dtype: Any) -> Array:
    """The numbers of one of its lists."""
    hold(found)
    return np.array(found, dtype) if len(found) else np.zeros(0, dtype)


@contextmanager
def fbx_errors(ufbx: Any, path: Path) -> Iterator[None]:
    """Turn the library's errors into `InputError` of one line."""
    try:
        yield
    except ufbx.UfbxError as exc:
        reason = " ".join(str(exc).split())[:200] or type(exc).__name__
        raise InputError(f"{path} cannot be read as FBX: {reason}; export it again") from exc
