"""Feature vectors <-> bytes: residuals of closed-loop prediction, range coded in contexts of their expected magnitude.

A residual's magnitude is forecast from integers alone, all decoded before:

- the mean magnitude of its component, which is sent;
- how large the vector's earlier components came out against theirs, over a short and a long span;
- how large the same component was in the block before;
- how large it was in the causal neighbours.

The forecast is a product of powers of these, worked out as a sum of integer logarithms. In half octaves it is the context,
which picks one of `N_CONTEXTS` frequency tables::

    vectors = [varint] bytes of the levels, levels: R integers (`gvpipe.entropy.integers`), differences; then blocks
              (`gvpipe.entropy.block_coder`): for every block of vectors, every component's residuals
    level   = of the component's mean magnitude m: the largest with 2 ** (level / 4) <= 64 m + 1

Residuals on a trellis (`gvpipe.trajectory.trellis`) have the same levels and blocks. Their stream is [varint] flags, then
words; its tables learn (`gvpipe.trajectory.trellis_coding`). Their forecast has powers of its own for a basis, for first
components and for those that follow (`gvpipe.trajectory.contexts.TREND_POWERS`). Trends, which follow a vector's components one
by one, take the place of spans, and what earlier blocks have left of a component's mean counts, too.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gvpipe.container.cursor import Cursor, pack_block, varint
from gvpipe.entropy.block_coder import BlockDecoder, BlockEncoder
from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.arrays import Float64, Int32, Int64, Integers
from gvpipe.runtime.ahead import run_ahead
from gvpipe.trajectory.causal_order import CausalOrder
from gvpipe.trajectory.contexts import (
    MAX_LEVEL,
    N_CONTEXTS,
    REST,
    Residuals,
    check_residuals,
    context_inputs,
    first_means,
    level_of,
)
from gvpipe.trajectory.prediction import predict_vectors, start_vectors
from gvpipe.trajectory.trellis import FINDS_NOISES, FINENESS, GRADES, PARTS, WHAT, block_steps, find_noises
from gvpipe.trajectory.trellis_coding import TrellisDecoder, encode_numbers
from gvpipe.trajectory.trellis_search import search

MOST_FLAGS = GRADES | FINDS_NOISES | REST << WHAT  # of residuals on a trellis, in place of the number of contexts
MAX_VALUES = 1 << 27  # of a section: vectors times components
PART, MOST_PARTS = 4096, 16  # vectors whose residuals are decoded before they are predicted, about; parts of all of them


def encode_vectors(
    target: Float64,
    step: float,
    causal: CausalOrder,
    predictor: str = "kalman",
    beta: float = 1.8,
    given: Float64 | None = None,
    penalty: float | None = None,
    factor: Float64 | None = None,
    flags: int = 0,
    known: Float64 | None = None,
    rounds: bool = False,
) -> tuple[bytes, Float64]:
    """Code ``target (n, R)``; return the bytes and what the decoder will have, ``(n, R)``; on a trellis but for the last bits.

    Args:
        target: n vectors of R components, in the order of transmission.
        step: quantisation step, in the unit of the components.
        causal: the order of the vectors.
        predictor: one of `gvpipe.trajectory.prediction.PREDICTORS`.
        beta: exponent of the radial function (rbf).
        given: ``(n, R)`` decoded vectors that ``causal`` leaves out (`gvpipe.trajectory.causal_selection.leave_out`); contexts
            take their residuals for 0.
        penalty: of a bit, in squared fine steps, for residuals on a trellis (`gvpipe.trajectory.trellis`, ``kalman`` alone);
            None: residuals of plain rounding.
        factor: how errors of the vectors add up, on a trellis (`gvpipe.trajectory.trellis_search.search`).
        flags: of a stream on a trellis (`gvpipe.trajectory.trellis`).
        known: ``(n, K)`` decoded first components of all vectors, on a trellis: the others alone are coded.
        rounds: as of `gvpipe.trajectory.trellis_search.search`, on a trellis.

    Raises:
        InputError: a value is too large for the step.
    """
    if penalty is not None:
        return _encode_trellis(
            target, causal, search(target, step, causal, given, penalty, factor, flags, known, rounds), flags
        )
    from gvpipe.trajectory.context_kernels import find_all_contexts

    wide = np.zeros((len(causal.order), target.shape[1]), np.int64)
    decoded = np.zeros(target.shape) if given is None else given.copy()
    predict_vectors(causal, step, wide, decoded, target, predictor, beta)
    largest = check_residuals(wide)
    residuals: Integers = wide.astype(np.int32) if largest <= np.iinfo(np.int32).max else wide
    del wide  # what follows takes as much memory again
    levels = level_of(residuals)
    contexts = find_all_contexts(residuals, context_inputs(causal, len(target), levels, len(causal.blocks) - 1))
    coder = BlockEncoder(N_CONTEXTS)
    for first, end in pairwise(causal.blocks.tolist()):
        for c in range(target.shape[1]):
            coder.add(residuals[first:end, c], contexts[first:end, c])
    head = encode_integers(np.diff(levels, prepend=0))
    return pack_block(head) + coder.finish(), decoded


def _encode_trellis(
    target: Float64, causal: CausalOrder, found: tuple[Int64, Int64, Float64], flags: int
) -> tuple[bytes, Float64]:
    """As `encode_vectors`, of what was found on the trellis (`search`): in contexts by trends or by spans, what is smaller."""
    numbers, ranked, decoded = found
    check_residuals(ranked)
    levels, streams = level_of(ranked), []
    for what in dict.fromkeys((flags >> WHAT, 0)):
        words = encode_numbers(numbers, context_inputs(causal, len(target), levels, len(causal.blocks) - 1, what))
        streams.append(varint(flags % (1 << WHAT) | what << WHAT) + words)
    return pack_block(encode_integers(np.diff(levels, prepend=0))) + min(streams, key=len), decoded


def decode_vectors(
    data: bytes,
    n_components: int,
    step: float,
    causal: CausalOrder,
    name: str,
    n_blocks: int | None = None,
    predictor: str = "kalman",
    beta: float = 1.8,
    given: Float64 | None = None,
    known: Float64 | None = None,
    rounds: bool = False,
) -> Float64:
    """Mirror of `encode_vectors`: ``(n, R)``.

    Args:
        data: the bytes.
        n_components: R.
        step, causal, predictor, beta, given, known, rounds: as for `encode_vectors`.
        name: of the section, for messages.
        n_blocks: decode the first so many blocks alone, other vectors stay 0; None: all.

    Raises:
        CorruptFile: the bytes are not what the encoder writes.
    """
    from gvpipe.trajectory.context_kernels import decode_residuals

    cursor = Cursor(data, name)
    n_coded = n_components - (0 if known is None else known.shape[1])
    if len(causal.order) * n_components > MAX_VALUES:  # zeros may cost no bits: believe no counts beyond this
        raise cursor.corrupt(f"{len(causal.order)} vectors of {n_components} components")
    head = cursor.block()
    levels = np.cumsum(decode_integers(head, n_coded, name=name))
    if ((levels < 0) | (levels > MAX_LEVEL)).any():
        raise cursor.corrupt("a magnitude level is out of range")
    rest = cursor.rest()
    flags = _flags(rest)
    if flags is None and (rounds or known is not None):
        raise cursor.corrupt("its residuals are not on a trellis")
    if flags and predictor != "kalman":
        raise cursor.corrupt("its flags are those of the predictor kalman")
    what = (flags or 0) >> WHAT
    coder = BlockDecoder(rest, N_CONTEXTS, name) if flags is None else TrellisDecoder(rest[1:], what > 0, name)
    steps = block_steps(step if flags is None else step * FINENESS, len(causal.blocks) - 1, flags or 0).tolist()
    wanted = len(causal.blocks) - 1 if n_blocks is None else n_blocks
    n_vectors = int(causal.blocks[wanted])
    decoded = start_vectors((len(causal.order), n_components), given, known)
    inputs = context_inputs(causal, len(decoded), levels, wanted, what)
    ranked, rows = np.zeros((n_vectors, n_coded), np.int64), np.zeros((n_coded, n_vectors), np.int64)
    residuals = Residuals(ranked, rows, first_means(inputs))

    def take(blocks: tuple[int, int]) -> tuple[int, int]:
        """Decode the residuals of blocks, and return these."""
        if isinstance(coder, TrellisDecoder):
            coder.take(residuals, inputs, *blocks)
        else:
            coder.check(decode_residuals(residuals, inputs, coder.stream, *blocks))
        return blocks

    parts = _parts(causal.blocks[: wanted + 1])
    bounds = causal.blocks.tolist()
    for first, last in run_ahead(take, parts, len(parts), n_threads=1):  # predict while the next ones are decoded
        for b, end in pairwise([*range(first, last), last] if flags else [first, last]):
            noises = find_noises(ranked[bounds[max(0, b - 1)] : bounds[b]], steps[b], flags or 0, n_components - n_coded)
            unit = steps[b] / PARTS if rounds else 0.0
            predict_vectors(causal, steps[b], ranked, decoded, None, predictor, beta, bounds[b], bounds[end], noises, unit)
    if n_blocks is None:
        coder.end()
    return decoded


def stream_flags(data: bytes, name: str) -> int:
    """Flags of the stream of bytes that `encode_vectors` wrote; 0 if it is not on a trellis."""
    cursor = Cursor(data, name)
    cursor.block()
    return _flags(cursor.rest()) or 0


def _flags(stream: bytes) -> int | None:
    """Flags of a stream on a trellis, or None."""
    return stream[0] if stream and stream[0] <= MOST_FLAGS else None


def _parts(bounds: Int32) -> list[tuple[int, int]]:
    """Up to `MOST_PARTS` runs of blocks, of about `PART` vectors or more; ``bounds (B + 1,)`` of blocks."""
    n_parts = max(1, min(MOST_PARTS, int(bounds[-1]) // PART))
    starts = np.searchsorted(bounds, bounds[-1] / n_parts * np.arange(n_parts))
    return list(pairwise(np.unique([*starts, len(bounds) - 1]).tolist()))
