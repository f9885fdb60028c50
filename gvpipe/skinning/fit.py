"""A skeleton for a sequence: weights from the codec that blends affine motions, transforms fitted to the source.

1. The codec `mcgv` finds clusters and weights for a target error (Le and Deng, "Smooth Skinning Decomposition with Rigid
   Bones", 2012, with affine motions in place of rigid ones).
2. The bind pose is the first frame. With weights and bind pose given, each frame's transforms follow from least squares.
3. If the error is too large, corrective shapes are added, or more joints are tried: what takes fewer bytes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gvpipe.coding.codec import Memo
from gvpipe.coding.quality_scale import quality_of
from gvpipe.coding.registry import make_codec
from gvpipe.foundation.arrays import Float32, Float64
from gvpipe.foundation.errors import InputError, SettingError
from gvpipe.foundation.progress import Progress, silent
from gvpipe.metrics.vertex_errors import Errors, frame_diagonal, measure_errors, measure_spread
from gvpipe.model.sequence import MeshSequence
from gvpipe.model.skin import INFLUENCES, Skin, joint_means
from gvpipe.runtime.blas import one_blas_thread
from gvpipe.skinning.corrective_fit import correct
from gvpipe.skinning.rigid_fit import make_rigid

if TYPE_CHECKING:
    from scipy import sparse

ONE_FRAME = "one frame needs no skeleton; write it without one"
CODEC = "mcgv"  # whose files have a skeleton
LOOSE = 1.35  # of the error, what the codec is asked for at first: fitting the transforms anew mends about as much
MORE = (64, 128, 256)  # joints that are tried where those that the codec finds do not do
MOST = 1024  # joints
DEFAULT_KG = 0.14  # percent: that of quality 75
COARSEST = 20.0  # percent
OVER_MEAN = 4.0  # times, the largest distance of a vertex is the root mean square
SMALLEST = 1e-4  # of the diagonal: joints that are smaller count as so large
SHAPES = 64  # corrective ones, at most, where no number is given
JOINT_BYTES, SHAPE_BYTES = 20.0, 5.0  # of a joint and frame, and of a shape and vertex, in compressed files of samba and cloth
ROOMY, SOME = 0.8, 0.75  # part of the error, below which fewer joints may hold it; and how many of them are tried
FEWER = 2  # times, joints that are tried with shapes in their place
LEAST = 8  # joints that shapes are left to help
RIDGE = 1e-8  # of a joint's energy, towards its motion alone: what no vertex tells follows that


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

    @property
    def joints_size(self) -> float:
        """Bytes that its joints take, about, in a compressed file."""
        return JOINT_BYTES * self.skin.joints * self.skin.n_frames

    @property
    def shapes_size(self) -> float:
        """Bytes that its corrective shapes take, about, in a compressed file."""
        return SHAPE_BYTES * len(self.skin.shapes) * len(self.skin.bind)

    @property
    def size(self) -> float:
        """Bytes of both."""
        return self.joints_size + self.shapes_size


@one_blas_thread
def fit_skin(
    sequence: MeshSequence,
    joints: int = 0,
    kg: float | None = None,
    largest: float | None = None,
    progress: Progress | None = None,
    rigid: bool = False,
    correctives: int = SHAPES,
) -> Fitted:
    """The smallest skeleton of those that were tried that holds an error, or the one with the least.

    Args:
        sequence: to be moved.
        joints: about how many, 1..1024: those that nothing follows go, and what stands still has one more; 0: as many as
            it takes.
        kg, largest: as of `Wanted`; where neither is given, nor a number of joints, a KG error of `DEFAULT_KG`.
        progress: called with each stage and the part of it that is done.
        rigid: joints turn, go and grow alike along all axes, and are tied to a tree (`gvpipe.skinning.rigid_fit`).
        correctives: shapes that may be added where joints do not hold the error, at most; 0..1024.

    Raises:
        InputError: there is one frame, or a frame cannot be read.
        SettingError: a number of joints or shapes, or an error, out of range.
    """
    if not 0 <= joints <= MOST:
        raise SettingError(f"joints is {joints!r}; an integer in 1..{MOST} is needed, or 0 for as many as it takes")
    if not 0 <= correctives <= MOST:
        raise SettingError(f"correctives is {correctives!r}; an integer in 0..{MOST} is needed")
    if sequence.n_frames < 2:
        raise InputError(f"{sequence.name}: {ONE_FRAME}")
    wanted = Wanted(DEFAULT_KG if kg is None and largest is None and not joints else kg, largest)
    search = _Search(sequence, wanted, rigid, correctives, progress or silent)
    begun = ((0, 1.0),) if rigid else ((0, LOOSE), (0, 1.0))
    for count, factor in ((joints, 1.0),) if joints else (*begun, *((count, 1.0) for count in MORE)):
        if search.look(count, factor):
            break
    if not search.held and not joints:
        search.look(LEAST, 1.0, again=True)
    if not (joints or rigid):
        search.look_for_fewer()
    found = search.held or search.best
    if found is None:
        raise InputError(f"{sequence.name}: no skeleton was found; its frames have fewer than two vertices")
    return found


@dataclass(eq=False)
class _Search:
    """Skeletons that were tried.

    Args:
        sequence, wanted, rigid, correctives, report: as `fit_skin` has them.

    Attributes:
        held: the smallest one that holds the error.
        best: of those that do not hold it, the one with the least error.
        joints: that the codec found last.
        memo: what the codec keeps of the sequence.
    """

    sequence: MeshSequence
    wanted: Wanted
    rigid: bool
    correctives: int
    report: Progress
    held: Fitted | None = None
    best: Fitted | None = None
    joints: int = 0
    memo: Memo = field(default_factory=lambda: Memo(is_shared=False))

    def look(self, count: int, factor: float, again: bool = False) -> bool:
        """Try a number of joints, 0 for any, and part of the error; returns whether more joints would be of no use.

        Fewer than those that were found before are tried ``again`` alone.
        """
        if 0 < count <= self.joints and not again:
            return False
        if self.held and JOINT_BYTES * count * self.sequence.n_frames >= self.held.size:
            return True
        codec = make_codec(CODEC, {"quality": quality_of(factor * self._kg), "clusters": count})
        coarse = codec.find_skin(self.sequence, self.report, self.memo)
        if coarse is None:
            return True
        self.joints = coarse.joints
        skin = refit(coarse, self.sequence, self.report)
        if self.rigid:
            skin = make_rigid(skin, self.sequence, self.report)
        nearest = Fitted(*measured(skin, self.sequence), False)
        if self.wanted.is_met(nearest.errors):
            self._hold(nearest._replace(is_met=True))
            return True
        corrected = self._corrected(nearest)
        if corrected and corrected.is_met:
            self._hold(corrected)
            return corrected.shapes_size <= corrected.joints_size / 2
        for each in (nearest, corrected):
            if each and (self.best is None or each.errors.rmse < self.best.errors.rmse):
                self.best = each
        return False

    @cached_property
    def _kg(self) -> float:
        """The error that the codec is asked for; what only the largest distance bounds has about so much."""
        if self.wanted.kg is not None or self.wanted.largest is None:
            return self.wanted.kg or DEFAULT_KG
        return min(COARSEST, 100 * self.wanted.largest / (OVER_MEAN * measure_spread(self.sequence)))

    def look_for_fewer(self) -> None:
        """Try fewer joints where the error has room, then with shapes in their place, for as long as that pays."""
        found = self.held
        if found and found.errors.kg is not None and self.wanted.kg and found.errors.kg < ROOMY * self.wanted.kg:
            self.look(round(found.skin.joints * SOME), 1.0, again=True)
        while self.correctives and self.held:
            before = self.held
            fewer = before.skin.joints // FEWER
            spared = JOINT_BYTES * (before.skin.joints - fewer) * self.sequence.n_frames
            is_even = before.shapes_size > before.joints_size
            if is_even or fewer < LEAST or spared <= 2 * SHAPE_BYTES * self.sequence.n_vertices:
                return
            self.look(fewer, 1.0, again=True)
            if self.held is before:
                return

    def _hold(self, found: Fitted) -> None:
        if self.held is None or found.size < self.held.size:
            self.held = found

    def _corrected(self, found: Fitted) -> Fitted | None:
        """A skeleton with the fewest corrective shapes that hold the error, or with as many as are allowed; None without any.

        What takes more than the skeleton that holds it already is not looked at.
        """
        room = math.inf if self.held is None else (self.held.size - found.joints_size) / (SHAPE_BYTES * len(found.skin.bind))
        most = int(min(self.correctives, room))
        if most < 1:
            return None
        results: dict[int, Fitted] = {}

        def is_enough(skin: Skin) -> bool:
            own, errors = measured(skin, self.sequence)
            results[len(skin.shapes)] = Fitted(own, errors, self.wanted.is_met(errors))
            return results[len(skin.shapes)].is_met

        part = (self.wanted.kg or math.inf) / (found.errors.kg or math.inf)
        corrected = correct(found.skin, self.sequence, most, 1.0 if math.isnan(part) else part, is_enough)
        return None if corrected is None else results[len(corrected.shapes)]


def refit(skin: Skin, sequence: MeshSequence, report: Progress = silent) -> Skin:
    """The same joints and weights, the first frame as the bind pose, and transforms that carry it to the frames best.

    Each joint's unknowns are about the middle of what follows it, and in units of its size. What the vertices leave open is
    drawn to what each joint would be alone: the affine motion of the vertices that follow it, by their weights.
    """
    from scipy.linalg import cho_factor, cho_solve

    bind = sequence.read(0, 1)[0]
    diagonal = frame_diagonal(sequence) or 1.0
    frames = _joint_frames(skin, bind, diagonal)
    blend, alone = _blend(skin, bind, frames)
    normal = (blend.T @ blend).toarray()
    energies = normal.diagonal().reshape(-1, 4).sum(axis=1)
    ridge = RIDGE * energies + 1e-12 * max(float(energies.max()), 1.0)
    factored = cho_factor(normal + np.diag(np.repeat(ridge, 4)), lower=True)
    transforms = np.tile(np.eye(4), (sequence.n_frames, skin.joints, 1, 1))
    for first, block in sequence.chunks():
        # displacements in units of the diagonal, (V, n, 3): frame by frame takes twenty times as long
        moved = (block.astype(np.float64) - bind).swapaxes(0, 1) / diagonal
        given = blend.T @ moved.reshape(len(bind), -1)
        own = ridge[:, None, None] * (alone @ given.reshape(skin.joints, 4, -1))
        rows = cho_solve(factored, given + own.reshape(given.shape), check_finite=False)
        fitted = rows.reshape(skin.joints, 4, len(block), 3).transpose(2, 0, 3, 1)
        transforms[first : first + len(block), :, :3] += diagonal * fitted @ frames
        report("skin", (first + len(block)) / sequence.n_frames)
    return Skin(skin.indices, skin.weights, bind, transforms)


def _joint_frames(skin: Skin, bind: Float32, diagonal: float) -> Float64:
    """``(J, 4, 4)``: from model units to those of each joint: about its weighted mean, one standard deviation long."""
    middle = joint_means(skin, bind)
    squares = np.zeros((skin.joints, 2))
    away = np.square(bind[:, None] - middle[skin.indices]).sum(axis=2)  # (V, 4)
    np.add.at(squares, skin.indices, skin.weights[:, :, None] * np.stack([away, np.ones_like(away)], axis=2))
    size = np.sqrt(squares[:, 0] / np.where(squares[:, 1] > 0, squares[:, 1], 1))
    scale = 1 / np.maximum(size, SMALLEST * diagonal)
    result = np.tile(np.eye(4), (skin.joints, 1, 1))
    result[:, :3, :3] *= scale[:, None, None]
    result[:, :3, 3] = -scale[:, None] * middle
    return result


def _blend(skin: Skin, bind: Float32, frames: Float64) -> tuple[sparse.csr_array, Float64]:
    """``(V, 4J)``: what a row of each joint's transform moves each vertex by; and ``(J, 4, 4)``, see `refit`.

    The latter makes a joint's rows, as if it were alone, from the sums of its vertices' displacements.
    """
    from scipy import sparse

    n = len(bind)
    points = np.concatenate([bind.astype(np.float64), np.ones((n, 1))], axis=1)
    own = np.einsum("viab,vb->via", frames[skin.indices], points)
    columns = (4 * skin.indices[:, :, None] + np.arange(4)).reshape(n, 4 * INFLUENCES)
    values = (skin.weights[:, :, None] * own).reshape(n, 4 * INFLUENCES)
    starts = np.arange(0, values.size + 1, 4 * INFLUENCES)
    made = sparse.csr_array((values.ravel(), columns.ravel(), starts), shape=(n, 4 * skin.joints))
    made.sum_duplicates()
    sums = np.zeros((skin.joints, 4, 4))
    np.add.at(sums, skin.indices, skin.weights[:, :, None, None] * own[:, :, :, None] * own[:, :, None, :])
    sums += 1e-6 * (np.trace(sums, axis1=1, axis2=2)[:, None, None] + 1e-12) * np.eye(4)
    return made, np.asarray(np.linalg.inv(sums), np.float64)


def measured(skin: Skin, sequence: MeshSequence) -> tuple[Skin, Errors]:
    """The skin with its errors about the frames of a sequence, and all errors."""
    errors = measure_errors(sequence, skin.read)
    largest, rmse = (math.nan if each is None else each for each in (errors.max_diag, errors.rmse_diag))
    return replace(skin, error=largest, rmse=rmse), errors
