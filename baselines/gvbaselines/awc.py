"""AWC: wavelet details of every frame on one hierarchy of vertices, weights from the first frame, differences in time.

Guskov and Khodakovsky, "Wavelet Compression of Parametrically Coherent Mesh Sequences", SCA 2004. Steps:

1. The mesh is taken apart, vertex by vertex, to a coarse one. The same hierarchy serves all frames.
2. A vertex that comes back is predicted from the ring around it. Weights follow the geometry of frame 0, so that they fit
   irregular and stretched triangles, and all frames that have about its lengths. What is left is the vertex' detail.
3. Differences of details to the frame before are rounded and coded. Coarse details reach more vertices, and are finer.

    segment = [3 x float64] origin, [float64] step of frame 0, [varint] length, frame 0 [integers]: what the parallelogram
              leaves; then, if there are more frames, [varint] levels L, [L x float64] steps, residuals [columns]: a column for
              each point, a row for each frame and axis

Readings: the texts at hand are the abstract, and what the papers say that compare with it. The hierarchy is gvpipe's, made
from triangles alone; theirs is a progressive mesh that is sent. Weights minimise second differences across the edges at the
vertex (Guskov, Sweldens and Schroeder, "Multiresolution Signal Processing for Meshes", 1999, which theirs cites). Equal
weights take 48 % more bytes on cow and 19 % on chicken, at quality 60. The transform predicts and does not update. A level's
step is `step` divided by the norm of its synthesis functions, where the paper codes bit planes. Coefficients are range coded,
with a context for the magnitude of each point.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from scipy import sparse

from gvbaselines.baseline import Baseline
from gvbaselines.numbers import STEP, decode_columns, encode_columns, multiples, pack_origin, quantise, read_origin, read_step
from gvbaselines.parallelogram import residuals_of, traversal_of, values_of
from gvpipe.coding.codec import Memo
from gvpipe.connectivity.topology_only import Topology
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.json_object import JsonObject
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int64
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.mesh.hierarchy_kernels import Hierarchy

STEP_PER_ERROR = 2.0  # at first; the loop around corrects it
BASE_STEP = 0.5  # of frame 0, in `step`
FLAT = 1e-6  # of an edge: a wing that is nearer to its line has no height
MOST_WEIGHT = 2.0  # a ring whose weights are larger is averaged
SEED = 5  # of the signs that norms are measured with


@dataclass(frozen=True)
class Awc(Baseline):
    """Settings of animation wavelet compression."""

    id: ClassVar[str] = "awc"
    version: ClassVar[int] = 1
    summary: ClassVar[str] = "wavelets on a vertex hierarchy, differences in time (Guskov and Khodakovsky 2004)"

    def code_frames(self, frames: Float64, mesh: Topology, error: float, memo: Memo) -> bytes:
        """Code a segment; see `Baseline.code_frames`."""
        step = STEP_PER_ERROR * error
        head, origin = pack_origin(frames)
        points = quantise(frames[0] - origin, BASE_STEP * step)
        base = multiples(points, BASE_STEP * step)
        data = head + STEP.pack(BASE_STEP * step) + pack_block(encode_integers(residuals_of(points, traversal_of(mesh))))
        if len(frames) == 1:
            return data
        wavelets = find_wavelets(memo("hierarchy", lambda: build_hierarchy(mesh.point_faces, mesh.n_points)), base)
        steps = step / level_norms(wavelets)
        moved = (frames[1:] - origin - base).swapaxes(0, 1).reshape(mesh.n_points, -1)  # (P, 3(n - 1))
        numbers = quantise(analyse(moved, wavelets) / steps[wavelets.levels, None], 1.0)
        residuals = np.diff(numbers.reshape(mesh.n_points, -1, 3), axis=1, prepend=0).reshape(mesh.n_points, -1)
        return data + varint(len(steps)) + steps.astype("<f8").tobytes() + encode_columns(np.ascontiguousarray(residuals.T))

    @classmethod
    def decode_frames(cls, cursor: Cursor, settings: JsonObject, mesh: Topology, n_frames: int) -> Float64:
        """Mirror of `code_frames`."""
        origin, base_step = read_origin(cursor), read_step(cursor)
        residuals = decode_integers(cursor.block(), 3 * mesh.n_points, name=cursor.name).reshape(-1, 3)
        base = multiples(values_of(residuals, traversal_of(mesh)), base_step)
        frames = np.repeat(base[None], n_frames, axis=0)
        if n_frames > 1:
            wavelets = find_wavelets(build_hierarchy(mesh.point_faces, mesh.n_points), base)
            steps = cursor.array("<f8", cursor.varint(mesh.n_points, "the number of levels"))
            if len(steps) <= wavelets.levels.max() or not (np.abs(steps) < np.finfo(np.float32).max).all():
                raise cursor.corrupt("its steps are not those of its levels")
            numbers = decode_columns(cursor, 3 * (n_frames - 1), mesh.n_points).T.reshape(mesh.n_points, -1, 3)
            sums = np.cumsum(numbers, axis=1).reshape(mesh.n_points, -1)
            details = np.asarray(sums * steps[wavelets.levels, None], np.float64)
            moved = synthesise(details, wavelets).reshape(mesh.n_points, -1, 3)  # from frame 0, (P, n - 1, 3)
            frames[1:] = frames[1:] + moved.swapaxes(0, 1)
        cursor.end()
        return np.asarray(frames + origin)


class Wavelets(NamedTuple):
    """How points are predicted from others.

    Args:
        weights: ``(P, P)`` of the ring around each point; no row is filled in the coarsest mesh.
        levels: ``(P,)`` 0 in the coarsest mesh; of any other point one more than the highest of its ring.
    """

    weights: sparse.csr_array
    levels: Int64


def find_wavelets(hierarchy: Hierarchy, base: Float64) -> Wavelets:
    """Weights and levels by the geometry of frame 0, ``base (P, 3)``."""
    n_points, sizes = len(base), np.abs(hierarchy.rings)
    rows, columns, values = [], [], []
    for size in np.unique(sizes[sizes > 0]).tolist():
        for at_boundary in (False, True):
            ranks = np.flatnonzero(hierarchy.rings == (-size if at_boundary else size))
            rings = hierarchy.neighbours[hierarchy.starts[ranks, None] + np.arange(size)].astype(np.int64)  # (m, size)
            found = _ends(rings) if at_boundary else ring_weights(base[hierarchy.order[ranks]], base[rings])
            rows.append(np.repeat(hierarchy.order[ranks].astype(np.int64), size))
            columns.append(rings.ravel())
            values.append(found.ravel())
    if not rows:
        return Wavelets(sparse.csr_array((n_points, n_points)), np.zeros(n_points, np.int64))
    points, ring = np.concatenate(rows), np.concatenate(columns)
    weights = sparse.csr_array((np.concatenate(values), (points, ring)), shape=(n_points, n_points))
    return Wavelets(weights, _levels(points, ring, n_points))


def ring_weights(points: Float64, rings: Float64) -> Float64:
    """Weights ``(m, r)`` of ``rings (m, r, 3)`` around ``points (m, 3)`` that make second differences at them least.

    The second difference across an edge is how far the gradient turns from one triangle to the other, both laid into one plane.
    """
    size = rings.shape[1]
    spokes = rings - points[:, None]
    lengths = np.linalg.norm(spokes, axis=2)
    own, others = np.zeros(len(points)), np.zeros(lengths.shape)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(size):
            edge, wings = spokes[:, k] / lengths[:, k, None], ((k - 1) % size, (k + 1) % size)
            along = [(spokes[:, wing] * edge).sum(axis=1) for wing in wings]
            heights = [
                np.sqrt(np.maximum(lengths[:, w] ** 2 - a**2, (FLAT * lengths[:, k]) ** 2))
                for w, a in zip(wings, along, strict=True)
            ]
            slopes = sum(a / h for a, h in zip(along, heights, strict=True)) / lengths[:, k]
            centre = slopes - sum(1 / h for h in heights)
            own += centre**2
            others[:, k] += centre * slopes
            for wing, height in zip(wings, heights, strict=True):
                others[:, wing] -= centre / height
        found = others / own[:, None]
    is_used = np.isfinite(found).all(axis=1) & (np.abs(found).max(axis=1) <= MOST_WEIGHT)
    return np.where(is_used[:, None], found, 1 / size)


def analyse(values: Float64, wavelets: Wavelets) -> Float64:
    """Details ``(P, m)`` of ``values (P, m)``."""
    return np.asarray(values - wavelets.weights @ values)


def synthesise(details: Float64, wavelets: Wavelets) -> Float64:
    """Mirror of `analyse`: values ``(P, m)`` of ``details (P, m)``."""
    values = details.copy()
    for level in range(1, int(wavelets.levels.max()) + 1):
        points = np.flatnonzero(wavelets.levels == level)
        values[points] += wavelets.weights[points] @ values
    return values


def level_norms(wavelets: Wavelets) -> Float64:
    """The norms ``(L,)`` of the synthesis functions of each level, by one sum of all of them with random signs."""
    counts = np.bincount(wavelets.levels)
    signs = np.random.default_rng(SEED).choice([-1.0, 1.0], len(wavelets.levels))
    made = synthesise((wavelets.levels[:, None] == np.arange(len(counts))) * signs[:, None], wavelets)
    return np.asarray(np.sqrt(np.square(made).sum(axis=0) / counts))


def _ends(rings: Int64) -> Float64:
    """Weights at a boundary: of the ring's ends alone, which lie there."""
    weights = np.zeros(rings.shape)
    weights[:, 0] += 0.5
    weights[:, -1] += 0.5
    return weights


def _levels(points: Int64, ring: Int64, n_points: int) -> Int64:
    levels = np.zeros(n_points, np.int64)
    while True:
        before = levels.copy()
        np.maximum.at(levels, points, levels[ring] + 1)
        if np.array_equal(before, levels):
            return levels
