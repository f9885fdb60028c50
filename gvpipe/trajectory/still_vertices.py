"""Vertices that never move: which they are, and their flags as bytes.

A vertex is still if it has one position in all frames, each coordinate compared exactly. A codec that signals still vertices
codes one position of each and returns it in every frame: nothing shimmers, and stillness costs hardly a bit.

Flags are coded as run lengths, since still vertices are neighbours along the surface::

    flags = [varint] m, [integers] m lengths: moving, still, moving, ...; the first may be 0; the last run is left out
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Bool
from gvpipe.model.sequence import MeshSequence


def find_still(sequence: MeshSequence) -> Bool:
    """Flags ``(V,)`` of the vertices that stand still in all frames; none of a sequence of one frame, where nothing can move.

    Frames are read once, a chunk at a time, and no further than to the chunk in which the last vertex has moved.
    """
    still = np.full(sequence.n_vertices, sequence.n_frames > 1)
    first = sequence.read(0, 1)[0]
    for _, block in sequence.chunks():
        if not still.any():
            break
        left = np.flatnonzero(still)
        still[left] = (block[:, left] == first[left]).all(axis=(0, 2))
    return still


def encode_flags(flags: Bool) -> bytes:
    """Return the bytes of ``flags (n,)``.

    Examples:
        >>> decode_flags(encode_flags(np.array([False, True, True])), 3, "example").tolist()
        [False, True, True]
    """
    ends = np.flatnonzero(np.diff(flags, prepend=False))
    return varint(len(ends)) + encode_integers(np.diff(ends, prepend=0))


def decode_flags(data: bytes, n: int, name: str) -> Bool:
    """Mirror of `encode_flags`: ``(n,)``; raises `CorruptFile`, naming the section, for bytes that it does not write."""
    cursor = Cursor(data, name)
    n_runs = cursor.varint(n, "the number of runs")
    lengths = decode_integers(cursor.rest(), n_runs, name=name)
    if (lengths < 0).any() or (lengths > n).any() or lengths.sum() >= max(n, 1) or (lengths[1:] == 0).any():
        raise cursor.corrupt(f"its runs do not fit {n} flags")
    changes = np.zeros(n, np.int64)
    changes[np.cumsum(lengths)] = 1
    return np.asarray(np.cumsum(changes) % 2 == 1)
