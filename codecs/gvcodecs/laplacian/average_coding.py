"""The average mesh as bytes: its coordinates coded as trajectories are, by the Laplacian of connectivity alone.

Place and size do not matter to the operators, so that they are left out: the unit is the mean edge length. What precision the
weights need is measured in docs/experiments/laplacian-average.md. They need local shape, which is what deltas keep; positions
predicted along the vertex hierarchy took 3 bits per point more at equal errors.

Source: Sorkine, Cohen-Or and Toledo, "High-pass quantization for mesh encoding", 2003.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from gvcodecs.laplacian.coefficients import decode_coefficients, encode_coefficients
from gvcodecs.laplacian.domain import Surface, build_domain
from gvcodecs.laplacian.header import CoefficientCoding
from gvcodecs.laplacian.mesh_scale import edge_lengths
from gvpipe.container.cursor import Cursor, pack_block
from gvpipe.foundation.arrays import Float64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import InputError, corrupt_section

NAME = "average"
SPACING = 256  # points per anchor
FARTHEST = 1e9  # mean edge lengths: what a decoded coordinate may have


def encode_average(points: Float64, surface: Surface, coding: CoefficientCoding) -> tuple[bytes, Float64]:
    """Code ``points (P, 3)``, model units; return the bytes and the decoded points in mean edge lengths.

    Raises:
        InputError: a point lies too far from the others.
    """
    lengths = edge_lengths(points, surface.edges)
    unit = float(lengths.mean()) if len(lengths) else 0.0
    unit = unit or float(np.abs(points).max(initial=0)) or 1.0
    own = _own_coding(coding)
    domain = build_domain(surface, None, own)
    anchors, deltas, decoded = encode_coefficients((points - points.mean(axis=0)) / unit, coding.average_step, domain, own)
    if not _is_near(decoded):
        raise InputError(
            f"the mesh reaches over {FARTHEST:.0e} mean edge lengths or more, too far for laplacian; encode it as pca"
        )
    return pack_block(anchors) + deltas, decoded


def decode_average(data: bytes, surface: Surface, coding: CoefficientCoding, budget: Budget = UNLIMITED) -> Float64:
    """Mirror of `encode_average`.

    Raises:
        CorruptFile: the bytes are not what it writes.
        TooMuchFill, OverBudget, Singular: of `gvcodecs.laplacian.normal_equations.NormalEquations`.
    """
    own = _own_coding(coding)
    cursor = Cursor(data, NAME)
    anchors = cursor.block()
    with budget.releasing():
        domain = build_domain(surface, None, own, budget=budget)
        domain.system.equations.ask_to_solve(3)
    points = decode_coefficients(anchors, cursor.rest(), 3, coding.average_step, domain, own, (NAME, NAME))
    if not _is_near(points):
        raise corrupt_section(NAME, "a position is out of range")
    return points


def _is_near(points: Float64) -> bool:
    """Whether coordinates, mean edge lengths, are within what is decoded."""
    return bool(np.abs(points).max(initial=0) < FARTHEST)


def _own_coding(coding: CoefficientCoding) -> CoefficientCoding:
    """How the average itself is coded."""
    return dataclasses.replace(coding, operator="tutte", delta_prediction="kalman", anchors=SPACING, anchor_ratio=1.0)
