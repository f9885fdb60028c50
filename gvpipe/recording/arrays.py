"""Arrays of other libraries as numpy's: of PyTorch, JAX, Warp, CuPy and their like, without an import of any."""

from __future__ import annotations

from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import InputError

STEPS = ("detach", "cpu", "numpy")  # methods of tensors that lead to numpy, in this order
COPY = "get"  # of arrays on a GPU that have no `numpy`


def as_array(given: Any, what: str) -> Array:
    """An array of numbers as numpy has it; ``what`` names it in messages.

    Raises:
        InputError: it is no array of numbers.

    Examples:
        >>> class Tensor:
        ...     def numpy(self):
        ...         return np.ones(3)
        >>> as_array(Tensor(), "stress")
        array([1., 1., 1.])
    """
    if not isinstance(given, np.ndarray) and not hasattr(given, "__array_interface__"):
        for step in STEPS:
            method = getattr(given, step, None)
            given = method() if callable(method) else given
        if not hasattr(given, "__array__") and callable(getattr(given, COPY, None)):
            given = given.get()
    try:
        array: Array = np.asarray(given)
    except (TypeError, ValueError, RuntimeError) as exc:
        raise InputError(f"{what} cannot be made an array: {exc}") from exc
    if array.dtype.kind not in "fiub":
        raise InputError(f"{what} has type {array.dtype}; an array of numbers is needed")
    return array
