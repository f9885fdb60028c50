"""Files that are packed: each read and checked once, before it is known which shard it goes to and what it shares there."""

from __future__ import annotations

import hashlib
import json
import os
import tarfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import file_bytes, read_bytes
from gvpipe.container.shared_parts import SharedParts
from gvpipe.container.shared_sections import MAX_SHARED, section_hash
from gvpipe.datasets.recorded import ERRORS, Recorded
from gvpipe.datasets.sample_names import DESCRIPTION
from gvpipe.datasets.statistics import KEYS, describe_positions
from gvpipe.foundation.errors import FormatError, InputError, SeveralShots, in_file
from gvpipe.foundation.isolation.plain_files import open_plain
from gvpipe.foundation.progress import Progress

LEAST_SHARED = 256  # bytes of a section: shorter ones take as much to refer to, with the header of their member
MAX_DESCRIPTION = 1 << 20  # bytes of a file's own JSON


@dataclass(frozen=True)
class Section:
    """A section that files may share: its hash and its bytes."""

    digest: str
    length: int


@dataclass(frozen=True)
class Entry:
    """A file to pack.

    Args:
        key: of its sample.
        path: of the file.
        n_bytes: of the file.
        digest: SHA-256 of the file: it is read again when its shard is written.
        description: the sample's JSON.
        sections: what it may share, by name.
    """

    key: str
    path: Path
    n_bytes: int
    digest: bytes
    description: bytes
    sections: Mapping[str, Section] = field(default_factory=dict)

    def read(self, unlimited: bool, stored: frozenset[str]) -> tuple[bytes, dict[str, bytes]]:
        """Return the file as its shard has it, and the sections that it refers to, by hash.

        Args:
            unlimited: as for `gvpipe.open`.
            stored: hashes of the sections that the shard stores.

        Raises:
            InputError: the file has changed since it was looked at, or it cannot be read.
        """
        data = read_file(self.path)
        if hashlib.sha256(data).digest() != self.digest:
            raise InputError(f"{self.path} has changed while it was packed; pack the folder again")
        shared = {name: section.digest for name, section in self.sections.items() if section.digest in stored}
        if not shared:
            return data, {}
        bitstream = read_bytes(data, str(self.path), unlimited)
        return file_bytes(bitstream, shared=shared), {digest: bitstream.sections[name] for name, digest in shared.items()}


def look_at(
    files: Mapping[str, Path], recorded: Recorded, left_out: dict[str, str], progress: Progress | None, unlimited: bool
) -> Iterator[Entry]:
    """Yield the files that can be packed.

    Args:
        files: by key, in order.
        recorded: of their folder.
        left_out: gets why the others cannot be packed, by path.
        progress, unlimited: as for `gvpipe.datasets.pack`.
    """
    shared = SharedParts()
    for k, (key, path) in enumerate(files.items()):
        if progress:
            progress("check", k / len(files))
        try:
            data = read_file(path)
            yield _look(key, path, data, recorded.of(path, len(data)), shared, unlimited)
        except SeveralShots:
            left_out[str(path)] = (
                f"{path} is a capture, and a sample has one connectivity; encode --split makes a file of each shot"
            )
        except (FormatError, InputError) as exc:
            left_out[str(path)] = str(exc)


def describe(bitstream: Bitstream) -> dict[str, Any]:
    """What gvpipe writes of a sequence into its sample's JSON."""
    return {
        "codec": bitstream.codec,
        "vertices": bitstream.n_vertices,
        "triangles": bitstream.n_triangles,
        "frames": bitstream.n_frames,
        "fps": bitstream.fps,
        "bytes": bitstream.n_bytes,
    }


def read_file(path: Path) -> bytes:
    """Return the bytes of an ordinary file; raises `InputError`."""
    try:
        with open_plain(path, follows=False) as file:
            return file.read()
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check its permissions") from exc


def _look(key: str, path: Path, data: bytes, known: dict[str, Any], shared: SharedParts, unlimited: bool) -> Entry:
    bitstream = read_bytes(data, str(path), unlimited)
    known = {name: known[name] for name in (*KEYS, *ERRORS) if known.get(name) is not None}
    with in_file(str(path)):
        positions = {} if known.keys() >= set(KEYS) else describe_positions(bitstream, shared)
    text = _as_json({**_beside(path), **known, **positions, **describe(bitstream)}, path)
    try:
        tarfile.TarInfo(f"{key}.{DESCRIPTION}").tobuf(tarfile.USTAR_FORMAT)
    except ValueError as exc:
        raise InputError(f"{path}: its path is too long for a tar file; choose a shorter name") from exc
    return Entry(key, path, len(data), hashlib.sha256(data).digest(), text, _sections(bitstream, data))


def _sections(bitstream: Bitstream, data: bytes) -> dict[str, Section]:
    """What a file may share: nothing, unless it has the bare layout and comes back to the bit."""
    if not bitstream.is_bare or file_bytes(bitstream) != data:
        return {}
    found = {name: part for name, part in bitstream.sections.items() if len(part) >= LEAST_SHARED}
    if sum(map(len, found.values())) > MAX_SHARED:
        return {}
    return {name: Section(section_hash(part), len(part)) for name, part in found.items()}


def _beside(path: Path) -> dict[str, Any]:
    """The JSON object beside a file; empty if there is none."""
    beside = path.with_suffix(f".{DESCRIPTION}")
    if not os.path.lexists(beside):
        return {}
    try:
        with open_plain(beside, follows=False) as file:
            data = file.read(MAX_DESCRIPTION + 1)
    except OSError as exc:
        raise InputError(f"{beside} cannot be read: {exc.strerror or exc}; check its permissions") from exc
    if len(data) > MAX_DESCRIPTION:
        raise InputError(f"{beside} has more than {MAX_DESCRIPTION} bytes; shorten it")
    try:
        found = json.loads(data)
    except (ValueError, RecursionError) as exc:
        raise InputError(f"{beside} is not JSON ({exc}); mend or remove it") from exc
    if not isinstance(found, dict):
        raise InputError(f"{beside} is no JSON object; give one, with names")
    return found


def _as_json(description: dict[str, Any], path: Path) -> bytes:
    try:
        return json.dumps(description, separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode()
    except ValueError as exc:  # half a character, say; or NaN, which is no JSON
        beside = path.with_suffix(f".{DESCRIPTION}")
        raise InputError(f"{beside} holds what no JSON file in UTF-8 can hold ({exc}); mend or remove it") from exc
