"""Values of a field predicted from causal neighbours and from their own past, without trajectories: for fronts that travel.

A row is coded whole, all frames and components, before the next. So its neighbours in the causal order are decoded in the same
frame, in the one before and in the one after. With S the neighbours' average under the prior weights (`spatial_neighbours` of
`gvpipe.trajectory`), a value is predicted as ``S + sum of w z`` from these signals z:

- the value less S in the frame before, and how it changed over the two frames before;
- S less S of the frame before, and S of the frame after less S;
- the value less S of the component before;
- the neighbours one by one.

Two filters learn the weights from the row's own values, by the recursion of recursive least squares with a prior (a Kalman
filter of constant weights). The first one learns fast, the second one slowly: how much so is one of `TUNINGS`. Their guesses
are averaged, each weighed by the inverse square of its recent squared errors. The weights of the first five signals, and the
errors, start from what the nearest neighbours came to.

Values are in steps. The step is twice the bound, and a residual is rounded to a whole step, so that no value misses the bound.

Exact values come in two kinds. Of integers, predictions are rounded. Of float32, a residual counts the numbers of float32
from the one nearest to the prediction, in the order of floats; values are in units of a power of two. Both decode alike
wherever float64 and float32 are IEEE's and sums keep their order.

Source: Vasa and Skala 2010, section 3.4 (weights learnt from earlier components; see `gvpipe.trajectory.prediction`). S.
Haykin, "Adaptive Filter Theory", 2002, chapter 9 (recursive least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.foundation.arrays import Bool, Float64, Int64
from gvpipe.trajectory.causal_order import CausalOrder


@dataclass(frozen=True)
class Kind:
    """What residuals are: whole steps of real numbers by default.

    Args:
        whole: values are integers, kept exactly.
        unit: above 0: values are float32 over this power of two, kept exactly.
    """

    whole: bool = False
    unit: float = 0.0


STEPS, WHOLE = Kind(), Kind(whole=True)
# Constants of both filters: prior variance of a shared weight; of a neighbour's, in that of the causal order; variance of what
# weights do not explain, as a share of the residuals' and in steps squared; share of a residual's square in their variance.
# The second set suits smooth fields inside of volumes, such as a temperature.
TUNINGS = (
    ((0.15, 1.5, 0.25, 0.05, 0.2), (0.05, 0.3, 1.0, 0.3, 0.05)),
    ((0.15, 0.03, 0.12, 0.1, 0.9), (0.05, 0.01, 1.35, 0.05, 0.12)),
)


def predict_values(
    target: Float64, n_frames: int, causal: CausalOrder, still: Bool, kind: Kind = STEPS, tuning: int = 0
) -> Int64:
    """Return the residuals ``(R, N)`` of ``target (R, N)``, N = C F columns.

    Args:
        target: values in steps, or as ``kind`` says, component after component.
        n_frames: F.
        causal: the order of the R rows.
        still: ``(R,)`` rows that keep each component's first value.
        kind: of the residuals.
        tuning: which of `TUNINGS` the filters have.
    """
    residuals, decoded = np.zeros(target.shape, np.int64), np.zeros(target.shape)
    _run(residuals, decoded, target, (n_frames, causal, still, kind, tuning))
    return residuals


def restore_values(
    residuals: Int64, n_frames: int, causal: CausalOrder, still: Bool, kind: Kind = STEPS, tuning: int = 0
) -> Float64:
    """Mirror of `predict_values`: values ``(R, N)``; NaN where a residual leads to no float32."""
    decoded = np.zeros(residuals.shape)
    _run(residuals, decoded, np.zeros((0, 0)), (n_frames, causal, still, kind, tuning))
    return decoded


def _run(residuals: Int64, decoded: Float64, target: Float64, shared: tuple[int, CausalOrder, Bool, Kind, int]) -> None:
    from gvpipe.fields import prediction_kernels as kernels

    n_frames, causal, still, kind, tuning = shared
    number = kernels.FLOATS if kind.unit else kernels.WHOLE if kind.whole else kernels.STEPS
    target, n_rows = np.ascontiguousarray(target), len(causal.order)
    learnt = np.zeros((n_rows, kernels.N_FILTERS, kernels.N_SHARED + 2))
    coding = kernels.FieldCoding(
        causal, n_frames, still, number, kind.unit, np.array(TUNINGS[tuning]), residuals, decoded, target, learnt
    )
    kernels.predict_rows(coding, 0, n_rows)
