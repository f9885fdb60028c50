"""Coefficients of which some come first: back with as little error, in fewer bytes; damage is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from sequences import grid

from gvcodecs.pca.coefficients import Orders, decode_coefficients, encode_coefficients
from gvpipe.container.cursor import pack_block, varint
from gvpipe.foundation.errors import CorruptFile
from gvpipe.mesh.hierarchy import build_hierarchy
from gvpipe.trajectory.coefficient_coding import encode_vectors
from gvpipe.trajectory.spatial_neighbours import hierarchy_order, parallelogram_order
from gvpipe.trajectory.trellis import GRADES
from gvpipe.trajectory.trellis_search import PENALTY

SIDE, STEP = 24, 0.01


def sheet() -> tuple[Orders, np.ndarray]:
    """Orders of a wavy sheet, and coefficients (n, 7), of which three are its shape."""
    points, faces = grid(SIDE)
    x, y = points[:, 0], points[:, 1]
    shape = np.c_[9 * x, 9 * y + np.sin(7 * x), np.sin(9 * x * y)]
    motion = np.stack([np.sin(k * x + y) / k for k in range(2, 6)], axis=1)
    orders = Orders(parallelogram_order(faces, SIDE * SIDE), hierarchy_order(build_hierarchy(faces, SIDE * SIDE)))
    return orders, np.concatenate([shape, motion], axis=1)


def decoded_of(data: bytes, orders: Orders, n_blocks: int | None = None, given: np.ndarray | None = None) -> np.ndarray:
    """Coefficients (n, 7)."""
    how: dict[str, Any] = {"name": "coefficients.0", "n_blocks": n_blocks, "given": given}
    return decode_coefficients(data, 7, STEP, orders.causal, lambda: orders.first, **how)


def test_first_components_take_fewer_bytes_and_come_back() -> None:
    orders, wanted = sheet()
    data = encode_coefficients(wanted, STEP, orders, None)
    alone, decoded = encode_vectors(wanted, STEP, orders.causal, penalty=PENALTY, flags=GRADES)
    found = decoded_of(data, orders)
    assert data[0] >= 3
    assert len(data) < 0.9 * len(alone)
    assert np.square(found - wanted).mean() < 1.3 * np.square(decoded - wanted).mean()
    part = decoded_of(data, orders, n_blocks=3)
    known = orders.causal.order[: orders.causal.blocks[3]]
    assert np.array_equal(part[known], found[known])


def test_points_that_are_given_are_neighbours() -> None:
    from gvpipe.trajectory.causal_selection import leave_out

    orders, wanted = sheet()
    held = np.arange(len(wanted)) % 5 == 0
    left = Orders(leave_out(orders.first, held), leave_out(orders.causal, held))
    data = encode_coefficients(wanted, STEP, left, wanted)
    found = decoded_of(data, left, given=wanted)
    assert data[0] > 0
    assert np.array_equal(found[held], wanted[held])
    assert np.abs(found - wanted).max() < 2 * STEP


def test_damage_is_refused() -> None:
    orders, wanted = sheet()
    data = encode_coefficients(wanted, STEP, orders, None)
    plain, _ = encode_vectors(wanted[:, :2], STEP, orders.first)
    for damaged, message in (
        (varint(8) + data[1:], "the number of first components"),
        (data[:60], "coefficients.0"),
        (varint(2) + pack_block(plain) + data, "its residuals are not on a trellis"),
    ):
        with pytest.raises(CorruptFile, match=message):
            decoded_of(damaged, orders)
