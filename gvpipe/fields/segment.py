"""One segment of a field: its layout, and its way from bytes back to values (`segment_encoder` has the way there).

What repeats is left out, and the rest is coded by one mode.

::

    segment = [block] holes, [block] holds, [8 bits] mode, C x [8 bits] 1 where the component is constant, else 0,
              value of each constant component, then if any is not: [float64] step or unit, [block] still, rest to the
              end
    holds   = nothing if all frames differ from the frame before, else [varint] D, [integers] D lengths - 1
    still   = nothing if no row keeps its values over all frames, else residuals of R flags

=============  ==========================================================================================
mode           rest
=============  ==========================================================================================
0 exact        residuals of exact values (`gvpipe.fields.prediction`): integers, unit 1, or float32 in a unit of a power of two
1 prediction   residuals in steps (`gvpipe.fields.prediction`)
2 trajectories `gvpipe.fields.trajectories`
3 derived      a derivation (`gvpipe.fields.derived`), then residuals in steps of what does not follow, as in mode 1
4 tuned        [8 bits] which constants the filters have (`gvpipe.fields.prediction`), then residuals in steps
=============  ==========================================================================================

Blocks and rest hold the D distinct frames and the components that are not constant.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass

import numpy as np

from gvpipe.container.cursor import Cursor
from gvpipe.container.segments import LARGEST_STEP
from gvpipe.entropy.integers import decode_integers
from gvpipe.fields.derived import Derivation, Span
from gvpipe.fields.holes import decode_holes
from gvpipe.fields.prediction import STEPS, TUNINGS, WHOLE, Kind, restore_values
from gvpipe.fields.residual_coding import decode_residuals
from gvpipe.fields.trajectories import decode_trajectories
from gvpipe.fields.values import from_numbers
from gvpipe.foundation.arrays import Array, Float64, Int64
from gvpipe.foundation.budget import UNLIMITED, Budget
from gvpipe.foundation.errors import InputError, corrupt_section
from gvpipe.trajectory.causal_order import CausalOrder

EXACT, PREDICTION, TRAJECTORIES, DERIVED, TUNED = range(5)
MODES = ("exact", "prediction", "trajectories", "derived", "tuned")
STEP = struct.Struct("<d")
BYTES_PER_VALUE, SECONDS_PER_VALUE = 40, 0.4e-6
BYTES_PER_FLAG, SECONDS_PER_FLAG = 24, 0.2e-6


@dataclass(frozen=True, eq=False)
class Place:
    """Where a segment belongs.

    Args:
        causal: the order of the R rows.
        name: of the section, for messages.
        span: the motion of the segment's frames; None where positions are not known.
        budget: of the file.
    """

    causal: CausalOrder
    name: str
    span: Span | None = None
    budget: Budget = UNLIMITED


def cost(n_values: int, n_distinct: int, n_coded: int, dtype: np.dtype[np.generic]) -> tuple[float, float]:
    """Bytes of memory and seconds of work that decoding a segment takes.

    Args:
        n_values: of all frames.
        n_distinct: of the distinct frames.
        n_coded: of these, in components that are not constant.
        dtype: of the values.
    """
    memory = dtype.itemsize * n_values + (dtype.itemsize + 1) * n_distinct + BYTES_PER_VALUE * n_coded
    return memory, SECONDS_PER_VALUE * n_coded


def decode_segment(data: bytes, shape: tuple[int, ...], dtype: np.dtype[np.generic], place: Place) -> Array:
    """Mirror of `gvpipe.fields.segment_encoder.encode_segment`.

    Args:
        data: the bytes.
        shape: n, R, C.
        dtype: of the values, one of `gvpipe.fields.values.TYPES`.
        place: where the segment belongs.

    Returns:
        ``(n, R, C)`` values; holes are NaN.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
        InputError: values follow from positions, and these are not known.
    """
    n_frames, n_rows, n_components = shape
    cursor = Cursor(data, place.name)
    n_values, what = n_frames * n_rows * n_components, f"section {place.name!r}, {n_frames} frames of {n_rows} rows,"
    place.budget.ask(what, dtype.itemsize * n_values)
    mask = cursor.block()
    if mask:
        place.budget.ask(what, BYTES_PER_FLAG * n_values, SECONDS_PER_FLAG * n_values)
    holes = decode_holes(mask, (n_frames, n_rows, n_components), place.causal, place.name)
    if holes is not None and dtype.kind != "f":
        raise cursor.corrupt("integers have holes")
    frames = _decode_holds(cursor.block(), n_frames, place.name)
    mode = cursor.take(1)[0]
    flags = cursor.array("u1", n_components)
    if mode >= len(MODES) or (flags > 1).any():
        raise cursor.corrupt(f"its mode is {mode}, its flags {flags.tolist()}")
    constant = flags > 0
    n_distinct = (int(frames[-1]) + 1) * n_rows
    place.budget.ask(what, *cost(n_values, n_distinct * n_components, n_distinct * int((~constant).sum()), dtype))
    result = np.zeros((int(frames[-1]) + 1, n_rows, n_components), dtype)
    if n_rows:
        result[:, :, constant] = cursor.array(dtype.str, int(constant.sum()))
    if n_rows and not constant.all():
        with np.errstate(over="ignore", invalid="ignore"):  # of damaged bytes; what is not finite is refused below
            numbers = _decode_numbers(cursor, mode, dtype.kind != "f", int((~constant).sum()), frames, place)
        values = from_numbers(numbers, dtype, mode == EXACT)
        if values is None:
            raise cursor.corrupt("a value is out of its type's range")
        result[:, :, ~constant] = values
    cursor.end()
    if not np.isfinite(result).all():
        raise cursor.corrupt("a value is not finite")
    result = result[frames]
    if holes is not None:
        result[holes] = np.nan
    return result


def read_mode(data: bytes, name: str) -> str:
    """Which of `MODES` a segment is coded in; constant ones are ``exact``. Raises `CorruptFile`."""
    cursor = Cursor(data, name)
    cursor.block()
    cursor.block()
    mode = cursor.take(1)[0]
    if mode >= len(MODES):
        raise cursor.corrupt(f"its mode is {mode}")
    return MODES[mode]


def _decode_numbers(cursor: Cursor, mode: int, is_whole: bool, n_components: int, of_frames: Int64, place: Place) -> Float64:
    """Numbers ``(D, R, K)`` of the K components that are not constant.

    Args:
        cursor: at the step.
        mode: of `MODES`, its number.
        is_whole: whether values are integers.
        n_components: K.
        of_frames: the distinct frame of each frame.
        place: where the segment belongs.
    """
    causal, n_frames = place.causal, int(of_frames[-1]) + 1
    (step,) = cursor.struct(STEP)
    if not 0 < step <= LARGEST_STEP:  # NaN neither
        raise cursor.corrupt(f"its step is {step}")
    if mode == EXACT and (step != 1 if is_whole else math.frexp(step)[0] != 0.5):
        raise cursor.corrupt(f"its unit is {step}")
    flags = cursor.block()
    still = np.zeros(len(causal.order), np.bool_)
    if flags:
        still = decode_residuals(flags, 1, 1, causal, cursor.name)[:, 0] != 0
    if mode == TRAJECTORIES:
        columns = decode_trajectories(cursor.rest(), (n_frames, n_components), causal, cursor.name, place.budget)
        return np.asarray(by_frame(columns, n_frames) * step)
    base = None
    if mode == DERIVED:
        if place.span is None:
            raise InputError(f"{place.name!r} follows from the mesh's positions; give its reader the positions")
        derivation = Derivation.take(cursor, n_components, place.span.motion.n_frames)
        base = derivation.values(place.span)[np.flatnonzero(np.diff(of_frames, prepend=-1))]
    tuning = cursor.take(1)[0] if mode == TUNED else 0
    if tuning >= len(TUNINGS):
        raise cursor.corrupt(f"its filters have constants of number {tuning}")
    residuals = decode_residuals(cursor.rest(), n_components * n_frames, n_frames, causal, cursor.name, still)
    kind = STEPS if mode != EXACT else WHOLE if is_whole else Kind(unit=step)
    own: Float64 = by_frame(restore_values(residuals, n_frames, causal, still, kind, tuning), n_frames) * step
    return own if base is None else base + own


def by_component(values: Float64) -> Float64:
    """Columns of each row, component after component: ``(D, R, C) -> (R, C D)``."""
    return np.ascontiguousarray(values.transpose(1, 2, 0).reshape(values.shape[1], -1))


def by_frame(columns: Float64, n_frames: int) -> Float64:
    """Mirror of `by_component`."""
    return np.ascontiguousarray(columns.reshape(len(columns), -1, n_frames).transpose(2, 0, 1))


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
