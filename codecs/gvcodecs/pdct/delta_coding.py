"""Range coding of delta coefficients, frame after frame, with tables that learn as they go, and a weight in time that does.

What: the three axes of a frame's quantised delta coefficients, in turn; each coefficient's context comes from how large it and
its neighbours in frequency lately were, and how large it is on the axes before.
Why not `gvpipe.entropy.integers`: its contexts must be known before a block is decoded, and the best context is what was just
decoded. All contexts, counts and probabilities are integers or one division of integers, so no rounding can part decoder and
encoder.

In smooth motion the next delta is nearly the last one; in quantisation noise it is not. Each group of coefficients (an octave
of a cluster's frequencies) finds how much repeats by least squares over the deltas decoded so far, so no flag is sent.

A value is folded and cut into a token and raw low bits as in `gvpipe.entropy.integers`. Tables start flat, gain 32 per
token and halve when they reach 65536::

    section = [varint] W, [W x u32] range-coded tokens, raw low bits, in order of frame, axis, coefficient
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gvpipe.container.cursor import Cursor, varint
from gvpipe.entropy.range_decoder import edges_of, start
from gvpipe.entropy.tokens import tokenise
from gvpipe.foundation.arrays import Float64, Int64, UInt8
from gvpipe.foundation.elementary import log2

if TYPE_CHECKING:
    from gvcodecs.pdct.delta_kernels import Layout

PROBLEMS = ("", "its range-coded data do not decode", "its raw bits end too early")  # of `delta_kernels.decode_deltas`


class DeltaEncoder:
    """Collects frames of delta coefficients of one clip, and learns from them as the decoder does."""

    def __init__(self, layout: Layout) -> None:
        from gvcodecs.pdct.delta_kernels import start_learning
        from gvpipe.entropy.range_encoder import RangeEncoder

        self._layout, self._learning = layout, start_learning(layout)
        self._coder = RangeEncoder()
        self._raw: list[UInt8] = []

    @property
    def sums(self) -> Int64:
        """``(3, C)`` of all deltas so far, units."""
        return self._learning.sums

    def predict(self) -> Int64:
        """The next delta's prediction ``(3, C)``, units."""
        from gvcodecs.pdct.delta_kernels import predict_delta

        return predict_delta(self._layout, self._learning)

    def find_contexts(self, axis: int, values: Int64, contexts: Int64) -> None:
        """Fill an axis of ``contexts (3, C)``; ``values (3, C)`` holds this frame's axes before it."""
        from gvcodecs.pdct.delta_kernels import find_contexts

        find_contexts(self._layout, self._learning, axis, values, contexts)

    def costs(self) -> Float64:
        """Bits ``(contexts, tokens)`` that a token costs, raw bits included; for the encoder's choices only."""
        from gvcodecs.pdct.delta_kernels import EXTRA_BITS

        counts = self._learning.counts
        return np.asarray(log2(counts.sum(axis=1, keepdims=True) / counts) + EXTRA_BITS)

    def add_frame(self, contexts: Int64, values: Int64) -> None:
        """Code a frame: ``values (3, C)`` in ``contexts (3, C)``."""
        from gvcodecs.pdct.delta_kernels import learn_frame

        for axis in range(3):
            tokens, extra, n_extra = tokenise(values[axis])
            for context, where in _groups(contexts[axis]):
                self._coder.encode(tokens[where], edges_of(self._learning.counts[context]))
            self._raw.append(((np.repeat(extra, n_extra) >> _shifts(n_extra)) & 1).astype(np.uint8))
        learn_frame(self._layout, self._learning, contexts, values)

    def finish(self) -> bytes:
        """Return the section."""
        words = self._coder.finish().astype("<u4")
        raw = np.packbits(np.concatenate(self._raw)).tobytes() if self._raw else b""
        return varint(len(words)) + words.tobytes() + raw


class DeltaDecoder:
    """Mirror of `DeltaEncoder`; raises `CorruptFile` where the section does not decode."""

    def __init__(self, cursor: Cursor, layout: Layout) -> None:
        from gvcodecs.pdct.delta_kernels import DeltaStream, start_learning

        self._cursor = cursor
        words = cursor.array("<u4", cursor.varint(cursor.left // 4, "the word count")).astype(np.uint32)
        raw = np.frombuffer(cursor.rest(), np.uint8)
        self._layout, self._learning = layout, start_learning(layout)
        self._stream = DeltaStream(start(words), words, raw.copy(), np.zeros(1, np.int64))

    def take_frames(self, n_frames: int) -> Int64:
        """The sums of all deltas in each of the next frames: ``(n_frames, 3, C)``, units."""
        from gvcodecs.pdct.delta_kernels import decode_deltas

        sums = np.empty((n_frames, 3, len(self._layout.kinds)), np.int64)
        status = decode_deltas(self._layout, self._learning, self._stream, sums)
        if status:
            raise self._cursor.corrupt(PROBLEMS[status])
        return sums

    def finish(self) -> None:
        """Check that no raw byte is left over."""
        if (self._stream.place[0] + 7) // 8 != len(self._stream.raw):
            raise self._cursor.corrupt("raw bits are left over")


def _shifts(widths: Int64) -> Int64:
    """The place of every bit in its value, most significant first, values of ``widths (C,)`` bits one after the other."""
    ends = np.repeat(np.cumsum(widths), widths)
    return ends - 1 - np.arange(len(ends))


def _groups(contexts: Int64) -> list[tuple[int, NDArray[np.intp]]]:
    order = np.argsort(contexts.astype(np.int16), kind="stable")
    counts = np.bincount(contexts)
    ends = np.cumsum(counts)
    return [(int(c), order[ends[c] - counts[c] : ends[c]]) for c in np.flatnonzero(counts)]
