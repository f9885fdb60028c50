"""Payloads whose JSON was changed behind valid checksums, one value after the other."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping
from typing import Any

from gvpipe.asset_coding.reader import AssetReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import CHECKSUM, ENTRY, MAGIC, PREFIX, VERSION, Bitstream, pack_header
from gvpipe.foundation.budget import Budget

ODD = (
    *(
        "null",
        "true",
        "-1",
        "0",
        "1",
        "2",
        "16777216",
        "2147483648",
        str(10**30),
        str(10**400),
        "1.5",
        "-0.0",
        "5e-324",
        "1e39",
    ),
    *(
        "1e308",
        "-1e308",
        "1e999",
        "NaN",
        "-Infinity",
        '"x"',
        '""',
        '"klt"',
        '"\\ud800"',
        "[]",
        "[1]",
        "{}",
        "[null,null,null,null]",
    ),
    *("[[]]", "[1e308,1e308,1e308,1e308]", "[1e38,-1e38,1e38,1e38]", "[0,0,0,5e-324]", "false"),
)
MARK = "the value goes here"


def odd_texts(values: Any) -> Iterator[tuple[str, str]]:
    """Yield each key of a JSON object, of those inside it and of its lists, and its text with an odd value there."""
    for path in _paths(values):
        changed = json.loads(json.dumps(values))
        holder = changed
        for key in path[:-1]:
            holder = holder[key]
        holder[path[-1]] = MARK
        text = json.dumps(changed)
        for value in ODD:
            yield f"{'/'.join(map(str, path))} = {value[:40]}", text.replace(f'"{MARK}"', value)


def _paths(values: Any) -> Iterator[tuple[Any, ...]]:
    items = values.items() if isinstance(values, dict) else enumerate(values[:2]) if isinstance(values, list) else ()
    for key, value in items:
        yield (key,)
        for rest in _paths(value):
            yield (key, *rest)


def payload_of(header: str, sections: Mapping[str, bytes]) -> bytes:
    """A payload of container version 1 with whatever header."""
    return _payload({"header": zlib.compress(header.encode()), **sections})


def first_payload(bitstream: Bitstream, extra: Mapping[str, Any]) -> bytes:
    """The payload of container version 1, as files had it; ``extra`` is the container's own part of the header."""
    return _payload({"header": pack_header(bitstream, extra), **bitstream.sections})


def _payload(parts: Mapping[str, bytes]) -> bytes:
    head = MAGIC + PREFIX.pack(VERSION, len(parts))
    head += b"".join(bytes([len(k.encode())]) + k.encode() + ENTRY.pack(len(v), zlib.crc32(v)) for k, v in parts.items())
    return head + CHECKSUM.pack(zlib.crc32(head)) + b"".join(parts.values())


def header_of(bitstream: Bitstream) -> dict[str, Any]:
    """The header as a file has it."""
    return {
        "codec": bitstream.codec,
        "version": bitstream.version,
        "frames": bitstream.n_frames,
        "vertices": bitstream.n_vertices,
        "triangles": bitstream.n_triangles,
        "fps": bitstream.fps,
        "origin": list(bitstream.origin),
        **({"outline": bitstream.outline.to_json()} if bitstream.outline else {}),
        "container": {"id": "x", "video_crc32": 1},
        "settings": dict(bitstream.header),
    }


def read_all(bitstream: Bitstream) -> Any:
    """What a player reads first: frame 0, triangles, and all that lies beside them."""
    reader = open_reader(bitstream)
    asset = AssetReader(bitstream, reader)
    frame = reader.read(0, 1)
    for each in (*asset.attributes.values(), *(field[0:1] for field in asset.fields.values())):
        assert each is not None
    assert asset.faces is not None and asset.parts is not None and asset.images is not None and asset.metadata is not None
    return frame


def budget_of(sections: dict[str, bytes]) -> Budget:
    """The budget of a file of about that size."""
    return Budget(2000 + sum(map(len, sections.values())))
