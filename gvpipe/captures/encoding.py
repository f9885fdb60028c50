"""A capture to a geometry video: each shot is coded as a sequence is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gvpipe.coding.codec import Codec
from gvpipe.coding.registry import segment_parts
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.companion import Companion
from gvpipe.container.shots import WrittenShots, write_shots
from gvpipe.foundation.arguments import StrPath
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import GvpipeError
from gvpipe.foundation.progress import Progress
from gvpipe.model.capture import Capture
from gvpipe.model.sequence import MeshSequence
from gvpipe.rendering.poster import make_poster, poster_of

STREAMED_FRAMES = 256  # of a shot that is written in the stream layout, where that is asked for; shorter ones load as a whole


@dataclass(frozen=True)
class CodedShot:
    """A shot's bitstream, the codec that made it, notes, and names of what it leaves out."""

    bitstream: Bitstream
    codec: Codec
    notes: list[str]
    not_carried: list[str]


@dataclass(frozen=True)
class WrittenCapture:
    """The file of a capture.

    Args:
        coded: its shots.
        written: bytes of the file and of its parts.
        shots: ``start``, ``frames``, ``vertices``, ``triangles``, ``codec`` and ``bytes`` of each.
    """

    coded: list[CodedShot]
    written: WrittenShots
    shots: list[dict[str, Any]]

    @property
    def n_samples(self) -> int:
        """Vertices of all frames together."""
        return sum(row["vertices"] * row["frames"] for row in self.shots)

    @property
    def notes(self) -> list[str]:
        """What a user should know, each line once."""
        return list(dict.fromkeys(note for shot in self.coded for note in shot.notes))

    @property
    def not_carried(self) -> list[str]:
        """What the shots leave out, each name once."""
        return list(dict.fromkeys(name for shot in self.coded for name in shot.not_carried))


def write_capture(
    capture: Capture,
    path: StrPath,
    code: Callable[[int, MeshSequence, Progress], CodedShot],
    progress: Progress,
    is_stream: bool = False,
    companions: Sequence[Companion] = (),
) -> WrittenCapture:
    """Code each shot and write them as one file, all of it or nothing.

    Args:
        capture: its shots.
        path: of the file.
        code: codes one of them, given its number.
        progress: called with a stage's name and the part of the whole that is done.
        companions: tracks beside the video.
        is_stream: whether long shots are written so that a jump in them loads a segment alone.

    Raises:
        InputError: a shot cannot be coded; the message names it.
        OutputError: the file cannot be written; no part of it is left.
    """
    count, first = len(capture.shots), capture.shots[0]
    poster = make_poster(first.read(0, 1)[0], first.faces, capture.fps, len(capture))
    coded: list[CodedShot] = []
    corners: list[Float64] = []
    for number, shot in enumerate(capture.shots):
        try:
            found = code(number, shot, lambda stage, done, number=number: progress(stage, (number + done) / count))  # type: ignore[misc]
        except GvpipeError as exc:
            _name(exc, capture, number)
            raise
        if is_stream and len(shot) >= STREAMED_FRAMES:
            bitstream = replace(found.bitstream, is_bare=False, video=found.bitstream.video or poster_of(shot))
            found = replace(found, bitstream=bitstream)
        coded.append(found)
        corners += [corner + shot.origin for corner in _corners(shot)]
    bitstreams = [shot.bitstream for shot in coded]
    parts = {number: segment_parts(each) for number, each in enumerate(bitstreams) if not each.is_bare}
    progress("write", 0.0)
    low, high = (choose(corners, axis=0) - first.origin for choose in (np.min, np.max))
    box = [*low.tolist(), *high.tolist()]
    written = write_shots(path, poster, bitstreams, capture.fps, parts, companions, box)
    rows = [
        {
            "start": start,
            "frames": shot.bitstream.n_frames,
            "vertices": shot.bitstream.n_vertices,
            "triangles": shot.bitstream.n_triangles,
            "codec": shot.codec.id,
            "bytes": n_bytes,
        }
        for start, shot, n_bytes in zip(capture.starts, coded, written.n_bytes, strict=True)
    ]
    return WrittenCapture(coded, written, rows)


def _corners(shot: MeshSequence) -> list[Float64]:
    """The smallest and the largest corner of the motion, relative to the shot's origin."""
    ends = [(chunk.min(axis=(0, 1)), chunk.max(axis=(0, 1))) for _, chunk in shot.chunks()]
    corners = np.array(ends, np.float64)  # (chunks, 2, 3)
    return [corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)]


def _name(exc: GvpipeError, capture: Capture, number: int) -> None:
    """Let an error's message say which shot it is about."""
    if len(capture.shots) > 1 and exc.args:
        start = capture.starts[number]
        where = f"shot {number} (frames {start} to {start + capture.lengths[number] - 1})"
        exc.args = (f"{where}: {exc.args[0]}", *exc.args[1:])
