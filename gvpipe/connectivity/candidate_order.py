"""The vertex order of a mesh <-> bytes: each vertex is one of a few candidates, which adaptive contexts predict.

Why: the successor of a vertex often lies beside the successor of its neighbour, as in rows, rings, strips and subdivided
faces. `vertex_order` counts along a search instead, which does not know what the order did before. Candidates take a quarter
less than ranks by adaptive contexts (`adaptive_order`, which readers keep for older files).

Stream: [8 bits] `MARK`; decisions (`gvpipe.entropy.decision_kernels`), as `candidate_kernels` asks for them. No table of
`vertex_order` begins with the mark: it would stand for more vertices than a mesh has.
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

MARK = 255  # first byte
MAX_VERTICES = 1 << 16  # larger meshes take too long
MAX_BYTES = 160  # per vertex, of a stream: two for each decision, at most
SECONDS_PER_VERTEX = 11e-6  # of hostile streams


def seconds_of(order: bytes, n_vertices: int) -> float:
    """What decoding section ``order`` takes beyond the mesh, seconds, at most."""
    return SECONDS_PER_VERTEX * n_vertices if order[:1] == bytes([MARK]) else 0.0


def encode_candidate_order(visits: Array, points: Array, faces: Array) -> bytes:
    """Code ``visits (V,)``, where visits[v] is the codec's vertex of the user's vertex v.

    ``points (V,)`` are the vertices' points and ``faces (T, 3)`` the triangles, in the codec's order.
    """
    from gvpipe.connectivity.candidate_kernels import code_by_candidates
    from gvpipe.entropy.decision_kernels import finish, start_encoder

    state, data = start_encoder(), np.zeros(MAX_BYTES * len(visits) + 64, np.uint8)
    code_by_candidates(*_known(points, faces), state, data, False, visits.astype(np.int64))
    return bytes([MARK]) + data[: finish(state, data)].tobytes()


def decode_candidate_order(data: bytes, points: Array, faces: Array) -> Int64:
    """Mirror of `encode_candidate_order`: ``(V,)``, always a permutation; raises `CorruptFile`."""
    from gvpipe.connectivity.candidate_kernels import code_by_candidates
    from gvpipe.entropy.decision_kernels import AHEAD, PLACE, start_decoder

    if len(points) > MAX_VERTICES:
        raise corrupt_section("order", f"{len(points)} vertices, at most {MAX_VERTICES}")
    stream, visits = np.frombuffer(bytearray(data[1:]), np.uint8), np.zeros(len(points), np.int64)  # kernels want both writable
    state = start_decoder(stream)
    fits = code_by_candidates(*_known(points, faces), state, stream, True, visits)
    if not fits or state[PLACE] != len(stream) + AHEAD:
        raise corrupt_section("order", "its decisions name no vertex order")
    return visits


def _known(points: Array, faces: Array) -> tuple[NeighbourLists, Int64, int, Mixing, Mixing]:
    """What both directions know: neighbours, points, the reach of a search, and what was learnt: nothing."""
    from gvpipe.connectivity.candidate_kernels import N_CONTEXTS, N_GROUPS, NUMBER_CONTEXTS, NUMBER_GROUPS
    from gvpipe.entropy.number_kernels import new_number_mixing

    own = np.ascontiguousarray(points, np.int64)
    lists = neighbour_lists(np.c_[own, np.zeros((len(own), 2), np.int64)], faces)
    return lists, own, REACH, new_number_mixing(N_CONTEXTS, N_GROUPS), new_number_mixing(NUMBER_CONTEXTS, NUMBER_GROUPS)
