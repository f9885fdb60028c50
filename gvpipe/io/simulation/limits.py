"""How large the numbers that a file declares may be, for the file's size."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

SMALLEST = 64 << 20  # bytes that any file may need
RATIO = 2000  # bytes per byte of the file; deflate reaches 1032


def check_bytes(shape: Sequence[int], itemsize: int, bytes_file: int, what: str) -> None:
    """Raise `ValueError` if an array would be far larger than its file can hold."""
    needed = prod(int(size) for size in shape) * itemsize
    if min(shape, default=0) < 0 or needed > max(SMALLEST, RATIO * bytes_file):
        raise ValueError(f"{what} has {' x '.join(map(str, shape))} numbers, which a file of {bytes_file} bytes cannot hold")
