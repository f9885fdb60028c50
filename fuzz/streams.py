"""Files of the stream layout: taken apart into head, index, sections and fragments, changed, and put together again.

The index says where everything lies. It is made anew after each change, with its checksums, unless it is what was changed.
"""

from __future__ import annotations

import zlib

import numpy as np

from fuzz.boxes import mutate_boxes
from fuzz.mutation import mutate_bytes, mutate_json
from fuzz.parts import Parts, Seed, Target
from fuzz.videos import FILE, parse_video
from gvpipe.container.bitstream import CHECKSUM, HEADER, MAGIC, PREFIX, VERSION
from gvpipe.container.boxes import BOX, uuid_head
from gvpipe.container.companion import without_companions
from gvpipe.container.cursor import Cursor
from gvpipe.container.stream_layout import COUNT, DATA_UUID, FRAGMENT, INDEX_UUID, PLACE, WHOLE
from gvpipe.foundation.errors import FormatError

HEAD, INDEX = "(head)", "(index)"
MOOF, MDAT = "(moof {})", "(mdat {})"


def split_stream(data: bytes) -> Parts:
    """A sound file of the stream layout in parts, in the order of the file; the header is JSON."""
    start = data.index(INDEX_UUID.bytes) + 16
    cursor = Cursor(data[start:], "index")
    cursor.take(len(MAGIC))
    _, count = cursor.struct(PREFIX)
    places: list[tuple[int, str, int]] = []
    for _ in range(count):
        name = cursor.take(cursor.take(1)[0]).decode()
        length, _, offset = cursor.struct(PLACE)
        places.append((offset, name, length))
    fragments = np.frombuffer(cursor.take(cursor.struct(COUNT)[0] * FRAGMENT.itemsize), FRAGMENT)
    for number, (offset, moof, mdat, _, _) in enumerate(fragments.tolist()):
        places += [(offset, MOOF.format(number), moof), (offset + moof, MDAT.format(number), mdat)]
    parts = {HEAD: data[: cursor.struct(WHOLE)[1]]}
    for offset, name, length in sorted(places):
        parts[name] = data[offset : offset + length]
    return {**parts, HEADER: zlib.decompress(parts[HEADER])}


def join_stream(parts: Parts) -> dict[str, bytes]:
    """The file of some parts: places, lengths and checksums are made here."""
    return {FILE: _join(parts)}


def _join(parts: Parts) -> bytes:
    head, header = parts[HEAD], zlib.compress(parts[HEADER], 9)
    index, content = b"", b""
    for _ in range(2):  # places follow from the length of the index
        start = len(head) + len(uuid_head(INDEX_UUID, len(index) + len(header))) + len(index)
        index, content = _index_and_content(parts, head, header, start)
    if INDEX in parts:
        index = parts[INDEX] + CHECKSUM.pack(zlib.crc32(parts[INDEX]))
    return head + uuid_head(INDEX_UUID, len(index) + len(header)) + index + header + content


def _index_and_content(parts: Parts, head: bytes, header: bytes, start: int) -> tuple[bytes, bytes]:
    """The index, and what follows the header, which begins at byte ``start``."""
    content, rows, table = b"", [(HEADER, header, start)], []
    at = start + len(header)
    for name, data in parts.items():
        if name in (HEAD, INDEX, HEADER) or name.startswith("(mdat"):
            continue
        if name.startswith("(moof"):
            mdat = parts.get(name.replace("moof", "mdat"), b"")
            table.append((at + len(content), len(data), len(mdat), _n_pictures(data), zlib.crc32(mdat, zlib.crc32(data))))
            content += data + mdat
        else:
            box = uuid_head(DATA_UUID, len(data))
            rows.append((name, data, at + len(content) + len(box)))
            content += box + data
    entries = [bytes([len(name)]) + name.encode() + PLACE.pack(len(data), zlib.crc32(data), o) for name, data, o in rows]
    fragments = COUNT.pack(len(table)) + np.array(table, FRAGMENT).tobytes()
    whole = WHOLE.pack(at + len(content), len(head), _head_checksum(head))
    index = b"".join([MAGIC, PREFIX.pack(VERSION, len(rows)), *entries, fragments, whole])
    return index + CHECKSUM.pack(zlib.crc32(index)), content


def _head_checksum(head: bytes) -> int:
    try:
        return zlib.crc32(without_companions(head))
    except FormatError:
        return zlib.crc32(head)


def _n_pictures(moof: bytes) -> int:
    """What the table of a fragment says, wherever that is now."""
    at = moof.find(b"trun")
    return int.from_bytes(moof[at + 8 : at + 12], "big") % (1 << 32) if at >= 0 else 1


def stream_target(seeds: tuple[Seed, ...]) -> Target:
    """The parser of the stream layout."""
    return Target("stream", seeds, _mutate, join_stream, parse_video, (FormatError,))


def _mutate(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change parts; now and then one is left out, or comes to another place."""
    for _ in range(1 + (int(rng.geometric(0.5)) if rng.random() < 0.5 else 0)):
        names = [name for name in parts if name != HEAD]
        name = HEAD if rng.random() < 0.15 else INDEX if rng.random() < 0.3 else names[int(rng.integers(len(names)))]
        if name == INDEX:
            index = parts.get(INDEX) or _index_of(parts)
            parts[INDEX] = mutate_bytes(index, rng)
        elif rng.random() < 0.06 and name not in (HEAD, HEADER):
            moved = parts.pop(name)
            if rng.random() < 0.5:
                parts[name] = moved
        elif name == HEADER:
            parts[name] = mutate_json(parts[name], rng)
        elif name == HEAD or name.startswith("(moof"):
            parts[name] = mutate_boxes(parts[name], rng)
        elif name.startswith("(mdat"):
            parts[name] = parts[name][: BOX.size] + mutate_bytes(parts[name][BOX.size :], rng)
            parts[name] = len(parts[name]).to_bytes(4, "big") + parts[name][4:]
        else:
            parts[name] = mutate_bytes(parts[name], rng)
    return parts


def _index_of(parts: Parts) -> bytes:
    """The index as it would be, without its checksum."""
    data = _join(parts)
    start = data.index(INDEX_UUID.bytes) + 16
    length = int.from_bytes(data[start - 24 : start - 20], "big") - 24 - len(zlib.compress(parts[HEADER], 9))
    return data[start : start + length - CHECKSUM.size]
