"""Files of machine code: what goes in comes back, and a file that does not fit raises one of a few errors."""

from __future__ import annotations

import hashlib
import json
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba.core import types
from numba.core.types import containers

from gvpipe.runtime import code_file
from gvpipe.runtime.code_file import HEAD, Unstorable, pack, rebuild, unpack
from gvpipe.runtime.compiled import compiled

NAMED = ValueError, KeyError, TypeError, AttributeError, ImportError


class Pair(NamedTuple):
    """Of a kernel's results."""

    one: Any
    other: Any


@compiled
def pair(values: Any, scale: float) -> Any:
    return Pair(values * scale, (len(values), scale, values.sum() > 0))


def _result() -> Any:
    kernel: Any = pair
    kernel._cache.disable()  # what is loaded from a file holds no object code
    kernel(np.arange(3, dtype=np.float32), 2.0)
    return next(iter(kernel.overloads.values()))


def _changed(data: bytes, **changes: Any) -> bytes:
    described, code, bitcode = unpack(data)
    text = json.dumps({**described, **changes}).encode()
    body = HEAD.pack(len(text), len(code), len(bitcode)) + text + code + bitcode
    return hashlib.sha256(body).digest() + body


def test_a_result_comes_back() -> None:
    result = _result()
    parts = unpack(pack(result))
    again = rebuild(result.target_context, result.signature.args, parts)
    assert again.signature.return_type == result.signature.return_type
    for name in (*code_file.TEXTS, *code_file.PLAIN, "args", "argtypes", "restype"):
        assert getattr(again.fndesc, name) == getattr(result.fndesc, name)
    assert not {b"pickle", b"c__builtin__"} & {parts.code[:64], parts.bitcode[:64]}


@pytest.mark.parametrize(
    "kind",
    [
        types.none,
        types.boolean,
        types.uint8,
        types.float32,
        types.Array(types.int16, 2, "C"),
        types.Array(types.float64, 1, "A", readonly=True, aligned=False),
        containers.UniTuple(types.int64, 3),
        containers.Tuple((types.int64, types.Array(types.boolean, 3, "F"))),
        containers.NamedTuple((types.int64, types.float64), Pair),
        containers.NamedUniTuple(types.int64, 2, Pair),
    ],
    ids=str,
)
def test_types_as_text(kind: Any) -> None:
    text = json.loads(json.dumps(code_file.text_of_type(kind)))
    assert code_file.type_of_text(text) == kind


def test_types_that_have_no_text() -> None:
    with pytest.raises(Unstorable):
        code_file.text_of_type(types.unicode_type)


CHANGES: dict[str, dict[str, Any]] = {
    "other arguments": {"types": ["int64"]},
    "no type": {"result": ["thing"]},
    "a module that is not loaded": {"result": ["named", "antigravity", "Pair", ["int64"]]},
    "a function for a class": {"result": ["named", "os", "system", ["int64"]]},
    "an environment elsewhere": {"environment": ["a name", "antigravity", []]},
    "no number": {"environment": ["another name", "os", ["thing"]]},
    "nothing": {"function": {}},
}


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
def test_files_that_do_not_fit(changes: dict[str, Any]) -> None:
    result = _result()
    with pytest.raises(NAMED):
        rebuild(result.target_context, result.signature.args, unpack(_changed(pack(result), **changes)))


@pytest.mark.parametrize("cut", [0, 1, 31, 32, 40, 60, 100, -1])
def test_files_that_are_cut_short(cut: int) -> None:
    with pytest.raises(ValueError):
        unpack(pack(_result())[:cut])


def test_lengths_that_do_not_hold() -> None:
    body = HEAD.pack(2, 1 << 60, 0) + b"{}"
    with pytest.raises(ValueError, match="another length"):
        unpack(hashlib.sha256(body).digest() + body)
