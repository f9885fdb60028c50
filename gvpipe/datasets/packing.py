"""Geometry videos of a folder into shards: tar files in WebDataset's layout, the same bytes on every machine.

A sample is two members, ``KEY.mp4`` and ``KEY.json``. The files come in natural order of their paths. Owners, permissions and
times are left out, so that equal files make equal shards. A shard takes its name once it is whole.
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

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.mp4 import read_bytes
from gvpipe.container.sources import check_target
from gvpipe.datasets.sample_names import DESCRIPTION, VIDEO, is_plain, key_of
from gvpipe.foundation.arguments import StrPath, check_path
from gvpipe.foundation.atomic import unnamed_path
from gvpipe.foundation.errors import FormatError, InputError, OutputError
from gvpipe.foundation.isolation.plain_files import open_plain
from gvpipe.foundation.progress import Progress
from gvpipe.io.frames.numbering import natural_key

SHARD_BYTES = 1_000_000_000
BLOCK = tarfile.BLOCKSIZE
END = 2 * BLOCK  # bytes that mark the end of a shard, before it is filled up
NUMBER = re.compile(r"%0?\d{0,2}d")
MAX_DESCRIPTION = 1 << 20  # bytes of a file's own JSON


@dataclass(frozen=True)
class Packed:
    """What `pack` did.

    Args:
        shards: their paths.
        sequences: how many samples they have.
        bytes: of all shards.
        left_out: by path, why a file is in none of them, one line each.
    """

    shards: list[str] = field(default_factory=list)
    sequences: int = 0
    bytes: int = 0
    left_out: dict[str, str] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The same as JSON values."""
        return asdict(self)


def pack(
    folder: StrPath,
    target: StrPath,
    *,
    shard_bytes: int = SHARD_BYTES,
    shard_sequences: int | None = None,
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
        progress: called with ``"pack"`` and the part that is done.
        unlimited: as for `gvpipe.open`.

    Raises:
        InputError: there are no such files, two of them have one key, or a limit cannot be.
        OutputError: a shard cannot be written, or is there already. Shards that are whole stay.
    """
    pattern = os.fspath(check_path(target, "the shards"))
    for name, value in (("shard_bytes", shard_bytes), ("shard_sequences", shard_sequences)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
            raise InputError(f"{name} is {value!r}; a whole number of 1 or more is needed")
    left_out: dict[str, str] = {}
    files = _find(Path(check_path(folder, "the folder of geometry videos")), left_out)
    is_numbered = _check_pattern(pattern)
    if not is_numbered:
        shard_bytes, shard_sequences = len(files) << 40, None
    samples = _Ahead(_samples(files, left_out, progress, unlimited))
    shards: list[str] = []
    while samples.has_next():
        shards.append(pattern % len(shards) if is_numbered else pattern)
        _write_shard(shards[-1], samples, shard_bytes, shard_sequences)
    return Packed(shards, samples.n_taken, sum(map(os.path.getsize, shards)), left_out)


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


@dataclass(frozen=True)
class _Sample:
    """A sample's members by name."""

    members: dict[str, bytes]

    @property
    def n_bytes(self) -> int:
        """Bytes in a shard: of headers, and of contents that fill blocks."""
        return sum(BLOCK + len(data) + -len(data) % BLOCK for data in self.members.values())


class _Ahead:
    """Samples one after the other; the next can be looked at."""

    def __init__(self, samples: Iterator[_Sample]) -> None:
        self._samples, self._next, self.n_taken = samples, next(samples, None), 0

    def has_next(self, room: float = float("inf")) -> bool:
        """Whether there is a sample of at most so many bytes."""
        return self._next is not None and self._next.n_bytes <= room

    def take(self) -> _Sample:
        """Return the next; there must be one."""
        sample, self._next = self._next, next(self._samples, None)
        assert sample is not None
        self.n_taken += 1
        return sample


def _write_shard(path: str, samples: _Ahead, most_bytes: int, most: int | None) -> None:
    """Write samples until a limit, the first in any case."""
    with unnamed_path(path) as temporary, tarfile.open(temporary, "w", format=tarfile.USTAR_FORMAT) as archive:
        n, n_bytes = 0, END
        while samples.has_next(most_bytes - n_bytes if n else float("inf")) and (most is None or n < most):
            sample = samples.take()
            n, n_bytes = n + 1, n_bytes + sample.n_bytes
            for name, data in sample.members.items():
                archive.addfile(_member(name, len(data)), io.BytesIO(data))


def _member(name: str, size: int) -> tarfile.TarInfo:
    """The header of a member, which depends on nothing else; the time is 0."""
    member = tarfile.TarInfo(name)
    member.size, member.mode = size, 0o644
    return member


def _samples(files: dict[str, Path], left_out: dict[str, str], progress: Progress | None, unlimited: bool) -> Iterator[_Sample]:
    for k, (key, path) in enumerate(files.items()):
        if progress:
            progress("pack", k / len(files))
        try:
            with open_plain(path, follows=False) as file:
                data = file.read()
            description = {**_beside(path), **describe(read_bytes(data, str(path), unlimited))}
            text = _as_json(description, path)
            _member(f"{key}.{DESCRIPTION}", 0).tobuf(tarfile.USTAR_FORMAT)
        except (FormatError, InputError) as exc:
            left_out[str(path)] = str(exc)
        except OSError as exc:
            left_out[str(path)] = f"{path} cannot be read: {exc.strerror or exc}; check its permissions"
        except ValueError:
            left_out[str(path)] = f"{path}: its path is too long for a tar file; choose a shorter name"
        else:
            yield _Sample({f"{key}.{VIDEO}": data, f"{key}.{DESCRIPTION}": text})


def _beside(path: Path) -> dict[str, Any]:
    """The JSON object beside a file; empty if there is none."""
    beside = path.with_suffix(f".{DESCRIPTION}")
    if not os.path.lexists(beside):
        return {}
    with open_plain(beside, follows=False) as file:
        data = file.read(MAX_DESCRIPTION + 1)
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
