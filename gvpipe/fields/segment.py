"""One segment of a field: its layout, and its way from bytes back to values (`segment_encoder` has the way there).

What repeats is left out, and the rest is coded by one mode.

::

    segment = [block] holes, [block] holds, [8 bits] mode, C x [8 bits] 1 where the component is constant, else 0,
              value of each constant component, then if any is not: [float64] step (not if exact), [block] still, rest to the
              end
    holds   = nothing if all frames differ from the frame before, else [varint] D, [integers] D lengths - 1
    still   = nothing if no row keeps its values over all frames, else residuals of R flags

=============  ==========================================================================================
mode           rest
=============  ==========================================================================================
0 exact        residuals of integers in the order of the values (`gvpipe.fields.prediction`, whole)
1 prediction   residuals in steps (`gvpipe.fields.prediction`)
2 trajectories `gvpipe.fields.trajectories`
=============  ==========================================================================================

Blocks and rest hold the D distinct frames and the components that are not constant.
"""

from __future__ import annotations

import struct

import numpy as np

from gvpipe.arrays import Array, Float64, Int64
from gvpipe.container.cursor import Cursor
from gvpipe.container.segments import LARGEST_STEP
from gvpipe.entropy.integers import decode_integers
from gvpipe.errors import corrupt_section
from gvpipe.fields.holes import decode_holes
from gvpipe.fields.prediction import restore_values
from gvpipe.fields.residual_coding import decode_residuals
from gvpipe.fields.trajectories import decode_trajectories
from gvpipe.fields.values import from_integers, from_numbers
from gvpipe.trajectory.causal_order import CausalOrder

EXACT, PREDICTION, TRAJECTORIES = range(3)
MODES = ("exact", "prediction", "trajectories")
STEP = struct.Struct("<d")


def decode_segment(data: bytes, shape: tuple[int, ...], dtype: np.dtype[np.generic], causal: CausalOrder, name: str) -> Array:
    """Mirror of `gvpipe.fields.segment_encoder.encode_segment`: ``shape`` (n, R, C) of a type of
    `gvpipe.fields.values.TYPES`; holes are NaN.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
    """
    n_frames, n_rows, n_components = shape
    cursor = Cursor(data, name)
    holes = decode_holes(cursor.block(), (n_frames, n_rows, n_components), causal, name)
    if holes is not None and dtype.kind != "f":
        raise cursor.corrupt("integers have holes")
    frames = _decode_holds(cursor.block(), n_frames, name)
    mode = cursor.take(1)[0]
    flags = cursor.array("u1", n_components)
    if mode >= len(MODES) or (flags > 1).any():
        raise cursor.corrupt(f"its mode is {mode}, its flags {flags.tolist()}")
    constant = flags > 0
    result = np.zeros((int(frames[-1]) + 1, n_rows, n_components), dtype)
    if n_rows:
        result[:, :, constant] = cursor.array(dtype.str, int(constant.sum()))
    if n_rows and not constant.all():
        kept = (len(result), n_rows, int((~constant).sum()))
        result[:, :, ~constant] = _decode_kept(cursor, mode, kept, dtype, causal)
    cursor.end()
    if not np.isfinite(result).all():
        raise cursor.corrupt("a value is not finite")
    result = result[frames]
    if holes is not None:
        result[holes] = np.nan
    return result


def _decode_kept(
    cursor: Cursor, mode: int, shape: tuple[int, int, int], dtype: np.dtype[np.generic], causal: CausalOrder
) -> Array:
    """The components that are not constant, ``shape`` (D, R, C)."""
    n_frames, n_rows, n_components = shape
    step = 1.0
    if mode != EXACT:
        (step,) = cursor.struct(STEP)
        if not 0 < step <= LARGEST_STEP:  # NaN neither
            raise cursor.corrupt(f"its step is {step}")
    flags = cursor.block()
    still = np.zeros(n_rows, np.bool_)
    if flags:
        still = decode_residuals(flags, 1, 1, causal, cursor.name)[:, 0] != 0
    if mode == TRAJECTORIES:
        columns = decode_trajectories(cursor.rest(), (n_frames, n_components), causal, cursor.name)
    else:
        residuals = decode_residuals(cursor.rest(), n_components * n_frames, n_frames, causal, cursor.name, still)
        columns = restore_values(residuals, n_frames, causal, still, mode == EXACT)
    frames = np.ascontiguousarray(columns.reshape(n_rows, n_components, n_frames).transpose(2, 0, 1))
    values = _to_values(frames, step, mode, dtype)
    if values is None:
        raise cursor.corrupt("a value is out of its type's range")
    return values


def _to_values(frames: Float64, step: float, mode: int, dtype: np.dtype[np.generic]) -> Array | None:
    if mode != EXACT:
        return from_numbers(frames * step, dtype)
    if not (np.abs(frames) < 2.0**62).all():
        return None
    return from_integers(frames.astype(np.int64), dtype)


def _decode_holds(data: bytes, n_frames: int, name: str) -> Int64:
    """The distinct frame of each frame, ``(n,)``."""
    if not data:
        return np.arange(n_frames)
    cursor = Cursor(data, name)
    n_distinct = cursor.varint(n_frames, "the number of distinct frames")
    lengths = decode_integers(cursor.rest(), n_distinct, name=name) + 1
    if not n_distinct or lengths.min() < 1 or lengths.max() > n_frames or lengths.sum() != n_frames:
        raise corrupt_section(name, "its repeated frames do not fit")
    return np.repeat(np.arange(n_distinct), lengths)
