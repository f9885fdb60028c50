"""Clustered PCA: vertices whose trajectories lie in one small space are a cluster with principal trajectories of its own.

Sattler, Sarlette and Klein, "Simple and Efficient Compression of Animation Sequences", SCA 2005. Steps:

1. Clusters of trajectories are found by a form of Lloyd's algorithm: each trajectory goes to the cluster whose mean and first
   components rebuild it best, then means and components are found anew.
2. A vertex is its cluster and its coefficients there.

    segment = [float64] step, [varint] clusters K, [varint] length, labels [integers]: differences; then of each cluster
              [varint] length, basis (`plain_basis`), coefficients [columns]

Readings: the paper starts from random clusters, and names that a drawback; here they start from the trajectories farthest from
each other, so that results repeat. It takes one number of components for all clusters; here as many as pay at one step, which
takes fewer bytes. Bases are not predicted in time, as COBRA did it four years later. ``basis=predicted`` codes
them as gvpipe does (`gvpipe.trajectory.basis`), which takes far less where there are many frames.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import eigh

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, decode_columns, decode_labels, encode_columns, multiples, quantise, read_step
from gvbaselines.plain_basis import decode_plain, encode_plain
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import encode_integers
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.trajectory.basis import (
    count_components,
    decode_basis,
    encode_basis,
    find_principal,
    fit_coefficients,
)
from gvpipe.trajectory.gram import is_tall, smaller_gram

MAX_CLUSTERS = 256
PLAIN = "plain"
BASES = (PLAIN, "predicted")
ROUNDS = 12  # of Lloyd's algorithm
REDUCED = 96
ROUNDING = 1e-12  # of the total energy: eigenvalues below are noise
STEP_PER_ERROR = 2.0  # at first; the loop around corrects it


@dataclass(frozen=True)
class ClusteredPca(Baseline):
    """Settings of clustered PCA."""

    id: ClassVar[str] = "cpca"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "clustered PCA of trajectories (Sattler, Sarlette and Klein 2005)"

    clusters: int = 10  # K, 1..256
    components: int = 4  # that clusters are found with, 0..64
    basis: str = PLAIN  # plain, or predicted in time

    def __post_init__(self) -> None:
        super().__post_init__()
        self.check_range(1, MAX_CLUSTERS, "clusters")
        self.check_range(0, 64, "components")
        self.check_choice("basis", BASES)

    def header(self) -> dict[str, Any]:
        """How bases are coded."""
        return {"basis": self.basis}

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        trajectories = np.ascontiguousarray(frames.swapaxes(0, 1)).reshape(mesh.n_points, -1)  # (P, 3n)
        step = STEP_PER_ERROR * error
        labels = memo("labels", lambda: find_clusters(trajectories, self.clusters, self.components))
        n_clusters = int(labels.max()) + 1
        parts = [STEP.pack(step), varint(n_clusters), pack_block(encode_integers(np.diff(labels, prepend=0)))]
        for k in range(n_clusters):
            own = trajectories[labels == k]
            principal = find_principal(own, error * error * own.size)
            kept = count_components(principal, len(own), step)
            data, basis = (encode_plain if self.basis == PLAIN else encode_basis)(principal, kept, len(own), step)
            parts += [pack_block(data), encode_columns(quantise(fit_coefficients(own, basis), step))]
        return b"".join(parts)

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        step = read_step(cursor)
        n_clusters = cursor.varint(min(MAX_CLUSTERS, mesh.n_points), "the number of clusters")
        labels = decode_labels(cursor, cursor.block(), mesh.n_points, n_clusters)
        trajectories = np.zeros((mesh.n_points, 3 * n_frames))
        for k in range(n_clusters):
            members = np.flatnonzero(labels == k)
            if not len(members):
                raise cursor.corrupt("a cluster is empty")
            block = cursor.block()
            if settings.choice("basis", BASES) == PLAIN:
                basis = decode_plain(Cursor(block, cursor.name), n_frames, len(members), step)
            else:
                Cursor(block, cursor.name).varint(min(len(members), 3 * n_frames), "the number of components")
                basis = decode_basis(block, n_frames, len(members), step, cursor.name)
            coefficients = multiples(decode_columns(cursor, len(members), basis.vectors.shape[1]), step)
            trajectories[members] = basis.mean + coefficients @ basis.vectors.T
        cursor.end()
        return np.ascontiguousarray(trajectories.reshape(mesh.n_points, n_frames, 3).swapaxes(0, 1))


def find_clusters(trajectories: Float64, n_clusters: int, n_components: int) -> Int64:
    """Labels ``(P,)``, 0..K-1 without gaps, of ``trajectories (P, 3n)``, each in the cluster that rebuilds it best.

    Distances are those in the space of the first `REDUCED` principal trajectories of all, which makes it quick.
    """
    centred = trajectories - trajectories.mean(axis=0)
    trajectories = centred @ find_space(centred, REDUCED)
    labels = _nearest_seeds(trajectories, n_clusters)
    for _ in range(ROUNDS):
        errors = np.stack([_errors(trajectories, trajectories[labels == k], n_components) for k in np.unique(labels)])
        before, labels = labels, errors.argmin(axis=0)
        labels = np.unique(labels, return_inverse=True)[1].ravel()
        if np.array_equal(before, labels):
            break
    return np.asarray(labels, np.int64)


def _errors(trajectories: Float64, members: Float64, n_components: int) -> Float64:
    """Squared errors ``(P,)`` of trajectories in the space of a cluster's ``members (m, 3n)``."""
    left = trajectories - members.mean(axis=0)
    space = find_space(members - members.mean(axis=0), n_components)
    return np.asarray(np.square(left).sum(axis=1) - np.square(left @ space).sum(axis=1))


def find_space(centred: Float64, n_components: int) -> Float64:
    """The leading principal directions ``(3n, c)`` of ``centred (m, 3n)``; fewer where there are no more."""
    gram = smaller_gram(centred)
    kept = min(n_components, len(gram))
    if not kept:
        return np.zeros((centred.shape[1], 0))
    energies, vectors = eigh(gram, subset_by_index=[len(gram) - kept, len(gram) - 1])
    real = energies > ROUNDING * np.trace(gram)
    energies, vectors = energies[real], vectors[:, real]
    return np.asarray(vectors if is_tall(centred) else centred.T @ vectors / np.sqrt(energies))


def _nearest_seeds(trajectories: Float64, n_clusters: int) -> Int64:
    """For each trajectory the nearest of K that are far from each other, the first that farthest from the mean."""
    nearest = np.square(trajectories - trajectories.mean(axis=0)).sum(axis=1)
    labels = np.zeros(len(trajectories), np.int64)
    first = True
    for k in range(min(n_clusters, len(trajectories))):
        seed = int(nearest.argmax())
        if not nearest[seed] > 0:
            break
        distances = np.square(trajectories - trajectories[seed]).sum(axis=1)
        closer = distances < nearest if not first else np.ones(len(labels), bool)
        labels[closer], nearest[closer], first = k, distances[closer], False
    return np.asarray(np.unique(labels, return_inverse=True)[1].ravel(), np.int64)
