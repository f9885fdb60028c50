"""The elements of a PLY file as columns of numbers, from text or binary.

PLY (G. Turk, The PLY Polygon File Format, 1994) begins with a header in text. It names the elements (vertices, faces ...), how
many there are of each, and their properties. A property is a number, or a list of numbers with its length before it. The
elements follow in the header's order, one per line of text or packed without gaps.

Binary lists of one property are equally long in most files, so that a whole element is one structured array; others go through
a kernel. Other packages were passed over: trimesh 5.2 keeps columns in a private place and accepts text that ends early;
plyfile's licence (GPL) is not gvpipe's.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gvpipe.foundation.arrays import Array, Float64, Int64
from gvpipe.io.text import count_tokens, line_spans, parse_floats

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4", "double": "f8",
    "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8",
}  # fmt: skip
BYTE_ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True)
class Lists:
    """A property that is a list, of all N elements of a kind.

    Args:
        values: the numbers of all lists, one list after the other; of the header's type.
        lengths: ``(N,)``.
    """

    values: Array
    lengths: Int64


Columns = dict[str, Array | Lists]
"""Properties by name: ``(N,)`` numbers of the header's type, or lists."""


@dataclass(frozen=True)
class _Property:
    """A property's type, and that of the length before it if it is a list (else ``""``); types as NumPy writes them."""

    kind: str
    length_kind: str = ""


@dataclass(frozen=True)
class _Element:
    """An element as the header describes it: how many, and their properties by name."""

    count: int
    properties: dict[str, _Property]


def read_comments(data: bytes, keyword: str = "comment") -> list[str]:
    """The comments of a PLY file's header, or its lines of ``obj_info``."""
    head = data[: max(0, data.find(b"end_header"))]
    lines = head.decode("utf-8", "replace").splitlines()
    return [line.strip().removeprefix(keyword).strip() for line in lines if line.startswith(keyword)]


def read_elements(data: bytes) -> dict[str, Columns]:
    """Return the columns of a PLY file by element and property; an element of which there are none has no columns.

    Raises:
        ValueError: the header is not PLY's, or the file holds less or more than the header announces.
    """
    order, elements, body = _read_header(data)
    read = _read_text if order == "=" else _read_binary
    return read(elements, data[body:])


def _read_header(data: bytes) -> tuple[str, dict[str, _Element], int]:
    """The byte order of `BYTE_ORDERS`, the elements, and where they begin."""
    order = ""
    elements: dict[str, _Element] = {}
    name = ""
    end = 0
    while True:
        start, end = end, data.find(b"\n", end) + 1
        words = data[start : end or len(data)].decode("ascii", "replace").split()
        match words:
            case ["ply"] if start == 0:
                pass
            case _ if start == 0:
                raise ValueError("it does not start with ply")
            case ["end_header"] if order and end:
                return order, elements, end
            case ["format", form, _] if form in BYTE_ORDERS:
                order = BYTE_ORDERS[form]
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["element", name, count] if name not in elements:
                elements[name] = _Element(int(count), {})
            case ["property", *_, key] if name and key in elements[name].properties:
                raise ValueError(f"its header has two properties {key!r} of element {name!r}")
            case ["property", "list", length, kind, key] if name and length in TYPES and kind in TYPES:
                elements[name].properties[key] = _Property(order + TYPES[kind], order + TYPES[length])
            case ["property", kind, key] if name and kind in TYPES:
                elements[name].properties[key] = _Property(order + TYPES[kind])
            case _:
                raise ValueError(f"its header holds {' '.join(words)[:40]!r}, which is not PLY's")
        if not end:
            raise ValueError("its header does not end")


def _read_text(elements: dict[str, _Element], body: bytes) -> dict[str, Columns]:
    lines = b"\n".join(line for line in body.splitlines() if line.strip()) + b"\n"
    starts, ends = line_spans(np.frombuffer(lines, np.uint8))
    n_lines = len(ends) if len(lines) > 1 else 0
    columns: dict[str, Columns] = {}
    first = 0
    for name, element in elements.items():
        if first + element.count > n_lines:
            raise _ends_early(name, element)
        if element.count:
            last = first + element.count
            columns[name] = _text_columns(name, element, lines[starts[first] : ends[last - 1]])
            first = last
    return columns


def _text_columns(name: str, element: _Element, lines: bytes) -> Columns:
    """The columns of as many lines as there are elements; what lines hold beyond the last property is skipped."""
    values = parse_floats(lines)
    text = np.frombuffer(lines, np.uint8)
    counts = count_tokens(text, line_spans(text)[0])
    if len(values) != counts.sum():
        raise ValueError(f"element {name!r} holds something that is not a number")
    ends = np.cumsum(counts)
    at = ends - counts  # (N,) where each line's next number is
    columns: Columns = {}
    for key, kinds in element.properties.items():
        _check_reach(name, at + 1, ends)
        first, at = values[at], at + 1
        if not kinds.length_kind:
            columns[key] = first.astype(kinds.kind)
            continue
        lengths = first.astype(np.int64)
        if (lengths < 0).any():
            raise ValueError(f"a list of element {name!r} has length {lengths.min()}")
        _check_reach(name, at + lengths, ends)
        columns[key] = Lists(_gather(values, at, lengths).astype(kinds.kind), lengths)
        at = at + lengths
    return columns


def _check_reach(name: str, at: Int64, ends: Int64) -> None:
    """Raise `ValueError` unless what is read up to ``at`` lies in the lines of element ``name``, which end at ``ends``."""
    if (at > ends).any():
        raise ValueError(f"a line of element {name!r} has fewer numbers than its properties need")


def _gather(values: Float64, starts: Int64, lengths: Int64) -> Float64:
    """The numbers of lists, one after the other."""
    before = np.cumsum(lengths) - lengths
    gathered: Float64 = values[np.repeat(starts - before, lengths) + np.arange(lengths.sum())]
    return gathered


def _read_binary(elements: dict[str, _Element], body: bytes) -> dict[str, Columns]:
    columns: dict[str, Columns] = {}
    at = 0
    for name, element in elements.items():
        if element.count and element.properties:
            record = _record(name, element, body, at)
            n_there = min(element.count, (len(body) - at) // record.itemsize)
            records = np.frombuffer(body, record, n_there, at)
            if n_there == element.count and _are_alike(element, records):
                columns[name] = _alike_columns(element, records)
                at += n_there * record.itemsize
            else:
                columns[name], at = _ragged_columns(name, element, body, at)
    if at != len(body):
        raise ValueError(f"it holds {len(body) - at} bytes more than its header announces")
    return columns


def _ends_early(name: str, element: _Element) -> ValueError:
    return ValueError(f"it announces {element.count} of element {name!r} but ends before the last")


def _record(name: str, element: _Element, body: bytes, at: int) -> np.dtype[Any]:
    """The type of one element, lists as long as those of the first one, which begins at ``at``."""
    fields: list[tuple[Any, ...]] = []
    size = 0
    for i, kinds in enumerate(element.properties.values()):
        shape: tuple[int, ...] = ()
        if kinds.length_kind:
            length_kind = np.dtype(kinds.length_kind)
            if at + size + length_kind.itemsize > len(body):
                raise _ends_early(name, element)
            length = int(np.frombuffer(body, length_kind, 1, at + size)[0])
            if not 0 <= length <= len(body):
                raise ValueError(f"a list of element {name!r} has length {length}")
            fields.append((f"n{i}", length_kind))
            shape = (length,)
        fields.append((f"v{i}", kinds.kind, shape))
        size = np.dtype(fields).itemsize
    return np.dtype(fields)


def _are_alike(element: _Element, records: Array) -> bool:
    """Whether all lists of a property are as long as the first one."""
    lists = [f"n{i}" for i, kinds in enumerate(element.properties.values()) if kinds.length_kind]
    return all(bool((records[name] == records[name][:1]).all()) for name in lists)


def _alike_columns(element: _Element, records: Array) -> Columns:
    columns: Columns = {}
    for i, (key, kinds) in enumerate(element.properties.items()):
        values = records[f"v{i}"]
        columns[key] = Lists(values.reshape(-1), records[f"n{i}"].astype(np.int64)) if kinds.length_kind else values
    return columns


def _ragged_columns(name: str, element: _Element, body: bytes, at: int) -> tuple[Columns, int]:
    """The columns of elements whose lists differ in length, and where they end."""
    from gvpipe.io.ply.kernels import Layout, find_records

    kinds = list(element.properties.values())
    lists = [np.dtype(one.length_kind or "u1") for one in kinds]
    layout = Layout(
        np.array([np.dtype(one.kind).itemsize for one in kinds]),
        np.array([kind.itemsize if one.length_kind else 0 for one, kind in zip(kinds, lists, strict=True)]),
        np.array([int(kind.kind == "i") for kind in lists]),
        kinds[0].kind.startswith(">"),
    )
    smallest = int(np.where(layout.length_sizes > 0, layout.length_sizes, layout.sizes).sum())
    if element.count > (len(body) - at) // smallest:
        raise _ends_early(name, element)
    starts, lengths = np.empty((2, element.count, len(kinds)), np.int64)
    data = np.frombuffer(body, np.uint8)
    end = find_records(data, at, layout, starts, lengths)
    if end == -2:
        raise ValueError(f"a list of element {name!r} has a negative length")
    if end < 0:
        raise _ends_early(name, element)
    columns: Columns = {}
    for p, (key, one) in enumerate(element.properties.items()):
        n_bytes = lengths[:, p] * layout.sizes[p]
        before = np.cumsum(n_bytes) - n_bytes
        values = data[np.repeat(starts[:, p] - before, n_bytes) + np.arange(n_bytes.sum())].view(one.kind)
        columns[key] = Lists(values, lengths[:, p].copy()) if one.length_kind else values
    return columns, end
