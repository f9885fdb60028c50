"""Symbols come back from words, carries too, and nothing is left over."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.entropy import range_decoder, range_encoder
from gvpipe.entropy.learning_kernels import LearningStream, code_block, new_block_memory
from gvpipe.entropy.tokens import MAX_TOKENS
from gvpipe.foundation.arrays import Int64, UInt32, UInt64


def test_nothing_takes_no_words() -> None:
    assert len(range_encoder.finish(range_encoder.start(), np.zeros(4, np.uint32))) == 0


@pytest.mark.parametrize("seed", range(6))
def test_the_library_reads_what_the_encoder_writes(seed: int) -> None:
    """Symbols of any tables and values of any sizes in turn; the encoder's room grows on the way."""
    constriction = pytest.importorskip("constriction")
    rng = np.random.default_rng(seed)
    coder, written = range_encoder.RangeEncoder(), []
    for size in rng.integers(2, 88, 12).tolist():
        counts = rng.integers(0, 4097, size) * (rng.random(size) < 0.8) + 1
        symbols = rng.choice(size, int(rng.integers(0, 200)), p=counts / counts.sum())
        sizes = rng.integers(1, 1 << int(rng.integers(1, 25)), len(symbols))
        values = rng.integers(0, sizes)
        coder.encode(symbols, range_decoder.edges_of(counts))
        coder.encode_uniform(values, sizes)
        written.append((counts, symbols, sizes, values))
    decoder = constriction.stream.queue.RangeDecoder(coder.finish())
    for counts, symbols, sizes, values in written:
        model = constriction.stream.model.Categorical(counts.astype(float) / float(counts.sum()), perfect=False)
        assert (decoder.decode(model, len(symbols)) == symbols).all()
        for value, size in zip(values.tolist(), sizes.tolist(), strict=True):
            assert size == 1 or decoder.decode(constriction.stream.model.Uniform(size)) == value


@pytest.mark.parametrize("last", [1, 1 << 12, (1 << 24) - 3])
def test_carries_go_back_into_words(last: int) -> None:
    """The last of three symbols has most of the interval's upper end: long runs of words of ones, then a carry."""
    edges = np.array([0, 1, (1 << 24) - last, 1 << 24], np.uint64)
    symbols = np.random.default_rng(5).choice(3, 4000, p=[0.02, 0.03, 0.95])
    symbols[:600] = 2
    state, words = range_encoder.start(), np.zeros(4004, np.uint32)
    range_encoder.encode_symbols(state, words, edges, symbols)
    sent = range_encoder.finish(state, words)
    state, found = range_decoder.start(sent), np.zeros_like(symbols)
    assert range_decoder.decode_symbols(state, sent, edges, found)
    assert np.array_equal(found, symbols)
    assert range_decoder.may_be_exhausted(state, sent)


def test_tables_learn_alike_on_both_sides() -> None:
    rng = np.random.default_rng(6)
    contexts = rng.integers(0, 2, 3000)
    values = np.rint(rng.laplace(0, np.where(contexts, 40, 0.5))).astype(np.int64)
    values[::500] = (1 << 36) - 1

    def code(state: UInt64, words: UInt32, given: Int64 | None) -> tuple[LearningStream, Int64]:
        stream = LearningStream(state, words, np.full((2, MAX_TOKENS), 1 << 13))
        memory, found = new_block_memory(100, stream), []
        for first in range(0, len(contexts), 100):
            if given is not None:
                memory.values[:] = given[first : first + 100]
            assert code_block(stream, contexts[first : first + 100], memory, given is not None) == 0
            found.append(memory.values.copy())
        return stream, np.concatenate(found)

    written, kept = code(range_encoder.start(), np.zeros(3 * len(values), np.uint32), values)
    assert np.array_equal(kept, values)
    sent = range_encoder.finish(written.state, written.words)
    read, found = code(range_decoder.start(sent), sent, None)
    assert np.array_equal(found, values)
    assert np.array_equal(read.frequencies, written.frequencies)
    assert range_decoder.may_be_exhausted(read.state, read.words)
    assert 4 * len(sent) < 0.75 * len(values)
