"""One sequence of many, encoded by a worker: its hash first, then its file, unless both are there."""

from __future__ import annotations

import glob
import hashlib
import os
import pickle
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gvpipe.foundation.errors import GvpipeError, InputError, printable
from gvpipe.foundation.isolation.plain_files import open_plain
from gvpipe.tasks.executor import Work

if TYPE_CHECKING:
    from gvpipe.encoding.report import Report

BLOCK = 1 << 20  # bytes that are hashed at a time


@dataclass(frozen=True)
class Task:
    """A sequence to encode.

    Args:
        source: as `gvpipe.playback.files.read` takes it, absolute.
        target: of the file to write, absolute.
        done_hash: of the input that the file was made of, None if there is no such file.
    """

    source: str
    target: str
    done_hash: str | None


@dataclass(frozen=True)
class Done:
    """What became of it.

    Args:
        hash: of the input, None if it could not be read.
        error: why there is no file.
        bytes: of the file.
        seconds: that it took.
        is_new: whether the file was made now.
        notes: of the encode.
        description: of the sequence, for data sets.
    """

    hash: str | None
    error: str | None
    bytes: int
    seconds: float
    is_new: bool = True
    notes: tuple[str, ...] = ()
    description: dict[str, Any] = field(default_factory=dict)


def prepare(data: bytes) -> Work:
    """In a worker: what encodes sequences, given keywords of `gvpipe.api.encode`, pickled."""
    return partial(encode_one, pickle.loads(data))


def encode_one(keywords: dict[str, Any], task: Task) -> Done:
    """Encode a sequence, unless it is done; whatever goes wrong is returned as ``error``, one line."""
    from gvpipe import api

    started = time.perf_counter()
    found = None
    try:
        found = hash_input(task.source, keywords.get("mesh"))
        if found == task.done_hash:
            return Done(found, None, os.path.getsize(task.target), time.perf_counter() - started, False)
        Path(task.target).parent.mkdir(parents=True, exist_ok=True)
        report = api.encode(task.source, task.target, **keywords)
        description = _described(task.target, report)
    except GvpipeError as exc:
        error = str(exc)
    except MemoryError:
        error = "not enough memory; take fewer --workers, or fewer frames per segment (--segment)"
    except Exception as exc:  # the other sequences go on
        error = printable(f"unexpected {type(exc).__name__}: {' '.join(str(exc).split())}")
    else:
        seconds = time.perf_counter() - started
        return Done(found, None, report.bytes, seconds, notes=tuple(report.notes), description=description)
    return Done(found, error, 0, time.perf_counter() - started)


def _described(target: str, report: Report) -> dict[str, Any]:
    """What a data set says of a file; of a capture, which goes into no data set, its numbers."""
    from gvpipe.container.mp4 import read_file
    from gvpipe.datasets.entries import describe
    from gvpipe.datasets.statistics import describe_positions

    if report.shots:
        names = ("codec", "frames", "vertices", "triangles", "fps", "bytes")
        return {**{name: getattr(report, name) for name in names}, "shots": len(report.shots)}
    bitstream = read_file(target, unlimited=True)
    return {**describe(bitstream), **describe_positions(bitstream), **report.errors}


def hash_input(source: str, mesh: str | None = None) -> str:
    """SHA-256 of a sequence's files, hexadecimal: of several, of their names too. Files that they refer to do not count.

    Raises:
        InputError: one cannot be read.
    """
    digest = hashlib.sha256()
    files = [source] if os.path.exists(source) else sorted(glob.glob(source))
    if not files:
        raise InputError(f"{source}: no such file; it has gone since the sequences were listed")
    if len(files) == 1 and mesh is None:
        _add(digest, files[0])
        return digest.hexdigest()
    for file in [*files, *([] if mesh is None else [mesh])]:
        own = hashlib.sha256()
        _add(own, file)
        digest.update(os.path.basename(file).encode(errors="surrogateescape") + b"\0" + own.digest())
    return digest.hexdigest()


def _add(digest: Any, file: str) -> None:
    for block in _blocks(file):
        digest.update(block)


def _blocks(file: str) -> Iterator[bytes]:
    try:
        with open_plain(file) as opened:
            while block := opened.read(BLOCK):
                yield block
    except OSError as exc:
        raise InputError(f"{file}: {exc.strerror or exc}; check the path and its permissions") from exc
