"""The chart of every point as bytes: most points lie in the chart of their neighbours.

Points are visited in the codec's order. The charts of a point's causal neighbours are listed, most frequent first
(`chart_kernels`). The rank of the point's own chart in that list is coded. One that is not listed is signalled by number:
charts are numbered as they first occur::

    section = [varint] length, [integers] rank of each point, in the context of min(causal neighbours, 4);
              [varint] count, [integers] for each point whose rank is its list's length: 0 for a new chart, else how many
              charts ago its own first occurred
"""

from __future__ import annotations

import numpy as np

from gvcodecs.mcgv.base.causal_neighbours import CausalNeighbours
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Int64, Integers

SECTION = "charts"
CONTEXTS = 5


def number_charts(charts: Integers) -> Int64:
    """Return ``charts (P,)`` numbered as they first occur."""
    _, first, own = np.unique(charts, return_index=True, return_inverse=True)
    return np.asarray(np.argsort(np.argsort(first))[own.ravel()])


def encode_charts(charts: Int64, causal: CausalNeighbours) -> bytes:
    """Return the section for ``charts (P,)`` of `number_charts`, given the points' causal neighbours."""
    from gvcodecs.mcgv.layout.chart_kernels import describe

    ranks, numbers = np.empty(len(charts), np.int64), np.empty(len(charts), np.int64)
    count = describe(causal.starts, causal.neighbours, charts, ranks, numbers)
    first = encode_integers(ranks, _contexts(causal))
    return pack_block(first) + varint(count) + encode_integers(numbers[:count])


def decode_charts(data: bytes, causal: CausalNeighbours) -> Int64:
    """Mirror of `encode_charts`; raises `CorruptFile` where a point's chart makes no sense."""
    from gvcodecs.mcgv.layout.chart_kernels import restore

    cursor = Cursor(data, SECTION)
    n_points = len(causal.starts) - 1
    ranks = decode_integers(cursor.block(), n_points, _contexts(causal), SECTION)
    count = cursor.varint(n_points, "the number of charts told by number")
    numbers = decode_integers(cursor.rest(), count, name=SECTION)
    charts = np.empty(n_points, np.int64)
    wrong = restore(causal.starts, causal.neighbours, ranks, numbers, charts)
    if wrong >= 0:
        raise cursor.corrupt(f"the chart of point {wrong} makes no sense")
    return charts


def _contexts(causal: CausalNeighbours) -> Int64:
    return np.asarray(np.minimum(np.diff(causal.starts), CONTEXTS - 1))
