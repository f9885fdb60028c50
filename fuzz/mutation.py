"""Changes of bytes, of text and of JSON: each function makes one, at a place that random numbers choose."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Callable
from typing import Any

import numpy as np

Rng = np.random.Generator
Change = Callable[[bytes, Rng], bytes]

INTEGERS = [0, 1, 2, 3, 7, 127, 128, 255, 256, 32767, 65535, 65536, 10**6, 1 << 24, (1 << 28) + 1, (1 << 31) - 1, 1 << 31,
            (1 << 32) - 1, (1 << 53) + 1, (1 << 63) - 1, (1 << 64) - 1, -1, -2, -(1 << 31), -(1 << 63)]  # fmt: skip
FLOATS = [0.0, -0.0, 1.0, -1.0, 0.1, 1e-45, 1e-38, 1e-300, 3e38, 1e39, -1e39, 1e308, float("nan"), float("inf"), float("-inf")]
NUMBERS = [b"0", b"-1", b"1", b"2147483648", b"-2147483649", b"1e39", b"-1e400", b"nan", b"inf", b"1e-320", b"0x10", b"1.5",
           b"99999999999999999999999", b"--1", b"", b"1_0", b"1000000", b"4294967295", b"/", b"+"]  # fmt: skip
ODD_BYTES = [
    b"\0",
    b"\n",
    b"\r\n",
    b"\x1b[31m",
    b"\xff\xfe",
    b"\xe2\x80\xae",
    b"\xc2\x85",
    b"%s%n",
    b"\t",
    b'"',
    b"<",
    b"}",
    b"\\",
    b" ",
]
JSON_VALUES: list[Any] = [
    *(None, True, False, 0, 1, -1, 2, 3, 255, 65536, 1 << 31, -(1 << 31), 1 << 64, 10**30, -(10**30)),
    *(0.5, 1e39, -1e39, 1e308, float("nan"), float("inf")),
    *("", "x", "\x1b[31m\n", "../x", "\ud800", "9" * 5000),
    *([], {}, [[]], [None] * 3, {"": 0}),
]
FORMS = ["<u1", "<u2", "<u4", "<u8", "<f4", "<f8", ">u2", ">u4", ">f4"]  # of fields, as numpy names them
NUMBER = re.compile(rb"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
LONGEST = 1 << 18  # bytes that a change may make of a part


def mutate_bytes(data: bytes, rng: Rng) -> bytes:
    """One change of binary data; of what a zlib stream in it holds, if there is one and chance wants it."""
    if rng.random() < 0.4:
        at = data.find(b"\x78\xda")
        if at >= 0 and (found := _inflate(data[at:])) is not None:
            content, rest = found
            change = mutate_json if content[:1] in (b"{", b"[") else _change_bytes
            return data[:at] + zlib.compress(change(content, rng), 9) + rest
    return _change_bytes(data, rng)


def mutate_text(data: bytes, rng: Rng) -> bytes:
    """One change of text: a number, a line, a byte."""
    kind = rng.integers(10)
    if kind < 4:
        found = list(NUMBER.finditer(data[:LONGEST]))
        if found:
            chosen = found[int(rng.integers(len(found)))]
            new = NUMBERS[int(rng.integers(len(NUMBERS)))]
            if rng.random() < 0.5:
                new = NUMBER.findall(data[:LONGEST])[int(rng.integers(len(found)))]
            return data[: chosen.start()] + new + data[chosen.end() :]
    if kind < 7:
        lines = data.split(b"\n")
        i, j = (int(k) for k in rng.integers(len(lines), size=2))
        match int(rng.integers(5)):
            case 0:
                del lines[i]
            case 1:
                lines[i], lines[j] = lines[j], lines[i]
            case 2:
                lines[i:i] = lines[j : j + 1 + int(rng.integers(4))]
            case 3:
                words = lines[i].split(b" ")
                words[int(rng.integers(len(words)))] = words[int(rng.integers(len(words)))]
                lines[i] = b" ".join(words)
            case _:
                lines[i] = lines[i] * int(rng.integers(2, 50))
        return b"\n".join(lines)[:LONGEST]
    if kind < 8:
        at = _place(data, rng)
        return data[:at] + ODD_BYTES[int(rng.integers(len(ODD_BYTES)))] + data[at:]
    return _change_bytes(data, rng)


def mutate_json(data: bytes, rng: Rng) -> bytes:
    """One change of a JSON text: of a member, or rarely of its bytes."""
    if rng.random() < 0.08:
        return mutate_text(data, rng)
    try:
        tree = json.loads(data)
    except (ValueError, RecursionError):
        return mutate_text(data, rng)
    places = list(_places(tree))
    if not places:
        return mutate_text(data, rng)
    holder, key = places[int(rng.integers(len(places)))]
    match int(rng.integers(8)):
        case 0:
            del holder[key]
        case 1:
            other, there = places[int(rng.integers(len(places)))]
            if there in other or isinstance(other, list):
                holder[key] = json.loads(json.dumps(other[there]))
        case 2 if isinstance(holder[key], int | float) and not isinstance(holder[key], bool):
            holder[key] = _near(holder[key], rng)
        case 3 if isinstance(holder[key], list) and holder[key]:
            holder[key] = holder[key] * int(rng.integers(2, 200))
        case 4 if rng.random() < 0.1:
            text = json.dumps(tree)
            return text.replace(json.dumps(holder[key]), "[" * 30000 + "]" * 30000, 1).encode("utf-8", "surrogatepass")
        case _:
            holder[key] = JSON_VALUES[int(rng.integers(len(JSON_VALUES)))]
    return json.dumps(tree, separators=(",", ":")).encode()


def _change_bytes(data: bytes, rng: Rng) -> bytes:
    at = _place(data, rng)
    match int(rng.integers(11)):
        case 0 | 1:
            return data[:at] + bytes([(data[at] if at < len(data) else 0) ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
        case 2 | 3:
            return data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
        case 4:
            number = _packed(rng)
            return data[:at] + number + data[at + len(number) :]
        case 5:
            return data[:at] + _varint(INTEGERS[int(rng.integers(len(INTEGERS)))] % (1 << 64)) + data[at + 1 :]
        case 6:
            return data[:at] + data[at + 1 + int(rng.integers(8)) :]
        case 7:
            return data[:at] + rng.bytes(1 + int(rng.integers(8))) + data[at:]
        case 8:
            there = _place(data, rng)
            chunk = data[there : there + 1 + int(rng.integers(32))]
            return (data[:at] + chunk + data[at + (len(chunk) if rng.random() < 0.5 else 0) :])[:LONGEST]
        case 9:
            return data[:at] if rng.random() < 0.5 else data + rng.bytes(1 + int(rng.integers(64)))
        case _:
            size = int(rng.integers(1, 33))
            return (
                data[:at]
                + (b"\xff" if rng.random() < 0.3 else b"\0" if rng.random() < 0.5 else rng.bytes(1)) * size
                + data[at + size :]
            )


def _place(data: bytes, rng: Rng) -> int:
    """A byte's number; half of them are among the first 32, where fields are declared."""
    return int(rng.integers(max(1, len(data) if rng.random() < 0.5 else min(len(data), 32))))


def _packed(rng: Rng) -> bytes:
    """A number that breaks things, in one of the forms that fields have."""
    form = FORMS[int(rng.integers(len(FORMS)))]
    if form[1] == "f":
        with np.errstate(over="ignore"):
            return np.array(FLOATS[int(rng.integers(len(FLOATS)))]).astype(form).tobytes()
    size = int(form[2])
    value = INTEGERS[int(rng.integers(len(INTEGERS)))] % (1 << 8 * size)
    return value.to_bytes(size, "little" if form[0] == "<" else "big")


def _varint(value: int) -> bytes:
    result = bytearray()
    while value >= 128:
        result.append(value & 127 | 128)
        value >>= 7
    return bytes(result) + bytes([value])


def _inflate(data: bytes) -> tuple[bytes, bytes] | None:
    inflater = zlib.decompressobj()
    try:
        content = inflater.decompress(data, LONGEST)
    except zlib.error:
        return None
    return (content, inflater.unused_data) if inflater.eof and content else None


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """Every member of every object and list: what holds it, and its key."""
    found: list[tuple[Any, Any]] = []
    todo = [tree]
    while todo:
        holder = todo.pop()
        keys = list(holder) if isinstance(holder, dict) else range(len(holder)) if isinstance(holder, list) else []
        for key in keys:
            found.append((holder, key))
            todo.append(holder[key])
    return found


def _near(value: Any, rng: Rng) -> Any:
    match int(rng.integers(5)):
        case 0:
            return value + 1
        case 1:
            return value - 1
        case 2:
            return -value
        case 3:
            return value * 2
        case _:
            return value * 10 ** int(rng.integers(1, 20))
