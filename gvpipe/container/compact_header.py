"""The header of payloads that must be small: JSON with the lengths of sections in it, deflated with a preset dictionary.

The bare layout (`gvpipe.container.bare`) and the plain one (`gvpipe.container.plain`) have it, each with a dictionary of its
own::

    header = [varint] bytes, a JSON object in UTF-8, deflated without head and checksum (RFC 1951)

It is that of `gvpipe.container.bitstream`. ``sections`` has the length of each section by name, in the order of their data.
``container`` is left out where it is empty.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping
from typing import Any

from gvpipe.container.bitstream import CHECKSUM, HEADER, MAX_HEADER, MAX_NAME, MAX_SECTIONS, NAME, Bitstream, header_values
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.json_object import JsonObject, unpack_json
from gvpipe.foundation.budget import Budget
from gvpipe.foundation.errors import corrupt

MAX_LENGTH = 1 << 40  # of a section, bytes
SECTIONS = "sections"
RAW = -15  # deflate without head and checksum, window of 32 KiB


def compact_values(bitstream: Bitstream, extra: Mapping[str, Any]) -> dict[str, Any]:
    """The header as JSON values; ``extra`` is the container's own part of it."""
    values = header_values(bitstream, extra)
    if not extra:
        del values["container"]
    return {**values, SECTIONS: {name: len(data) for name, data in bitstream.sections.items()}}


def pack_compact(values: Mapping[str, Any], dictionary: bytes) -> bytes:
    """Return the header behind its length."""
    deflater = zlib.compressobj(9, zlib.DEFLATED, RAW, zdict=dictionary)
    text = json.dumps(values, separators=(",", ":"), allow_nan=False).encode()
    return pack_block(deflater.compress(text) + deflater.flush())


def unpack_compact(cursor: Cursor, dictionary: bytes, budget: Budget) -> JsonObject:
    """Mirror of `pack_compact`; raises `CorruptFile`, `OverBudget`."""
    return unpack_json(cursor.block(), HEADER, MAX_HEADER, budget, zlib.decompressobj(RAW, zdict=dictionary))


def checked_content(payload: bytes) -> bytes:
    """A payload without the checksum at its end; raises `CorruptFile` if that does not match."""
    content = payload[: -CHECKSUM.size]
    if CHECKSUM.unpack(payload[-CHECKSUM.size :]) != (zlib.crc32(content),):
        raise corrupt("the checksum of its payload does not match")
    return content


def section_lengths(header: JsonObject) -> dict[str, int]:
    """Bytes of each section, in order; raises `CorruptFile`."""
    found = header.object(SECTIONS)
    names = list(found.plain)
    if len(names) > MAX_SECTIONS or not all(map(_is_name, names)):
        raise found.corrupt("the names of its sections are not a letter and up to 63 of a to z, 0 to 9 and dots")
    return {name: found.integer(name, 0, MAX_LENGTH) for name in names}


def _is_name(name: str) -> bool:
    """Whether a section may have the name; it begins with a letter, since JavaScript puts numbers before other keys."""
    fits = name.isascii() and len(name) <= MAX_NAME and NAME.fullmatch(name.encode()) is not None
    return fits and name[0].isalpha() and name != HEADER
