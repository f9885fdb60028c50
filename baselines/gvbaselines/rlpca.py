"""RLPCA: principal components of each cluster's trajectories in a local coordinate frame that moves with the cluster.

Amjoun and Strasser, "Efficient Compression of 3D Dynamic Mesh Sequences", Journal of WSCG 15, 2007. Steps:

1. Seed triangles are farthest points of frame 0. A vertex joins the cluster in whose local coordinate frame it moves least. The
   authors' paper of 2008 says how (sections 4.1 and 4.2); gvpipe's `pdct` has it.
2. The seed triangles' vertices are coded by differences in time. Their decoded positions give the local frames.
3. The trajectories of each cluster, in local coordinates, have principal components of their own. How many is a matter of
   bits and error.

    segment = [3 x float64] origin, [float64 x 2] steps of seeds and of coefficients, [varint] seeds K, [varint] length, seeds'
              points [integers]: differences; [varint] length, labels [integers]: differences; seeds' positions [columns]:
              differences in time; then of each cluster that has other points [varint] length, basis (`plain_basis`),
              coefficients [columns]

Readings: the texts at hand are the abstract of 2007, and what the authors' paper of 2008 and others say of it. The bit
allocation is one step for all clusters, and in each as many components as pay at it. Bases are coded number by number, as
Vasa and Skala report. The step of seeds is a quarter of that of coefficients: the paper of 2008 has 16 bits of them at all
rates, and a setting for them would hardly matter.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import (
    STEP,
    check_lattice,
    decode_columns,
    decode_labels,
    encode_columns,
    multiples,
    pack_origin,
    quantise,
    read_origin,
    read_step,
)
from gvbaselines.plain_basis import decode_plain, encode_plain
from gvcodecs.pdct.clustering import find_clusters
from gvcodecs.pdct.local_frames import local_frames
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import encode_integers
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.trajectory.basis import count_components, find_principal, fit_coefficients

MAX_CLUSTERS = 256
STEP_PER_ERROR = 2.0  # at first; the loop around corrects it
SEED_STEP = 0.25  # of the step of coefficients


@dataclass(frozen=True)
class Rlpca(Baseline):
    """Settings of relative local PCA."""

    id: ClassVar[str] = "rlpca"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "clustered PCA in local coordinate frames (Amjoun and Strasser 2007)"

    clusters: int = 10  # K, 1..256

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_range(1, MAX_CLUSTERS, "clusters")

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        head, origin = pack_origin(frames)
        step = STEP_PER_ERROR * error
        seed_step = SEED_STEP * step
        found = memo("clusters", lambda: find_clusters(frames.astype(np.float32), mesh.point_faces, self.clusters))
        seeds, labels = found.seeds, found.labels
        corners = quantise(frames[:, seeds] - origin, seed_step)  # (n, K, 3, 3)
        origins, axes = local_frames(corners)
        parts = [
            head,
            STEP.pack(seed_step),
            STEP.pack(step),
            varint(len(seeds)),
            pack_block(encode_integers(np.diff(seeds.ravel(), prepend=0))),
            pack_block(encode_integers(np.diff(labels, prepend=0))),
            encode_columns(np.diff(corners.reshape(len(frames), -1), axis=0, prepend=0)),
        ]
        for k in range(len(seeds)):
            members = _members(labels, seeds, k)
            if not len(members):
                continue
            own = localised(frames[:, members] - origin, seed_step * origins[:, k], axes[:, k])
            principal = find_principal(own, error * error * own.size)
            kept = min(count_components(principal, len(own), step), *own.shape)
            data, basis = encode_plain(principal, kept, len(own), step)
            parts += [pack_block(data), encode_columns(quantise(fit_coefficients(own, basis), step))]
        return b"".join(parts)

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        origin, seed_step, step = read_origin(cursor), read_step(cursor), read_step(cursor)
        n_seeds = cursor.varint(min(MAX_CLUSTERS, max(mesh.n_points, len(mesh.faces))), "the number of clusters")
        seeds = decode_labels(cursor, cursor.block(), 3 * n_seeds, mesh.n_points).reshape(-1, 3)
        labels = decode_labels(cursor, cursor.block(), mesh.n_points, n_seeds)
        corners = np.cumsum(decode_columns(cursor, n_frames, 9 * n_seeds), axis=0).reshape(n_frames, n_seeds, 3, 3)
        check_lattice(cursor, corners)
        origins, axes = local_frames(corners)
        frames = np.zeros((n_frames, mesh.n_points, 3))
        frames[:, seeds] = seed_step * corners
        for k in range(n_seeds):
            members = _members(labels, seeds, k)
            if not len(members):
                continue
            basis = decode_plain(Cursor(cursor.block(), cursor.name), n_frames, len(members), step)
            coefficients = multiples(decode_columns(cursor, len(members), basis.vectors.shape[1]), step)
            own = basis.mean + coefficients @ basis.vectors.T
            frames[:, members] = placed(own, seed_step * origins[:, k], axes[:, k])
        cursor.end()
        return np.asarray(frames + origin)


def _members(labels: Int64, seeds: Int64, k: int) -> Int64:
    """Points of cluster k, without those that are corners of any seed."""
    is_member = labels == k
    is_member[seeds] = False
    return np.flatnonzero(is_member)


def localised(positions: Float64, origins: Float64, axes: Float64) -> Float64:
    """Local trajectories ``(m, 3n)`` of ``positions (n, m, 3)``, given ``origins (n, 3)`` and ``axes (n, 3, 3)``, its rows."""
    local = (positions - origins[:, None]) @ axes.swapaxes(1, 2)
    return np.ascontiguousarray(local.swapaxes(0, 1)).reshape(-1, 3 * len(local))


def placed(local: Float64, origins: Float64, axes: Float64) -> Float64:
    """Mirror of `localised`: ``(n, m, 3)``."""
    return np.asarray(local.reshape(len(local), len(axes), 3).swapaxes(0, 1) @ axes + origins[:, None])
