"""Holes of a field: values that are not there, NaN in source and decoded frames.

A mask says where they are. Each of its flags is coded as whether it differs from the same row's flag in the frame before; of
later components as whether it differs from the first component's. So still holes cost a frame's outline, and moving ones
their fronts. Holes are filled before coding with the row's last value, since any value will do.
"""

from __future__ import annotations

import numpy as np

from gvpipe.fields.residual_coding import decode_residuals, encode_residuals
from gvpipe.foundation.arrays import Array, Bool
from gvpipe.foundation.errors import corrupt_section
from gvpipe.trajectory.causal_order import CausalOrder


def encode_holes(holes: Bool | None, causal: CausalOrder) -> bytes:
    """Return the bytes of a mask ``(n, R, C)``; none for None."""
    if holes is None:
        return b""
    changes = holes.astype(np.int64)
    changes[:, :, 1:] ^= changes[:, :, :1]
    changes[1:] ^= changes[:-1].copy()
    columns = changes.transpose(1, 2, 0).reshape(holes.shape[1], -1)
    return encode_residuals(columns, len(holes), causal)


def decode_holes(data: bytes, shape: tuple[int, int, int], causal: CausalOrder, name: str) -> Bool | None:
    """Mirror of `encode_holes`; ``shape`` is n, R, C. Raises `CorruptFile`."""
    if not data:
        return None
    n_frames, n_rows, n_components = shape
    columns = decode_residuals(data, n_components * n_frames, n_frames, causal, name)
    if ((columns < 0) | (columns > 1)).any():
        raise corrupt_section(name, "a flag of its holes is neither 0 nor 1")
    changes = columns.reshape(n_rows, n_components, n_frames).transpose(2, 0, 1)
    flags = np.bitwise_xor.accumulate(changes, axis=0)
    flags[:, :, 1:] ^= flags[:, :, :1].copy()
    return flags.astype(np.bool_)


def fill_holes(values: Array, holes: Bool | None) -> Array:
    """Return ``values (n, R, C)`` with each hole replaced: by the row's last value, its first one, or any at all."""
    if holes is None:
        return values
    n_frames = len(values)
    frames = np.arange(n_frames)[:, None, None]
    last = np.maximum.accumulate(np.where(holes, -1, frames), axis=0)
    first = np.minimum.accumulate(np.where(holes, n_frames, frames)[::-1], axis=0)[::-1]
    source = np.where(last >= 0, last, np.minimum(first, n_frames - 1))
    filled = np.take_along_axis(values, source, axis=0)
    empty = np.isnan(filled)  # rows without any value
    if empty.any():
        there = filled[~empty]
        filled[empty] = there.mean() if len(there) else 0
    return filled
