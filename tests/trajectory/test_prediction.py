"""Predictors: what they decode is what they coded, and kalman's two forms predict the same."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.arrays import Float64
from gvpipe.trajectory import prediction_kernels
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.prediction import PREDICTORS, predict_vectors
from gvpipe.trajectory.prediction_kernels import VectorCoding
from gvpipe.trajectory.temporal_neighbours import temporal_order

STEP = 0.01


@pytest.mark.parametrize("n_components", [1, 2, 7, 60])
@pytest.mark.parametrize("predictor", PREDICTORS)
def test_decoded_is_what_was_coded(predictor: str, n_components: int) -> None:
    causal, target = _rows(n_components)
    residuals, coded = np.zeros(target.shape, np.int64), np.zeros(target.shape)
    predict_vectors(causal, STEP, residuals, coded, target, predictor, 1.8)
    decoded = np.zeros(target.shape)
    predict_vectors(causal, STEP, residuals, decoded, None, predictor, 1.8)
    assert np.array_equal(decoded, coded)
    assert np.abs(target - coded).max() < 0.0059  # ROUND_UP lets 0.58 of a step pass


@pytest.mark.parametrize("affine", [True, False])
@pytest.mark.parametrize(("n_components", "step"), [(1, STEP), (2, STEP), (7, STEP), (30, STEP), (7, STEP / 1000)])
def test_both_forms_of_kalman_predict_the_same(n_components: int, step: float, affine: bool) -> None:
    """Of the components' covariances and of the weights', whichever a vector's neighbours make cheaper; fine steps too."""
    causal, target = _rows(n_components)
    causal = causal._replace(affine=affine)
    most = int(np.diff(causal.starts).max())
    residuals, coded, decoded = np.zeros(target.shape, np.int64), np.zeros(target.shape), np.zeros(target.shape)
    coding = VectorCoding(causal, step, residuals, coded, target)
    prediction_kernels._predict_few(coding, 0, len(target), most)
    prediction_kernels._predict_many(coding._replace(decoded=decoded, target=np.zeros((0, 0))), 0, len(target), most)
    assert np.abs(residuals).max() > 10
    assert np.allclose(coded, decoded, rtol=0, atol=0.01 * step)


def _rows(n_components: int) -> tuple[CausalOrder, Float64]:
    """Smooth movements of three axes over 50 frames, far from the origin."""
    rng = np.random.default_rng(2)
    time = np.arange(50)[:, None]
    target = np.repeat(np.sin(time / rng.uniform(3, 20, n_components)) * 40 * 0.7 ** np.arange(n_components), 3, axis=0)
    return temporal_order(50), target * np.tile([1, -2, 0.5], 50)[:, None] + 1000
