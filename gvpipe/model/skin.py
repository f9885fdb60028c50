"""A skeleton that moves a mesh: linear blend skinning of a bind pose by affine joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gvpipe.foundation.arrays import Float32, Float64, Int32
from gvpipe.foundation.errors import InputError
from gvpipe.model.clips import Clip

ROUNDING = 1e-5  # of the sum of weights
INFLUENCES = 4  # joints that a vertex follows, at most


@dataclass(frozen=True, eq=False)
class Skin:
    """Joints, and how a mesh of V vertices follows them in F frames.

    Vertex v of frame k is at ``sum over i  weights[v, i] (A bind[v] + t)``, with ``A = transforms[k, j, :3, :3]`` and
    ``t = transforms[k, j, :3, 3]`` of joint ``j = indices[v, i]``.

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
        for clip in self.clips:
            if not 0 <= clip.start < clip.stop <= self.n_frames:
                raise InputError(f"clip {clip.name!r} is of frames {clip.start}..{clip.stop}; the skin has {self.n_frames}")
        off = np.abs(self.weights.sum(axis=1, dtype=np.float64) - 1).max(initial=0)
        if not (self.weights.min(initial=0) >= 0 and off <= ROUNDING):
            raise InputError("a skin's weights are below 0, or do not add up to 1 at each vertex; divide them by their sum")

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
        return self.posed(self.transforms[frame])

    def read(self, start: int, stop: int) -> Float32:
        """Positions of frames ``start`` to ``stop``: ``(stop - start, V, 3) float32``, model units."""
        frames = [self.evaluate(k) for k in range(start, stop)]
        return np.stack(frames) if frames else np.zeros((0, *self.bind.shape), np.float32)

    def posed(self, transforms: Float64) -> Float32:
        """Positions ``(V, 3) float32`` by the joints' transforms ``(J, 4, 4)``."""
        points = np.concatenate([self.bind, np.ones((len(self.bind), 1))], axis=1)
        result = np.zeros((len(points), 3))
        for i in range(INFLUENCES):
            used = np.flatnonzero(self.weights[:, i])
            own = transforms[self.indices[used, i], :3]
            result[used] += self.weights[used, i, None] * np.einsum("vij,vj->vi", own, points[used])
        return result.astype(np.float32)

    def part(self, start: int, stop: int) -> Skin:
        """Frames ``start`` to ``stop`` alone, as one animation."""
        return replace(self, transforms=self.transforms[start:stop], clips=())


def joint_means(skin: Skin, bind: Float32) -> Float64:
    """``(J, 3)``: mean of the vertices ``bind (V, 3)`` that follow each joint, by their weights; 0 where none does."""
    sums = np.zeros((skin.joints, 4))
    points = np.concatenate([bind.astype(np.float64), np.ones((len(bind), 1))], axis=1)
    np.add.at(sums, skin.indices, skin.weights[:, :, None] * points[:, None])
    return np.asarray(sums[:, :3] / np.where(sums[:, 3:] > 0, sums[:, 3:], 1))


def extent_of(points: Float32) -> float:
    """The diagonal of the box around ``points (V, 3)``, without the overflow of float32."""
    return float(np.linalg.norm(np.ptp(points.astype(np.float64), axis=0)))
