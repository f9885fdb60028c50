"""The hypothetical predictor of Vasa and Skala 2010, section 3.3: a computation, since nothing of it could be decoded.

It is codec ``pca`` with predictor ``navg``, but that each vector's weights are those which fit it best by least squares
(equation 3), and that the decoder is taken to know them. So its rates count all sections but those weights.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from gvpipe.benchmark.bd_rate import average_rate_difference, rate_at
from gvpipe.benchmark.reproduction.lab import Lab
from gvpipe.coding.codec import Memo
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.progress import silent
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.model.sequence import MeshSequence
from gvpipe.trajectory.basis import reduce_trajectories, squared_errors
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.coded_points import CodedConnectivity, code_connectivity, read_trajectories
from gvpipe.trajectory.coefficient_coding import encode_vectors
from gvpipe.trajectory.spatial_neighbours import hierarchy_order

RIDGE = 1e-9  # of a vector's neighbours' energy: these may depend on each other


def hypothetical_rate(sequence: str, kg: float) -> Callable[[Lab], float | None]:
    """Bits per vertex and frame of the hypothetical predictor at a KG error."""
    return lambda lab: rate_at(_points_of(sequence, lab), "kg", kg)


def hypothetical_gain(sequence: str, other: str) -> Callable[[Lab], float | None]:
    """By how many percent its rate is below a codec's, averaged over the errors that both reach."""

    def measured(lab: Lab) -> float | None:
        found = average_rate_difference(lab.points(sequence, other), _points_of(sequence, lab), "kg")
        return None if found is None else -found

    return measured


def _points_of(name: str, lab: Lab) -> list[dict[str, Any]]:
    sequence = lab.sequence(name)
    return lab.memo(f"hypothetical {name}", lambda: hypothetical_points(sequence, lab))


def hypothetical_points(sequence: MeshSequence, lab: Lab) -> list[dict[str, Any]]:
    """Rates ``bpvf`` and errors ``kg`` at the lab's qualities."""
    shared = code_connectivity(sequence, False, Memo(), silent)
    causal = hierarchy_order(build_hierarchy(shared.mesh.point_faces, shared.mesh.n_points), False)
    trajectories = read_trajectories(sequence, 0, sequence.n_frames, shared.members)
    return [_point(sequence, shared, causal, trajectories, quality) for quality in lab.qualities]


def best_weights(vectors: Float64, causal: CausalOrder) -> CausalOrder:
    """The order with the weights that predict each of ``vectors (n, R)`` best from the neighbours that ``navg`` uses."""
    weights = causal.weights.copy()
    counts = np.where(causal.ring_sizes > 0, causal.ring_sizes, np.diff(causal.starts))
    for n in np.unique(counts[counts > 0]).tolist():
        ranks = np.flatnonzero(counts == n)
        places = causal.starts[ranks][:, None] + np.arange(n)
        around = vectors[causal.neighbours[places]]  # (m, n, R)
        gram = around @ around.swapaxes(1, 2)
        ridge = RIDGE * np.einsum("mnn->m", gram)[:, None, None] + np.finfo(float).tiny
        wanted = around @ vectors[causal.order[ranks]][:, :, None]
        weights[places] = np.linalg.solve(gram + ridge * np.eye(n), wanted)[..., 0]
    return causal._replace(weights=weights)


def _point(
    sequence: MeshSequence, shared: CodedConnectivity, causal: CausalOrder, trajectories: Float64, quality: float
) -> dict[str, Any]:
    squared = shared.target_error(quality) ** 2 * shared.mesh.n_points * sequence.n_frames
    reduced = reduce_trajectories(trajectories, squared)
    data, decoded = encode_vectors(
        reduced.coefficients, reduced.step, best_weights(reduced.coefficients, causal), predictor="navg"
    )
    copies = np.bincount(shared.mesh.points, minlength=shared.mesh.n_points)
    left = float(squared_errors(trajectories, reduced.decoded, decoded) @ copies)
    size = len(shared.coded.mesh) + len(shared.coded.order) + len(reduced.basis) + len(data)
    count = sequence.n_vertices * sequence.n_frames
    return {"quality": quality, "bpvf": 8 * size / count, "kg": 100 * float(np.sqrt(left / count)) / shared.spread}
