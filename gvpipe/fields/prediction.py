"""Values of a field predicted from causal neighbours and from their own past, without trajectories: for fronts that travel.

A row is coded whole, all frames and components, before the next. So its neighbours in the causal order are decoded in the same
frame, in the one before and in the one after. With S the neighbours' average under the prior weights (`spatial_neighbours` of
`gvpipe.trajectory`), a value is predicted as ``S + sum of w z`` from these signals z:

- the value less S in the frame before, and how it changed over the two frames before;
- S less S of the frame before, and S of the frame after less S;
- the value less S of the component before;
- the neighbours one by one.

Two filters learn the weights from the row's own values, by the recursion of recursive least squares with a prior (a Kalman
filter of constant weights). The first one learns fast, the second one slowly. Their guesses are averaged, each weighed by the
inverse square of its recent squared errors. The weights of the first five signals, and the errors, start from what the nearest
neighbours came to.

Values are in steps. The step is twice the bound, and a residual is rounded to a whole step, so that no value misses the
bound. With ``whole`` values are integers and predictions are rounded; then only the order of plain IEEE operations on float64
matters, which is the same everywhere, and the round trip is exact.

Source: Vasa and Skala 2010, section 3.4 (weights learnt from earlier components; see `gvpipe.trajectory.prediction`). S.
Haykin, "Adaptive Filter Theory", 2002, chapter 9 (recursive least squares).
"""

from __future__ import annotations

import numpy as np

from gvpipe.arrays import Bool, Float64, Int64
from gvpipe.trajectory.causal_order import CausalOrder


def predict_values(target: Float64, n_frames: int, causal: CausalOrder, still: Bool, whole: bool) -> tuple[Int64, Float64]:
    """Return the residuals ``(R, N)`` of ``target (R, N)``, N = C F columns, in steps, and what the decoder will have.

    Args:
        target: values in steps, component after component.
        n_frames: F.
        causal: the order of the R rows.
        still: ``(R,)`` rows that keep each component's first value.
        whole: whether values are integers, to be kept exactly.
    """
    residuals, decoded = np.zeros(target.shape, np.int64), np.zeros(target.shape)
    _run(residuals, decoded, target, (n_frames, causal, still, whole))
    return residuals, decoded


def restore_values(residuals: Int64, n_frames: int, causal: CausalOrder, still: Bool, whole: bool) -> Float64:
    """Mirror of `predict_values`: values ``(R, N)`` in steps."""
    decoded = np.zeros(residuals.shape)
    _run(residuals, decoded, np.zeros((0, 0)), (n_frames, causal, still, whole))
    return decoded


def _run(residuals: Int64, decoded: Float64, target: Float64, shared: tuple[int, CausalOrder, Bool, bool]) -> None:
    from gvpipe.fields.prediction_kernels import FieldCoding, predict_rows

    n_frames, causal, still, whole = shared
    predict_rows(FieldCoding(causal, n_frames, still, whole, residuals, decoded, np.ascontiguousarray(target)))
