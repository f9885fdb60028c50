"""Sections that are one zlib stream of a number of bytes that the reader knows."""

from __future__ import annotations

import zlib

from gvpipe.foundation.errors import corrupt_section


def deflated(data: bytes) -> bytes:
    """A zlib stream."""
    return zlib.compress(data, 9)


def inflated(data: bytes, n_bytes: int, section: str, what: str = "") -> bytes:
    """Mirror of `deflated`.

    Args:
        data: the stream.
        n_bytes: that come out of it.
        section: that it lies in, for messages.
        what: these bytes are, for messages.

    Raises:
        CorruptFile: it is no such stream, or another number of bytes comes out.
    """
    inflater = zlib.decompressobj()
    try:
        found = inflater.decompress(data, n_bytes + 1)
    except zlib.error as exc:
        raise corrupt_section(section, f"it does not inflate ({exc})") from exc
    if len(found) != n_bytes or not inflater.eof or inflater.unused_data:
        raise corrupt_section(section, f"it does not hold {what or f'{n_bytes} bytes'}")
    return found
