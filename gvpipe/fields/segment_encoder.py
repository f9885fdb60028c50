"""Which mode holds a segment of a field in the fewest bytes; see `gvpipe.fields.segment` for the modes and the layout."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from gvpipe.container.cursor import pack_block, varint
from gvpipe.entropy.integers import encode_integers
from gvpipe.fields.derived import SIGNALS, fit_derivation
from gvpipe.fields.holes import encode_holes, fill_holes
from gvpipe.fields.prediction import STEPS, TUNINGS, WHOLE, Kind, predict_values
from gvpipe.fields.residual_coding import LARGEST, encode_residuals
from gvpipe.fields.segment import (
    DERIVED,
    EXACT,
    MODES,
    PREDICTION,
    STEP,
    TRAJECTORIES,
    TUNED,
    Place,
    by_component,
    decode_segment,
)
from gvpipe.fields.trajectories import SHARES, WORTH, encode_trajectories
from gvpipe.fields.values import FieldBound, choose_step, choose_unit, keeps_bound, to_integers
from gvpipe.foundation.arrays import Array, Bool, Float64, Int64
from gvpipe.foundation.errors import InputError
from gvpipe.trajectory.causal_order import CausalOrder

HOPE = 1.35  # other constants are tried where prediction is at most so much larger than the best; they saved up to a fifth
EXPLAINED = 0.25  # energy of changes that may be left where values follow from positions


@dataclass(frozen=True, eq=False)
class Kept:
    """What of a segment is coded by a mode: its distinct frames, and the components that are not constant.

    Args:
        values: ``(D, R, K)`` of a type of `gvpipe.fields.values.TYPES`, without holes.
        distinct: ``(n,)`` the segment's frames that these are.
        still: ``(R,)`` rows that keep their values.
        bound: on every value.
        place: where the segment belongs.
    """

    values: Array
    distinct: Bool
    still: Bool
    bound: FieldBound
    place: Place

    @property
    def n_frames(self) -> int:
        """D."""
        return len(self.values)


def encode_segment(values: Array, holes: Bool | None, bound: FieldBound, place: Place, modes: tuple[str, ...] = MODES) -> bytes:
    """Return the bytes of ``values (n, R, C)``, verified by decoding them.

    Args:
        values: of a type of `gvpipe.fields.values.TYPES`; NaN where ``holes`` are.
        holes: as ``values``, or None.
        bound: on every value.
        place: where the segment belongs.
        modes: which to try; what none of them holds within the bound is coded as ``exact``.

    Raises:
        InputError: the bytes do not decode to what they hold; this machine's arithmetic is not IEEE's.
    """
    filled = fill_holes(values, holes)
    numbers = to_integers(filled)
    distinct = _find_distinct(numbers)
    constant = (numbers == numbers[:1, :1]).all(axis=(0, 1))
    before = pack_block(encode_holes(holes, place.causal)) + pack_block(_encode_holds(distinct))
    after: bytes = constant.astype(np.uint8).tobytes() + filled[:1, :1, constant].tobytes()
    changing = numbers[distinct][:, :, ~constant]
    still = (changing == changing[:1]).all(axis=(0, 2))
    kept = Kept(filled[distinct][:, :, ~constant], distinct, still, bound, place)
    for mode, data in _choices(kept, modes) if changing.size else [(EXACT, b"")]:
        section = before + bytes([mode]) + after + data
        decoded = decode_segment(section, values.shape, values.dtype, place)
        there = slice(None) if holes is None else ~holes
        holds = holes is None or np.array_equal(np.isnan(decoded), holes)
        if holds and keeps_bound(filled[there], decoded[there], FieldBound(exact=True) if mode == EXACT else bound):
            return section
    raise InputError("a field does not decode to what was encoded; check this machine's floating-point arithmetic")


def _choices(kept: Kept, modes: tuple[str, ...]) -> Iterator[tuple[int, bytes]]:
    """Modes and bytes, the smallest first; the exact one is the last, and is made only if it is asked for."""
    still = _encode_still(kept.still, kept.place.causal)
    found: list[tuple[int, bytes]] = []
    step = choose_step(kept.values, kept.bound)
    if step:
        columns = by_component(kept.values.astype(np.float64)) / step
        if "prediction" in modes:
            found += [(PREDICTION, STEP.pack(step) + still + data) for data in _predicted(columns, kept, kept.still)]
        if "derived" in modes:
            found += [(DERIVED, data) for data in _derived(kept)]
        if "trajectories" in modes and kept.n_frames > 1:
            for share in SHARES:
                data = encode_trajectories(columns, kept.n_frames, kept.place.causal, share)
                if data is None:
                    break
                found.append((TRAJECTORIES, STEP.pack(step) + pack_block(b"") + data))
                if len(data) > WORTH * min(len(other) for _, other in found):
                    break
        usual = [len(data) for mode, data in found if mode == PREDICTION]
        if "tuned" in modes and (not usual or usual[0] < HOPE * min(len(data) for _, data in found)):
            for tuning in range(1, len(TUNINGS)):
                own = [still + bytes([tuning]) + data for data in _predicted(columns, kept, kept.still, tuning=tuning)]
                found += [(TUNED, STEP.pack(step) + data) for data in own]
    yield from sorted(found, key=lambda pair: len(pair[1]))
    unit = choose_unit(kept.values)
    exact = by_component(kept.values.astype(np.float64)) / unit
    kind = WHOLE if kept.values.dtype.kind != "f" else Kind(unit=unit)
    yield from ((EXACT, STEP.pack(unit) + still + data) for data in _predicted(exact, kept, kept.still, kind))


def _predicted(columns: Float64, kept: Kept, still: Bool, kind: Kind = STEPS, tuning: int = 0) -> list[bytes]:
    """The bytes of ``columns (R, K D)`` by prediction; none if a residual is too large."""
    residuals = predict_values(columns, kept.n_frames, kept.place.causal, still, kind, tuning)
    if np.abs(residuals).max(initial=0) >= LARGEST:
        return []
    return [encode_residuals(residuals, kept.n_frames, kept.place.causal, still)]


def _derived(kept: Kept) -> list[bytes]:
    """The bytes of values that follow from positions, for each kind that explains most of them."""
    span = kept.place.span
    if span is None or kept.n_frames < 2:
        return []
    found = []
    energy = float(np.square(np.diff(kept.values.astype(np.float64), axis=0)).sum())
    all_frames = kept.values[np.cumsum(kept.distinct) - 1]
    for kind in range(len(SIGNALS)):
        fits = [fit_derivation(all_frames, span, kind, reference) for reference in span.references]
        lefts = [kept.values - fit.values(span)[kept.distinct] for fit in fits]
        best = min(range(len(fits)), key=lambda k: float(np.square(lefts[k]).sum()))
        step = choose_step(kept.values, kept.bound) - 2 * fits[best].rounding(span)
        unexplained = float(np.square(np.diff(lefts[best], axis=0)).sum())
        if step > kept.bound.largest and unexplained < EXPLAINED * energy:
            still = np.zeros(len(kept.still), np.bool_)
            head = STEP.pack(step) + pack_block(b"") + fits[best].pack()
            found += [head + data for data in _predicted(by_component(lefts[best]) / step, kept, still)]
    return found


def _encode_still(still: Bool, causal: CausalOrder) -> bytes:
    return pack_block(encode_residuals(still[:, None].astype(np.int64), 1, causal) if still.any() else b"")


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
