"""FAMC: skinning of clusters that move affinely, and cosine transforms in time of what that leaves, coded in layers.

ISO/IEC 14496-16, Amendment 2, 2009; Mamou, Zaharia, Preteux, Stefanoski and Ostermann, "Frame-Based Compression of Animated
Meshes in MPEG-4", ICME 2008. The mode is DCT with layered decomposition. Steps:

1. Frame 0 is coded on a lattice.
2. Points are in clusters, each of which has an affine motion from frame 0 to every frame.
3. A point whose neighbours have other clusters moves by a weighted sum of their motions (`skinning`).
4. What is left of a trajectory is transformed in time. Points are in layers, from coarse to fine. A point's coefficients are
   predicted by the mean of the decoded ones around it, rounded, and range coded.

A motion has four rows (`affine_clusters`), which take the place of the amendment's four reference points::

    segment = [3 x float64] origin, [float64 x 3] steps of frame 0, of motions, of what is left, then blocks: frame 0, labels,
              weights [integers each]; [varint] clusters K; blocks: motions and what is left, a vector for each row of a
              motion and for each point, a component for each frequency and axis (`gvpipe.trajectory.coefficient_coding`)

Readings: the amendment's encoder finds clusters by collapsing edges, and so their number; here they are those of the authors'
earlier paper (`affine_clusters`). ``clusters`` says how many, or 0 to search for as many as take the fewest bytes. CABAC is
gvpipe's range coder, with its contexts. Layers are gvpipe's vertex hierarchy, which is made from triangles alone as the
amendment's are. A transform spans 32 frames: all of chicken's 400 take half as much again. Weights are found by least squares,
as in the paper.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from scipy.fft import dct, idct

from gvbaselines.affine_clusters import find_affine_clusters, fit_motion, local_coordinates, place, shifts_of
from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, decode_labels, pack_origin, quantise, read_origin, read_step
from gvbaselines.parallelogram import residuals_of, traversal_of, values_of
from gvbaselines.skinning import MAX_WEIGHT, blend, find_candidates, find_weights
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.trajectory.causal_order import CausalOrder, independent_order
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors
from gvpipe.trajectory.spatial_neighbours import hierarchy_order

MAX_CLUSTERS = 254  # as in the amendment
STEP_PER_ERROR = 2.5  # at first; the loop around corrects it
BLOCK = 32  # frames of a transform
LADDER, START = (6, 12, 25, 50, 100, 200), 25  # numbers of clusters that are tried, the first of them
PREDICTOR = "navg"  # the mean of the neighbours in coarser layers
BASE_STEP, MOTION_STEP = 0.5, 0.5  # of the step of what is left


@dataclass(frozen=True)
class Famc(Baseline):
    """Settings of FAMC."""

    id: ClassVar[str] = "famc"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "skinning, DCT in time and layers (FAMC of MPEG-4 AFX, Mamou et al. 2008)"

    clusters: int = 50  # K, 1..254; 0: as many of `LADDER` as take the fewest bytes, which takes 3 to 5 times as long

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_range(0, MAX_CLUSTERS, "clusters")

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""

        def size(n_clusters: int) -> int:
            return len(_encode(frames, mesh, error, memo, n_clusters))

        n_clusters = self.clusters or memo("clusters", lambda: find_count(size))
        return _encode(frames, mesh, error, memo, n_clusters)

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        origin, base_step, motion_step, step = read_origin(cursor), read_step(cursor), read_step(cursor), read_step(cursor)
        traversal = traversal_of(mesh)
        residuals = decode_integers(cursor.block(), 3 * mesh.n_points, name=cursor.name).reshape(-1, 3)
        base = origin + base_step * values_of(residuals, traversal)
        coded_labels, coded_weights = cursor.block(), cursor.block()
        n_clusters = cursor.varint(min(MAX_CLUSTERS, mesh.n_points), "the number of clusters")
        labels = np.zeros(mesh.n_points, np.int64)
        labels[traversal.order] = decode_labels(cursor, coded_labels, mesh.n_points, n_clusters)
        beside = find_candidates(mesh, labels)
        weights = decode_integers(coded_weights, int(beside.is_used.sum()), name=cursor.name)
        if np.abs(weights).max(initial=0) > MAX_WEIGHT:
            raise cursor.corrupt("a weight is out of range")
        coded_motions, coded_left = cursor.block(), cursor.block()
        cursor.end()
        alone = independent_order(4 * n_clusters)
        motions = _motions(decode_vectors(coded_motions, 3 * n_frames, motion_step, alone, cursor.name, predictor=PREDICTOR))
        left = decode_vectors(coded_left, 3 * n_frames, step, _layers(mesh), cursor.name, predictor=PREDICTOR)
        shifts = _from_frequencies(left) + blend(base, labels, motions, place(base, labels), beside, weights)
        return np.asarray(base + shifts.reshape(mesh.n_points, n_frames, 3).swapaxes(0, 1))


def find_count(size: Callable[[int], int]) -> int:
    """The number of `LADDER` with the least ``size``, from `START` on while a neighbour's is less; each is asked once."""
    known = cache(size)
    at = LADDER.index(START)
    while True:
        best = min(range(max(at - 1, 0), min(at + 2, len(LADDER))), key=lambda i: (known(LADDER[i]), i != at))
        if best == at:
            return LADDER[at]
        at = best


def _encode(frames: Float64, mesh: Topology, error: float, memo: Memo, n_clusters: int) -> bytes:
    """Code a segment in so many clusters."""
    step = STEP_PER_ERROR * error
    base_step, motion_step = BASE_STEP * step, MOTION_STEP * step
    head, origin = pack_origin(frames)
    points = quantise(frames[0] - origin, base_step)
    base = origin + base_step * points
    trajectories = np.ascontiguousarray(frames.swapaxes(0, 1)).reshape(mesh.n_points, -1)  # (P, 3n)
    labels = memo(f"labels of {n_clusters}", lambda: find_affine_clusters(frames, mesh, n_clusters))
    traversal, shifts, places = traversal_of(mesh), shifts_of(trajectories, base), place(base, labels)
    local = local_coordinates(base, places, labels)
    fitted = [fit_motion(shifts[labels == k], local[labels == k]) for k in range(len(places.centres))]
    series = _to_frequencies(np.concatenate(fitted))  # (4K, 3n)
    coded_motions, decoded = encode_vectors(series, motion_step, independent_order(len(series)), PREDICTOR)
    motions = _motions(decoded)
    beside = find_candidates(mesh, labels)
    weights = find_weights(shifts, base, labels, motions, places, beside)
    left = _to_frequencies(shifts - blend(base, labels, motions, places, beside, weights))
    coded_left, _ = encode_vectors(left, step, memo("layers", lambda: _layers(mesh)), PREDICTOR)
    return b"".join(
        [
            head,
            *(STEP.pack(one) for one in (base_step, motion_step, step)),
            pack_block(encode_integers(residuals_of(points, traversal))),
            pack_block(encode_integers(np.diff(labels[traversal.order], prepend=0))),
            pack_block(encode_integers(weights)),
            varint(len(places.centres)),
            pack_block(coded_motions),
            pack_block(coded_left),
        ]
    )


def _layers(mesh: Topology) -> CausalOrder:
    """The points from coarse layers to fine ones."""
    return hierarchy_order(build_hierarchy(mesh.point_faces, mesh.n_points), overshoots=False)


def _motions(series: Float64) -> Float64:
    """Motions ``(K, 4, 3n)`` of their frequencies ``(4K, 3n)``."""
    return _from_frequencies(series).reshape(-1, 4, series.shape[1])


def _to_frequencies(rows: Float64) -> Float64:
    """The orthonormal cosine transform in time of ``rows (m, 3n)``, `BLOCK` frames at a time."""
    blocks = np.split(rows.reshape(len(rows), -1, 3), range(BLOCK, rows.shape[1] // 3, BLOCK), axis=1)
    return np.concatenate([dct(block, axis=1, norm="ortho").reshape(len(rows), -1) for block in blocks], axis=1)


def _from_frequencies(rows: Float64) -> Float64:
    """Mirror of `_to_frequencies`."""
    blocks = np.split(rows.reshape(len(rows), -1, 3), range(BLOCK, rows.shape[1] // 3, BLOCK), axis=1)
    return np.concatenate([idct(block, axis=1, norm="ortho").reshape(len(rows), -1) for block in blocks], axis=1)
