"""Still points of codecs that code trajectories of points: one position each, in place of a trajectory.

What: the flags of the points that never move (`gvpipe.trajectory.still_vertices`), and their positions on a lattice. These are
predicted by parallelograms along a traversal of the triangles between still points. They are rounded to float32 once, so that
all frames, segments and levels of detail have the same bits. Why: no shimmer, and three numbers in place of a trajectory.
Moving points are still predicted from still neighbours: a still point's coefficients are those that bring the decoded basis
closest to its position::

    section = [float64] step, [3 x float32] origin, [varint] bytes, flags, vectors of 3 components: lattice points
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.bitstream import Bitstream
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.container.segments import LARGEST_STEP, SMALLEST_STEP
from gvpipe.foundation.arrays import Bool, Float32, Float64, Int32, Integers
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import corrupt_section
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.basis import Basis
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.coded_points import CodedConnectivity
from gvpipe.trajectory.coefficient_coding import MAX_VALUES, decode_vectors, encode_vectors
from gvpipe.trajectory.spatial_neighbours import traversal_order
from gvpipe.trajectory.still_vertices import decode_flags, encode_flags, find_still

SECTION = "still"
HEAD = struct.Struct("<d3f")
BYTES_PER_STILL, SECONDS_PER_STILL = 240, 1e-6
SECONDS_PER_PRODUCT = 1e-9


@dataclass(frozen=True)
class StillPoints:
    """Decoded still points.

    Args:
        flags: ``(P,)`` which points stand still.
        positions: ``(P, 3) float32``, model units, of the still ones; the others' mean nothing.
    """

    flags: Bool
    positions: Float32

    @property
    def n_moving(self) -> int:
        """How many points move."""
        return int((~self.flags).sum())

    @property
    def most_components(self) -> int:
        """How many components a segment may have, still points counted."""
        return MAX_VALUES // len(self.flags)

    def given(self, basis: Basis, budget: Budget = UNLIMITED) -> Float64 | None:
        """``(P, R)`` coefficients of the still points in a segment's decoded basis, in closest fit; None if all points move.

        Raises:
            CorruptFile: more than `most_components`.
            OverBudget: their trajectories take more than the file may.
        """
        from gvpipe.trajectory.still_kernels import fit_still

        if not self.flags.any():
            return None
        n_still, n_coordinates = len(self.flags) - self.n_moving, len(basis.mean)
        n_values = n_still * (2 * n_coordinates + 3 * basis.vectors.shape[1])
        what = f"coefficients of {n_still} still points over {n_coordinates // 3} frames"
        budget.ask(what, 8 * n_values, SECONDS_PER_PRODUCT * n_still * n_coordinates * basis.vectors.shape[1])
        if basis.vectors.shape[1] > self.most_components:
            size = f"{basis.vectors.shape[1]} components of {len(self.flags)} points"
            raise corrupt_section(SECTION, f"{size}")
        result = np.zeros((len(self.flags), basis.vectors.shape[1]))
        positions = self.positions[self.flags].astype(np.float64)
        result[self.flags] = fit_still(positions, basis.mean.copy(), np.ascontiguousarray(basis.vectors))
        return result

    def join(self, moving: Float64, given: Float64 | None) -> Float64:
        """``(P, R)`` coefficients of all points: those of the ``moving (Q, R)``, and those that are given."""
        if given is None:
            return moving
        result = given.copy()
        result[~self.flags] = moving
        return result

    def overwrite(self, frames: Float32, points: Integers) -> None:
        """Give the still vertices of ``frames (n, V, 3)`` their positions; ``points (V,)`` are the vertices' points."""
        where = self.flags[points]
        frames[:, where] = self.positions[points[where]]


def code_still(sequence: MeshSequence, shared: CodedConnectivity, error: float, memo: Memo) -> tuple[bytes, StillPoints]:
    """Find and code the still points of a sequence, leaving an ``error`` as in `encode_still`; no bytes if all points move."""
    flags = memo("still", lambda: find_still(sequence))[shared.members]
    if not flags.any():
        return b"", no_still(len(flags))
    positions = sequence.read(0, 1)[0, shared.members[flags]].astype(np.float64)
    return encode_still(flags, positions, error, shared.mesh.point_faces)


def read_still(bitstream: Bitstream, mesh: Topology) -> StillPoints:
    """Decode the section of a bitstream, none if it has none; raises `CorruptFile`."""
    if SECTION not in bitstream.sections:
        return no_still(mesh.n_points)
    bitstream.budget.ask(f"{mesh.n_points} still points", BYTES_PER_STILL * mesh.n_points, SECONDS_PER_STILL * mesh.n_points)
    return decode_still(bitstream.section(SECTION), mesh.point_faces, mesh.n_points)


def no_still(n_points: int) -> StillPoints:
    """What a file without the section has: all P points move."""
    return StillPoints(np.zeros(n_points, bool), np.zeros((n_points, 3), np.float32))


def encode_still(flags: Bool, positions: Float64, error: float, point_faces: Int32) -> tuple[bytes, StillPoints]:
    """Code the still points; return the bytes and what the decoder will have.

    Args:
        flags: ``(P,)``; one at least is set.
        positions: ``(S, 3)`` of the still points, model units.
        error: root mean square distance to leave, about, model units.
        point_faces: ``(T, 3)`` triangles over all points.

    Raises:
        InputError: a position is too far from the others for the error.
    """
    step = float(np.clip(2 * error, SMALLEST_STEP, LARGEST_STEP))  # rounding leaves step / sqrt(12) on each of three axes
    origin = positions.mean(axis=0).astype(np.float32)
    indices = np.rint((positions - origin) / step)
    data, _ = encode_vectors(indices, 1.0, _still_order(flags, point_faces), "navg")
    coded = encode_flags(flags)
    return HEAD.pack(step, *origin.tolist()) + pack_block(coded) + data, _round(flags, indices, step, origin)


def decode_still(data: bytes, point_faces: Int32, n_points: int) -> StillPoints:
    """Mirror of `encode_still`; raises `CorruptFile` if the bytes are not what it writes."""
    cursor = Cursor(data, SECTION)
    step, *origin = cursor.struct(HEAD)
    if not SMALLEST_STEP <= step <= LARGEST_STEP or not np.isfinite(origin).all():  # NaN neither
        raise cursor.corrupt(f"its step is {step}, its origin {origin}")
    flags = decode_flags(cursor.block(), n_points, SECTION)
    if not flags.any():
        raise cursor.corrupt("no point stands still")
    indices = decode_vectors(cursor.rest(), 3, 1.0, _still_order(flags, point_faces), SECTION, predictor="navg")
    still = _round(flags, indices, step, np.array(origin, np.float32))
    if not np.isfinite(still.positions).all():
        raise cursor.corrupt("a position is larger than float32 can hold")
    return still


def _still_order(flags: Bool, point_faces: Int32) -> CausalOrder:
    """Rows of the still points, numbered among themselves, along a traversal of the triangles between them."""
    number = np.cumsum(flags) - 1
    between = point_faces[flags[point_faces].all(axis=1)]
    return traversal_order(number[between].astype(np.int32), int(flags.sum()))


def _round(flags: Bool, indices: Float64, step: float, origin: Float32) -> StillPoints:
    """Still points at lattice points ``indices (S, 3)``, rounded to float32."""
    positions = np.zeros((len(flags), 3), np.float32)
    with np.errstate(over="ignore"):
        positions[flags] = (origin + step * indices).astype(np.float32)
    return StillPoints(flags, positions)
