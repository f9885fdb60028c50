"""``gvpipe encode --live``: frames on standard input become a file while they come."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import IO, Any

import numpy as np

from gvpipe.cli.pipes import PIPE, STDIN
from gvpipe.cli.process import Ended
from gvpipe.foundation.arrays import Float32
from gvpipe.foundation.errors import InputError

BYTES_PER_VERTEX = 12
CODEC = "pdct"


@dataclass(frozen=True)
class LiveReport:
    """What was written."""

    output: str
    codec: str
    vertices: int
    triangles: int
    frames: int
    fps: float
    bytes: int


def encode_live(
    sources: tuple[str, ...],
    target: str,
    mesh: str | None,
    fps: float | None,
    codec: str | None,
    settings: Mapping[str, str],
) -> LiveReport:
    """Write a file of the frames on standard input, float32 positions ``(V, 3)`` each, until that ends.

    Args:
        sources: ``-`` alone.
        target: the ``.mp4``.
        mesh: a file with the triangles and as many vertices as frames have.
        fps: frames per second; None: the mesh file's.
        codec: its id; None: ``pdct``.
        settings: of the codec, as texts.

    Raises:
        InputError: something else is given, the mesh cannot be read, or standard input ends inside a frame.
        OutputError: the file cannot be written.
    """
    from gvpipe.coding.registry import codec_class
    from gvpipe.playback.files import read
    from gvpipe.playback.live import open_live

    if sources != (PIPE,) or target == PIPE:
        raise InputError(f"--live reads frames on {STDIN} and writes a file: gvpipe encode --live --mesh body.obj - OUTPUT.mp4")
    if mesh is None:
        raise InputError("--live reads positions alone; give a file with the triangles by --mesh")
    if sys.stdin.isatty():
        raise InputError(f"{STDIN} is a terminal; pipe frames into it, float32 positions of all vertices each")
    sequence = read(mesh)
    made = codec_class(codec or CODEC).from_texts(settings)
    given: dict[str, Any] = {key: getattr(made, key) for key in settings}
    live = open_live(target, sequence.faces, sequence.fps if fps is None else fps, codec or CODEC, **given)
    try:
        with live:
            for frame in read_frames(sys.stdin.buffer, sequence.n_vertices):
                live.append(frame)
    except InputError as exc:
        if not live.n_written:
            raise
        raise InputError(f"{exc}; {target} is finished, with the {live.n_written} frames before") from exc
    except (KeyboardInterrupt, Ended) as exc:
        if live.n_written:
            exc.add_note(f"{target} is finished, with the {live.n_written} frames before")
        raise
    if not live.n_frames:
        raise InputError(f"{STDIN} is empty; pipe frames into it, {BYTES_PER_VERTEX * sequence.n_vertices} bytes each")
    counts = (sequence.n_vertices, len(sequence.faces), live.n_frames, live.fps)
    return LiveReport(target, codec or CODEC, *counts, os.path.getsize(target))


def read_frames(file: IO[bytes], n_vertices: int) -> Iterator[Float32]:
    """Yield frames ``(V, 3)`` of a stream of little-endian float32, each as soon as it is there; raises `InputError`."""
    size, count = BYTES_PER_VERTEX * n_vertices, 0
    while data := file.read(size):
        if len(data) < size:
            raise InputError(
                f"{STDIN} ends after {len(data)} of the {size} bytes of frame {count}: {n_vertices} vertices, as --mesh has"
            )
        yield np.frombuffer(data, "<f4").reshape(n_vertices, 3)
        count += 1
