"""Sequences as trajectories: welded points, their connectivity and spread, and the trajectories of a segment.

Vertices with one trajectory (seams, triangle soups) are one point, coded once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Float64, Int64
from gvpipe.codec import Memo, Progress
from gvpipe.connectivity.base_mesh import EncodedMesh
from gvpipe.connectivity.topology_only import Topology, encode_mesh
from gvpipe.metrics.vertex_errors import Spread
from gvpipe.quality_scale import error_of
from gvpipe.sequence import MeshSequence


@dataclass(frozen=True)
class CodedConnectivity:
    """A sequence's connectivity as it is coded, and the points whose trajectories are still to be.

    Args:
        coded: the mesh's sections.
        mesh: as the decoder will have it.
        members: ``(P,)`` a given vertex of each of the mesh's points.
        spread: of the vertices, model units (`gvpipe.metrics.vertex_errors.Spread`).
    """

    coded: EncodedMesh
    mesh: Topology
    members: Int64
    spread: float

    def target_error(self, quality: float) -> float:
        """Root mean square error of a vertex, model units, that a quality asks for (`gvpipe.quality_scale`)."""
        return self.spread * error_of(quality) / 100


def code_connectivity(sequence: MeshSequence, reorder: bool, memo: Memo, report: Progress) -> CodedConnectivity:
    """Find a sequence's points and code its mesh; ``reorder`` lets the decoder see the codec's vertex order."""
    report("read", 0)
    points, spread = memo("survey", lambda: survey(sequence, report))
    report("mesh", 0)
    coded, mesh = memo("mesh", lambda: encode_mesh(sequence.faces, points, reorder))
    _, first = np.unique(mesh.points, return_index=True)
    return CodedConnectivity(coded, mesh, coded.permutation[first], spread)


def survey(sequence: MeshSequence, report: Progress) -> tuple[Int64, float]:
    """Points ``(V,)`` of vertices, equal where trajectories are, and the vertices' spread, model units."""
    points = np.zeros(sequence.n_vertices, np.int64)
    spread = Spread()
    for first, block in sequence.chunks():
        spread.add(block)
        vectors = np.ascontiguousarray((block + np.float32(0)).swapaxes(0, 1)).reshape(sequence.n_vertices, -1)  # no minus zero
        _, ids = np.unique(vectors.view(np.dtype((np.void, vectors.shape[1] * 4))).ravel(), return_inverse=True)
        _, points = np.unique(points * sequence.n_vertices + ids, return_inverse=True)
        report("read", (first + len(block)) / sequence.n_frames)
    _, first_vertex = np.unique(points, return_index=True)
    points = np.argsort(np.argsort(first_vertex))[points]  # numbered as their first vertices are
    return points.astype(np.int64), spread.value


def read_trajectories(sequence: MeshSequence, start: int, stop: int, members: Int64) -> Float64:
    """Trajectories of the vertices ``members (P,)`` from frame ``start`` to ``stop``: ``(P, 3n)``, n frames, model units."""
    result = np.empty((len(members), stop - start, 3))
    for first, block in sequence.chunks(start, stop):
        result[:, first - start : first - start + len(block)] = block[:, members].swapaxes(0, 1)
    return result.reshape(len(members), -1)  # (P, n, 3) -> (P, 3n)
