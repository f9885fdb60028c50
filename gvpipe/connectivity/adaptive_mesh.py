"""Triangles and lattice positions of points <-> bytes, as in `base_mesh`, with positions that adapt.

Draco codes connectivity alone (`topology_only`); positions follow, in the order of `gvpipe.mesh.entry_kernels`. Why: objects
recur, and grids are regular. What followed the last residuals before, and coordinates that were seen before, predict the next
ones, where Draco has one table for all. A *fitted* stream has a forecast of each position beside (`fitted_kernels`). It is
smaller, and takes three times as long as one without (`position_kernels`).

Stream: [varint] P; blocks: Draco's stream, merges, loose triangles; [varint] loose triangles; decisions
(`gvpipe.entropy.decision_kernels`) to the end.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gvpipe.connectivity.base_mesh import MAX_PER_BYTE, check_draco_header
from gvpipe.connectivity.topology_only import CodedTriangles, decode_triangles, encode_triangles
from gvpipe.connectivity.vertex_order import MAX_VERTICES
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.foundation.arrays import Array, Int32, Int64
from gvpipe.mesh.topology import opposite_corners

if TYPE_CHECKING:
    from gvpipe.entropy.decision_kernels import Mixing
    from gvpipe.mesh.entry_kernels import EntryOrder

MAX_POINTS = 1 << 15  # larger meshes take too long
MAX_BYTES = 24  # per point, of a stream


def encode_adaptive_mesh(
    points: Array, faces: Array, is_fitted: bool = True, triangles: CodedTriangles | None = None
) -> tuple[bytes, Array, Array]:
    """Code lattice ``points (P, 3)``, 0..2**31 - 1, with triangles ``faces (T, 3)``; ``is_fitted``: with a forecast.

    ``triangles`` are those of `encode_triangles`, if they are coded already.

    Returns:
        The stream, the given point ``(P,)`` of each decoded one, and the decoded triangles.
    """
    from gvpipe.connectivity.fitted_kernels import code_fitted
    from gvpipe.connectivity.position_kernels import code_positions
    from gvpipe.entropy.decision_kernels import finish, start_encoder

    parts, permutation, coded = triangles or encode_triangles(faces.astype(np.int64), len(points))
    state, data = start_encoder(), np.zeros(MAX_BYTES * len(points) + 64, np.uint8)
    moved = np.ascontiguousarray(points[permutation], np.int64)
    if is_fitted:
        code_fitted(*_known(coded, len(points)), state, data, False, moved)
    else:
        code_positions(*_known_unfitted(coded, len(points)), state, data, False, moved)
    head = [varint(len(points)), *map(pack_block, parts[:3]), varint(parts[3])]
    return b"".join([*head, data[: finish(state, data)].tobytes()]), permutation, coded


def decode_adaptive_mesh(
    stream: bytes, n_vertices: int = MAX_POINTS, n_triangles: int = 2 * MAX_VERTICES, is_fitted: bool = True
) -> tuple[Int64, Array]:
    """Mirror of `encode_adaptive_mesh`: points ``(P, 3)``, at most ``n_vertices``, and triangles, at most ``n_triangles``.

    Raises:
        CorruptFile: malformed, or larger.
    """
    from gvpipe.connectivity.fitted_kernels import code_fitted
    from gvpipe.connectivity.position_kernels import code_positions
    from gvpipe.entropy.decision_kernels import AHEAD, PLACE, start_decoder

    cursor = Cursor(stream, "mesh")
    n_points = cursor.varint(min(MAX_POINTS, n_vertices), "the number of points")
    draco, merges, loose = cursor.block(), cursor.block(), cursor.block()
    check_draco_header(draco, n_triangles)
    n_loose = cursor.varint(min(n_triangles, MAX_PER_BYTE * len(stream)), "the number of loose triangles")
    faces = decode_triangles(draco, merges, loose, n_loose)
    if faces.size and (faces.min() < 0 or faces.max() >= n_points):
        raise cursor.corrupt("a triangle names a point that does not exist")
    data = np.frombuffer(bytearray(cursor.rest()), np.uint8)  # kernels want it writable
    state, points = start_decoder(data), np.zeros((n_points, 3), np.int64)
    if is_fitted:
        fits = code_fitted(*_known(faces, n_points), state, data, True, points)
    else:
        fits = code_positions(*_known_unfitted(faces, n_points), state, data, True, points)
    if not fits or state[PLACE] != len(data) + AHEAD:
        raise cursor.corrupt("its decisions name no positions")
    return points, faces


def _known(faces: Array, n_points: int) -> tuple[EntryOrder, Int32, Int64, Mixing]:
    """The order of points, triangles, their opposite corners, and what was learnt of positions: nothing."""
    from gvpipe.connectivity.fitted_kernels import N_CONTEXTS, N_GROUPS
    from gvpipe.entropy.forecast_kernels import new_forecast_mixing
    from gvpipe.mesh.entry_kernels import order_by_corners

    triangles = np.ascontiguousarray(faces, np.int32)
    opposite = opposite_corners(triangles)
    order = order_by_corners(triangles, opposite, n_points)
    return order, triangles, opposite, new_forecast_mixing(N_CONTEXTS, N_GROUPS)


def _known_unfitted(faces: Array, n_points: int) -> tuple[EntryOrder, Mixing]:
    """The same without a forecast."""
    from gvpipe.connectivity.position_kernels import N_CONTEXTS, N_GROUPS
    from gvpipe.entropy.number_kernels import new_number_mixing

    return _known(faces, n_points)[0], new_number_mixing(N_CONTEXTS, N_GROUPS)
