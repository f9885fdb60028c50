"""Corrective shapes: what a skeleton leaves, as a few morph targets of the bind pose that the joints then move.

1. What joints leave at each vertex of each frame is taken back to the bind pose, by the inverse of the joints' blend.
2. Its principal shapes over all frames are the targets (Alexa and Mueller, "Representing Animations by Principal Components",
   2000). What they add to a vertex is left out where it is small against the error.
3. Each frame's weights follow from least squares, on what the joints make of the shapes.
4. As many shapes are kept as the error needs. Weights are shifted to 0..1, and the bind pose with them.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64
from gvpipe.metrics.vertex_errors import frame_diagonal
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import Skin

MEMORY = 1 << 29  # bytes of what the joints leave; longer sequences are looked at in some of their frames
DAMPING = 1e-2  # of the identity: blends that flatten a vertex take nothing back
FIRST = 16  # shapes that are looked at, before as many as are allowed: sixty-four take sixteen times as long
SMALL = 0.1  # of the root mean square that is left at last: what a shape adds to a vertex, at most, and is left out
TINY = 1e-6  # of the longest change that a shape makes: the same
RIDGE = 1e-9  # of a shape's energy


def correct(skin: Skin, sequence: MeshSequence, most: int, part: float, is_enough: Callable[[Skin], bool]) -> Skin | None:
    """The skin with the fewest corrective shapes that are enough, or with ``most`` of them; None if there is nothing to mend.

    Args:
        skin: without shapes, of the sequence.
        sequence: that it moves.
        most: shapes, at least 1.
        part: of the root mean square error, which must not stay; where looking begins.
        is_enough: whether a skin will do.
    """
    unit = frame_diagonal(sequence) or 1.0
    most = min(most, max(1, math.isqrt(MEMORY // (16 * sequence.n_frames))))
    shapes = _principal_shapes(skin, sequence, most, unit)
    if not len(shapes):
        return None
    equations = _equations(skin, sequence, shapes[:FIRST], unit)
    if len(shapes) > FIRST and equations.left(FIRST) > part:
        equations = _equations(skin, sequence, shapes, unit)
    else:
        shapes = shapes[:FIRST]
    tried: dict[int, tuple[Skin, bool]] = {}

    def made(count: int) -> tuple[Skin, bool]:
        if count not in tried:
            found = _with_shapes(skin, unit * shapes[:count], equations.weights(count))
            tried[count] = found, is_enough(found)
        return tried[count]

    numbers = range(1, len(shapes) + 1)
    begin = min(numbers[0] + bisect_left(numbers, True, key=lambda count: equations.left(count) <= part), len(shapes))
    low, high = begin - 1, begin  # what is below has too large an error; `high` grows until it is enough
    while not made(high)[1] and high < len(shapes):
        low, high = high, min(high + max(high - begin, 1), len(shapes))
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if made(middle)[1] else (middle, high)
    return made(high)[0]


@dataclass(frozen=True, eq=False)
class _Equations:
    """What each frame's weights of K shapes should solve.

    Args:
        normal: ``(F, K, K)``, products of the posed shapes.
        given: ``(F, K)``, their products with what is left.
        energy: sum of squares of what is left.
    """

    normal: Float64
    given: Float64
    energy: float

    def weights(self, count: int) -> Float64:
        """``(F, count)``: the best weights of the first shapes."""
        normal, given = self.normal[:, :count, :count].copy(), self.given[:, :count, None]
        at = np.arange(count)
        normal[:, at, at] += RIDGE * np.trace(normal, axis1=1, axis2=2).max(initial=1e-300)
        return np.asarray(np.linalg.solve(normal, given)[:, :, 0])

    def left(self, count: int) -> float:
        """Part of the root mean square that stays with the first shapes."""
        mended = float((self.given[:, :count] * self.weights(count)).sum())
        return math.sqrt(max(1 - mended / self.energy, 0.0)) if self.energy else 0.0


def _principal_shapes(skin: Skin, sequence: MeshSequence, most: int, unit: float) -> Float32:
    """``(K, V, 3)`` in a unit, K at most ``most``, largest first; each as large as it is in the frame that has most of it."""
    n = len(skin.bind)
    held = max(2, MEMORY // (12 * max(n, 1)))
    chosen = np.unique(np.linspace(0, sequence.n_frames - 1, min(held, sequence.n_frames)).astype(int)).tolist()
    left = np.empty((len(chosen), 3 * n), np.float32)
    damping = DAMPING * np.eye(3)
    for row, k in enumerate(chosen):
        off = (sequence.read(k, k + 1)[0].astype(np.float64) - skin.evaluate(k)) / unit
        blends = skin.blended(k)[:, :, :3]
        normal = np.einsum("vji,vjk->vik", blends, blends) + damping
        left[row] = _solve(normal, np.einsum("vji,vj->vi", blends, off)).reshape(-1)
    energies, vectors = np.linalg.eigh((left @ left.T).astype(np.float64))
    energies, vectors = energies[::-1], vectors[:, ::-1]
    count = min(most, int((energies > 1e-12 * max(energies[0], 0)).sum())) if energies[0] > 0 else 0
    shapes = vectors[:, :count].T.astype(np.float32) @ left
    shapes *= np.abs(vectors[:, :count]).max(axis=0)[:, None].astype(np.float32)
    remains = np.sqrt(max(float(energies[count:].sum()), 0.0) / (len(chosen) * n)) if n else 0.0
    made = shapes.reshape(count, n, 3)
    length = np.linalg.norm(made, axis=2)
    made[length < max(SMALL * remains, TINY * float(length.max(initial=0)))] = 0
    return made


def _solve(matrices: Float64, right: Float64) -> Float64:
    """``(n, 3)`` that solve ``matrices (n, 3, 3)`` by Cramer's rule: libraries take longer for many small ones."""
    one, two, three = np.moveaxis(matrices, 1, 0)
    inverse = np.stack([np.cross(two, three), np.cross(three, one), np.cross(one, two)], axis=2)  # times the determinant
    return np.asarray(np.einsum("vij,vj->vi", inverse, right) / (one * inverse[:, :, 0]).sum(axis=1)[:, None])


def _equations(skin: Skin, sequence: MeshSequence, shapes: Float32, unit: float) -> _Equations:
    count, energy = len(shapes), 0.0
    normal, given = np.empty((sequence.n_frames, count, count)), np.empty((sequence.n_frames, count))
    by_axis = np.ascontiguousarray(np.moveaxis(shapes, 0, 2).swapaxes(0, 1))  # (3, V, K)
    posed = np.empty((by_axis.shape[1], 3, count), np.float32)
    for first, block in sequence.chunks():
        for k, frame in enumerate(block, first):
            blends = skin.blended(k).astype(np.float32)[..., None]  # (V, 3, 4, 1)
            for axis in range(3):  # products of so small matrices take five times as long
                posed[:, axis] = sum(blends[:, axis, other] * by_axis[other] for other in range(3))
            rows = posed.reshape(-1, count)
            off = ((frame.astype(np.float64) - skin.evaluate(k)) / unit).reshape(-1)
            normal[k], given[k] = rows.T @ rows, rows.T @ off
            energy += float(np.square(off).sum())
    return _Equations(normal, given, energy)


def _with_shapes(skin: Skin, shapes: Float32, weights: Float64) -> Skin:
    """The skin with shapes and ``weights (F, K)``, which are then 0..1: programs such as Blender cut off what is less or more.

    The bind pose takes what the least weights add. What a shape adds is as large as what its weight changes.
    """
    least, spread = weights.min(axis=0), np.ptp(weights, axis=0)
    bind = skin.bind + np.tensordot(least, shapes, 1)
    scaled = (weights - least) / np.where(spread > 0, spread, 1)
    return replace(
        skin, bind=bind.astype(np.float32), shapes=shapes * spread[:, None, None].astype(np.float32), shape_weights=scaled
    )
