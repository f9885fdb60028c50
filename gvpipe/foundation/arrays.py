"""Names of the array types that gvpipe passes around; a docstring adds each array's shape and unit."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Float32 = NDArray[np.float32]
Float64 = NDArray[np.float64]
Int32 = NDArray[np.int32]
Int64 = NDArray[np.int64]
UInt8 = NDArray[np.uint8]
UInt16 = NDArray[np.uint16]
UInt32 = NDArray[np.uint32]
UInt64 = NDArray[np.uint64]
Bool = NDArray[np.bool_]
Floats = NDArray[np.floating]
"""Floating-point numbers of any precision."""
Integers = NDArray[np.integer]
"""Integers of any size, signed or not."""
Array = NDArray[Any]
"""Numbers of a type that the docstring names."""


class Frames(Protocol):
    """What positions must offer: a shape, and slices of frames as arrays."""

    @property
    def shape(self) -> tuple[int, ...]: ...

    def __getitem__(self, key: slice, /) -> Floats: ...
