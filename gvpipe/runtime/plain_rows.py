"""Rows of numbers in kernels as arrays: what `gvpipe.runtime.lanes` hands on where kernels are plain, or not compiled.

numpy's operators work number by number, as the vectors of `gvpipe.runtime.vector_rows` do. So the bits are the same.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gvpipe.foundation.arrays import Float64, Int32

Load = Callable[[Float64, int], Float64]
Store = Callable[[Float64, int, Float64], None]
Same = Callable[[float], Float64]
Prefetch = Callable[[Float64 | Int32, int, int], None]


def make_rows(lanes: int) -> tuple[Load, Store, Same]:
    """What loads, stores and makes rows of so many numbers."""

    def load(array: Float64, at: int) -> Float64:
        return array[at : at + lanes].copy()

    def store(array: Float64, at: int, row: Float64) -> None:
        array[at : at + lanes] = row

    def same(number: float) -> Float64:
        return np.full(lanes, number)

    return load, store, same


def prefetch(array: Float64 | Int32, row: int, column: int) -> None:
    """Ask for nothing."""
