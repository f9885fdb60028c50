"""Predictions that differ by the rounding of another machine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gvpipe.trajectory import coefficient_coding, prediction
from gvpipe.trajectory.causal_order import CausalOrder

PART = 1e-12  # of a prior weight


def perturb_predictions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Change each prior weight of predictions from causal neighbours by `PART` of it, up or down, until the test ends."""
    original = prediction.predict_vectors

    def perturbed(causal: CausalOrder, *rest: Any) -> None:
        noise = 1 + PART * np.random.default_rng(5).choice([-1, 1], len(causal.weights))
        original(causal._replace(weights=causal.weights * noise), *rest)

    monkeypatch.setattr(coefficient_coding, "predict_vectors", perturbed)
