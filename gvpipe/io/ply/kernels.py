"""Kernel of `gvpipe.io.ply.elements`: where the properties of packed records are, if lists differ in length."""

from __future__ import annotations

from typing import NamedTuple

from gvpipe.foundation.arrays import Int64, UInt8
from gvpipe.runtime.compiled import compiled


class Layout(NamedTuple):
    """Properties of one element, in order.

    Args:
        sizes: ``(n,)`` bytes of a number.
        length_sizes: ``(n,)`` bytes of the length before a list; 0: the property is one number.
        is_signed: ``(n,)`` 1 where that length is signed.
        is_big: whether bytes are in big-endian order.
    """

    sizes: Int64
    length_sizes: Int64
    is_signed: Int64
    is_big: bool


@compiled
def find_records(body: UInt8, at: int, layout: Layout, starts: Int64, lengths: Int64) -> int:
    """Fill ``starts`` and ``lengths (N, n)`` of the properties' numbers; return where the records end.

    Returns -1 if the body ends before, -2 if a length is negative.
    """
    n_records, n_properties = starts.shape
    for i in range(n_records):
        for p in range(n_properties):
            n_bytes = layout.length_sizes[p]
            length = 1
            if n_bytes > 0:
                if at + n_bytes > len(body):
                    return -1
                length = 0
                for b in range(n_bytes):
                    place = b if layout.is_big else n_bytes - 1 - b
                    length = length * 256 + int(body[at + place])
                if layout.is_signed[p] == 1 and length >= 1 << (8 * n_bytes - 1):
                    return -2
                at += n_bytes
            starts[i, p], lengths[i, p] = at, length
            if length > (len(body) - at) // layout.sizes[p]:
                return -1
            at += length * layout.sizes[p]
    return at
