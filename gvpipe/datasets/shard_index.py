"""Where the samples of a shard are: one pass over the headers of a tar file, which is hostile until it is checked.

Members are read where they lie, and never unpacked. Links, folders and devices are no samples and are passed over. A
member whose name leads out of a folder, a second one of the same name, or one that the file has no bytes for is an error.
"""

from __future__ import annotations

import os
import tarfile
from collections.abc import Iterator
from typing import Any, BinaryIO, NamedTuple, cast

from gvpipe.datasets.sample_names import DESCRIPTION, VIDEO, is_plain, shared_hash, split_name
from gvpipe.foundation.errors import CorruptFile, FormatError, InputError, TruncatedFile, corrupt, quote

BLOCK = tarfile.BLOCKSIZE
MAX_MEMBERS = 1 << 24
MAX_HEADER = 1 << 20  # bytes of a long name, or of what else precedes a member
PARSER_ERRORS = (tarfile.TarError, RecursionError, OverflowError, ValueError, MemoryError)
REMEDY = "get the shard again from its source, or pack it again"


class Place(NamedTuple):
    """Bytes of a file: ``offset`` of the first, and how many."""

    offset: int
    length: int


class Sample(NamedTuple):
    """Where a sample's video and its description are; the latter has length 0 where there is none."""

    key: str
    video: Place
    description: Place


class Index(NamedTuple):
    """Samples that have a video, in the order of their videos, and where shared sections are, by hash."""

    samples: list[Sample]
    shared: dict[str, Place]


def index_shard(path: str) -> Index:
    """Return what a shard has, and where.

    Raises:
        InputError: there is no such file, or it cannot be read.
        TruncatedFile: it is cut; the message names the sample and the byte.
        CorruptFile: a header is damaged, or a member may not be there.
    """
    videos: dict[str, Place] = {}
    descriptions: dict[str, Place] = {}
    shared: dict[str, Place] = {}
    kinds = {VIDEO: videos, DESCRIPTION: descriptions}
    try:
        for name, place in _members(path):
            digest = shared_hash(name)
            key, kind = split_name(name) if digest is None else (digest, "")
            places = kinds.get(kind) if digest is None else shared
            if places is None:
                continue
            if key in places:
                raise corrupt(f"member {quote(name)} at byte {place.offset} occurs twice")
            places[key] = place
    except FormatError as exc:
        raise exc.within(str(path)) from exc
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the path and its permissions") from exc
    return Index([Sample(key, place, descriptions.get(key, Place(0, 0))) for key, place in videos.items()], shared)


def _members(path: str) -> Iterator[tuple[str, Place]]:
    """Name and place of each ordinary file of an archive, each place inside the file."""
    size = os.path.getsize(path)
    with open(path, "rb") as file:
        if size < BLOCK:
            raise TruncatedFile(f"it ends at byte {size}, before its first sample; {REMEDY}")
        last, archive = "", _open(file)
        for _ in range(MAX_MEMBERS):
            start = archive.offset if last else 0
            member = _next(archive, start)
            if member is None:
                _check_end(file, start, size, last)
                return
            archive.members = []  # type: ignore[attr-defined]  # it would keep all that it has read
            last = member.name
            if member.size < 0 or not is_plain(last):
                raise corrupt(f"the member at byte {start} has the name {quote(last)} and {member.size} bytes")
            if member.offset_data + member.size > size:
                end = member.offset_data + member.size
                raise TruncatedFile(
                    f"it ends at byte {size}, inside sample {_named(last)}, which goes on to byte {end}; {REMEDY}"
                )
            if member.isreg() and not member.issparse():
                yield last, Place(member.offset_data, member.size)
        raise corrupt(f"it has more than {MAX_MEMBERS} members")


def _open(file: BinaryIO) -> tarfile.TarFile:
    """An archive; opening reads its first header."""
    try:
        return tarfile.TarFile(fileobj=cast(Any, _Headers(file)))
    except PARSER_ERRORS as exc:
        raise CorruptFile(f"it is no tar file ({exc}); give a shard as gvpipe pack writes it") from exc


class _Headers:
    """A file of which a parser reads headers alone, none of them long: a name may say that it has gigabytes."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self.mode = file, "rb"
        self.seek, self.tell = file.seek, file.tell

    def read(self, n: int = -1) -> bytes:
        """Read some bytes; raises `tarfile.TarError` for more than `MAX_HEADER`."""
        if not 0 <= n <= MAX_HEADER:
            raise tarfile.HeaderError(f"a header of {n} bytes, above {MAX_HEADER}")
        return self._file.read(n)


def _next(archive: tarfile.TarFile, start: int) -> tarfile.TarInfo | None:
    """The next member, whose header is at byte ``start``; None where the reader finds no header."""
    try:
        return archive.next()
    except PARSER_ERRORS as exc:
        raise CorruptFile(f"the header at byte {start} is damaged ({exc}); {REMEDY}") from exc


def _check_end(file: BinaryIO, start: int, size: int, last: str) -> None:
    """Raise unless the block at byte ``start`` is the mark of an archive's end: what is no header ends the reading, too."""
    behind = f"behind sample {_named(last)}" if last else "before its first sample"
    if start + BLOCK > size:
        raise TruncatedFile(f"it ends at byte {size}, {behind}, without the mark of its end; {REMEDY}")
    file.seek(start)
    if file.read(BLOCK).strip(b"\0"):
        raise CorruptFile(f"the header at byte {start}, {behind}, is damaged; {REMEDY}")


def _named(member: str) -> str:
    """The key of a member's sample, for messages; the name of a member that belongs to none."""
    return quote(split_name(member)[0] or member)
