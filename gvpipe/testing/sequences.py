"""Small sequences that every codec must carry: one that moves well, one that half stands still, and those that break codecs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from gvpipe.model.sequence import MeshSequence


def grid(n: int) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int32]]:
    """An open sheet of n x n vertices in the unit square."""
    y, x = np.divmod(np.arange(n * n), n)
    corner = np.flatnonzero((x < n - 1) & (y < n - 1))
    faces = np.concatenate([np.c_[corner, corner + 1, corner + n], np.c_[corner + 1, corner + n + 1, corner + n]])
    return np.column_stack([x, y, np.zeros(n * n)]) / (n - 1), faces.astype(np.int32)


def waving(n: int = 14, n_frames: int = 40, name: str = "waving") -> MeshSequence:
    """A sheet that bends, turns and drifts; shuffled, so that its vertex order says nothing."""
    points, faces = grid(n)
    order = np.random.default_rng(3).permutation(len(points))
    t = np.arange(n_frames)[:, None] / 12
    x, y = points[:, 0], points[:, 1]
    height = 0.2 * np.sin(3 * x + 2 * t) * np.cos(2 * y - t) + 0.04 * np.sin(11 * x - 4 * t) * np.sin(9 * y + 3 * t)
    turned = np.stack([x * np.cos(0.2 * t) - height * np.sin(0.2 * t) + 0.1 * t, y + 0 * t, height + 0.05 * t], axis=2)
    return MeshSequence(turned[:, order].astype(np.float32), np.argsort(order)[faces].astype(np.int32), 24.0, name=name)


def partly_still() -> MeshSequence:
    """A sheet half of which waves; two vertices elsewhere and one at the sheet's middle stand still too. 20 frames."""
    points, faces = grid(12)
    t = np.arange(20)[:, None] / 6
    x = points[:, 0]
    height = np.where(x < 0.5, 0, 0.3 * np.sin(5 * x + 2 * t) * (x - 0.4))
    frames = np.stack([x + 0 * t, points[:, 1] + 0.1 * height, height], axis=2) + 7
    frames[:, 139] = frames[:1, 139]
    extra = np.array([[7.0, 8.0, 9.0], [6.5, 7.0, 7.0]])
    frames = np.concatenate([frames, np.tile(extra, (len(frames), 1, 1))], axis=1)
    order = np.random.default_rng(1).permutation(frames.shape[1])
    return MeshSequence(frames[:, order].astype(np.float32), np.argsort(order)[faces].astype(np.int32), 24.0)


def held(sequence: MeshSequence, lengths: list[int]) -> MeshSequence:
    """Each frame shown for so many frames."""
    return MeshSequence(np.repeat(np.asarray(sequence.positions[:]), lengths, axis=0), sequence.faces, sequence.fps)


def _moving(points: npt.ArrayLike, faces: npt.ArrayLike, name: str, n_frames: int = 9) -> MeshSequence:
    """Any mesh, made to sway, each vertex a little differently."""
    points = np.asarray(points, float).reshape(-1, 3)
    t = np.arange(n_frames)[:, None, None] / 5
    sway = 0.2 * np.sin(t + points.sum(axis=1)[:, None] * [1.0, 2.0, 3.0])
    positions = (points + sway).astype(np.float32)
    return MeshSequence(positions, np.asarray(faces, np.int32).reshape(-1, 3), 30.0, name=name)


def awkward() -> dict[str, MeshSequence]:
    """The inputs that every codec must survive."""
    points, faces = grid(6)
    rng = np.random.default_rng(5)
    tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    many = np.concatenate([corners + np.array([2 * i, 0, 0]) for i in range(25)])
    still = _moving(points, faces, "x").positions
    sequences = [
        _moving(corners[:3], [[0, 1, 2]], "one triangle"),
        _moving(many, (tetrahedron + 4 * np.arange(25)[:, None, None]).reshape(-1, 3), "many components"),
        _moving(points[faces.ravel()], np.arange(faces.size), "triangle soup"),
        _moving(rng.random((60, 3)), np.arange(60), "loose soup"),
        _moving(points, np.concatenate([faces, faces[:3, [0, 2, 1]], faces[:2]]), "non-manifold"),
        _moving(np.concatenate([points, points]), np.concatenate([faces, faces[:, ::-1] + 36]), "duplicate positions"),
        _moving(np.concatenate([rng.random((3, 3)), points, rng.random((2, 3))]), faces + 3, "unreferenced vertices"),
        _moving(rng.random((5, 3)), np.zeros((0, 3)), "no triangles"),
        _moving(rng.random((1, 3)), np.zeros((0, 3)), "one vertex"),
        _moving(points, np.concatenate([faces, [[0, 0, 1], [2, 2, 2]]]), "degenerate triangles"),
        _moving(points, faces, "one frame", n_frames=1),
        MeshSequence(np.repeat(np.asarray(still[:1]), 12, axis=0), faces, name="still"),
        MeshSequence(np.zeros((4, 36, 3), np.float32), faces, name="all at one point"),
        MeshSequence(np.asarray(still[:]) * np.float32(1e-20), faces, name="tiny"),
        MeshSequence(np.asarray(still[:]) * np.float32(1e20), faces, name="huge"),
        MeshSequence(np.asarray(still[:]) + np.float32(1000), faces, name="far from the origin"),
        MeshSequence(np.asarray(still[:])[[0, 1, 2, 3, 4, 4, 0, 8, 8, 1]], faces, name="jump cuts"),
        MeshSequence(np.concatenate([np.zeros_like(still[:1]), still[:]]), faces, name="base frame at one point"),
    ]
    return {sequence.name: sequence for sequence in sequences}


def same_triangles(a: npt.NDArray[np.integer], b: npt.NDArray[np.integer]) -> bool:
    """Whether two lists hold the same triangles with the same winding, in any order, each starting anywhere."""
    return _canonical(a) == _canonical(b)


def _canonical(faces: npt.NDArray[np.integer]) -> list[list[int]]:
    turns = [faces[:, [i, (i + 1) % 3, (i + 2) % 3]].tolist() for i in range(3)]
    return sorted(min(rows) for rows in zip(*turns, strict=True))
