"""The library ufbx, inside the process of its own that `gvpipe.io.fbx.worker` is: its objects are held there for ever.

ufbx 0.0.5 gives out its objects without a reference of their own: the second look at a node, or a garbage collection, frees
what is still in use, and the process dies. So every object gets a reference that is never taken back, and nothing is collected.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from gvpipe.arrays import Array, Float64

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


def numbers(found: Any, dtype: Any) -> Array:
    """The numbers of one of its lists."""
    hold(found)
    return np.array(found, dtype) if len(found) else np.zeros(0, dtype)


def columns(node: Any) -> Float64:
    """``(4, 3)`` the columns of the transform from a node's geometry to the world."""
    return np.array(hold(node.geometry_to_world), np.float64)


def square(matrix: Any) -> Float64:
    """``(4, 4)`` a transform, for rows of coordinates."""
    result = np.eye(4)
    result[:, :3] = np.array(hold(matrix), np.float64)
    return result
