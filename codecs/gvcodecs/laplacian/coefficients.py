"""Coefficients of a segment <-> the sections ``anchors`` and ``deltas``.

Deltas come first: they do not depend on the anchors' values, which are chosen to make good what the deltas' rounding did.
"""

from __future__ import annotations

from gvcodecs.laplacian.domain import Domain
from gvcodecs.laplacian.header import CoefficientCoding
from gvpipe.foundation.arrays import Float64
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors


def encode_coefficients(
    coefficients: Float64, step: float, domain: Domain, coding: CoefficientCoding, given: Float64 | None = None
) -> tuple[bytes, bytes, Float64]:
    """Code ``coefficients (P, R)`` with the deltas' ``step``; return the bytes of anchors and deltas, and what they decode to.

    ``given (P, R)`` has the coefficients of the points that stand still, which are those in ``coefficients``.
    """
    target = domain.system.deltas(coefficients)[domain.delta_points]
    deltas, rounded = encode_vectors(target, step, domain.deltas, _predictor(coding))
    if len(target):
        anchored = domain.system.fit_anchors(domain.delta_points, rounded, coefficients)
    else:  # nothing was rounded
        anchored = domain.anchors.select(coefficients)
    anchors, sent = encode_vectors(
        anchored, step * coding.anchor_ratio, domain.anchors.causal, given=_of_anchors(given, domain)
    )
    return anchors, deltas, domain.system.solve(domain.delta_points, rounded, sent)


def decode_coefficients(
    anchors: bytes,
    deltas: bytes,
    n_components: int,
    step: float,
    domain: Domain,
    coding: CoefficientCoding,
    names: tuple[str, str],
    given: Float64 | None = None,
) -> Float64:
    """Mirror of `encode_coefficients`: ``(P, R)``; raises `CorruptFile` naming the section that is not what it writes."""
    anchor_step, held = step * coding.anchor_ratio, _of_anchors(given, domain)
    anchored = decode_vectors(anchors, n_components, anchor_step, domain.anchors.causal, names[0], given=held)
    decoded = decode_vectors(deltas, n_components, step, domain.deltas, names[1], predictor=_predictor(coding))
    return domain.system.solve(domain.delta_points, decoded, anchored)


def _of_anchors(given: Float64 | None, domain: Domain) -> Float64 | None:
    return None if given is None else given[domain.anchors.points]


def _predictor(coding: CoefficientCoding) -> str:
    """Section 7's weights as they stand are those of a prediction by fixed weights."""
    return "kalman" if coding.delta_prediction == "kalman" else "navg"
