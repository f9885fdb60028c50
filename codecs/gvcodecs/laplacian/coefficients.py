"""Coefficients of a segment <-> the sections ``anchors`` and ``deltas``."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gvcodecs.laplacian.domain import Domain
from gvcodecs.laplacian.format import Header
from gvpipe.row_coding import decode_rows, encode_rows

Float64 = NDArray[np.float64]


def encode_coefficients(coefficients: Float64, step: float, domain: Domain, header: Header) -> tuple[bytes, bytes]:
    """Code ``coefficients (P, R)`` with the deltas' ``step``; return the bytes of anchors and of deltas."""
    anchored = coefficients[domain.anchors.points]
    anchors, _ = encode_rows(anchored, step * header.anchor_ratio, domain.anchors.rows)
    wanted = domain.system.deltas(coefficients)[domain.delta_points]
    deltas, _ = encode_rows(wanted, step, domain.deltas, _predictor(header))
    return anchors, deltas


def decode_coefficients(
    anchors: bytes, deltas: bytes, n_components: int, step: float, domain: Domain, header: Header, number: int
) -> Float64:
    """Mirror of `encode_coefficients`: ``(P, R)``; raises `CorruptFile` if a section is not what it writes."""
    anchored = decode_rows(anchors, n_components, step * header.anchor_ratio, domain.anchors.rows, f"anchors.{number}")
    decoded = decode_rows(deltas, n_components, step, domain.deltas, f"deltas.{number}", predictor=_predictor(header))
    return domain.system.solve(domain.delta_points, decoded, anchored)


def _predictor(header: Header) -> str:
    """Section 7's weights as they stand are those of a prediction by fixed weights."""
    return "kalman" if header.delta_prediction == "kalman" else "navg"
