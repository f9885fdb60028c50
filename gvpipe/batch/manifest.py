"""What became of each sequence: a file of JSON Lines beside the outputs, which the next run resumes from.

A line is added when a sequence ends, and is on the disk before the next one is. A line that a kill cut short is dropped. Of
several lines of one output, the last counts.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from gvpipe.foundation.atomic import output_error
from gvpipe.foundation.errors import InputError, quote

NAME = "manifest.jsonl"
REMEDY = "write to another folder, or remove the manifest to encode all anew"


@dataclass(frozen=True)
class Entry:
    """A line.

    Args:
        input: as `gvpipe.playback.files.read` takes it.
        hash: SHA-256 of the input's bytes, as hexadecimal digits; None: it could not be read.
        output: below the manifest's folder, with ``/`` between folders.
        error: why there is no output; None: it is there.
        bytes: of the output, 0 without one.
        seconds: that the sequence took.
        gvpipe: version.
        settings: what was asked for.
        description: what a sample of a data set says of the sequence (`gvpipe.datasets`), and errors that were measured.
        decided: the codec that all sequences of the run have, of several candidates; empty: each chose, or there was one.
    """

    input: str
    hash: str | None
    output: str
    error: str | None
    bytes: int
    seconds: float
    gvpipe: str
    settings: Mapping[str, Any]
    description: Mapping[str, Any] = field(default_factory=dict)
    decided: str = ""


TYPES: dict[str, Any] = {
    "input": str,
    "hash": str | None,
    "output": str,
    "error": str | None,
    "bytes": int,
    "seconds": float | int,
    "gvpipe": str,
    "settings": dict,
}
# keys that older manifests lack: type, and what stands for it
ADDED: dict[str, tuple[Any, Any]] = {"description": (dict, {}), "decided": (str, "")}


class Manifest:
    """An open manifest.

    Args:
        file: to append to.
        path: of it.
        entries: by output.
    """

    def __init__(self, file: IO[bytes], path: Path, entries: dict[str, Entry]) -> None:
        self._file, self.path, self.entries = file, path, entries

    def add(self, entry: Entry) -> None:
        """Add a line; it is on the disk when this returns; raises `OutputError`."""
        line = json.dumps(dataclasses.asdict(entry), allow_nan=False) + "\n"
        try:
            self._file.write(line.encode())
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as exc:
            raise output_error(self.path, exc) from exc


@contextlib.contextmanager
def open_manifest(folder: Path, settings: Mapping[str, Any]) -> Iterator[Manifest]:
    """Open the manifest of a folder, a new one if there is none.

    Args:
        folder: of the outputs.
        settings: what is asked for, as JSON values.

    Raises:
        InputError: another process writes it, it is no manifest, or that of a run with other settings.
        OutputError: it cannot be written.
    """
    path = folder / NAME
    try:
        file = open(path, "a+b")  # noqa: SIM115 - the block below closes it, and raises errors of other kinds
    except OSError as exc:
        raise output_error(path, exc) from exc
    with file:
        _lock(file, path)
        file.seek(0)
        data = file.read()
        whole = data[: data.rfind(b"\n") + 1]
        entries = {}
        for number, line in enumerate(whole.splitlines(), 1):
            entry = _parse(line, f"{path}, line {number}")
            if entry.error is None:  # what failed leaves no file of its settings
                _check_settings(entry.settings, settings, path)
            entries[entry.output] = entry
        if len(whole) < len(data):
            _check_cut(data[len(whole) :], path)
            file.truncate(len(whole))
        yield Manifest(file, path, entries)


def _lock(file: IO[bytes], path: Path) -> None:
    """Refuse a manifest that another process writes, where the system can tell."""
    if sys.platform == "win32":
        return
    import fcntl

    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as exc:
        raise InputError(f"{path}: another gvpipe encode-all writes it; wait for it, or write to another folder") from exc
    except OSError:
        return  # a file system without locks


def _parse(line: bytes, where: str) -> Entry:
    try:
        values = json.loads(line)
    except (ValueError, RecursionError) as exc:
        raise InputError(f"{where}: it is no JSON, so this is no manifest; {REMEDY}") from exc
    if not isinstance(values, dict):
        raise InputError(f"{where}: it is {quote(values)}, so this is no manifest; {REMEDY}")
    for name, kind in TYPES.items():
        if name not in values or not isinstance(values[name], kind):
            found = quote(values[name]) if name in values else "missing"
            raise InputError(f"{where}: {name} is {found}, so this is no manifest of this gvpipe; {REMEDY}")
    for name, (kind, default) in ADDED.items():
        if not isinstance(values.setdefault(name, default), kind):
            raise InputError(f"{where}: {name} is {quote(values[name])}, so this is no manifest of this gvpipe; {REMEDY}")
    return Entry(**{name: values[name] for name in (*TYPES, *ADDED)})


def _check_settings(found: Mapping[str, Any], wanted: Mapping[str, Any], path: Path) -> None:
    for name in sorted({*found, *wanted}):
        if found.get(name) != wanted.get(name):
            was, now = (quote(each[name]) if name in each else "not given" for each in (found, wanted))
            raise InputError(f"{path} is of a run with other settings: {name} is {was} there, {now} here; {REMEDY}")


def _check_cut(rest: bytes, path: Path) -> None:
    """Refuse to drop what no manifest ends with."""
    if not rest.startswith(b"{"):
        raise InputError(f"{path}: its end is no line of a manifest; {REMEDY}")
