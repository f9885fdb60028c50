"""A clip: consecutive frames coded from the shared base frame alone, in closed loop.

Amjoun and Strasser 2008, sections 4.3 to 4.7. In its cluster's local coordinate frame a vertex hardly moves from frame to
frame; what moves is the delta vectors, and each cluster's, axis by axis, are one signal over the cluster's vertices,
transformed by an orthonormal DCT and quantised.

The loop runs on integers. The DCT is linear, so the sum of all deltas is kept as decoded coefficients, S, in
sixteenths of a step, and a frame is ``base + step / 16 * (B S_affine + inverse DCT of S)`` in the local frame: no rounding can
grow from frame to frame, and no decision hangs on one. Departures from the paper:

- every clip, the first too, starts from the base frame, whose difference to the clip's first frame is coded like any other;
- a delta is predicted as the part ``w`` (sixteenths) of the delta before. Each group of coefficients (cluster, octave) learns
  its w by least squares from decoded deltas: near 0 in noise, near 1 in smooth motion (`delta_coding`);
- before the DCT, four functions per cluster (1 and the three base coordinates) take the affine part of the motion. A
  traversal of the vertices would turn it into high frequencies (`Dictionary`).

A clip's bytes::

    clip = [6 x float64] seed lattice (origin, step), step, fineness; [varint] K; three blocks and the deltas, each block
           [varint] length, data: seed triangles [integers], clusters (`labels`), seed vertices (`seed_coding`); `delta_coding`
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from gvcodecs.pdct.clustering import Clusters
from gvcodecs.pdct.delta_coding import DeltaDecoder, DeltaEncoder
from gvcodecs.pdct.dictionary import BaseFrame, Dictionary, frames_of
from gvcodecs.pdct.labels import decode_labels, encode_labels
from gvcodecs.pdct.seed_coding import decode_seeds, encode_seeds
from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.container.segments import HUGE, TINY
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.entropy.tokens import tokenise
from gvpipe.foundation.arrays import Float32, Float64, Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import InputError
from gvpipe.mesh.lattice import Lattice
from gvpipe.trajectory.gram import gram_of_columns, product

HEAD = struct.Struct("<6d")
MAX_CLUSTERS = 1024
BYTES_PER_POINT, SECONDS_PER_POINT = 160, 0.4e-6  # of a frame
BYTES_PER_NUMBER = 64  # of seeds
SECONDS_PER_FRAME = 0.6e-3
TOGETHER = 16  # frames decoded and rebuilt at once, an even number
LOCAL = 1 << 20  # vertices of all frames whose coordinates are transformed at once
RIDGE = 1e-6  # of the affine fit
LAMBDA = 0.14  # squared steps that a bit is worth; 0.1155 by theory at a high rate


@dataclass(frozen=True)
class DeltaQuantiser:
    """The step of the delta coefficients, model units; that of low frequencies is ``step / fineness``; ``kept`` 0: by cost."""

    step: float
    fineness: float
    kept: float


def encode_clip(frames: Float32, surface: BaseFrame, quantiser: DeltaQuantiser, clusters: Clusters, seed_bits: int) -> bytes:
    """Code ``frames (n, V, 3)``, model units, in the order of vertices that ``surface`` has."""
    lattice = Lattice.over(frames.reshape(-1, 3), seed_bits)
    seeds, labels = clusters.seeds, clusters.labels
    dictionary = Dictionary.of(surface, seeds, labels, lattice, quantiser.fineness)
    if dictionary is None:
        raise InputError(f"the clip moves within {lattice.step} x 2**{seed_bits}, far from frame 0; subtract its origin")
    seed_points = np.rint((frames[:, seeds].astype(np.float64) - lattice.origin) / lattice.step).astype(np.int64)
    signals = _signals(frames, dictionary, seed_points, quantiser.step)
    blocks = [
        encode_integers(np.diff(seeds.ravel(), prepend=0)),
        encode_labels(labels[surface.traversal], len(seeds)),
        encode_seeds(seed_points, dictionary.base_seeds),
    ]
    return b"".join(
        [
            HEAD.pack(*lattice.origin, lattice.step, quantiser.step, quantiser.fineness),
            varint(len(seeds)),
            *(pack_block(block) for block in blocks),
            _encode_deltas(signals, dictionary, quantiser),
        ]
    )


def decode_clip(data: bytes, n_frames: int, surface: BaseFrame, name: str, budget: Budget = UNLIMITED) -> Float32:
    """Mirror of `encode_clip`: ``(n_frames, V, 3) float32``, model units; vertices that are not in the traversal are left at 0.

    Raises:
        CorruptFile: the clip does not decode to that many frames.
        OverBudget: so many frames take more than the file may.
    """
    n_points = n_frames * len(surface.base)
    what = f"{name!r}, {n_frames} frames of {len(surface.base)} points,"
    budget.ask(what, count_bytes(n_frames, len(surface.base), 0), SECONDS_PER_FRAME * n_frames + SECONDS_PER_POINT * n_points)
    cursor = Cursor(data, name)
    *origin, seed_step, step, fineness = cursor.struct(HEAD)
    wrong = not all(abs(v) < HUGE for v in origin) or not all(TINY < v < HUGE for v in (seed_step, step))
    if wrong or not 1 <= fineness <= 64:  # NaN neither
        raise cursor.corrupt("a step or the lattice's origin is out of range")
    lattice = Lattice((origin[0], origin[1], origin[2]), seed_step)
    n_vertices = len(surface.base)
    n_seeds = cursor.varint(min(MAX_CLUSTERS, n_vertices), "the number of clusters")
    budget.ask(what, count_bytes(n_frames, n_vertices, n_seeds))
    if n_seeds < 1:
        raise cursor.corrupt("there is no cluster")
    blocks = [cursor.block() for _ in range(3)]
    seeds = np.cumsum(decode_integers(blocks[0], 3 * n_seeds, name=name)).reshape(-1, 3)
    if seeds.min() < 0 or seeds.max() >= n_vertices:
        raise cursor.corrupt("a seed vertex does not exist")
    labels = np.zeros(n_vertices, np.int64)
    labels[surface.traversal] = decode_labels(Cursor(blocks[1], name), len(surface.traversal), n_seeds, name)
    dictionary = Dictionary.of(surface, seeds, labels, lattice, fineness)
    if dictionary is None:
        raise cursor.corrupt("the base lies out of the seed lattice's range")
    seed_points = decode_seeds(Cursor(blocks[2], name), n_frames, dictionary.base_seeds, name)
    positions = np.zeros((n_frames, n_vertices, 3), np.float32)
    if not _decode_frames(cursor, dictionary, seeds, seed_points, step, positions):
        raise cursor.corrupt("a position is larger than float32 can hold")
    return positions


def count_bytes(n_frames: int, n_vertices: int, n_clusters: int | None = None) -> int:
    """Memory that a clip takes to decode; with the most clusters that it can have, where their number is not known."""
    n_seeds = min(MAX_CLUSTERS, n_vertices) if n_clusters is None else n_clusters
    return n_frames * (BYTES_PER_POINT * n_vertices + 9 * BYTES_PER_NUMBER * n_seeds)


def _decode_frames(
    cursor: Cursor, dictionary: Dictionary, seeds: Int64, seed_points: Int64, step: float, positions: Float32
) -> bool:
    """Fill in the ``positions (n, V, 3)`` of members and seeds; false where one is larger than float32 can hold."""
    from gvcodecs.pdct.shape_kernels import place_seeds, rebuild_positions

    coder, lattice, fits = DeltaDecoder(cursor, dictionary.layout), dictionary.lattice, True
    for first in range(0, len(positions), TOGETHER):
        block = slice(first, first + TOGETHER)
        frames, sums = frames_of(seed_points[block], lattice), coder.take_frames(len(positions[block]))
        fits &= rebuild_positions(dictionary.members, dictionary.shape, frames, sums, step, positions[block])
    coder.finish()
    return fits and place_seeds(seeds, seed_points.reshape(len(positions), -1, 9), lattice, positions)


def _encode_deltas(signals: Float64, dictionary: Dictionary, quantiser: DeltaQuantiser) -> bytes:
    """Code ``signals (n, 3, N)``, coefficients in steps, by the loop that the decoder runs."""
    from gvcodecs.pdct.delta_kernels import UNIT

    coder = DeltaEncoder(dictionary.layout)
    n_affine, scale = dictionary.n_affine, dictionary.shape.scale
    shapes = dictionary.transform(dictionary.shape.functions)  # (4, N)
    projections = np.concatenate([_projection(shapes[:, w]) for w in dictionary.slices] or [np.zeros((4, 0))], axis=1)
    bounds = dictionary.members.bounds
    sizes = np.diff(bounds)
    for signal in signals:
        prediction = (coder.sums + coder.predict()) / UNIT
        residual = signal - prediction[:, n_affine:] * scale - _expand(prediction[:, :n_affine], shapes, sizes)
        coefficients = np.empty_like(prediction)
        coefficients[:, :n_affine] = _project(residual, projections, bounds)
        residual -= _expand(np.rint(coefficients[:, :n_affine]), shapes, sizes)
        coefficients[:, n_affine:] = residual / scale
        if quantiser.kept > 0:
            _drop_small(coefficients[:, n_affine:], dictionary, quantiser.kept)
        values, contexts = np.zeros(prediction.shape, np.int64), np.zeros(prediction.shape, np.int64)
        costs = coder.costs()
        for axis in range(3):
            coder.find_contexts(axis, values, contexts)
            values[axis] = _choose(coefficients[axis], contexts[axis], costs, n_affine)
        coder.add_frame(contexts, values)
    return coder.finish()


def _signals(frames: Float32, dictionary: Dictionary, seed_points: Int64, step: float) -> Float64:
    """DCT coefficients ``(n, 3, N)``, in steps, of how ``frames (n, V, 3)`` differ from the base in local coordinates."""
    members = dictionary.members.vertices
    signals = np.empty((len(frames), 3, len(members)))
    few = max(1, LOCAL // max(1, len(members)))
    for first in range(0, len(frames), few):  # a copy of all frames' coordinates would be large
        block = slice(first, first + few)
        axes = frames_of(seed_points[block], dictionary.lattice)
        local = dictionary.to_local(frames[block, members].astype(np.float64), axes)
        signals[block] = dictionary.transform(local - dictionary.shape.rest) / step
    return signals


def _drop_small(coefficients: Float64, dictionary: Dictionary, kept: float) -> None:
    """Zero all but the largest part ``kept`` of each cluster's coefficients, axis by axis (section 4.5)."""
    for where in dictionary.slices:
        n_dropped = round((1 - kept) * (where.stop - where.start))
        smallest = np.argsort(np.abs(coefficients[:, where]), axis=1, kind="stable")[:, :n_dropped]
        np.put_along_axis(coefficients[:, where], smallest, 0.0, axis=1)


def _choose(coefficients: Float64, contexts: Int64, costs: Float64, n_affine: int) -> Int64:
    """Round ``coefficients (C,)`` to the nearest integer or the next one towards 0, whichever costs less in error and bits.

    The affine values are rounded to the nearest: what is left of them has been carried into the DCT.
    """
    nearest = np.rint(coefficients).astype(np.int64)
    at = np.flatnonzero(nearest[n_affine:]) + n_affine
    if len(at):
        x, high = coefficients[at], nearest[at]
        low = high - np.sign(high)
        rows = contexts[at]
        gain = (x - low) ** 2 - (x - high) ** 2
        bits = costs[rows, tokenise(high)[0]] - costs[rows, tokenise(low)[0]]
        nearest[at] = np.where(gain < LAMBDA * bits, low, high)
    return nearest


def _projection(shapes: Float64) -> Float64:
    """The matrix ``(4, n)`` that fits the functions ``shapes (4, n)``."""
    from gvpipe.trajectory.product_kernels import solve_definite

    result = shapes.copy()
    solve_definite(gram_of_columns(shapes.T) + RIDGE * np.eye(4), result)
    return result


def _project(signals: Float64, projections: Float64, bounds: Int64) -> Float64:
    """Coefficients ``(3, 4 K)`` of ``signals (3, N)``."""
    if not signals.shape[1]:
        return np.zeros((3, 0))
    products = signals[:, None] * projections  # (3, 4, N)
    return np.add.reduceat(products, bounds[:-1], axis=2).swapaxes(1, 2).reshape(3, -1)


def _expand(coefficients: Float64, shapes: Float64, sizes: Int64) -> Float64:
    """Mirror of `_project`: ``(3, 4 K) -> (3, N)``."""
    result = np.empty((3, shapes.shape[1]))
    bounds = np.concatenate([[0], np.cumsum(sizes)])
    for k, (start, stop) in enumerate(pairwise(bounds)):
        result[:, start:stop] = product(coefficients[:, 4 * k : 4 * k + 4], shapes[:, start:stop])
    return result
