"""Segments are the rigid parts of the motion, found by local affine motion (equation 1)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from surfaces import affine_maps, bumpy_sheet

from gvcodecs.mcgv.motion import affine_fit, segmentation
from gvcodecs.mcgv.motion.affine_fit import AffinePredictor
from gvcodecs.mcgv.motion.segmentation import LocalAffineFit, local_motions, segment
from gvpipe.mesh.topology import adjacency, k_ring
from gvpipe.model.sequence import MeshSequence


def walk(faces: NDArray[np.int32], start: int, k: int) -> set[int]:
    """Vertices that a path of at most k edges reaches."""
    reached = {start}
    for _ in range(k):
        reached = reached.union(*(set(face) for face in faces.tolist() if reached & set(face)))
    return reached


def test_local_motion_is_the_true_map() -> None:
    """On a mesh that moves affinely, every vertex finds that motion, up to the ridge's pull (1e-6 of the spread)."""
    points, faces = bumpy_sheet()
    linear, shift = affine_maps(4)
    frames = np.einsum("vi,nij->nvj", points, linear) + shift[:, None]
    motion = LocalAffineFit(points, k_ring(adjacency(faces, len(points)), 3)).motion(frames)
    assert motion.shape == (len(points), 4, 4, 3)
    np.testing.assert_allclose(motion[:, :, :3], np.broadcast_to(linear - np.eye(3), (len(points), 4, 3, 3)), atol=1e-4)
    moved = np.einsum("vi,vnij->nvj", points, motion[:, :, :3]) + motion[:, :, 3].swapaxes(0, 1) + points
    np.testing.assert_allclose(moved, frames, atol=1e-4)


def test_local_motion_is_the_ridge_regression() -> None:
    """Each vertex' fit to a random motion equals ordinary least squares over its 3-ring with the ridge as extra rows."""
    points, faces = bumpy_sheet(6)
    points = points / 6 - 0.4
    frames = points + np.random.default_rng(2).normal(0, 0.3, (3, *points.shape))
    motion = LocalAffineFit(points, k_ring(adjacency(faces, len(points)), 3)).motion(frames)
    for v in range(len(points)):
        ring = sorted(walk(faces, v, 3))
        centred = points[ring] - points[ring].mean(axis=0)
        ridge = 1e-6 * (centred**2).sum() + 1e-12
        rows = np.vstack([np.c_[centred, np.ones(len(ring))], np.c_[np.sqrt(ridge) * np.eye(3), np.zeros(3)]])
        for i, frame in enumerate(frames):
            wanted, *_ = np.linalg.lstsq(rows, np.vstack([(frame - points)[ring], np.zeros((3, 3))]), rcond=None)
            wanted[3] -= points[ring].mean(axis=0) @ wanted[:3]  # back from the ring's mean to the origin
            np.testing.assert_allclose(motion[v, i], wanted, atol=1e-8)


def test_motions_of_large_meshes_keep_distances(monkeypatch: pytest.MonkeyPatch) -> None:
    """Block by block, on the axes of some points, as at once on the axes of all."""
    points, faces = bumpy_sheet(20)
    ring = k_ring(adjacency(faces, len(points)), 3)
    moved = np.einsum("vi,nij->vnj", points, affine_maps(3)[0]).reshape(len(points), -1)
    moved += np.random.default_rng(5).normal(0, 1e-4, moved.shape)
    at_once = local_motions(points, ring, moved)
    monkeypatch.setattr(segmentation, "LARGE", 150)
    by_blocks = local_motions(points, ring, moved)
    near, far = (np.linalg.norm(rows[:-1] - rows[1:], axis=1) for rows in (at_once, by_blocks))
    assert by_blocks.shape == (len(points), 4 * moved.shape[1])
    np.testing.assert_allclose(far, near, rtol=1e-6)


def two_halves(n_frames: int = 6) -> tuple[MeshSequence, NDArray[np.bool_]]:
    """A sheet whose left and right halves turn rigidly about different axes."""
    points, faces = bumpy_sheet(14)
    right = points[:, 0] > 6.5
    frames = np.tile(points, (n_frames, 1, 1))
    for f in range(1, n_frames):
        c, s = np.cos(0.15 * f), np.sin(0.15 * f)
        frames[f, right] = (points[right] - 7) @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) + 7
        frames[f, ~right] = points[~right] @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return MeshSequence(frames.astype(np.float32), faces), right


def test_segmentation_finds_the_rigid_parts() -> None:
    """Two rigid halves, K = 2: exactly the halves, and the prediction then leaves nothing; the same again.

    Where the halves are one surface, neighbours have a say: a vertex at the border may go either way, here at most 1 in 100.
    """
    sequence, right = two_halves()
    base = sequence.read(0, 1)[0].astype(float)
    joined = segment(sequence, base, adjacency(sequence.faces, len(base)), 2)
    wrong = (joined == joined[13]) != right
    assert set(joined) == {0, 1} and wrong.mean() <= 0.01 and np.abs(base[wrong, 0] - 6.5).max(initial=0) < 1
    torn = sequence.faces[right[sequence.faces].all(axis=1) | ~right[sequence.faces].any(axis=1)]
    clusters = segment(sequence, base, adjacency(torn, len(base)), 2)
    assert np.array_equal(clusters == clusters[13], right)
    predictor, frames = AffinePredictor(base, clusters, 2), sequence.read(0, 6).astype(float)
    assert np.abs(predictor.predict(predictor.fit(frames)) - frames).max() < 1e-5
    assert np.array_equal(segment(sequence, base, adjacency(torn, len(base)), 2), clusters)


@pytest.mark.parametrize("n_clusters", [1, 3, 20, 1000])
def test_segmentation_numbers_its_clusters(n_clusters: int) -> None:
    """Never more than K clusters, none empty; also for more clusters than points, still points and loose points."""
    points, faces = bumpy_sheet(5)
    moving = points + np.random.default_rng(3).normal(0, 0.2, (4, *points.shape))
    for frames, triangles in ((moving, faces), (np.tile(points, (4, 1, 1)), faces), (moving, faces[:3]), (moving[:1], faces)):
        sequence = MeshSequence(frames.astype(np.float32), triangles)
        clusters = segment(sequence, points, adjacency(triangles, 25), n_clusters)
        assert clusters.shape == (25,) and set(clusters.tolist()) == set(range(int(clusters.max()) + 1))
        assert clusters.max() < n_clusters


def test_large_meshes_begin_with_some_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """A partition that begins with a quarter of the points, and looks at two frames at a time, finds the halves too."""
    sequence, right = two_halves(8)
    base = sequence.read(0, 1)[0].astype(float)
    torn = sequence.faces[right[sequence.faces].all(axis=1) | ~right[sequence.faces].any(axis=1)]
    neighbours = adjacency(torn, len(base))
    monkeypatch.setattr(segmentation, "LARGE", 100)
    monkeypatch.setattr(segmentation, "SEGMENTED", len(base) // 4)
    monkeypatch.setattr(segmentation, "REFINE_FLOATS", 6 * len(base))
    monkeypatch.setattr(affine_fit, "ROWS", 50)
    clusters = segment(sequence, base, neighbours, 2)
    assert np.array_equal(clusters == clusters[13], right)


def test_errors_add_up_block_by_block(monkeypatch: pytest.MonkeyPatch) -> None:
    """Squared errors of a few frames and points at a time are those of all at once."""
    sequence, right = two_halves()
    frames = sequence.read(0, 6).astype(float)
    predictor = AffinePredictor(frames[0], right.astype(np.int32), 2)
    at_once = predictor.squared_errors(frames, predictor.fit(frames))
    monkeypatch.setattr(affine_fit, "ROWS", 37)
    groups = [frames[:2], frames[2:]]
    np.testing.assert_allclose(
        sum(predictor.squared_errors(group, predictor.fit(group)) for group in groups), at_once, atol=1e-9
    )
