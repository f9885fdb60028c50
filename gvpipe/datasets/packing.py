"""Geometry videos of a folder into shards: tar files in WebDataset's layout, the same bytes on every machine.

A sample is two members, ``KEY.mp4`` and ``KEY.json``. The files come in natural order of their paths. What several files of a
shard have in common is a member of its own, ``__shared-HASH__``, before the first of them. Owners, permissions and times are
left out, so that equal files make equal shards. A shard takes its name once it is whole.
"""

from __future__ import annotations

import glob
import io
import json
import os
import re
import tarfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

from gvpipe.container.sources import check_target
from gvpipe.datasets.card import Contents, check_card, write_card
from gvpipe.datasets.entries import look_at
from gvpipe.datasets.recorded import read_recorded
from gvpipe.datasets.sample_names import DESCRIPTION, VIDEO, is_plain, key_of, shared_name
from gvpipe.datasets.shard_plan import Shard, plan_shards
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import FormatError, InputError, OutputError
from gvpipe.foundation.progress import Progress
from gvpipe.io.frames.numbering import natural_key

SHARD_BYTES = 1_000_000_000
NUMBER = re.compile(r"%0?\d{0,2}d")


@dataclass(frozen=True)
class Packed:
    """What `pack` did.

    Args:
        shards: their paths.
        sequences: how many samples they have.
        bytes: of all shards.
        left_out: by path, why a file is in none of them, one line each.
        shared_sections: how many sections are stored once for several samples, all shards together.
    """

    shards: list[str] = field(default_factory=list)
    sequences: int = 0
    bytes: int = 0
    left_out: dict[str, str] = field(default_factory=dict)
    shared_sections: int = 0

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return asdict(self)


def pack(
    folder: StrPath,
    target: StrPath,
    *,
    shard_bytes: int = SHARD_BYTES,
    shard_sequences: int | None = None,
    share: bool = True,
    card: StrPath | None = None,
    progress: Progress | None = None,
    unlimited: bool = False,
) -> Packed:
    """Pack the geometry videos of a folder, and of the folders in it, into shards.

    Args:
        folder: with ``.mp4`` files. A ``NAME.json`` beside ``NAME.mp4``, such as labels or what
            ``gvpipe compare --json`` prints, goes into the description of the sample, below what gvpipe writes there.
        target: of the shards, ``shard-%05d.tar``, numbered from 0; without a number, all goes into one.
        shard_bytes: most bytes of a shard, unless one sample alone takes more.
        shard_sequences: most samples of a shard; None: as many as the bytes allow.
        share: whether sections that several files have in common, such as those of one connectivity, are stored once a
            shard, where that saves 1 % of the bytes. Only files of the bare layout share.
        card: of a page in Markdown that sums up the data set, for Hugging Face; None: none. In a page that is there, what
            lies between ``<!-- gvpipe: begin -->`` and ``<!-- gvpipe: end -->`` is written anew, the rest stays.
        progress: called with ``"check"``, then with ``"pack"``, and the part that is done.
        unlimited: as for `gvpipe.open`.

    Raises:
        InputError: there are no such files, two of them have one key, a limit cannot be, or the card has no such lines.
        OutputError: a shard cannot be written, or is there already. Shards that are whole stay.
    """
    pattern = os.fspath(check_path(target, "the shards"))
    card_before = "" if card is None else check_card(check_path(card, "the card"))
    _check_limits(shard_bytes=shard_bytes, shard_sequences=shard_sequences)
    left_out: dict[str, str] = {}
    place = Path(check_path(folder, "the folder of geometry videos"))
    files = _find(place, left_out)
    is_numbered = _check_pattern(pattern)
    if not is_numbered:
        shard_bytes, shard_sequences = len(files) << 40, None
    recorded = read_recorded(place)
    entries = list(look_at(files, recorded, left_out, progress, unlimited))
    plan = plan_shards(entries, shard_bytes, shard_sequences, share)
    names = [pattern % k if is_numbered else pattern for k in range(len(plan))]
    members = _Members(len(entries), left_out, progress, unlimited)
    for name, shard in zip(names, plan, strict=True):
        _write_shard(name, members.of(shard))
    if card is not None:
        packed = [json.loads(entry.description) for entry in entries if str(entry.path) not in left_out]
        together = NUMBER.sub("*", os.path.basename(pattern))
        write_card(card, card_before, Contents(names, together, packed, recorded.settings))
    sizes = sum(map(os.path.getsize, names))
    return Packed(names, members.n_packed, sizes, left_out, len(members.shared))


class _Members:
    """The members of one shard after the other, by name.

    Args:
        n_entries: of all shards.
        left_out: gets why a file is in no shard.
        progress, unlimited: as for `pack`.

    ``n_packed`` counts files, ``shared`` has the hashes of sections that were stored.
    """

    def __init__(self, n_entries: int, left_out: dict[str, str], progress: Progress | None, unlimited: bool) -> None:
        self._n_entries, self._left_out, self._progress, self._unlimited = n_entries, left_out, progress, unlimited
        self.n_packed, self.shared = 0, set[str]()

    def of(self, shard: Shard) -> Iterator[tuple[str, bytes]]:
        """Yield name and content of each member."""
        stored = set[str]()
        for entry in shard.entries:
            if self._progress:
                self._progress("pack", self.n_packed / self._n_entries)
            try:
                data, sections = entry.read(self._unlimited, shard.stored)
            except (FormatError, InputError) as exc:
                self._left_out[str(entry.path)] = str(exc)
                continue
            for digest in [digest for digest in sections if digest not in stored]:
                yield shared_name(digest), sections[digest]
            stored |= sections.keys()
            yield f"{entry.key}.{VIDEO}", data
            yield f"{entry.key}.{DESCRIPTION}", entry.description
            self.n_packed += 1
        self.shared |= stored


def _write_shard(path: str, members: Iterator[tuple[str, bytes]]) -> None:
    with unnamed_path(path) as temporary, tarfile.open(temporary, "w", format=tarfile.USTAR_FORMAT) as archive:
        for name, data in members:
            archive.addfile(_member(name, len(data)), io.BytesIO(data))


def _member(name: str, size: int) -> tarfile.TarInfo:
    """The header of a member, which depends on nothing else; the time is 0."""
    member = tarfile.TarInfo(name)
    member.size, member.mode = size, 0o644
    return member


def _find(folder: Path, left_out: dict[str, str]) -> dict[str, Path]:
    """The geometry videos of a folder by key, in natural order; hidden ones are left out, others as ``left_out`` gets told."""
    if not folder.is_dir():
        raise InputError(f"{folder} is no folder; give the one that has the .mp4 files")
    found = [path for path in folder.rglob("*") if path.suffix.lower() == f".{VIDEO}" and path.is_file()]
    relative = {path.relative_to(folder): path for path in found}
    visible = [path for path in relative if not any(part.startswith(".") for part in path.parts)]
    if not visible:
        raise InputError(f"{folder} has no .mp4 files; encode sequences into it first: gvpipe encode INPUT OUTPUT.mp4")
    files: dict[str, Path] = {}
    for path in sorted(visible, key=lambda path: natural_key(path.as_posix())):
        key = key_of(PurePosixPath(path.as_posix()))
        if not is_plain(key):
            left_out[str(relative[path])] = (
                f"{relative[path]}: its name has characters that a shard's member may not have; rename it"
            )
            continue
        if key in files:
            raise InputError(
                f"{files[key]} and {relative[path]} both have the key {key!r}, since keys have no dots; rename one"
            )
        files[key] = relative[path]
    return files


def _check_limits(**limits: object) -> None:
    for name, value in limits.items():
        if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
            raise InputError(f"{name} is {value!r}; a whole number of 1 or more is needed")


def _check_pattern(pattern: str) -> bool:
    """Whether the shards are numbered; raises `InputError`, `OutputError` for names that cannot be."""
    check_target(pattern)
    numbers = NUMBER.findall(pattern)
    if not pattern.lower().endswith(".tar") or len(numbers) > 1 or pattern.count("%") != len(numbers):
        raise InputError(f"{pattern}: shards are tar files with one number at most; name them like shard-%05d.tar")
    parent = Path(pattern).parent
    if not parent.is_dir():
        raise OutputError(f"cannot write {pattern}: no folder {parent}; create it first")
    before, _, behind = pattern.partition(numbers[0]) if numbers else (pattern, "", "")
    there = sorted(glob.glob(f"{glob.escape(before)}*{glob.escape(behind)}" if numbers else glob.escape(pattern)))
    taken = [path for path in there if not numbers or path[len(before) : len(path) - len(behind)].isdecimal()]
    if taken:
        raise OutputError(f"cannot write {pattern}: {taken[0]} is there already; remove the old shards or choose another name")
    return bool(numbers)
