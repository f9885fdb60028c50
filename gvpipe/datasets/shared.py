"""Shared sections of shards: what several of their files have in common, by hash (`gvpipe.container.shared_sections`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from gvpipe.container.shared_sections import MAX_SHARED
from gvpipe.container.sources import FileSource
from gvpipe.datasets.sample_names import shared_name
from gvpipe.datasets.shard_index import Place
from gvpipe.foundation.errors import FormatError, InputError, corrupt


class SharedSections:
    """Gives the bytes of a shared section by its hash; thread-safe, goes on in a forked process, pickles with its places.

    Args:
        shards: of each the file, and where its shared sections are, by hash.
    """

    def __init__(self, shards: Sequence[tuple[FileSource, Mapping[str, Place]]]) -> None:
        self._shards = list(shards)

    def __call__(self, digest: str) -> bytes:
        """Return the section, whose hash is not checked here.

        Raises:
            KeyError: no shard has it.
            FormatError: it is longer than a shared section may be, or its shard has changed.
        """
        for source, places in self._shards:
            if digest in places:
                return _read(source, digest, places[digest])
        raise KeyError(digest)

    def __len__(self) -> int:
        return sum(len(places) for _, places in self._shards)

    @property
    def n_bytes(self) -> int:
        """Bytes of all of them."""
        return sum(place.length for _, places in self._shards for place in places.values())


def open_source(path: str) -> FileSource:
    """A shard to read from; raises `InputError` if it cannot be read."""
    try:
        return FileSource(path)
    except OSError as exc:
        raise InputError(f"{path} cannot be read: {exc.strerror or exc}; check the path and its permissions") from exc


def _read(source: FileSource, digest: str, place: Place) -> bytes:
    if place.length > MAX_SHARED:
        raise corrupt(f"member {shared_name(digest)} at byte {place.offset} has {place.length} bytes, above {MAX_SHARED}")
    try:
        return source.read(*place)
    except FormatError as exc:
        raise exc.within(f"byte {place.offset} of the shard") from exc
