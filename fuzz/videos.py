"""Geometry videos: taken apart into video, header and sections, changed, and put together with checksums that hold."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import re
import struct
import zlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import av
import numpy as np

from fuzz.boxes import Box, mutate_boxes, parse_boxes
from fuzz.mutation import mutate_bytes, mutate_json
from fuzz.parts import Parts, Seed, Target
from fuzz.results import check_asset, check_faces, check_positions, check_text
from gvpipe.container.bitstream import CHECKSUM, ENTRY, HEADER, MAGIC, PREFIX, VERSION
from gvpipe.container.compact_header import RAW
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.mp4 import BOX_UUID
from gvpipe.container.plain import DICTIONARY, TAIL
from gvpipe.container.plain import VERSION as PLAIN_VERSION
from gvpipe.foundation.errors import FormatError
from gvpipe.playback.player import Player
from gvpipe.playback.video_info import info

FILE = "case.mp4"
VIDEO = "(video)"
JSON = "(header)"
TABLE = "(table)"  # of sections, where it was changed itself; in container version 2, the header that has one
PLAIN = "(plain)"  # of container version 2: the checksum of the video's description
TAG = re.compile(rb"gvpipe 2 ([0-9a-f]{32})")
MOST_VALUES = 1 << 22  # coordinates that are read of a case
GROUPS = {  # sections of one parser: those whose names begin so
    "connectivity": ("mesh", "order", "still"),
    "repeated": ("holds",),
    "corrections": ("corrections", "outliers"),
    "asset": ("asset", "arrangement", "times"),
    "volume": ("volume",),
    "attributes": ("attribute.",),
    "fields": ("field.",),
    "images": ("image.",),
    "layout": ("pixels", "charts", "clusters"),
    "motion": ("weights", "transforms", "trajectories"),
    "pca": ("basis", "coefficients"),
    "laplacian": ("average", "anchors", "deltas"),
    "pdct": ("clip",),
}


def split_video(data: bytes) -> Parts:
    """A sound geometry video in parts."""
    end = data.rindex(BOX_UUID.bytes) - 8
    payload = data[end + 24 :]
    if not payload.startswith(MAGIC):
        return {VIDEO: data[:end], **_split_plain(payload)}
    position = len(MAGIC)
    _, count = PREFIX.unpack_from(payload, position)
    position += PREFIX.size
    entries = []
    for _ in range(count):
        length = payload[position]
        name = payload[position + 1 : position + 1 + length].decode()
        entries.append((name, ENTRY.unpack_from(payload, position + 1 + length)[0]))
        position += 1 + length + ENTRY.size
    position += CHECKSUM.size
    parts = {VIDEO: data[:end]}
    for name, length in entries:
        parts[name] = payload[position : position + length]
        position += length
    header = json.loads(zlib.decompress(parts.pop(HEADER)))
    return {JSON: json.dumps(header).encode(), **parts}


def _split_plain(payload: bytes) -> Parts:
    cursor = Cursor(payload[1:-TAIL], HEADER)
    header = zlib.decompressobj(RAW, zdict=DICTIONARY).decompress(cursor.block())
    sections = {name: cursor.take(length) for name, length in json.loads(header)["sections"].items()}
    return {JSON: json.dumps(json.loads(header)).encode(), PLAIN: payload[-CHECKSUM.size - 4 : -CHECKSUM.size], **sections}


def join_video(parts: Parts) -> dict[str, bytes]:
    """The file of some parts: checksums, lengths, the content id and the checksum of the video are made here."""
    sections = {name: data for name, data in parts.items() if name not in (VIDEO, JSON, TABLE, PLAIN)}
    video, identity = parts[VIDEO], _content_id(sections)
    header = parts[JSON]
    if PLAIN in parts:
        payload = _join_plain(video, parts, sections)
        tag = TAG.search(video)
        video = video.replace(tag[1], identity.encode()) if tag else video
        return {FILE: video + _boxed(payload)}
    try:
        tree = json.loads(header)
        container = tree["container"]
        video = video.replace(container["id"].encode(), identity.encode())
        tree["container"] = {**container, "id": identity, "video_crc32": _video_checksum(video)}
        header = json.dumps(tree).encode()
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        pass  # the header is what was changed
    packed = {HEADER: zlib.compress(header, 9), **sections}
    rows = (_row(name.encode(), len(data), zlib.crc32(data)) for name, data in packed.items())
    table = parts.get(TABLE) or MAGIC + PREFIX.pack(VERSION, len(packed)) + b"".join(rows)
    payload = b"".join([table, CHECKSUM.pack(zlib.crc32(table)), *packed.values()])
    return {FILE: video + _boxed(payload)}


def _join_plain(video: bytes, parts: Parts, sections: Mapping[str, bytes]) -> bytes:
    header = parts.get(TABLE, parts[JSON])
    if TABLE not in parts:
        lengths = {name: len(data) for name, data in sections.items()}
        with contextlib.suppress(ValueError, TypeError, RecursionError):  # the header may be what was changed
            header = json.dumps({**json.loads(header), "sections": lengths}).encode()
    deflater = zlib.compressobj(9, zlib.DEFLATED, RAW, zdict=DICTIONARY)
    block = pack_block(deflater.compress(header) + deflater.flush())
    track = CHECKSUM.pack(_video_checksum(video)) + parts[PLAIN]
    payload = b"".join([bytes([PLAIN_VERSION]), block, *sections.values(), track])
    return payload + CHECKSUM.pack(zlib.crc32(payload))


def _boxed(payload: bytes) -> bytes:
    return struct.pack(">I", 24 + len(payload)) + b"uuid" + BOX_UUID.bytes + payload


def video_targets(seeds: tuple[Seed, ...]) -> list[Target]:
    """The parsers of geometry videos."""
    targets = [
        _target("boxes", seeds, partial(_mutate_part, VIDEO, mutate_boxes)),
        _target("header", seeds, partial(_mutate_part, JSON, mutate_json)),
        _target("table", seeds, _mutate_table),
        _target("pictures", tuple(seed for seed in seeds if b'"pictures": false' not in seed.parts[JSON]), _mutate_pictures),
    ]
    for group, beginnings in GROUPS.items():
        having = tuple(seed for seed in seeds if any(name.startswith(beginnings) for name in seed.parts))
        if having:
            targets.append(_target(group, having, partial(_mutate_sections, beginnings)))
    return targets


def _target(name: str, seeds: tuple[Seed, ...], mutate: Callable[..., Parts]) -> Target:
    return Target(name, seeds, mutate, join_video, parse_video, (FormatError,))


def parse_video(path: Path) -> None:
    """Open a file and read all of it that a player reads, and what it says of itself; of very large ones the ends.

    Raises:
        FormatError: it is refused.
        BrokenPromise: what was read cannot be.
    """
    with Player(path) as video:
        _read_all(video)
    info(path)


def _read_all(video: Player) -> None:
    n_frames, n_vertices, _ = video.shape
    check_positions(video[0][None], (1, n_vertices, 3))
    check_faces(video.faces, n_vertices)
    stop = max(1, min(n_frames, MOST_VALUES // (3 * n_vertices)))
    check_positions(video[:stop], (stop, n_vertices, 3))
    check_positions(video[n_frames - 1][None], (1, n_vertices, 3))
    for level, count in enumerate(video.levels[1:3], 1):
        coarse = video.level(level)
        check_faces(coarse.faces, count)
        check_positions(coarse.read(0, 1), (1, count, 3))
    check_asset(video.sequence())
    for note in video.notes:
        check_text(note)


def _mutate_part(name: str, change: Callable[[bytes, np.random.Generator], bytes], parts: Parts, rng: np.random.Generator,
                 seeds: tuple[Seed, ...]) -> Parts:  # fmt: skip
    for _ in range(_changes(rng)):
        parts[name] = change(parts[name], rng)
    return parts


def _mutate_sections(beginnings: tuple[str, ...], parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change sections; now and then one is left out, or comes from another file."""
    for _ in range(_changes(rng)):
        names = [name for name in parts if name.startswith(beginnings)]
        if not names:
            break
        name = names[int(rng.integers(len(names)))]
        kind = rng.random()
        if kind < 0.03:
            del parts[name]
        elif kind < 0.1:
            other = seeds[int(rng.integers(len(seeds)))].parts
            parts[name] = other.get(name, parts[names[int(rng.integers(len(names)))]])
        elif kind < 0.14:
            parts[JSON] = mutate_json(parts[JSON], rng)
        else:
            parts[name] = mutate_bytes(parts[name], rng)
    return parts


def _mutate_table(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change the table of sections, whose own checksum holds."""
    if PLAIN in parts:
        table = parts[JSON]
        for _ in range(_changes(rng)):
            table = mutate_json(table, rng)
        return {**parts, TABLE: table}
    data = join_video(parts)[FILE]
    payload = data[data.rindex(BOX_UUID.bytes) + 16 :]
    names = [HEADER, *(name for name in parts if name not in (VIDEO, JSON))]
    table = payload[: len(MAGIC) + PREFIX.size + sum(1 + len(name) + ENTRY.size for name in names)]
    for _ in range(_changes(rng)):
        kind = rng.random()
        if kind < 0.3:  # a section by another name, which all checksums allow
            old, new = names[int(rng.integers(len(names)))], bytes(rng.integers(0, 256, int(rng.integers(0, 20)), np.uint8))
            table = table.replace(bytes([len(old)]) + old.encode(), bytes([len(new)]) + new, 1)
        else:
            table = mutate_bytes(table, rng)
    return {**parts, TABLE: table or b"\0"}


def _mutate_pictures(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change bytes of the video's samples, or of the decoder's configuration."""
    boxes = parse_boxes(parts[VIDEO])
    media = [box for box in boxes if box.kind == b"mdat"] + _entries(boxes)
    for _ in range(_changes(rng)):
        box = media[0] if rng.random() < 0.8 else media[int(rng.integers(len(media)))]
        changed = mutate_bytes(box.content, rng)
        box.content = changed[: len(box.content)].ljust(len(box.content), b"\0")  # tables of samples hold
    return {**parts, VIDEO: b"".join(box.pack() for box in boxes)}


def _entries(boxes: list[Box]) -> list[Box]:
    found = [box for box in boxes if box.kind == b"stsd"]
    return found + [entry for box in boxes for entry in _entries(box.boxes)]


def _changes(rng: np.random.Generator) -> int:
    return 1 + int(rng.geometric(0.5)) if rng.random() < 0.5 else 1


def _row(name: bytes, length: int, checksum: int) -> bytes:
    return bytes([len(name)]) + name + ENTRY.pack(length, checksum)


def _content_id(sections: Mapping[str, bytes]) -> str:
    """As `docs/format.md` has it."""
    digest = hashlib.sha256()
    for name, data in sections.items():
        digest.update(name.encode() + b"\0" + struct.pack("<Q", len(data)) + data)
    return digest.hexdigest()[:32]


def _video_checksum(video: bytes) -> int:
    """CRC-32 of the samples as FFmpeg finds them, whatever the tables have become."""
    checksum = 0
    try:
        with av.open(io.BytesIO(video), "r", format="mp4") as container:
            for packet in container.demux(list(container.streams.video)) if container.streams.video else ():
                checksum = zlib.crc32(bytes(packet), checksum)
    except (av.FFmpegError, ValueError):
        return 0
    return checksum
