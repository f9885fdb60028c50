"""Vertices that never move: found exactly, and their flags as bytes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvpipe.binary import Cursor, varint
from gvpipe.entropy import decode_integers, encode_integers
from gvpipe.sequence import MeshSequence

Bools = NDArray[np.bool_]


def find_still(sequence: MeshSequence) -> Bools:
    """Return ``(V,)`` which vertices have one position in all frames, float32 for float32; one frame alone: none."""
    first = sequence.read(0, 1)[0]
    still = np.full(sequence.n_vertices, sequence.n_frames > 1)
    for _, block in sequence.chunks():
        if not still.any():
            break
        left = np.flatnonzero(still)
        still[left] = (block[:, left] == first[left]).all(axis=(0, 2))
    return still


def encode_flags(flags: Bools) -> bytes:
    """Code ``flags (n,)``: [varint] m, then [integers] m lengths of runs, of False first; the last run is left out."""
    ends = np.flatnonzero(np.diff(flags, prepend=False))
    return varint(len(ends)) + encode_integers(np.diff(ends, prepend=0))


def decode_flags(data: bytes, n: int, name: str) -> Bools:
    """Mirror of `encode_flags`: ``(n,)``; raises `CorruptFile`."""
    cursor = Cursor(data, name)
    n_runs = cursor.varint(n, "the number of runs")
    lengths = decode_integers(cursor.rest(), n_runs, name=name)
    if (lengths < 0).any() or (lengths > n).any() or lengths.sum() >= max(n, 1) or (lengths[1:] == 0).any():
        raise cursor.corrupt("its runs do not fit")
    changes = np.zeros(n, np.int64)
    changes[np.cumsum(lengths)] = 1
    return np.asarray(np.cumsum(changes) % 2 == 1)
