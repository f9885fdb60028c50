"""The payload of the plain layout, container version 2: as small as that of the bare layout.

What the file states elsewhere is not stated again: the content id is in the tag, and follows from the sections::

    payload = [u8] version 2, header, sections one after the other,
              [u32] CRC-32 of the video's samples, [u32] CRC-32 of its description, [u32] CRC-32 of all before

The header is that of `gvpipe.container.compact_header`. A payload of version 1 begins with a magic
(`gvpipe.container.bitstream`), whose first byte is none of a version.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gvpipe.container.bitstream import CHECKSUM, HEADER, Bitstream, check_version, parse_header
from gvpipe.container.compact_header import checked_content, compact_values, pack_compact, section_lengths, unpack_compact
from gvpipe.container.cursor import Cursor
from gvpipe.container.json_object import JsonObject
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import TruncatedFile, corrupt

VERSION = 2
MOST_VERSIONS = 32  # a first byte below is a version
TRACK = struct.Struct("<II")
TAIL = TRACK.size + CHECKSUM.size
VIDEO_KEY, TRACK_KEY = "video_crc32", "track_crc32"  # of the container's part of the header, in other layouts

# What headers have in common, the most frequent last. Files depend on it: it never changes within a version.
DICTIONARY = (
    b'"origin":[0.0,"companions":[{"kind":"sound","bytes":1,"crc32":1,"trak_crc32":1,"codec":"aac","opus","rate":48000,'
    b'"channels":2,"start":0.0}],"polygons":[4,"texture","predictor":"lsp","navg","rbf","weights","block":8,"profile":"jpeg",'
    b'"h264-10","outliers":true,"placement":"halves","charts","affine","transform":"klt","fineness":3,"components":[1,"live":'
    b'"asset":1,"corrections":1,"holds":1,"anchors.0":1,"deltas.0":1,"clip.0":1,"trajectories.0":1,"pixels":1,"outliers":1,'
    b'"average":1,"basis.1":1,"coefficients.1":1,"transforms.1":1,"settings":{"clips":1,"base":[-0.1,"settings":{"operator":'
    b'"mean-value","delta_prediction":"kalman","anchors":16,"anchor_choice":"hierarchy","edge_power":0.75,"average_step":0.0625,'
    b'"anchor_ratio":1.2,"basis_ratio":2.0,"segments":1,"steps":[0.0,{"codec":"laplacian","version":1,"frames":{"codec":"pdct",'
    b'"version":1,"frames":],"triangles":[1],"levels":[124,"fps":24.0,"outline":{"box":[-0.1,"fps":30.0,"outline":{"box":[-1.0,'
    b'-0.5],"transform_step":0.00],"placement":"tiles","profile":"h264-8","block":16,"width":48,"height":80,"transform_step":'
    b'0.00,"residual_step":0.00,"pictures":false},"sections":{"mesh":1,"order":1,"still":1,"weights":2,"transforms.0":1,'
    b'"charts":1}}{"codec":"mcgv","version":1,"frames":32,"vertices":100,"triangles":200,"fps":30.0,"outline":{"box":[-0.0]},'
    b'"settings":{"prediction":"blended","clusters":1,"segments":1,"base":[-0.0{"codec":"pca","version":1,"frames":100,'
    b'"vertices":2000,"triangles":4000,"fps":30.0,"outline":{"box":[-0.0,"levels":[1,53]},"settings":{"predictor":"kalman",'
    b'"beta":1.8,"segments":1,"steps":[0.00]},"sections":{"mesh":1,"order":1,"basis.0":1,"coefficients.0":1}}'
)


def pack_plain(bitstream: Bitstream, extra: Mapping[str, Any], track: tuple[int, int]) -> bytes:
    """Return the payload of everything but the video.

    Args:
        bitstream: with its sections.
        extra: the container's own part of the header, but for the track.
        track: the checksums of the samples and of the description of the video (`gvpipe.container.track.Track`).
    """
    header = pack_compact(compact_values(bitstream, extra), DICTIONARY)
    payload = b"".join([bytes([VERSION]), header, *bitstream.sections.values(), TRACK.pack(*track)])
    return payload + CHECKSUM.pack(zlib.crc32(payload))


def unpack_plain(payload: bytes, budget: Budget = UNLIMITED) -> tuple[Bitstream, JsonObject]:
    """Mirror of `pack_plain`: the bitstream without its video, and the container's part, with the checksums of the track.

    Raises:
        NewerVersion: its version is above `VERSION`.
        TruncatedFile: it is shorter than its shortest form.
        CorruptFile: anything else is not as written.
        OverBudget: the header inflates to more than the file may take.
    """
    if len(payload) <= 1 + TAIL:
        raise TruncatedFile("the payload ends inside its header; get the file again from its source")
    check_plain_version(payload)
    content = checked_content(payload)
    cursor = Cursor(content[: -TRACK.size], HEADER)
    cursor.take(1)
    header = unpack_compact(cursor, DICTIONARY, budget)
    bitstream = parse_header(header, budget)
    sections = {name: cursor.take(length) for name, length in section_lengths(header).items()}
    cursor.end()
    container = header.object("container").plain if "container" in header else {}
    checksums = dict(zip((VIDEO_KEY, TRACK_KEY), TRACK.unpack(content[-TRACK.size :]), strict=True))
    return replace(bitstream, sections=sections), JsonObject({**container, **checksums}, HEADER)


def check_plain_version(payload: bytes) -> None:
    """Raise unless a payload that does not begin with a magic is one of this version.

    Raises:
        NewerVersion: its version is above `VERSION`.
        CorruptFile: it begins with no version.
    """
    version = payload[0] if payload else 0
    if version >= MOST_VERSIONS:
        raise corrupt("the payload starts with no version of gvpipe's container")
    check_version(version, VERSION)
    if version != VERSION:
        raise corrupt(f"the payload of version {version} lacks its magic")
