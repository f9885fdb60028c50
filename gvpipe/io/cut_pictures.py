"""Whether a picture ends early. It is kept as it came, and a note says so: the programs that show it decide what they do.

Pictures are not decoded for this; their formats say where they end.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gvpipe.asset.material import Image

PNG = b"\x89PNG\r\n\x1a\n"
JPEG, JPEG_END = b"\xff\xd8\xff", b"\xff\xd9"
CHUNK = struct.Struct(">I4s")  # of PNG: bytes, type; a checksum of 4 bytes follows what it holds


def cut_notes(images: tuple[Image, ...]) -> tuple[str, ...]:
    """A note for each picture that ends early."""
    return tuple(
        f"picture {image.name!r} is cut short, at {len(image.data)} bytes; it is kept as it is, so replace it"
        for image in images
        if is_cut(image.data)
    )


def is_cut(data: bytes) -> bool:
    """Whether a PNG, JPEG or WebP ends before its end; False for other formats."""
    if data.startswith(PNG):
        return not _has_end(data)
    if data.startswith(JPEG):
        return JPEG_END not in data
    if data.startswith(b"RIFF") and len(data) >= 8:
        return int.from_bytes(data[4:8], "little") + 8 > len(data)
    return False


def _has_end(data: bytes) -> bool:
    """Whether the chunks of a PNG lead to the last one."""
    at = len(PNG)
    while at + CHUNK.size <= len(data):
        size, kind = CHUNK.unpack_from(data, at)
        at += CHUNK.size + size + 4
        if kind == b"IEND":
            return bool(at <= len(data))
    return False
