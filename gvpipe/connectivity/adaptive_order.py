"""Bytes -> the vertex order of a mesh, as in `vertex_order`, with ranks that adapt. Older files have it.

Objects recur (wheels, studs, links of a chain), each numbered like the one before. A fixed table of ranks cannot see it;
contexts of earlier ranks can, mixed decision by decision. Encoders now write `candidate_order`, which is smaller.

Stream: decisions (`gvpipe.entropy.decision_kernels`), as `order_kernels` asks for them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvpipe.connectivity.vertex_order import REACH, neighbour_lists
from gvpipe.foundation.arrays import Array, Int64
from gvpipe.foundation.errors import corrupt_section

if TYPE_CHECKING:
    from gvpipe.connectivity.visit_kernels import NeighbourLists
    from gvpipe.entropy.decision_kernels import Mixing

MAX_VERTICES = 1 << 16  # larger meshes take too long


def decode_adaptive_order(data: bytes, points: Array, faces: Array) -> Int64:
    """Decode ``visits (V,)``, where visits[v] is the codec's vertex of the user's vertex v, always a permutation.

    ``points (V,)`` are the vertices' points and ``faces (T, 3)`` the triangles, in the codec's order. Raises `CorruptFile`.
    """
    from gvpipe.connectivity.order_kernels import code_visits
    from gvpipe.entropy.decision_kernels import AHEAD, PLACE, start_decoder

    if len(points) > MAX_VERTICES:
        raise corrupt_section("order", f"{len(points)} vertices, at most {MAX_VERTICES}")
    stream, visits = np.frombuffer(bytearray(data), np.uint8), np.zeros(len(points), np.int64)  # kernels want both writable
    state = start_decoder(stream)
    fits = code_visits(*_known(points, faces), state, stream, True, visits)
    if not fits or state[PLACE] != len(data) + AHEAD:
        raise corrupt_section("order", "its decisions name no vertex order")
    return visits


def _known(points: Array, faces: Array) -> tuple[NeighbourLists, Int64, int, Mixing]:
    """What a decoder knows: neighbours, points, the reach of a search, and what was learnt: nothing."""
    from gvpipe.connectivity.order_kernels import N_CONTEXTS, N_GROUPS
    from gvpipe.entropy.number_kernels import new_number_mixing

    own = np.ascontiguousarray(points, np.int64)
    lists = neighbour_lists(np.c_[own, np.zeros((len(own), 2), np.int64)], faces)
    return lists, own, REACH, new_number_mixing(N_CONTEXTS, N_GROUPS)
