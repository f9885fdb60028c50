"""A skeleton that moves a mesh: linear blend skinning of a bind pose, which corrective shapes may change, by affine joints."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.model.clips import Clip

if TYPE_CHECKING:
    from scipy import sparse

ROUNDING = 1e-5  # of the sum of weights
SIMILAR = 1e-4  # of a square of a scale
INFLUENCES = 4  # joints that a vertex follows, at most


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints, and how a mesh of V vertices follows them in F frames.

    Vertex v of frame k is at ``sum over i  weights[v, i] (A bind[v] + t)``, with ``A = transforms[k, j, :3, :3]`` and
    ``t = transforms[k, j, :3, 3]`` of joint ``j = indices[v, i]``. With corrective shapes, ``bind`` stands for
    ``bind + sum over c  shape_weights[k, c] shapes[c]``, as morph targets of glTF and blend shapes of USD are defined.

    Args:
        indices: ``(V, 4) int32`` joints, 0..J-1; 0 where a weight is 0.
        weights: ``(V, 4) float32``, at least 0; rows add up to exactly 1.
        bind: ``(V, 3) float32`` model units, relative to the sequence's origin.
        transforms: ``(F, J, 4, 4) float64`` for columns, model units; affine, the last row is 0 0 0 1.
        error: largest distance of a vertex from what the skin was made of, in any frame, part of the first frame's diagonal;
            NaN: not measured.
        clips: the animations that its frames are, one after the other; none: they are one.
        parents: ``(J,) int32`` of joints that turn, go and grow alike along all axes: the one above each, -1 for none; None:
            joints are affine, and none is above another one.
        pivots: ``(J, 3) float64``, where each joint lies in the bind pose; None: in the middle of what follows it.
        shapes: ``(C, V, 3) float32`` model units, of C corrective shapes; a shape is 0 where it changes nothing.
        shape_weights: ``(F, C) float64``.
        rmse: root mean square of the distances whose largest is ``error``, mean over frames, in the same unit; or NaN.

    Raises:
        InputError: arrays do not fit each other.
    """

    indices: Int32
    weights: Float32
    bind: Float32
    transforms: Float64
    error: float = float("nan")
    clips: tuple[Clip, ...] = ()
    parents: Int32 | None = None
    pivots: Float64 | None = None
    shapes: Float32 = field(default_factory=lambda: np.zeros((0, 0, 3), np.float32))
    shape_weights: Float64 = field(default_factory=lambda: np.zeros((0, 0)))
    rmse: float = float("nan")

    def __post_init__(self) -> None:
        for name, dtype in (("indices", np.int32), ("weights", np.float32), ("bind", np.float32), ("transforms", np.float64)):
            object.__setattr__(self, name, np.asarray(getattr(self, name), dtype))
        n, n_joints = len(self.bind), self.transforms.shape[1] if self.transforms.ndim > 1 else 0
        shapes = self.indices.shape, self.weights.shape, self.bind.shape, self.transforms.shape[2:]
        if shapes != ((n, INFLUENCES), (n, INFLUENCES), (n, 3), (4, 4)):
            raise InputError(f"a skin's arrays are of shapes {shapes}; (V, 4), (V, 4), (V, 3) and (F, J, 4, 4) are needed")
        if n and not 0 <= self.indices.min() <= self.indices.max() < n_joints:
            raise InputError(f"a skin names joints {self.indices.min()}..{self.indices.max()}; there are {n_joints}")
        if not (np.isfinite(self.transforms).all() and np.isfinite(self.bind).all()):
            raise InputError("a skin's bind pose or transforms are not finite")
        self._check_tree(n_joints)
        self._check_shapes()
        for clip in self.clips:
            if not 0 <= clip.start < clip.stop <= self.n_frames:
                raise InputError(f"clip {clip.name!r} is of frames {clip.start}..{clip.stop}; the skin has {self.n_frames}")
        off = np.abs(self.weights.sum(axis=1, dtype=np.float64) - 1).max(initial=0)
        if not (self.weights.min(initial=0) >= 0 and off <= ROUNDING):
            raise InputError("a skin's weights are below 0, or do not add up to 1 at each vertex; divide them by their sum")

    def _check_shapes(self) -> None:
        shapes, weights = np.asarray(self.shapes, np.float32), np.asarray(self.shape_weights, np.float64)
        if not len(shapes) and not weights.size:
            shapes, weights = np.zeros((0, len(self.bind), 3), np.float32), np.zeros((self.n_frames, 0))
        if shapes.shape != (len(shapes), len(self.bind), 3) or weights.shape != (self.n_frames, len(shapes)):
            raise InputError(
                f"a skin's shapes are {shapes.shape}, their weights {weights.shape}; (C, {len(self.bind)}, 3) and "
                f"({self.n_frames}, C) are needed"
            )
        if not (np.isfinite(shapes).all() and np.isfinite(weights).all()):
            raise InputError("a skin's shapes or their weights are not finite")
        object.__setattr__(self, "shapes", shapes)
        object.__setattr__(self, "shape_weights", weights)

    def _check_tree(self, n_joints: int) -> None:
        if self.pivots is not None:
            object.__setattr__(self, "pivots", np.asarray(self.pivots, np.float64))
            if self.pivots.shape != (n_joints, 3) or not np.isfinite(self.pivots).all():
                raise InputError(f"a skin's pivots are of shape {self.pivots.shape}, or not finite; ({n_joints}, 3) is needed")
        if self.parents is None:
            return
        object.__setattr__(self, "parents", np.asarray(self.parents, np.int32))
        above = self.parents
        if above.shape != (n_joints,) or not (above.min(initial=-1) >= -1 and above.max(initial=-1) < n_joints):
            raise InputError(f"a skin's parents are of shape {above.shape}, or none of its joints; -1 stands for none")
        for _ in range(n_joints):
            above = np.where(above >= 0, self.parents[above], -1)
        if (above >= 0).any():
            raise InputError("a skin's parents go round in a circle; one joint must have none")
        linear = self.transforms[..., :3, :3]
        square = linear @ np.swapaxes(linear, -1, -2)
        size = np.trace(square, axis1=-2, axis2=-1)[..., None, None] / 3
        if (np.abs(square - size * np.eye(3)) > SIMILAR * size + 1e-18).any() or (np.linalg.det(linear) < 0).any():
            raise InputError(
                "a skin that has parents has a joint with shear; such joints turn, go and grow alike along all axes"
            )

    @property
    def joints(self) -> int:
        """J, how many there are."""
        return int(self.transforms.shape[1])

    @property
    def n_frames(self) -> int:
        """F."""
        return len(self.transforms)

    def evaluate(self, frame: int) -> Float32:
        """Positions of a frame: ``(V, 3) float32``, model units."""
        if not len(self.shapes):
            return self.posed(self.transforms[frame])
        added = np.tensordot(self.shape_weights[frame], self.shapes, 1)
        return self.posed(self.transforms[frame], self.bind + added)

    def read(self, start: int, stop: int) -> Float32:
        """Positions of frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units."""
        frames = [self.evaluate(k) for k in range(start, stop)]
        return np.stack(frames) if frames else np.zeros((0, *self.bind.shape), np.float32)

    def posed(self, transforms: Float64, bind: Float32 | Float64 | None = None) -> Float32:
        """Positions ``(V, 3) float32`` by the joints' transforms ``(J, 4, 4)``, of another ``bind (V, 3)`` if given."""
        blended = self._blended(transforms)
        points = (self.bind if bind is None else bind).astype(np.float64)
        return np.asarray(np.einsum("vij,vj->vi", blended[:, :, :3], points) + blended[:, :, 3]).astype(np.float32)

    def blended(self, frame: int) -> Float64:
        """``(V, 3, 4)``: how the joints together turn, stretch and move what lies about each vertex in a frame."""
        return self._blended(self.transforms[frame])

    def _blended(self, transforms: Float64) -> Float64:
        return np.asarray((self._blend @ transforms[:, :3].reshape(len(transforms), 12)).reshape(-1, 3, 4))

    @cached_property
    def _blend(self) -> sparse.csr_array:
        """``(V, J)``: the weight of each joint."""
        from scipy import sparse

        rows = np.repeat(np.arange(len(self.bind)), INFLUENCES)
        shape = len(self.bind), self.joints
        return sparse.csr_array((self.weights.ravel().astype(np.float64), (rows, self.indices.ravel())), shape=shape)

    def part(self, start: int, stop: int) -> Skin:
        """Frames ``start`` to ``stop`` alone, as one animation."""
        return replace(self, transforms=self.transforms[start:stop], shape_weights=self.shape_weights[start:stop], clips=())


def joint_means(skin: Skin, bind: Float32) -> Float64:
    """``(J, 3)``: mean of the vertices ``bind (V, 3)`` that follow each joint, by their weights; 0 where none does."""
    sums = np.zeros((skin.joints, 4))
    points = np.concatenate([bind.astype(np.float64), np.ones((len(bind), 1))], axis=1)
    np.add.at(sums, skin.indices, skin.weights[:, :, None] * points[:, None])
    return np.asarray(sums[:, :3] / np.where(sums[:, 3:] > 0, sums[:, 3:], 1))


def extent_of(points: Float32) -> float:
    """The diagonal of the box around ``points (V, 3)``, without the overflow of float32."""
    return float(np.linalg.norm(np.ptp(points.astype(np.float64), axis=0)))
