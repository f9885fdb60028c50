"""The library ufbx, inside the process of its own that `gvpipe.io.fbx.worker` is: its objects are held there for ever.

ufbx 0.0.5 gives out its objects without a reference of their own: the second look at a node, or a garbage collection, frees
what is still in use, and the process dies. So every object gets a reference that is never taken back, and nothing is collected.
"""

from __future__ import annotations

import ctypes
from array import array
from typing import Any

from gvpipe.io.fbx.answers import Numbers

_keep = ctypes.pythonapi.Py_IncRef
_keep.argtypes, _keep.restype = [ctypes.py_object], None


def hold(found: Any) -> Any:
    """Return an object of the library with a reference that is never taken back."""
    if found is not None:
        _keep(found)
    return found


def listed(found: Any) -> list[Any]:
    """The elements of one of its lists, each held."""
    hold(found)
    return [hold(found[number]) for number in range(len(found))]


def vectors(found: Any) -> Numbers:
    """The numbers of one of its lists of faces or vectors, row after row."""
    hold(found)
    if not len(found):  # a look at an empty one ends the process
        return Numbers("d", b"")
    view = memoryview(found)
    return Numbers(view.format, view.tobytes())


def integers(found: Any) -> Numbers:
    """The numbers of one of its lists of indices."""
    hold(found)
    return Numbers("I", array("I", found).tobytes() if len(found) else b"")


def columns(matrix: Any) -> tuple[float, ...]:
    """The 12 numbers of a transform, column after column."""
    return tuple(float(value) for column in hold(matrix) for value in column)
