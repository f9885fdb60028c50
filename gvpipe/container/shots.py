"""Bitstreams to the file of a capture: each shot is a file of its own, and what several have in common is stored once."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.companion import Companion
from gvpipe.container.mp4 import bytes_by_part, file_bytes
from gvpipe.container.segments import SegmentParts
from gvpipe.container.shared_sections import section_hash
from gvpipe.container.shot_layout import ShotFile, ShotIndex, pack_shots
from gvpipe.foundation.atomic import unnamed_path

LEAST_SHARED = 64  # bytes of a section that is shared: its hash takes 35


@dataclass(frozen=True)
class WrittenShots:
    """Bytes of a file, of each shot in it, and of its sections by name; what shots share counts once."""

    size: int
    n_bytes: list[int]
    sections: dict[str, int]


def write_shots(
    path: str | os.PathLike[str],
    poster: bytes,
    shots: Sequence[Bitstream],
    fps: float,
    parts: Mapping[int, SegmentParts] | None = None,
    companions: Sequence[Companion] = (),
    box: Sequence[float] | None = None,
) -> WrittenShots:
    """Write a capture, all of it or nothing.

    Args:
        path: of the file.
        poster: an MP4 with what ordinary players show.
        shots: in order, of one rate.
        fps: the rate, frames per second.
        parts: of shots that are written in the stream layout, what each segment has; the others get the bare one.
        companions: tracks beside the video, of the whole film.
        box: that the motion stays in, as of `ShotIndex`; None: that of the shots' first frames.

    Raises:
        OutputError: the file cannot be written; an older file of that name is left as it was.
    """
    packed = pack_row(poster, shots, fps, parts, companions, box)
    size = _write(path, packed.data)
    return WrittenShots(size, packed.n_bytes, packed.sections)


@dataclass(frozen=True)
class PackedShots:
    """The parts of a capture's file, bytes of each shot in it, and of its sections by name."""

    data: Iterable[bytes]
    n_bytes: list[int]
    sections: dict[str, int]


def pack_row(
    poster: bytes,
    shots: Sequence[Bitstream],
    fps: float,
    parts: Mapping[int, SegmentParts] | None = None,
    companions: Sequence[Companion] = (),
    box: Sequence[float] | None = None,
) -> PackedShots:
    """The file that `write_shots` would write."""
    parts = parts or {}
    hashes = [_hashes(shot) if number not in parts else {} for number, shot in enumerate(shots)]
    counts = Counter(digest for found in hashes for digest in set(found.values()))
    shared: dict[str, bytes] = {}
    files: list[ShotFile] = []
    sections = Counter[str]()
    for number, (shot, found) in enumerate(zip(shots, hashes, strict=True)):
        left_out = {name: digest for name, digest in found.items() if counts[digest] > 1}
        own = {name: len(data) for name, data in shot.sections.items() if left_out.get(name) not in shared}
        sections.update(own)
        sections["video"] += bytes_by_part(shot, 0).get("video", 0)
        for companion in shot.companions:
            sections[companion.kind] += companion.n_bytes
        shared |= {digest: shot.sections[name] for name, digest in left_out.items()}
        bare = replace(shot, is_bare=True)
        data = file_bytes(shot, parts[number]) if number in parts else file_bytes(bare, shared=left_out)
        files.append(ShotFile(data, shot.n_frames, shot.n_vertices, shot.n_triangles))
    for companion in companions:
        sections[companion.kind] += companion.n_bytes
    packed = pack_shots(poster, files, shared, fps, companions, box or _box(shots))
    n_bytes = [len(file.data) for file in files]
    return PackedShots(packed, n_bytes, {name: number for name, number in sections.items() if number})


def copy_shots(index: ShotIndex, path: str | os.PathLike[str], companions: Sequence[Companion]) -> int:
    """Write a capture again, with other companions; return the file's bytes.

    Raises:
        OutputError: the file cannot be written; an older file of that name is left as it was.
        FormatError: the capture is damaged.
    """
    poster = index.head + index.source.read(*index.poster)
    columns = zip(index.frames, index.vertices, index.triangles, strict=True)
    files = [ShotFile(index.source.read(index.offsets[k], index.n_bytes[k]), *counts) for k, counts in enumerate(columns)]
    shared = {digest: index.find(digest) for digest in index.shared}
    return _write(path, pack_shots(poster, files, shared, index.fps, companions, index.box))


def _write(path: str | os.PathLike[str], parts: Iterable[bytes]) -> int:
    size = 0
    with unnamed_path(path) as temporary, open(temporary, "wb") as file:
        for part in parts:
            size += file.write(part)
    return size


def _hashes(shot: Bitstream) -> dict[str, str]:
    return {name: section_hash(data) for name, data in shot.sections.items() if len(data) >= LEAST_SHARED}


def _box(shots: Sequence[Bitstream]) -> list[float] | None:
    """Smallest and largest corner of the shots' first frames, relative to the first's origin; None if a shot has no outline."""
    first, corners = shots[0].origin, []
    for shot in shots:
        if shot.outline is None:
            return None
        shift = [own - other for own, other in zip(shot.origin, first, strict=True)] * 2
        corners.append([float(value + by) for value, by in zip(shot.outline.box, shift, strict=True)])
    low, high = (list(map(choose, zip(*corners, strict=True))) for choose in (min, max))
    return low[:3] + high[3:]
