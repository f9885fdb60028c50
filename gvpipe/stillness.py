"""Vertices that never move: which they are, and their flags as bytes.

A vertex is still if it has one position in all frames, each coordinate compared exactly. A codec that signals still vertices
codes one position of each and returns it in every frame: nothing shimmers, and stillness costs hardly a bit.

Flags are coded as run lengths, since still vertices are neighbours along the surface::

    flags = [varint] runs R, [integers] R lengths: moving, still, moving, ...; the first may be 0, all others are 1 at least
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.binary import Cursor, varint
from gvpipe.entropy import decode_integers, encode_integers
from gvpipe.sequence import MeshSequence

Flags = NDArray[np.bool_]


def find_still(sequence: MeshSequence) -> Flags:
    """Flags ``(V,)`` of the vertices that stand still in all frames; none of a sequence of one frame, where nothing can move.

    Frames are read once, a chunk at a time, and no further than to the chunk in which the last vertex has moved.
    """
    still = np.full(sequence.n_vertices, sequence.n_frames > 1)
    first: NDArray[np.float32] | None = None
    for _, chunk in sequence.chunks():
        first = chunk[0].copy() if first is None else first
        still[still] = (chunk[:, still] == first[still]).all(axis=(0, 2))
        if not still.any():
            break
    return still


def encode_flags(flags: Flags) -> bytes:
    """Code ``flags (n,)``."""
    changes = np.flatnonzero(np.diff(flags, prepend=False))  # where runs after the first begin
    lengths = np.diff(np.concatenate([[0], changes, [len(flags)]]))
    return varint(len(lengths)) + encode_integers(lengths)


def decode_flags(data: bytes, n: int, name: str) -> Flags:
    """Mirror of `encode_flags`: ``(n,)``; raises `CorruptFile`, naming the section, for bytes that it does not write."""
    cursor = Cursor(data, name)
    n_runs = cursor.varint(n + 1, "the number of runs")
    lengths = decode_integers(cursor.rest(), n_runs, name=name)
    if lengths.min(initial=1) < 0 or (lengths[1:] == 0).any() or lengths.max(initial=0) > n or int(lengths.sum()) != n:
        raise cursor.corrupt(f"its runs do not fit {n} flags")
    return np.repeat(np.arange(n_runs) % 2 == 1, lengths)
