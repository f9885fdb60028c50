"""Which mode holds a segment of a field in the fewest bytes; see `gvpipe.fields.segment` for the modes and the layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gvpipe.arrays import Array, Bool, Float64, Int64
from gvpipe.container.cursor import pack_block, varint
from gvpipe.entropy.integers import encode_integers
from gvpipe.errors import InputError
from gvpipe.fields.holes import encode_holes, fill_holes
from gvpipe.fields.prediction import predict_values
from gvpipe.fields.residual_coding import LARGEST, encode_residuals
from gvpipe.fields.segment import EXACT, MODES, PREDICTION, STEP, TRAJECTORIES, decode_segment
from gvpipe.fields.trajectories import SHARES, WORTH, encode_trajectories
from gvpipe.fields.values import FieldBound, choose_step, keeps_bound, to_integers
from gvpipe.trajectory.causal_order import CausalOrder


@dataclass(frozen=True)
class Kept:
    """What of a segment is coded by a mode: its distinct frames, and the components that are not constant.

    Args:
        columns: ``(R, C D)`` values, component after component: steps, or integers for `EXACT`.
        n_frames: D.
        still: ``(R,)`` rows that keep their values.
        causal: the order of the R rows.
    """

    columns: Float64
    n_frames: int
    still: Bool
    causal: CausalOrder


def encode_segment(
    values: Array, holes: Bool | None, bound: FieldBound, causal: CausalOrder, modes: tuple[str, ...] = MODES
) -> bytes:
    """Return the bytes of ``values (n, R, C)``, verified by decoding them.

    Args:
        values: of a type of `gvpipe.fields.values.TYPES`; NaN where ``holes`` are.
        holes: as ``values``, or None.
        bound: on every value.
        causal: the order of the R rows.
        modes: which to try; what none of them holds within the bound is coded as ``exact``.

    Raises:
        InputError: the bytes do not decode to what they hold; this machine's arithmetic is not IEEE's.
    """
    filled = fill_holes(values, holes)
    numbers = to_integers(filled)
    distinct = _find_distinct(numbers)
    constant = (numbers == numbers[:1, :1]).all(axis=(0, 1))
    before = pack_block(encode_holes(holes, causal)) + pack_block(_encode_holds(distinct))
    after: bytes = constant.astype(np.uint8).tobytes() + filled[:1, :1, constant].tobytes()
    kept, kept_numbers = filled[distinct][:, :, ~constant], numbers[distinct][:, :, ~constant]
    still = (kept_numbers == kept_numbers[:1]).all(axis=(0, 2))
    described = pack_block(encode_residuals(still[:, None].astype(np.int64), 1, causal) if still.any() else b"")
    step = choose_step(kept, bound) if kept.size else 0.0
    choices = []
    if step:
        lossy = Kept(_columns(kept.astype(np.float64)) / step, len(kept), still, causal)
        choices = [(mode, STEP.pack(step) + described + data) for mode, data in _smallest_first(lossy, modes)]
    for mode, data in choices:
        section = before + bytes([mode]) + after + data
        if _verify(section, values, filled, holes, bound, causal):
            return section
    rest = b""
    if kept.size:
        integers = Kept(_columns(kept_numbers.astype(np.float64)), len(kept), still, causal)
        rest = described + (_encode_prediction(integers, True) or b"")
    section = before + bytes([EXACT]) + after + rest
    if not _verify(section, values, filled, holes, FieldBound(exact=True), causal):
        raise InputError("a field does not decode to what was encoded; check this machine's floating-point arithmetic")
    return section


def _verify(section: bytes, values: Array, filled: Array, holes: Bool | None, bound: FieldBound, causal: CausalOrder) -> bool:
    """Whether a segment decodes within the bound, with its holes."""
    decoded = decode_segment(section, values.shape, values.dtype, causal, "field")
    if holes is None:
        return keeps_bound(filled, decoded, bound)
    same = np.array_equal(np.isnan(decoded), holes)
    return same and keeps_bound(filled[~holes], decoded[~holes], bound)


def _smallest_first(kept: Kept, modes: tuple[str, ...]) -> list[tuple[int, bytes]]:
    """Modes and bytes, the smallest first; modes whose residuals are too large are left out."""
    found: list[tuple[int, bytes]] = []
    if "prediction" in modes:
        data = _encode_prediction(kept, False)
        if data is not None:
            found.append((PREDICTION, data))
    if "trajectories" in modes and kept.n_frames > 1:
        for share in SHARES:
            data = encode_trajectories(kept.columns, kept.n_frames, kept.causal, share)
            if data is None:
                break
            found.append((TRAJECTORIES, data))
            if len(data) > WORTH * min(len(other) for _, other in found):
                break
    return sorted(found, key=lambda pair: len(pair[1]))


def _encode_prediction(kept: Kept, whole: bool) -> bytes | None:
    residuals, _ = predict_values(kept.columns, kept.n_frames, kept.causal, kept.still, whole)
    if np.abs(residuals).max(initial=0) >= LARGEST:
        return None
    return encode_residuals(residuals, kept.n_frames, kept.causal, kept.still)


def _columns(values: Float64) -> Float64:
    """``(D, R, C) -> (R, C D)``, component after component."""
    return np.ascontiguousarray(values.transpose(1, 2, 0).reshape(values.shape[1], -1))


def _find_distinct(numbers: Int64) -> Bool:
    """Flags ``(n,)`` of the frames of ``numbers (n, R, C)`` that differ from the frame before, the first among them."""
    changed = np.ones(len(numbers), np.bool_)
    changed[1:] = (numbers[1:] != numbers[:-1]).any(axis=(1, 2))
    return changed


def _encode_holds(distinct: Bool) -> bytes:
    if distinct.all():
        return b""
    lengths = np.diff(np.flatnonzero(distinct), append=len(distinct))
    return varint(len(lengths)) + encode_integers(lengths - 1)
