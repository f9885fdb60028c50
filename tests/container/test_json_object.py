from __future__ import annotations

import zlib
from collections.abc import Callable
from typing import Any

import pytest

from gvpipe.container.json_object import JsonObject, pack_json, unpack_json
from gvpipe.foundation.errors import CorruptFile

VALUES = {"text": "a", "flag": True, "number": 0.5, "list": [1, 2], "objects": [{"a": 1}], "texts": {"k": "v"}, "huge": 2**80}


def test_what_is_packed_is_read() -> None:
    read = unpack_json(pack_json(VALUES), "asset", 1 << 16)
    assert read.text("text") == "a"
    assert read.text("missing", "b") == "b"
    assert read.flag("flag")
    assert read.number("number", 0, 1) == 0.5
    assert read.integers("list", 2, 0, 2) == (1, 2)
    assert read.numbers("missing", 2, 0, 1, (0.0, 1.0)) == (0.0, 1.0)
    assert [each.integer("a", 0, 1) for each in read.objects("objects", 1)] == [1]
    assert read.texts("texts", 1) == {"k": "v"}
    assert "text" in read
    assert "missing" not in read


@pytest.mark.parametrize(
    "ask",
    [
        lambda read: read.text("number"),
        lambda read: read.text("missing"),
        lambda read: read.choice("text", ("b",)),
        lambda read: read.flag("number"),
        lambda read: read.number("flag", 0, 1),
        lambda read: read.number("number", 0.6, 1),
        lambda read: read.integer("number", 0, 1),
        lambda read: read.integer("huge", 0, 1 << 64),
        lambda read: read.integers("list", 3, 0, 2),
        lambda read: read.integers("list", 2, 0, 1),
        lambda read: read.object("list"),
        lambda read: list(read.objects("objects", 0)),
        lambda read: list(read.objects("list", 2)),
        lambda read: read.texts("texts", 0),
        lambda read: read.texts("list", 2),
        lambda read: read.choices("list", 2, ("a",)),
    ],
)
def test_what_does_not_fit_is_corrupt(ask: Callable[[JsonObject], Any]) -> None:
    with pytest.raises(CorruptFile, match="section 'asset' is corrupt"):
        ask(unpack_json(pack_json(VALUES), "asset", 1 << 16))


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"hello",
        pack_json(VALUES)[:-1],
        pack_json(VALUES) + b"x",
        zlib.compress(b"[1]"),
        zlib.compress(b'{"a": NaN}'),
        zlib.compress(b'{"a": 1e999}'),
        zlib.compress(b"{" * 100_000),
        zlib.compress(b'{"a": "\xff"}'),
        zlib.compress(b"{" + b" " * (1 << 16) + b"}"),
    ],
)
def test_other_bytes_are_corrupt(data: bytes) -> None:
    with pytest.raises(CorruptFile):
        unpack_json(data, "asset", 1 << 16)
