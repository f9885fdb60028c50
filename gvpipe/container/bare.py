"""The bare layout: a geometry video in as few bytes as a reader of its frames needs, for data sets of short sequences.

It has no poster, no tag, no table of sections and one checksum. Programs that know MP4 see a film without tracks, or that of
the codec's pictures::

    file    = ftyp, moov, mdat, "uuid" box with the payload
    payload = magic, [u16] version, header, sections one after the other, [u32] CRC-32 of these

The header is that of `gvpipe.container.compact_header`. A file of 10 kB in the plain layout gives a twelfth of its bytes to
what is missing here.

Version 2 is that of files in a shard: ``shared`` has the hash of each section that the shard holds in place of the file
(`gvpipe.container.shared_sections`).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gvpipe.container.bitstream import CHECKSUM, HEADER, VERSION, Bitstream, check_version, parse_header
from gvpipe.container.boxes import BOX
from gvpipe.container.compact_header import checked_content, compact_values, pack_compact, section_lengths, unpack_compact
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.container.shared_sections import FindSection, find_shared
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import TruncatedFile

MAGIC = b"gvbare\r\n"
PREFIX = struct.Struct("<H")
NO_TRACKS = BOX.pack(16, b"ftyp") + b"isom" + bytes(4) + BOX.pack(8, b"moov") + BOX.pack(8, b"mdat")
SHARED, WITH_SHARED = "shared", 2  # key of the header, and the version of payloads that have it

# What headers have in common, the most frequent last. Files depend on it: it never changes within a version.
DICTIONARY = (
    b'"origin":[0.0,"predictor":"lsp","navg","weights":"delta_prediction":true,"anchors":"profile":"jpeg","h264-10",'
    b'"outliers":true,"halves","charts","affine",{"codec":"laplacian","version":1,{"codec":"pdct","version":1,'
    b'"container":{"video_crc32":1,"track_crc32":2},"placement":"tiles","profile":"h264-8","block":16,"width":48,"height":80,'
    b'"residual_step":1e-05,"asset":"still":"holds":"anchors.0":"deltas.0":"clip.0":"charts":"pixels":'
    b'{"codec":"mcgv","version":1,"frames":32,"vertices":"fps":24.0,"settings":{"prediction":"blended","clusters":1,"segments":1,'
    b'"base":[-0.0,"transform_step":0.00,"pictures":false},"sections":{"mesh":1,"order":1,"weights":2,"transforms.0":'
    b'{"codec":"pca","version":1,"frames":16,"vertices":2000,"triangles":4000,"fps":30.0,"settings":{"predictor":"kalman",'
    b'"beta":1.8,"segments":1,"steps":[0.00]},"sections":{"mesh":,"order":,"basis.0":,"coefficients.0":,"corrections":}}'
)


def pack_bare(bitstream: Bitstream, extra: Mapping[str, Any], shared: Mapping[str, str] | None = None) -> bytes:
    """Return the payload of everything but the video.

    Args:
        bitstream: with all of its sections.
        extra: the container's own part of the header.
        shared: hashes of sections that are left out, by name.
    """
    shared = shared or {}
    values = compact_values(bitstream, extra)
    if shared:
        values[SHARED] = dict(shared)
    header = pack_compact(values, DICTIONARY)
    own = [data for name, data in bitstream.sections.items() if name not in shared]
    payload = b"".join([MAGIC, PREFIX.pack(WITH_SHARED if shared else VERSION), header, *own])
    return payload + CHECKSUM.pack(zlib.crc32(payload))


def unpack_bare(payload: bytes, budget: Budget = UNLIMITED, find: FindSection | None = None) -> tuple[Bitstream, JsonObject]:
    """Mirror of `pack_bare`: the bitstream without its video, and the header.

    Args:
        payload: the bytes, which begin with `MAGIC`.
        budget: of the file, which the bitstream carries on to its readers; bytes of shared sections count as the file's.
        find: returns shared sections; None: there are none.

    Raises:
        NewerVersion: its version is above those of this layout.
        MissingSection: a shared section is not at hand.
        TruncatedFile: it is shorter than its shortest form.
        CorruptFile: anything else is not as written.
        OverBudget: the header inflates to more than the file may take.
    """
    start = len(MAGIC) + PREFIX.size
    if len(payload) <= start + CHECKSUM.size:
        raise TruncatedFile("the payload ends inside its header; get the file again from its source")
    (version,) = PREFIX.unpack_from(payload, len(MAGIC))
    check_version(version, WITH_SHARED)
    content = checked_content(payload)
    cursor = Cursor(content, HEADER)
    cursor.take(start)
    if version < 1:
        raise cursor.corrupt(f"version {version}")
    header = unpack_compact(cursor, DICTIONARY, budget)
    bitstream = parse_header(header, budget)
    lengths = section_lengths(header)
    shared = _find_shared(header, lengths, budget, find) if version == WITH_SHARED else {}
    sections = {name: shared[name] if name in shared else cursor.take(length) for name, length in lengths.items()}
    cursor.end()
    return replace(bitstream, sections=sections, is_bare=True, n_bytes=sum(map(len, shared.values()))), header


def _find_shared(header: JsonObject, lengths: dict[str, int], budget: Budget, find: FindSection | None) -> dict[str, bytes]:
    """The shared sections by name; the file may take what one that holds them may take."""
    hashes = header.object(SHARED)
    found = find_shared({name: hashes.text(name) for name in hashes.plain}, lengths, find)
    if budget.n_bytes is not None:
        budget.grow(budget.n_bytes + sum(map(len, {hashes.text(name): data for name, data in found.items()}.values())))
    return found
