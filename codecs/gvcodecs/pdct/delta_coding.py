"""Range coding of delta coefficients, frame after frame, with tables that learn as they go.

What: the three axes of a frame's quantised delta coefficients, in turn; each coefficient's context comes from how large it and
its neighbours in frequency lately were, and how large it is on the axes before.
Why not `gvpipe.entropy.integers`: its contexts must be known before a block is decoded, and the best context is what was just
decoded. All contexts, counts and probabilities are integers or one division of integers, so no rounding can part decoder and
encoder.

A value is folded and cut into a token and raw low bits as in `gvpipe.entropy.integers`. Tables start flat, gain `GAIN` per
token and halve when they reach `FULL`::

    section = [varint] W, [W x u32] range-coded tokens, raw low bits, in order of frame, axis, coefficient
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gvpipe.arrays import Float64, Int64, UInt8, UInt32
from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.tokens import DIRECT, model, tokenise

MAX_BITS = 36  # bit length of the largest folded value
N_TOKENS = DIRECT + 2 * (MAX_BITS - 4)
GAIN = 32  # of a token's count, when it occurs
FULL = 1 << 16  # tokens' counts are halved from here on
SLOW_LEVELS = np.array([1, 4, 10, 20, 36, 56, 80, 112, 160, 224, 320, 512, 1024, 2048, 4096, 16384])
N_RECENT = 5
KINDS = 2  # of coefficients: affine, DCT
N_BANDS = 16  # contexts of a clip's first frame: octaves of frequency
N_STEADY = KINDS * (len(SLOW_LEVELS) + 1) * N_RECENT
N_CONTEXTS = N_STEADY + KINDS * N_BANDS


@dataclass(frozen=True)
class Layout:
    """What is known of the C coefficients of an axis beforehand.

    Args:
        kinds: ``(C,)`` 0 affine, 1 DCT.
        bands: ``(C,)`` octave of its frequency, 0..15.
    """

    kinds: Int64
    bands: Int64


class Contexts:
    """Counts per context, and the recent magnitudes that choose the contexts; one for a clip, alike on both sides."""

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        n = len(layout.kinds)
        self.counts = np.ones((N_CONTEXTS, N_TOKENS), np.int64)
        self._slow = np.zeros((3, n), np.int64)  # running mean magnitude, 64ths
        self._last = np.zeros((3, n), np.int64)
        self._is_first = True

    def of(self, axis: int, values: Int64) -> Int64:
        """Contexts ``(C,)`` of an axis; ``values (3, C)`` holds this frame's axes before it."""
        if self._is_first:
            return N_STEADY + self._layout.kinds * N_BANDS + self._layout.bands
        slow, last = self._slow[axis], self._last[axis]
        near = 2 * slow + _beside(slow) + self._slow.sum(axis=0)
        level = np.searchsorted(SLOW_LEVELS, near >> 1, side="right")
        recent = 2 * last + _beside(last) + 2 * np.abs(values[:axis]).sum(axis=0)
        recent_level = np.minimum((recent > 0).astype(np.int64) + (recent > 1) + (recent > 3) + (recent > 7), N_RECENT - 1)
        return np.asarray((self._layout.kinds * (len(SLOW_LEVELS) + 1) + level) * N_RECENT + recent_level)

    def learn(self, contexts: Int64, values: Int64) -> None:
        """Take in a whole frame's ``contexts (3, C)`` and ``values (3, C)``."""
        pairs = contexts.ravel() * N_TOKENS + tokenise(values.ravel())[0]
        self.counts += GAIN * np.bincount(pairs, minlength=N_CONTEXTS * N_TOKENS).reshape(N_CONTEXTS, N_TOKENS)
        while (full := self.counts.sum(axis=1) > FULL).any():
            self.counts[full] = (self.counts[full] + 1) >> 1
        magnitude = np.minimum(np.abs(values), 1 << 16)
        if self._is_first:
            self._slow = 16 * magnitude
        else:
            self._slow += (64 * magnitude - self._slow) >> 3
        self._last = magnitude
        self._is_first = False

    def costs(self) -> Float64:
        """Bits ``(contexts, tokens)`` that a token costs, raw bits included; for the encoder's choices only."""
        return np.asarray(np.log2(self.counts.sum(axis=1, keepdims=True) / self.counts) + EXTRA_BITS)


class DeltaEncoder:
    """Collects frames of delta coefficients of one clip."""

    def __init__(self, layout: Layout) -> None:
        import constriction

        self.contexts = Contexts(layout)
        self._coder = constriction.stream.queue.RangeEncoder()
        self._raw: list[UInt8] = []

    def add_axis(self, contexts: Int64, values: Int64) -> None:
        """Code one axis of a frame: ``values (C,)`` in ``contexts (C,)``."""
        tokens, extra, n_extra = tokenise(values)
        for context, where in _groups(contexts):
            self._coder.encode(tokens[where].astype(np.int32), model(self.contexts.counts[context]))
        shifts = _shifts(n_extra)
        self._raw.append(((np.repeat(extra, n_extra) >> shifts) & 1).astype(np.uint8))

    def finish(self) -> bytes:
        """Return the section."""
        words: UInt32 = self._coder.get_compressed().astype("<u4")
        raw = np.packbits(np.concatenate(self._raw)).tobytes() if self._raw else b""
        return varint(len(words)) + words.tobytes() + raw


class DeltaDecoder:
    """Mirror of `DeltaEncoder`; raises `CorruptFile` where the section does not decode."""

    def __init__(self, cursor: Cursor, layout: Layout) -> None:
        import constriction

        self.contexts = Contexts(layout)
        self._cursor = cursor
        words = cursor.array("<u4", cursor.varint(cursor.left // 4, "the word count"))
        self._coder = constriction.stream.queue.RangeDecoder(words.astype(np.uint32))
        self._raw = np.unpackbits(np.frombuffer(cursor.rest(), np.uint8))
        self._position = 0

    def take_axis(self, contexts: Int64) -> Int64:
        """Return one axis of a frame: ``(C,)`` values in ``contexts (C,)``."""
        tokens = np.zeros(len(contexts), np.int64)
        try:
            for context, where in _groups(contexts):
                tokens[where] = self._coder.decode(model(self.contexts.counts[context]), len(where))
        except (ValueError, AssertionError, RuntimeError) as exc:
            raise self._cursor.corrupt("its range-coded data do not decode") from exc
        n_extra = EXTRA_BITS[tokens]
        total = int(n_extra.sum())
        bits = self._raw[self._position : self._position + total].astype(np.int64)
        if len(bits) < total:
            raise self._cursor.corrupt("its raw bits end too early")
        self._position += total
        sums = np.concatenate([[0], np.cumsum(bits << _shifts(n_extra))])
        ends = np.cumsum(n_extra)
        low = sums[ends] - sums[ends - n_extra]
        u = np.where(tokens < DIRECT, tokens, (2 + (tokens & 1) << n_extra) | low)
        return np.where(u & 1, -((u + 1) >> 1), u >> 1)

    def finish(self) -> None:
        """Check that no raw byte is left over."""
        if (self._position + 7) // 8 * 8 != len(self._raw):
            raise self._cursor.corrupt("raw bits are left over")


def _shifts(widths: Int64) -> Int64:
    """The place of every bit in its value, most significant first, values of ``widths (C,)`` bits one after the other."""
    ends = np.repeat(np.cumsum(widths), widths)
    return ends - 1 - np.arange(len(ends))


def _beside(values: Int64) -> Int64:
    """Sum of the coefficients before and after."""
    result = np.zeros_like(values)
    result[1:] += values[:-1]
    result[:-1] += values[1:]
    return result


def _groups(contexts: Int64) -> list[tuple[int, NDArray[np.intp]]]:
    order = np.argsort(contexts.astype(np.int16), kind="stable")
    counts = np.bincount(contexts)
    ends = np.cumsum(counts)
    return [(int(c), order[ends[c] - counts[c] : ends[c]]) for c in np.flatnonzero(counts)]


EXTRA_BITS = np.concatenate([np.zeros(DIRECT, np.int64), np.repeat(np.arange(3, MAX_BITS - 1), 2)])
