"""Names of a stranger, answers of a web server, and files of machine code, mutated.

- names: texts wherever a sequence has some. What is written must be read again, and no text may reach a terminal as it is.
- http: the bytes of an answer. Whatever a server sends, opening its address ends, in one line or with a video.
- kernels: what a file of machine code says of itself. It may name modules and types, and must load none that are not known.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import socket
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import gvpipe
from fuzz.mutation import mutate_bytes, mutate_json, mutate_text
from fuzz.parts import BrokenPromise, Parts, Seed, Target
from gvpipe.asset_coding.directory import Directory, ListedImage, pack_directory, unpack_directory
from gvpipe.foundation.errors import FormatError, InputError
from gvpipe.foundation.text import escaped, text_fault

TEXTS = ["part", "parent", "material", "attribute", "field", "unit", "source", "key", "several\nlines"]
STRANGE = ["\x1b[2J", "\u202e", "\u2066x\u2069", "\u2028", "\0", "x" * 70_000, "\U0001f600" * 40_000, "", "\ud800", "a\tb\r"]
HEAD, BODY = "head", "body"
KNOWN = ("gvpipe", "gvcodecs", "numba", "numpy", "llvmlite")  # packages that files of machine code may name
WORD = "file"


def strange_targets(video: bytes) -> list[Target]:
    """The three targets; ``video`` is a sound file."""
    names = Seed("texts", {WORD: json.dumps(TEXTS).encode()})
    answers = (
        Seed("part", {HEAD: b"HTTP/1.1 206 Partial Content\r\nContent-Range: bytes 0-%d/%d\r\nContent-Length: %d\r\nETag: 1"
                      % (len(video) - 1, len(video), len(video)), BODY: video}),
        Seed("whole", {HEAD: b"HTTP/1.1 200 OK\r\nContent-Length: %d\r\nLast-Modified: today" % len(video), BODY: video}),
        Seed("away", {HEAD: b"HTTP/1.1 302 Found\r\nLocation: ftp://127.0.0.1/a.mp4", BODY: b""}),
        Seed("refused", {HEAD: b"HTTP/1.1 416 Range Not Satisfiable\r\nContent-Range: bytes */0", BODY: b""}),
        Seed("chunks", {HEAD: b"HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked", BODY: b"4\r\nabcd\r\n0\r\n\r\n"}),
    )  # fmt: skip
    return [
        Target("names", (names,), _mutate_names, lambda parts: {"a.json": parts[WORD]}, parse_names, (FormatError, InputError)),
        Target("http", answers, _mutate_answer, join_answer, parse_answer, (FormatError, InputError), memory=256 << 20),
        Target("kernels", (kernel_seed(),), _mutate_kernel, join_kernel, parse_kernel, (InputError,)),
    ]


def _mutate_names(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    texts = [str(each) for each in json.loads(parts[WORD])]
    for _ in range(1 + int(rng.geometric(0.5))):
        k = int(rng.integers(len(texts)))
        if rng.random() < 0.5:
            texts[k] += STRANGE[int(rng.integers(len(STRANGE)))]
        else:
            texts[k] = mutate_text(texts[k].encode("utf-8", "surrogatepass"), rng).decode("utf-8", "replace")
    return {WORD: json.dumps(texts).encode()}


def parse_names(path: Path) -> None:
    """Make a sequence of texts, write its list and read it.

    Raises:
        InputError: two names are one.
        BrokenPromise: what was written is not what is read, or a text is none that can be shown.
    """
    texts = json.loads(path.read_bytes())
    part, parent, material, attribute, field, unit, source, key, lines = (str(text) for text in texts)
    sequence = gvpipe.MeshSequence(
        np.eye(3, dtype=np.float32)[None], np.array([[0, 1, 2]]), name=str(path),
        attributes={attribute: gvpipe.Attribute(np.arange(3, dtype=np.float32), unit=unit)},
        fields={field: gvpipe.Field(np.zeros((1, 3), np.float32), unit=unit)},
        parts=(gvpipe.Part(part, (0, 3), (0, 1), 0, parent),), materials=(gvpipe.Material(material),),
        metadata=gvpipe.Metadata(source=source, texts={key: lines}),
    )  # fmt: skip
    directory = Directory(
        parts=(gvpipe.Part(sequence.parts[0].name, (0, 3), (0, 0), 0, sequence.parts[0].parent),),
        materials=sequence.materials,
        images=(ListedImage(sequence.parts[0].name, "image/png", "image.0"),),
        metadata=sequence.metadata,
    )
    if unpack_directory(pack_directory(directory, 3), 3) != directory:
        raise BrokenPromise("a list that is read as another")
    every = [*sequence.attributes, *sequence.fields, sequence.parts[0].name, sequence.materials[0].name, *sequence.notes]
    if any(text_fault(escaped(text)) for text in every) or any(text_fault(text) for text in every):
        raise BrokenPromise("a text that cannot be shown")


def _mutate_answer(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    for _ in range(1 + int(rng.geometric(0.5))):
        name = HEAD if rng.random() < 0.7 else BODY
        parts[name] = (mutate_text if name == HEAD and rng.random() < 0.7 else mutate_bytes)(parts[name], rng)
    if rng.random() < 0.1:
        parts[BODY] = seeds[int(rng.integers(len(seeds)))].parts[BODY]
    return parts


def join_answer(parts: Parts) -> dict[str, bytes]:
    """The bytes of an answer."""
    return {"a.mp4": parts[HEAD] + b"\r\n\r\n" + parts[BODY]}


def parse_answer(path: Path) -> None:
    """Open an address whose server sends these bytes, and read what is there.

    Raises:
        InputError, FormatError: it is refused.
    """
    with _answering(path.read_bytes()) as port, gvpipe.open(f"http://127.0.0.1:{port}/{path.name}") as video:
        if not np.isfinite(video[0]).all():
            raise BrokenPromise("a position that is not finite")


@contextlib.contextmanager
def _answering(data: bytes) -> Iterator[int]:
    """The port of a server that sends the same bytes whatever it is asked, then closes the connection."""
    with socket.create_server(("127.0.0.1", 0)) as listening:

        def serve() -> None:
            with contextlib.suppress(OSError):
                while True:
                    connection, _ = listening.accept()
                    with connection, contextlib.suppress(OSError):
                        connection.recv(1 << 12)
                        connection.sendall(data)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        try:
            yield listening.getsockname()[1]
        finally:
            listening.shutdown(socket.SHUT_RDWR)
            thread.join()


def kernel_seed() -> Seed:
    """What the file of a kernel says, with code that nobody runs."""
    described: dict[str, Any] = {
        "symbols": ["a", "b"], "library": "lib", "types": ["int64", "array(float64, 1d, C)"],
        "result": ["named", "gvpipe.entropy.block_kernels", "BlockStream", ["int64", ["tuple", ["float32", "none"]],
                   ["array", "uint8", 2, "C", True, True], ["row", 8]]],
        "function": {"modname": "gvpipe.entropy.tokens", "qualname": "f", "unique_name": "f$1", "env_name": "e",
                     "mangled_name": "_Z", "native": True, "inline": False, "noalias": False, "uid": 1},
        "arguments": ["x"], "tags": ["c8"], "environment": ["e", "gvpipe.entropy.tokens", ["<f8"]],
        "environments": [["e", "gvpipe.entropy.tokens", ["<f8"]]],
    }  # fmt: skip
    return Seed("kernel", {HEAD: json.dumps(described).encode(), BODY: b"code"})


def _mutate_kernel(parts: Parts, rng: np.random.Generator, seeds: tuple[Seed, ...]) -> Parts:
    for _ in range(1 + int(rng.geometric(0.5))):
        parts[HEAD] = mutate_json(parts[HEAD], rng)
    if rng.random() < 0.2:
        parts["whole"] = mutate_bytes(join_kernel(parts)["a.nbc"], rng)
    return parts


def join_kernel(parts: Parts) -> dict[str, bytes]:
    """The file, whose checksum holds unless all of it was changed."""
    from gvpipe.runtime.code_file import HEAD as LENGTHS

    if "whole" in parts:
        return {"a.nbc": parts["whole"]}
    body = LENGTHS.pack(len(parts[HEAD]), len(parts[BODY]), 0) + parts[HEAD] + parts[BODY]
    return {"a.nbc": hashlib.sha256(body).digest() + body}


def parse_kernel(path: Path) -> None:
    """Take a file apart, and make all of it but its code.

    Raises:
        InputError: in place of the errors for which a kernel is compiled anew.
        BrokenPromise: a module was loaded that no file of machine code may name.
    """
    from gvpipe.runtime import code_file

    before = set(sys.modules)
    try:
        described = code_file.unpack(path.read_bytes()).described
        code_file.type_of_text(described["result"])
        for each in (described["environment"], *described["environments"]):
            code_file._environment(*each)
    except (ValueError, KeyError, TypeError, AttributeError, ImportError, IndexError, RecursionError) as exc:
        reason = escaped(" ".join(f"{path.name}: {type(exc).__name__}: {exc}".split()))[:400]
        raise InputError(reason) from exc
    finally:
        new = {name.partition(".")[0] for name in set(sys.modules) - before}
        if new - set(KNOWN) - set(sys.stdlib_module_names):
            raise BrokenPromise(f"modules were loaded: {', '.join(sorted(new))}")
