"""One affine map for each cluster and frame, fitted by least squares."""

from __future__ import annotations

import numpy as np
from surfaces import affine_maps, bumpy_sheet

from gvcodecs.mcgv.motion.affine_fit import AffinePredictor


def test_prediction_is_least_squares() -> None:
    """Per cluster and frame the residual is that of lstsq on homogeneous coordinates; an affine motion leaves none."""
    points, _ = bumpy_sheet()
    random = np.random.default_rng(4)
    clusters = random.integers(0, 4, len(points)).astype(np.int32)
    frames = random.normal(0, 5, (5, *points.shape))
    predictor = AffinePredictor(points, clusters, 6)  # two clusters are empty
    predicted = predictor.predict(predictor.fit(frames))
    homogeneous = np.c_[points, np.ones(len(points))]
    for k in range(4):
        own = clusters == k
        for i in range(5):
            rows, *_ = np.linalg.lstsq(homogeneous[own], frames[i, own], rcond=None)
            np.testing.assert_allclose(predicted[i, own], homogeneous[own] @ rows, atol=1e-9)
    linear, shift = affine_maps(4, 5)
    moved = np.einsum("vi,vij->vj", points, linear[clusters]) + shift[clusters]
    np.testing.assert_allclose(predictor.predict(predictor.fit(moved[None]))[0], moved, atol=1e-10)
    np.testing.assert_allclose(predictor.predict(predictor.rest[None])[0], points, atol=1e-12)
    errors = predictor.squared_errors(frames, predictor.fit(frames))
    for k in range(6):
        alone = AffinePredictor(points, clusters, 6)
        local = (points - alone._frame[k, :3]) / (alone._frame[k, 3] or 1.0)
        direct = np.einsum("vj,njc->nvc", np.c_[local, np.ones(len(points))], predictor.fit(frames)[:, k])
        np.testing.assert_allclose(errors[:, k], ((frames - direct) ** 2).sum(axis=(0, 2)), rtol=1e-8, atol=1e-8)


def test_prediction_is_stable() -> None:
    """One, two and three points, coplanar and collinear ones, far from the origin: finite, no worse than the mean, and moved by
    no more than a few times as much as the input is."""
    random = np.random.default_rng(6)
    shapes = [random.normal(size=(n, 3)) for n in (1, 2, 3, 4, 30)]
    shapes += [random.normal(size=(30, 3)) * [1, 1, flat] for flat in (0, 1e-12, 1e-5, 1e-3)] + [
        np.outer(np.arange(9.0), [1, 2, 3])
    ]
    for offset in (0.0, 1e4):
        for points in shapes:
            frames = random.normal(size=(3, *points.shape)) + offset
            predictor = AffinePredictor(points + offset, np.zeros(len(points), np.int32), 1)
            predicted = predictor.predict(predictor.fit(frames))
            spread = np.sqrt(((frames - frames.mean(axis=1, keepdims=True)) ** 2).sum())
            still = np.sqrt(((frames - (points + offset)) ** 2).sum())
            assert np.sqrt(((frames - predicted) ** 2).sum()) <= max(spread, still) * (1 + 1e-9) + 1e-9
            nudged = frames + random.choice([-1e-9, 1e-9], frames.shape)
            assert np.abs(predictor.predict(predictor.fit(nudged)) - predicted).max() < 1e-7
