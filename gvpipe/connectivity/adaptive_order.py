"""The vertex order of a mesh <-> bytes, as in `vertex_order`, with ranks that adapt.

Why: objects recur (wheels, studs, links of a chain), each numbered like the one before. A fixed table of ranks cannot
see it; contexts of earlier ranks, mixed decision by decision, take a quarter of the bytes there.

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
MAX_BYTES = 16  # per vertex, of a stream


def encode_adaptive_order(visits: Array, points: Array, faces: Array) -> bytes:
    """Code ``visits (V,)``, where visits[v] is the codec's vertex of the user's vertex v.

    ``points (V,)`` are the vertices' points and ``faces (T, 3)`` the triangles, in the codec's order.
    """
    from gvpipe.connectivity.order_kernels import code_visits
    from gvpipe.entropy.decision_kernels import finish, start_encoder

    state, data = start_encoder(), np.zeros(MAX_BYTES * len(visits) + 64, np.uint8)
    code_visits(*_known(points, faces), state, data, False, visits.astype(np.int64))
    return data[: finish(state, data)].tobytes()


def decode_adaptive_order(data: bytes, points: Array, faces: Array) -> Int64:
    """Mirror of `encode_adaptive_order`: ``(V,)``, always a permutation; raises `CorruptFile`."""
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
    """What both directions know: neighbours, points, the reach of a search, and what was learnt: nothing."""
    from gvpipe.connectivity.order_kernels import N_CONTEXTS, N_GROUPS
    from gvpipe.entropy.number_kernels import new_number_mixing

    own = np.ascontiguousarray(points, np.int64)
    lists = neighbour_lists(np.c_[own, np.zeros((len(own), 2), np.int64)], faces)
    return lists, own, REACH, new_number_mixing(N_CONTEXTS, N_GROUPS)
