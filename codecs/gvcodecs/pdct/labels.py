"""Which cluster each vertex belongs to, as runs along the traversal over the surface.

section = [varint] runs R, [varint] length of the next block, [integers] R lengths less 1, [integers] R clusters, each the
          difference from the run before
"""

from __future__ import annotations

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Int64


def encode_labels(labels: Int64, n_clusters: int) -> bytes:
    """Return the section of ``labels (V,)``, vertices in the order of the traversal."""
    if n_clusters == 1:
        return b""
    starts = np.flatnonzero(np.diff(labels, prepend=-1))
    lengths = encode_integers(np.diff(starts, append=len(labels)) - 1)
    return varint(len(starts)) + pack_block(lengths) + encode_integers(np.diff(labels[starts], prepend=0))


def decode_labels(cursor: Cursor, n_vertices: int, n_clusters: int, name: str) -> Int64:
    """Mirror of `encode_labels`; raises `CorruptFile` where the runs do not cover the vertices, or a cluster does not exist."""
    if n_clusters == 1:
        cursor.end()
        return np.zeros(n_vertices, np.int64)
    n_runs = cursor.varint(n_vertices, "the number of runs")
    lengths = decode_integers(cursor.block(), n_runs, name=name) + 1
    clusters = np.cumsum(decode_integers(cursor.rest(), n_runs, name=name))
    if n_runs < 1 or lengths.min() < 1 or lengths.max() > n_vertices or lengths.sum() != n_vertices:
        raise cursor.corrupt("the runs of clusters do not cover the vertices")
    if clusters.min() < 0 or clusters.max() >= n_clusters:
        raise cursor.corrupt("a cluster does not exist")
    return np.repeat(clusters, lengths)
