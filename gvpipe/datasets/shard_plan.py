"""Which files go to which shard, and which sections each shard stores once for all of its files.

A section is stored once where that takes fewer bytes: its member has a header and fills blocks, and each file refers to it.
Each shard has all that its files refer to, so that it can be read without the others.
"""

from __future__ import annotations

import tarfile
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from gvpipe.datasets.entries import Entry

BLOCK = tarfile.BLOCKSIZE
END = 2 * BLOCK  # bytes that mark the end of a shard, before it is filled up
REFERENCE = 64  # bytes of a hash in a file's header, at most, without the section's name
LEAST_GAIN = 0.01  # part of all bytes that sharing must save
NOTHING: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Shard:
    """The files of a shard, in order, and the hashes of the sections that it stores."""

    entries: list[Entry] = field(default_factory=list)
    stored: frozenset[str] = NOTHING


def plan_shards(entries: Sequence[Entry], most_bytes: int, most: int | None, share: bool) -> list[Shard]:
    """Divide files into shards.

    Args:
        entries: in order.
        most_bytes: of a shard, unless one file alone takes more.
        most: files of a shard.
        share: whether they may share sections, where that saves `LEAST_GAIN` of the bytes.
    """
    alone = [Shard(part) for part in _divide(entries, NOTHING, most_bytes, most)]
    common = _worth_storing(entries) if share else NOTHING
    if not common:
        return alone
    sharing = [_fit(part, common) for part in _divide(entries, common, most_bytes, most)]
    return sharing if _n_bytes(sharing) <= (1 - LEAST_GAIN) * _n_bytes(alone) else alone


def member_bytes(length: int) -> int:
    """Bytes of a member of that length in a tar file: its header, and its content, which fills blocks."""
    return BLOCK + length + -length % BLOCK


def _divide(entries: Iterable[Entry], common: frozenset[str], most_bytes: int, most: int | None) -> list[list[Entry]]:
    """Fill one shard after the other; the first file goes in, whatever it takes."""
    shards: list[list[Entry]] = []
    n_bytes, stored = END, set[str]()
    for entry in entries:
        size = _size(entry, common, stored)
        if not shards or n_bytes + size > most_bytes or len(shards[-1]) == most:
            shards.append([])
            n_bytes, stored = END, set()
            size = _size(entry, common, stored)
        shards[-1].append(entry)
        n_bytes += size
        stored |= {section.digest for section in entry.sections.values()} & common
    return shards


def _fit(entries: list[Entry], common: frozenset[str]) -> Shard:
    """The smaller of two shards: what these files share is stored, or what all files share, for which there is room."""
    return min(Shard(entries, _worth_storing(entries)), Shard(entries, common), key=lambda shard: _n_bytes([shard]))


def _size(entry: Entry, common: frozenset[str], stored: set[str]) -> int:
    """Bytes that a file adds to a shard which has stored some sections, at most."""
    shared = {name: section for name, section in entry.sections.items() if section.digest in common}
    own = entry.n_bytes + sum(REFERENCE + len(name) - section.length for name, section in shared.items())
    new = {section.digest: section.length for section in shared.values() if section.digest not in stored}
    return member_bytes(own) + member_bytes(len(entry.description)) + sum(map(member_bytes, new.values()))


def _worth_storing(entries: Iterable[Entry]) -> frozenset[str]:
    """Hashes of sections that take fewer bytes if they are stored once for these files."""
    gains, lengths = Counter[str](), dict[str, int]()
    for entry in entries:
        for name, section in entry.sections.items():
            gains[section.digest] += section.length - REFERENCE - len(name)
            lengths[section.digest] = section.length
    return frozenset(digest for digest, gain in gains.items() if gain > member_bytes(lengths[digest]))


def _n_bytes(shards: Iterable[Shard]) -> int:
    total = 0
    for shard in shards:
        stored = set[str]()
        for entry in shard.entries:
            total += _size(entry, shard.stored, stored)
            stored |= {section.digest for section in entry.sections.values()} & shard.stored
    return total
