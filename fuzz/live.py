"""Files that are still written: taken apart into head, header, shared sections and clips, changed, and put together again.

Places, lengths, checksums and the table of clips are made anew after each change, unless they are what was changed.
"""

from __future__ import annotations

import json
import zlib

import numpy as np

from fuzz.boxes import mutate_boxes
from fuzz.mutation import mutate_bytes, mutate_json
from fuzz.parts import Parts, Seed, Target
from fuzz.videos import FILE, parse_video
from gvpipe.container.bitstream import CHECKSUM, HEADER, PREFIX
from gvpipe.container.boxes import uuid_head
from gvpipe.container.live_layout import HEAD_BYTES, LIVE_UUID, ClipRow, read_rows
from gvpipe.container.stream_layout import DATA_UUID, FRAGMENT, ROOM_UUID, WHOLE, Place, index_size, pack_index, unpack_index
from gvpipe.foundation.errors import FormatError

HEAD, INDEX, TABLE = "(head)", "(index)", "(table)"
CLIP = "clip."
ROOM = bytes(64)  # readers do not look into it


def split_live(data: bytes) -> Parts:
    """A sound file that is not finished in parts, in the order of the file; the header is JSON."""
    start = data.index(LIVE_UUID.bytes) + 16
    index = unpack_index(data[start:])
    parts = {HEAD: data[: index.head[0]]}
    for name, place in sorted(index.places.items(), key=lambda item: item[1].offset):
        parts[name] = data[place.offset : place.offset + place.length]
    table = index.places[HEADER].offset + index.places[HEADER].length
    at = index.size
    for number, row in enumerate(read_rows(data[table:])):
        at += HEAD_BYTES
        parts[f"{CLIP}{number}"] = data[at : at + row.n_bytes]
        at += row.n_bytes
    return {**parts, HEADER: zlib.decompress(parts[HEADER])}


def join_live(parts: Parts) -> dict[str, bytes]:
    """The file of some parts, with little room for an index."""
    header = zlib.compress(parts[HEADER], 9)
    shared = {name: data for name, data in parts.items() if name[0] != "(" and name != HEADER and not name.startswith(CLIP)}
    clips = [data for name, data in parts.items() if name.startswith(CLIP)]
    rows = b"".join(ClipRow(len(data), zlib.crc32(data), _clip_frames(parts)).pack() for data in clips)
    table = parts.get(TABLE, rows)
    before = parts[HEAD] + uuid_head(ROOM_UUID, len(ROOM)) + ROOM
    n_index = len(parts[INDEX]) + CHECKSUM.size if INDEX in parts else index_size([HEADER, *shared], 0)
    before += uuid_head(LIVE_UUID, n_index + len(header) + len(table))
    at = len(before) + n_index
    places = {HEADER: Place(at, len(header), zlib.crc32(header))}
    box = uuid_head(DATA_UUID, sum(map(len, shared.values())))
    at += len(header) + len(table) + len(box)
    for name, data in shared.items():
        places[name] = Place(at, len(data), zlib.crc32(data))
        at += len(data)
    index = pack_index(places, np.zeros(0, FRAGMENT), WHOLE.pack(at, len(parts[HEAD]), zlib.crc32(parts[HEAD])))
    if INDEX in parts:
        index = parts[INDEX] + CHECKSUM.pack(zlib.crc32(parts[INDEX]))
    content = b"".join(uuid_head(DATA_UUID, len(data)) + data for data in clips)
    return {FILE: b"".join([before, index, header, table, box, *shared.values(), content])}


def _clip_frames(parts: Parts) -> int:
    """Frames of a clip, as the header has them."""
    try:
        frames = json.loads(parts[HEADER])["settings"]["clip"]
    except (ValueError, LookupError, TypeError, RecursionError):
        return 1
    return frames if isinstance(frames, int) and 0 < frames < 1 << 32 else 1


def live_target(seeds: tuple[Seed, ...]) -> Target:
    """The parser of files that are still written."""
    return Target("live", seeds, _mutate, join_live, parse_video, (FormatError,))


def _mutate(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change parts; now and then one is left out, or comes to another place."""
    for _ in range(1 + (int(rng.geometric(0.5)) if rng.random() < 0.5 else 0)):
        names = [name for name in parts if name != HEAD]
        name = str(rng.choice([HEAD, INDEX, TABLE, names[int(rng.integers(len(names)))]], p=[0.1, 0.25, 0.25, 0.4]))
        if name in (INDEX, TABLE):
            parts[name] = mutate_bytes(parts.get(name) or _made(parts, name), rng)
        elif name == HEADER:
            parts[name] = mutate_json(parts[name], rng)
        elif name == HEAD:
            parts[name] = mutate_boxes(parts[name], rng)
        elif rng.random() < 0.1:
            moved = parts.pop(name)
            if rng.random() < 0.5:
                parts[name] = moved
        else:
            parts[name] = mutate_bytes(parts[name], rng)
    return parts


def _made(parts: Parts, name: str) -> bytes:
    """The index without its checksum, or the table, as it would be."""
    data = join_live({each: part for each, part in parts.items() if each not in (INDEX, TABLE)})[FILE]
    start = data.index(LIVE_UUID.bytes) + 16
    index = unpack_index(data[start:])
    if name == INDEX:
        return data[start : start + index.n_bytes - CHECKSUM.size]
    header = index.places[HEADER]
    rows = b"".join(row.pack() for row in read_rows(data[header.offset + header.length :]))
    return rows or bytes(PREFIX.size)
