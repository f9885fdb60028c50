"""Shards of data sets: headers of tar members, and a bare geometry video inside, changed and put together again.

A member's checksum is made anew after each change of its header, and so are those of the video. A shared section is named by
its hash; where its bytes change, so do the names in the header and in the tar file.
"""

from __future__ import annotations

import json
import struct
import tarfile
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np

from fuzz.mutation import mutate_bytes, mutate_json
from fuzz.parts import BrokenPromise, Parts, Seed, Target
from fuzz.results import check_faces, check_positions
from gvpipe import datasets
from gvpipe.container import bare
from gvpipe.container.bare import DICTIONARY, MAGIC, NO_TRACKS, PREFIX
from gvpipe.container.bitstream import CHECKSUM, HEADER, VERSION
from gvpipe.container.boxes import uuid_head
from gvpipe.container.compact_header import RAW
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.mp4 import BOX_UUID, file_bytes, read_file
from gvpipe.container.shared_sections import section_hash
from gvpipe.datasets.sample_names import shared_name
from gvpipe.foundation.errors import FormatError, InputError

FILE = "a.tar"
BLOCK = tarfile.BLOCKSIZE
CHECKSUM_AT = slice(148, 156)
VIDEO_HEAD, TEXT_HEAD, TEXT, END = "(tar video)", "(tar text)", "(text)", "(end)"
SHARED_HEAD, SHARED, HASH = "(tar shared)", "(shared)", "(hash)"
DESCRIPTION = b'{"codec":"pca","label":[1,"walk"],"max_diag":0.001}'
OWN = (VIDEO_HEAD, TEXT_HEAD, TEXT, END, SHARED_HEAD, SHARED, HASH)


def split_shard(video: bytes, description: bytes, shared: str = "") -> Parts:
    """A shard of one sample in parts: tar headers, the header of a bare video as JSON, its sections, the description.

    Args:
        video: with all of its sections.
        description: JSON.
        shared: name of a section that lies beside the video; empty: none does.
    """
    cursor = Cursor(video[len(NO_TRACKS) + len(uuid_head(BOX_UUID, 0)) + len(MAGIC) + PREFIX.size : -CHECKSUM.size], HEADER)
    header = zlib.decompressobj(RAW, zdict=DICTIONARY).decompress(cursor.block())
    sections = {name: cursor.take(length) for name, length in json.loads(header)["sections"].items()}
    beside: Parts = {}
    if shared:
        data = sections.pop(shared)
        digest = section_hash(data)
        header = json.dumps({**json.loads(header), bare.SHARED: {shared: digest}}).encode()
        beside = {SHARED_HEAD: _head(shared_name(digest), len(data)), SHARED: data, HASH: digest.encode()}
    size = len(_join_video({**beside, HEADER: header, **sections}))
    return {
        **beside,
        VIDEO_HEAD: _head("a.mp4", size),
        HEADER: header,
        **sections,
        TEXT_HEAD: _head("a.json", len(description)),
        TEXT: description,
        END: bytes(BLOCK),
    }


def join_shard(parts: Parts) -> dict[str, bytes]:
    """The shard of some parts."""
    content = [_checked(parts[VIDEO_HEAD]), _filled(_join_video(parts))]
    content += [_checked(parts[TEXT_HEAD]), _filled(parts[TEXT]), parts[END]]
    if SHARED in parts:
        head = parts[SHARED_HEAD].replace(parts[HASH], section_hash(parts[SHARED]).encode())
        content = [_checked(head), _filled(parts[SHARED]), *content]
    return {FILE: b"".join(content)}


def _join_video(parts: Parts) -> bytes:
    text, version = parts[HEADER], VERSION
    if SHARED in parts:
        text, version = text.replace(parts[HASH], section_hash(parts[SHARED]).encode()), bare.WITH_SHARED
    deflater = zlib.compressobj(9, zlib.DEFLATED, RAW, zdict=DICTIONARY)
    header = pack_block(deflater.compress(text) + deflater.flush())
    sections = [data for name, data in parts.items() if name not in (*OWN, HEADER)]
    payload = b"".join([MAGIC, PREFIX.pack(version), header, *sections])
    payload += CHECKSUM.pack(zlib.crc32(payload))
    return NO_TRACKS + uuid_head(BOX_UUID, len(payload)) + payload


def shard_seeds(paths: list[Path]) -> tuple[Seed, ...]:
    """Shards of geometry videos whose codecs have no pictures; of each a second one, whose largest section lies beside."""
    seeds = []
    for path in paths:
        bitstream = replace(read_file(path), video=b"", is_bare=True)
        largest = max(bitstream.section_sizes, key=lambda name: bitstream.section_sizes[name])
        for name, shared in ((path.stem, ""), (f"{path.stem}-shared", largest)):
            seeds.append(Seed(name, split_shard(file_bytes(bitstream), DESCRIPTION, shared)))
    return tuple(seeds)


def shard_target(seeds: tuple[Seed, ...]) -> Target:
    """The reader of shards."""
    return Target("shard", seeds, _mutate, join_shard, parse_shard, (FormatError, InputError))


def parse_shard(path: Path) -> None:
    """Open a shard and read every sample in it.

    Raises:
        FormatError: it is refused.
        BrokenPromise: what was read cannot be.
    """
    dataset = datasets.open(path)
    for key in dataset.keys:
        if not isinstance(dataset.description(key), dict):
            raise BrokenPromise("a description is no object")
        bitstream = dataset.bitstream(key)
        check_positions(dataset.read(key, slice(0, 2)), (min(2, bitstream.n_frames), bitstream.n_vertices, 3))
        check_faces(dataset.faces(key), bitstream.n_vertices)


def _mutate(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    """Change parts, tar headers and the JSON most."""
    for _ in range(1 + int(rng.geometric(0.5))):
        names = [VIDEO_HEAD, TEXT_HEAD, HEADER, TEXT, *(name for name in parts if name != HASH)]
        name = names[int(rng.integers(len(names)))]
        parts[name] = (mutate_json if name in (HEADER, TEXT) else mutate_bytes)(parts[name], rng)
    return parts


def _head(name: str, size: int) -> bytes:
    member = tarfile.TarInfo(name)
    member.size = size
    return member.tobuf(tarfile.USTAR_FORMAT)


def _checked(head: bytes) -> bytes:
    """A member's header with the checksum that it should have, in one or more whole blocks."""
    filled = bytearray(_filled(head))
    if len(filled) >= BLOCK:
        filled[CHECKSUM_AT] = b" " * 8
        filled[CHECKSUM_AT] = struct.pack("8s", f"{sum(filled[:BLOCK]):06o}\0 ".encode())
    return bytes(filled)


def _filled(data: bytes) -> bytes:
    return data + bytes(-len(data) % BLOCK)
