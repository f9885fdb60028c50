"""Payloads: exact, every damage noticed, and headers read without trust."""

from __future__ import annotations

import dataclasses
import json
import zlib
from typing import Any

import pytest
from odd_headers import first_payload

from gvpipe.container.bitstream import ENTRY, MAGIC, PREFIX, Bitstream, unpack_payload
from gvpipe.foundation.errors import CorruptFile, FormatError, NewerVersion, TruncatedFile


def small_stream() -> Bitstream:
    header = {"text": "ä", "list": [1, 2.5, None]}
    return Bitstream("mcgv", 1, 7, 11, 5, 29.97, header, {"mesh": b"12345", "order": b"", "x" * 64: bytes(40)}, b"video")


def test_payload_round_trip() -> None:
    stream = small_stream()
    back, extra = unpack_payload(first_payload(stream, {"id": "abc"}))
    assert back == dataclasses.replace(stream, video=b"") and extra.plain == {"id": "abc"}
    assert list(back.sections) == list(stream.sections) and first_payload(stream, {"id": "abc"}) == first_payload(
        stream, {"id": "abc"}
    )


def test_every_damage_to_a_payload_is_noticed() -> None:
    """Every prefix, every byte changed in each bit, and bytes too many."""
    payload = first_payload(small_stream(), {"id": "abc"})
    for cut in range(len(payload)):
        with pytest.raises(TruncatedFile if cut >= len(MAGIC) else FormatError):
            unpack_payload(payload[:cut])
    for i in range(len(payload)):
        for bit in range(8):
            damaged = bytearray(payload)
            damaged[i] ^= 1 << bit
            with pytest.raises(FormatError):
                unpack_payload(bytes(damaged))
    for extra in (b"\0", payload):
        with pytest.raises(CorruptFile):
            unpack_payload(payload + extra)
    newer = bytearray(payload)
    newer[len(MAGIC) : len(MAGIC) + 2] = (2).to_bytes(2, "little")
    with pytest.raises(NewerVersion, match="upgrade"):
        unpack_payload(bytes(newer))


def sealed(header: bytes, sections_: dict[str, bytes] | None = None) -> bytes:
    """A payload with right checksums around any header."""
    parts = {"header": zlib.compress(header), **(sections_ or {})}
    table = MAGIC + PREFIX.pack(1, len(parts))
    for name, data in parts.items():
        table += bytes([len(name)]) + name.encode() + ENTRY.pack(len(data), zlib.crc32(data))
    return table + zlib.crc32(table).to_bytes(4, "little") + b"".join(parts.values())


def test_hostile_headers() -> None:
    """Right checksums, wrong content: always CorruptFile."""
    good = {
        "codec": "mcgv",
        "version": 1,
        "frames": 1,
        "vertices": 1,
        "triangles": 0,
        "fps": 1.0,
        "container": {},
        "settings": {},
    }
    assert unpack_payload(sealed(json.dumps(good).encode()))[0].n_frames == 1
    wrong: list[Any] = [None, -1, 0.5, "x", [], {}, True, 10**400, 1e308, float("nan"), float("inf")]
    for key in good:
        texts = [json.dumps({**good, key: value}) for value in wrong if key != "codec"] + [json.dumps({**good, key: 0})] * (
            key == "frames"
        )
        texts.append(json.dumps({k: v for k, v in good.items() if k != key}))
        for text in texts:
            if key in ("container", "settings") and '": {}' in text and json.loads(text).get(key) in ({}, []):
                continue
            if key == "fps" and json.loads(text).get(key) in (0.5, True):
                continue
            with pytest.raises(CorruptFile):
                unpack_payload(sealed(text.encode()))
    for raw in (b"", b"{", b"[1]", b"\xff\xfe", b"[" * 100_000, b" " * (1 << 21) + json.dumps(good).encode()):
        with pytest.raises(CorruptFile):
            unpack_payload(sealed(raw))
