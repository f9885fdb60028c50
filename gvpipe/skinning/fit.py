"""A skeleton for a sequence: weights from the codec that blends affine motions, transforms fitted to the source.

1. The codec `mcgv` finds clusters and weights for a target error (Le and Deng, "Smooth Skinning Decomposition with Rigid
   Bones", 2012, with affine motions in place of rigid ones).
2. The bind pose is the first frame. With weights and bind pose given, each frame's transforms follow from least squares.
3. If the error is too large, more joints are tried.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.coding.quality_scale import quality_of
from gvpipe.coding.registry import encode_sequence, make_codec, read_skin
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.foundation.progress import Progress, silent
from gvpipe.metrics.vertex_errors import Errors, frame_diagonal, measure_errors
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import INFLUENCES, Skin

if TYPE_CHECKING:
    from scipy import sparse

CODEC = "mcgv"  # whose files have a skeleton
LOOSE = 1.35  # of the error, what the codec is asked for at first: fitting the transforms anew mends about as much
MORE = (64, 128, 256)  # joints that are tried where those that the codec finds do not do
MOST = 1024  # joints
DEFAULT_KG = 0.14  # percent: that of quality 75
RIDGE = 1e-7  # of a joint's energy, towards the joint of the frame before: what no vertex tells stays as it is


@dataclass(frozen=True)
class Wanted:
    """What a skeleton should hold; None: anything.

    Args:
        kg: Karni and Gotsman's error, percent.
        largest: distance of a vertex, model units.

    Raises:
        SettingError: one of them is no finite number above 0.
    """

    kg: float | None = None
    largest: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("target KG", self.kg), ("max error", self.largest)):
            if value is not None and not (math.isfinite(value) and value > 0):
                raise SettingError(f"{name} is {value!r}; a number above 0 is needed")

    def is_met(self, errors: Errors) -> bool:
        """Whether errors are on the allowed side."""
        kg, largest = math.inf if errors.kg is None else errors.kg, errors.max
        return (self.kg is None or kg <= self.kg) and (self.largest is None or largest <= self.largest)


class Fitted(NamedTuple):
    """A skeleton, its errors, and whether these are as small as they should be."""

    skin: Skin
    errors: Errors
    is_met: bool


def fit_skin(
    sequence: MeshSequence,
    joints: int = 0,
    kg: float | None = None,
    largest: float | None = None,
    progress: Progress | None = None,
) -> Fitted:
    """The skeleton with the fewest joints that holds an error, or the best of those that were tried.

    Args:
        sequence: to be moved.
        joints: how many, 1..1024; 0: as many as it takes.
        kg, largest: as of `Wanted`; where neither is given, a KG error of `DEFAULT_KG`.
        progress: called with each stage and the part of it that is done.

    Raises:
        InputError: there is one frame, or a frame cannot be read.
        SettingError: a number of joints or an error out of range.
    """
    if not 0 <= joints <= MOST or isinstance(joints, bool):
        raise SettingError(f"joints is {joints!r}; an integer in 1..{MOST} is needed, or 0 for as many as it takes")
    if sequence.n_frames < 2:
        raise InputError(f"{sequence.name} has one frame, which needs no skeleton; write it without one")
    wanted = Wanted(DEFAULT_KG if kg is None and largest is None else kg, largest)
    best: Fitted | None = None
    for skin in _candidates(sequence, joints, wanted, progress or silent):
        own, errors = measured(skin, sequence)
        found = Fitted(own, errors, wanted.is_met(errors))
        if found.is_met:
            return found
        if best is None or errors.rmse < best.errors.rmse:
            best = found
    if best is None:
        raise InputError(f"{sequence.name}: no skeleton was found; its frames have fewer than two vertices")
    return best


def _candidates(sequence: MeshSequence, joints: int, wanted: Wanted, report: Progress) -> Iterator[Skin]:
    kg, last = wanted.kg if wanted.kg is not None else DEFAULT_KG, 0
    tries = ((joints, 1.0),) if joints else ((0, LOOSE), (0, 1.0), *((count, 1.0) for count in MORE))
    for count, factor in tries:
        if 0 < count <= last:
            continue
        codec = make_codec(CODEC, {"quality": quality_of(factor * kg), "clusters": count})
        encoded = encode_sequence(codec, sequence, report)
        coarse = read_skin(encoded.bitstream)
        if coarse is None:
            return
        last = coarse.joints
        yield refit(coarse, sequence, report)
        yield coarse  # better where the codec's bind pose is smoother than the first frame


def refit(skin: Skin, sequence: MeshSequence, report: Progress = silent) -> Skin:
    """The same joints and weights, the first frame as the bind pose, and transforms that carry it to the frames best."""
    from scipy.linalg import cho_factor, cho_solve

    bind = sequence.read(0, 1)[0]
    diagonal = frame_diagonal(sequence) or 1.0
    centre = (bind.min(axis=0).astype(np.float64) + bind.max(axis=0)) / 2
    points = np.concatenate([(bind - centre) / diagonal, np.ones((len(bind), 1))], axis=1)
    blend = _blend(skin, points)
    normal = (blend.T @ blend).toarray()
    energies = normal.diagonal().reshape(-1, 4).sum(axis=1)
    ridge = np.repeat(RIDGE * energies + 1e-12 * max(float(energies.max()), 1.0), 4)
    factored = cho_factor(normal + np.diag(ridge), lower=True)
    transforms = np.tile(np.eye(4), (sequence.n_frames, skin.joints, 1, 1))
    before = np.zeros((4 * skin.joints, 3))  # in units of the diagonal, of displacements
    for first, block in sequence.chunks():
        for k, frame in enumerate(block, first):
            moved = (frame.astype(np.float64) - bind) / diagonal
            rows = cho_solve(factored, blend.T @ moved + ridge[:, None] * before)
            before = rows
            transforms[k, :, :3] += _to_model(rows.reshape(-1, 4, 3), centre, diagonal)
        report("skin", (first + len(block)) / sequence.n_frames)
    return Skin(skin.indices, skin.weights, bind, transforms)


def _blend(skin: Skin, points: Float64) -> sparse.csr_array:
    """``(V, 4J)``: what a row of each joint's transform moves each vertex by."""
    from scipy import sparse

    n = len(points)
    columns = (4 * skin.indices[:, :, None] + np.arange(4)).reshape(n, 4 * INFLUENCES)
    values = (skin.weights[:, :, None] * points[:, None, :]).reshape(n, 4 * INFLUENCES)
    starts = np.arange(0, values.size + 1, 4 * INFLUENCES)
    made = sparse.csr_array((values.ravel(), columns.ravel(), starts), shape=(n, 4 * skin.joints))
    made.sum_duplicates()
    return made


def _to_model(rows: Float64, centre: Float64, diagonal: float) -> Float64:
    """``(J, 3, 4)`` less identity, in model units, from ``rows (J, 4, 3)`` of points in a unit box around 0."""
    linear = np.swapaxes(rows[:, :3], 1, 2)
    shift = diagonal * rows[:, 3] - linear @ centre
    return np.concatenate([linear, shift[:, :, None]], axis=2)


def measured(skin: Skin, sequence: MeshSequence) -> tuple[Skin, Errors]:
    """The skin with its largest error about the frames of a sequence, and all errors."""
    errors = measure_errors(sequence, skin.read)
    return replace(skin, error=math.nan if errors.max_diag is None else errors.max_diag), errors
