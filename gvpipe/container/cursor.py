"""Bounds-checked reading, and the matching writing, of small binary sections.

A number is one of two things:

- a field of a declared little-endian struct;
- a *varint*: seven bits a byte, least significant group first, top bit set on all bytes but the last (LEB128), at most 64 bits.

A length-prefixed block is the varint of its length, then its bytes.
"""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array
from gvpipe.foundation.errors import CorruptFile, corrupt_section

MAX_VARINT_BYTES = 10


def varint(value: int) -> bytes:
    """Return ``value`` (0..2**64-1) as a varint; raises ValueError beyond.

    Examples:
        >>> varint(300).hex()
        'ac02'
    """
    if not 0 <= value < 1 << 64:
        raise ValueError(f"varint of {value}: it must lie in 0..2**64-1")
    result = bytearray()
    while value >= 0x80:
        result.append(value & 0x7F | 0x80)
        value >>= 7
    result.append(value)
    return bytes(result)


def pack_block(data: bytes) -> bytes:
    """Return ``data`` behind the varint of its length; `Cursor.block` reads it.

    Examples:
        >>> pack_block(b"abc")
        b'\\x03abc'
    """
    return varint(len(data)) + data


class Cursor:
    """Reads one section from its start to its end; every read is checked against what is left.

    Examples:
        >>> cursor = Cursor(varint(300) + pack_block(b"abc"), "example")
        >>> cursor.varint(1000), cursor.block(), cursor.left
        (300, b'abc', 0)

    Args:
        data: the section.
        name: of the section, for messages.

    Raises:
        CorruptFile: a field reaches past the end, or is out of its range; the message names the section.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self._data = data
        self._position = 0
        self.name = name

    @property
    def left(self) -> int:
        """Bytes not read yet."""
        return len(self._data) - self._position

    def take(self, count: int) -> bytes:
        """Return the next ``count`` bytes."""
        if count > self.left:
            raise self.corrupt(f"needs {count} more bytes where {self.left} are left")
        self._position += count
        return self._data[self._position - count : self._position]

    def block(self) -> bytes:
        """Return the bytes of a length-prefixed block (`pack_block`)."""
        return self.take(self.varint(self.left, "a length"))

    def rest(self) -> bytes:
        """Return all bytes not read yet."""
        return self.take(self.left)

    def struct(self, layout: struct.Struct) -> tuple[Any, ...]:
        """Return the fields of ``layout``."""
        return layout.unpack(self.take(layout.size))

    def array(self, dtype: str, count: int) -> Array:
        """Return ``count`` items of a little-endian ``dtype``."""
        return np.frombuffer(self.take(count * np.dtype(dtype).itemsize), dtype)

    def varint(self, limit: int, what: str = "a number") -> int:
        """Return a varint that must not exceed ``limit``; ``what`` names it in the message."""
        if self._position < len(self._data) and self._data[self._position] < min(limit + 1, 0x80):  # most are one byte
            self._position += 1
            return self._data[self._position - 1]
        value = 0
        for k in range(MAX_VARINT_BYTES):
            byte = self.take(1)[0]
            value |= (byte & 0x7F) << (7 * k)
            if byte < 0x80:
                if value > limit:
                    raise self.corrupt(f"{what} is {value}, above its limit of {limit}")
                return value
        raise self.corrupt(f"{what} is longer than {MAX_VARINT_BYTES} bytes")

    def varints(self, count: int, limit: int, what: str = "a number") -> list[int]:
        """Return as many varints, none of which may exceed ``limit``."""
        data = self._data
        values: list[int] = []
        end = len(data) - 1
        while len(values) < count and self._position < end:  # those of one or two bytes, as most are
            value, length = data[self._position], 1
            if value >= 0x80:
                value, length = value & 0x7F | data[self._position + 1] << 7, 2
            if value > limit or value >= 1 << 14:
                break
            values.append(value)
            self._position += length
        return values + [self.varint(limit, what) for _ in range(count - len(values))]

    def end(self) -> None:
        """Check that nothing is left."""
        if self.left:
            raise self.corrupt(f"{self.left} bytes are left over")

    def corrupt(self, what: str) -> CorruptFile:
        """Return the error that says ``what`` is wrong in this section."""
        return corrupt_section(self.name, f"{what}")
