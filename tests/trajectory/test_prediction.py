"""Predictors: what they decode is what they coded, and kalman's two forms predict the same."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.foundation.arrays import Float64
from gvpipe.trajectory.batch_kernels import sort_window
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.kalman_kernels import predict_in_batches
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
    coding = VectorCoding(causal, step, residuals, coded, target, np.full(n_components, step * step), 0.0)
    predict_in_batches(coding, 0, len(target), most, True)
    predict_in_batches(coding._replace(decoded=decoded, target=np.zeros((0, 0))), 0, len(target), most, False)
    assert np.abs(residuals).max() > 10
    assert np.allclose(coded, decoded, rtol=0, atol=0.01 * step)


@pytest.mark.parametrize("are_few", [True, False])
@pytest.mark.parametrize("step", [STEP, STEP / 1000])  # of the finer one some vectors take the other form
def test_vectors_side_by_side_are_predicted_as_if_alone(step: float, are_few: bool) -> None:
    causal, target = _rows(7)
    most = int(np.diff(causal.starts).max())
    residuals, coded = np.zeros(target.shape, np.int64), np.zeros(target.shape)
    coding = VectorCoding(causal, step, residuals, coded, target, np.full(7, step * step), 0.0)
    predict_in_batches(coding, 0, len(target), most, are_few)
    decoded = np.zeros(target.shape)
    for i in range(len(target)):
        predict_in_batches(coding._replace(decoded=decoded, target=np.zeros((0, 0))), i, i + 1, most, are_few)
    assert np.array_equal(decoded, coded)


def test_vectors_side_by_side_do_not_predict_one_another() -> None:
    causal, _ = _rows(1)
    ranks, bounds, depths = np.empty(512, np.int32), np.empty(514, np.int32), np.zeros(150, np.int32)
    deepest = sort_window(causal, 30, 150, 0, depths, ranks, bounds)
    assert sorted(ranks[:120]) == list(range(30, 150)) and bounds[1] == 0 and bounds[deepest + 1] == 120
    done = set(causal.order[:30].tolist())
    for depth in range(1, deepest + 1):
        own = ranks[bounds[depth] : bounds[depth + 1]]
        assert len(own)
        assert all(set(causal.neighbours[causal.starts[i] : causal.starts[i + 1]].tolist()) <= done for i in own)
        done.update(causal.order[own].tolist())


def _rows(n_components: int) -> tuple[CausalOrder, Float64]:
    """Smooth movements of three axes over 50 frames, far from the origin."""
    rng = np.random.default_rng(2)
    time = np.arange(50)[:, None]
    target = np.repeat(np.sin(time / rng.uniform(3, 20, n_components)) * 40 * 0.7 ** np.arange(n_components), 3, axis=0)
    return temporal_order(50), target * np.tile([1, -2, 0.5], 50)[:, None] + 1000
