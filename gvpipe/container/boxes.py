"""MP4's boxes at top level: ``[u32 big-endian] size, [4 bytes] kind``, content.

Size 1 announces a 64-bit size behind the kind. A box of kind ``uuid`` begins with the 16 bytes of its own kind.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from uuid import UUID

BOX = struct.Struct(">I4s")
LARGE = struct.Struct(">Q")
UUID_BYTES = 16
LONGEST_HEAD = BOX.size + LARGE.size + UUID_BYTES


@dataclass(frozen=True)
class Box:
    """Where a box lies: ``start`` of its head, ``content`` behind it, ``stop``; ``uuid`` of a box of kind ``uuid``."""

    kind: bytes
    start: int
    content: int
    stop: int
    uuid: bytes = b""


def read_box(read: Callable[[int, int], bytes], start: int, size: int) -> Box | None:
    """The box at a place, None if there is no whole one.

    Args:
        read: ``read(offset, length)``, of a file.
        start: of the box.
        size: of the file.
    """
    head = read(start, max(0, min(LONGEST_HEAD, size - start)))
    if len(head) < BOX.size:
        return None
    length, kind = BOX.unpack_from(head)
    content = start + BOX.size
    if length == 1 and len(head) >= BOX.size + LARGE.size:
        length = LARGE.unpack_from(head, BOX.size)[0]
        content += LARGE.size
    uuid = head[content - start : content - start + UUID_BYTES] if kind == b"uuid" else b""
    content += len(uuid)
    return Box(kind, start, content, start + length, uuid) if content <= start + length <= size else None


def uuid_head(uuid: UUID, n_bytes: int) -> bytes:
    """The head of a ``uuid`` box with so many bytes of content."""
    size = BOX.size + UUID_BYTES + n_bytes
    if size < 1 << 32:
        return BOX.pack(size, b"uuid") + uuid.bytes
    return BOX.pack(1, b"uuid") + LARGE.pack(size + LARGE.size) + uuid.bytes
