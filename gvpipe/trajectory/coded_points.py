"""Sequences as trajectories: welded points, their connectivity and spread, and the trajectories of a segment.

Vertices with one trajectory (seams, triangle soups) are one point, coded once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.coding.codec import Memo
from gvpipe.coding.quality_scale import error_of
from gvpipe.connectivity.base_mesh import EncodedMesh
from gvpipe.connectivity.topology_only import Topology, encode_mesh
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.foundation.progress import Progress
from gvpipe.metrics.vertex_errors import measure_spread
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.basis import Basis, row_blocks, squared_errors
from gvpipe.trajectory.welding import find_points


@dataclass(frozen=True)
class CodedConnectivity:
    """A sequence's connectivity as it is coded, and the points whose trajectories are still to be.

    Args:
        coded: the mesh's sections.
        mesh: as the decoder will have it.
        members: ``(P,)`` a given vertex of each of the mesh's points.
        spread: of the vertices, model units (`gvpipe.metrics.vertex_errors.measure_spread`).
    """

    coded: EncodedMesh
    mesh: Topology
    members: Int64
    spread: float

    def target_error(self, quality: float) -> float:
        """Root mean square error of a vertex, model units, that a quality asks for (`gvpipe.coding.quality_scale`)."""
        return self.spread * error_of(quality) / 100


def code_connectivity(sequence: MeshSequence, reorder: bool, memo: Memo, report: Progress) -> CodedConnectivity:
    """Find a sequence's points and code its mesh; ``reorder`` lets the decoder see the codec's vertex order."""
    report("read", 0)
    spread = memo("spread", lambda: measure_spread(sequence))
    points = memo("points", lambda: find_points(sequence))
    report("mesh", 0)
    coded, mesh = memo("mesh", lambda: encode_mesh(sequence.faces, points, reorder))
    _, first = np.unique(mesh.points, return_index=True)
    return CodedConnectivity(coded, mesh, coded.permutation[first], spread)


def read_trajectories(sequence: MeshSequence, start: int, stop: int, members: Int64) -> Float64:
    """Trajectories of the vertices ``members (P,)`` from frame ``start`` to ``stop``: ``(P, 3n)``, n frames, model units."""
    result = np.empty((len(members), stop - start, 3))
    for first, block in sequence.chunks(start, stop):
        result[:, first - start : first - start + len(block)] = block[:, members].swapaxes(0, 1)
    return result.reshape(len(members), -1)  # (P, n, 3) -> (P, 3n)


def sum_squared_errors(
    sequence: MeshSequence, span: tuple[int, int], members: Int64, copies: Int64, basis: Basis, coefficients: Float64
) -> float:
    """Squared error of a segment's vertices, summed over its frames, squared model units, a block of points at a time.

    Args:
        sequence: that is coded.
        span: first frame, and the one after the last.
        members: ``(P,)`` a vertex of each point.
        copies: ``(P,)`` how many vertices each point has.
        basis: decoded, of the segment's frames.
        coefficients: ``(P, R)`` decoded.
    """
    start, stop = span
    total = 0.0
    for first, block in sequence.chunks(start, stop):
        axes = slice(3 * (first - start), 3 * (first - start + len(block)))
        part = Basis(basis.mean[axes], basis.vectors[axes])
        for points in row_blocks(len(members)):
            trajectories = block[:, members[points]].swapaxes(0, 1).reshape(-1, 3 * len(block))
            total += float((squared_errors(trajectories, part, coefficients[points]) * copies[points]).sum())
    return total
