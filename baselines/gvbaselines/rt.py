"""Rigid transforms alone: clusters that move rigidly, as many as the error needs.

Collins and Hilton, "A Rigid Transform Basis for Animation Compression and Level of Detail", SI3D 2005. Frame 0 is coded on a
lattice. A vertex follows one cluster, whose rotation and shift bring frame 0 to each frame; nothing else is coded. So the error
falls with the number of clusters::

    segment = [3 x float64] origin, [float64 x 2] steps of frame 0, of transforms, [float64] size, [varint] length, frame 0
              [integers], [varint] clusters K, [varint] length, labels [integers]: differences along the traversal, then
              transforms [columns]: 6 K series over the frames, second differences

A rotation is coded as its rotation vector times the mesh's size, so that a rounding error in it costs as much as one in a
shift.

Readings: the paper starts from seeds and grows segments under a bound on the error, weighting vertices; here the cluster with
the largest error is split in two, along the main axis of what its vertices' trajectories leave, until the bound holds. A
cluster of one or two vertices still has a whole transform.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gvbaselines.baseline import Baseline
from gvbaselines.cpca import find_space
from gvbaselines.numbers import (
    STEP,
    decode_columns,
    decode_labels,
    encode_columns,
    multiples,
    pack_origin,
    quantise,
    read_origin,
    read_step,
)
from gvbaselines.parallelogram import residuals_of, traversal_of, values_of
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Bool, Float64, Int64

BASE_STEP, MOTION_STEP = 1.0, 0.5  # of the error: frame 0 is rounded once for all frames
TINY_ANGLE = 1e-9


@dataclass(frozen=True)
class RigidTransforms(Baseline):
    """Settings of rigid transforms."""

    id: ClassVar[str] = "rt"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "rigid transforms of clusters (Collins and Hilton 2005)"

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        head, origin = pack_origin(frames)
        base_step, motion_step = BASE_STEP * error, MOTION_STEP * error
        points = quantise(frames[0] - origin, base_step)
        base = origin + base_step * points
        size = float(np.linalg.norm(np.ptp(frames[0], axis=0))) or 1.0
        labels = find_rigid_clusters(frames, base, error)
        traversal = traversal_of(mesh)
        along = labels[traversal.order]
        motion = np.stack([_fit(frames[:, labels == k], base[labels == k], size) for k in range(labels.max() + 1)], axis=1)
        series = quantise(motion.reshape(len(frames), -1), motion_step)  # (n, K, 6) -> (n, 6K)
        return b"".join(
            [
                head,
                STEP.pack(base_step),
                STEP.pack(motion_step),
                STEP.pack(size),
                pack_block(encode_integers(residuals_of(points, traversal))),
                varint(int(labels.max()) + 1),
                pack_block(encode_integers(np.diff(along, prepend=0))),
                encode_columns(np.diff(series, n=2, axis=0, prepend=np.zeros((2, series.shape[1]), np.int64))),
            ]
        )

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        origin, base_step, motion_step, size = read_origin(cursor), read_step(cursor), read_step(cursor), read_step(cursor)
        traversal = traversal_of(mesh)
        residuals = decode_integers(cursor.block(), 3 * mesh.n_points, name=cursor.name).reshape(-1, 3)
        base = origin + base_step * values_of(residuals, traversal)
        n_clusters = cursor.varint(mesh.n_points, "the number of clusters")
        labels = np.zeros(mesh.n_points, np.int64)
        labels[traversal.order] = decode_labels(cursor, cursor.block(), mesh.n_points, n_clusters)
        series = np.cumsum(np.cumsum(decode_columns(cursor, n_frames, 6 * n_clusters), axis=0), axis=0)
        cursor.end()
        motion = multiples(series, motion_step).reshape(n_frames, n_clusters, 6)
        frames = np.empty((n_frames, mesh.n_points, 3))
        for k in range(n_clusters):
            own = labels == k
            frames[:, own] = _move(base[own], motion[:, k], size)
        return frames


def find_rigid_clusters(frames: Float64, base: Float64, error: float) -> Int64:
    """Labels ``(P,)`` of clusters of ``frames (n, P, 3)`` that move rigidly from ``base (P, 3)``, within an error, rms."""
    allowed = error * error * frames.shape[0] * frames.shape[1]
    members = [np.arange(len(base))]
    left = [_leave(frames, base)]
    squares = [float(np.square(left[0]).sum())]
    while sum(squares) > allowed:
        worst = int(np.argmax(squares))
        if len(members[worst]) < 2:
            break
        own, halves = members[worst], _split(left[worst])
        parts = [own[halves], own[~halves]]
        found = [_leave(frames[:, part], base[part]) for part in parts]
        members[worst : worst + 1], left[worst : worst + 1] = parts, found
        squares[worst : worst + 1] = [float(np.square(each).sum()) for each in found]
    labels = np.zeros(len(base), np.int64)
    for k, own in enumerate(members):
        labels[own] = k
    return labels


def _split(left: Float64) -> Bool:
    """Which half each of the trajectories ``left (n, m, 3)`` lies in, along the main axis of what is left; both have some."""
    rows = left.swapaxes(0, 1).reshape(left.shape[1], -1)
    centred = rows - rows.mean(axis=0)
    axis = find_space(centred, 1)
    along = (centred @ axis)[:, 0] if axis.shape[1] else np.zeros(len(rows))
    halves = along > 0
    return halves if halves.any() and not halves.all() else np.arange(len(rows)) < len(rows) // 2


def _leave(frames: Float64, base: Float64) -> Float64:
    """What the best rigid motion leaves of ``frames (n, m, 3)``."""
    rotations, centres = _find_motion(frames, base)
    return np.asarray(frames - (base - base.mean(axis=0)) @ rotations.swapaxes(1, 2) - centres[:, None])


def _fit(frames: Float64, base: Float64, size: float) -> Float64:
    """The rotation vectors, times ``size``, and the centres of a cluster: ``(n, 6)``."""
    rotations, centres = _find_motion(frames, base)
    return np.concatenate([size * _vectors(rotations), centres], axis=1)


def _find_motion(frames: Float64, base: Float64) -> tuple[Float64, Float64]:
    """Rotations ``(n, 3, 3)`` and centres ``(n, 3)`` that bring ``base (m, 3)`` closest to ``frames (n, m, 3)`` (Kabsch)."""
    centre, centres = base.mean(axis=0), frames.mean(axis=1)
    covariance = (frames - centres[:, None]).swapaxes(1, 2) @ (base - centre)
    left, _, right = np.linalg.svd(covariance)
    left[:, :, 2] *= np.sign(np.linalg.det(left @ right))[:, None]
    return np.asarray(left @ right), np.asarray(centres)


def _move(base: Float64, motion: Float64, size: float) -> Float64:
    """Frames ``(n, m, 3)`` of a cluster's ``base (m, 3)`` that moves."""
    rotations = _rotations(motion[:, :3] / size)
    return np.asarray((base - base.mean(axis=0)) @ rotations.swapaxes(1, 2) + motion[:, None, 3:])


def _vectors(rotations: Float64) -> Float64:
    """Rotation vectors ``(n, 3)``, each of the turns that mean the same the one nearest to the frame before."""
    from scipy.spatial.transform import Rotation

    vectors = Rotation.from_matrix(rotations).as_rotvec()
    for f in range(1, len(vectors)):
        angle = float(np.linalg.norm(vectors[f]))
        if angle > TINY_ANGLE:
            turns = np.rint((vectors[f - 1] @ vectors[f] / angle - angle) / (2 * np.pi))
            vectors[f] *= 1 + 2 * np.pi * turns / angle
    return np.asarray(vectors)


def _rotations(vectors: Float64) -> Float64:
    """Mirror of `_vectors`: ``(n, 3, 3)``."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vectors).as_matrix())
