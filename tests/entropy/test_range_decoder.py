"""The compiled range decoder against the library that encodes."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.entropy import range_decoder


@pytest.mark.parametrize("seed", range(12))
def test_compiled_range_decoder_reads_what_the_library_writes(seed: int) -> None:
    """Symbols of any tables and raw bits in any mixture; then nothing is left."""
    constriction = pytest.importorskip("constriction")
    rng = np.random.default_rng(seed)
    coder = constriction.stream.queue.RangeEncoder()
    written: list[tuple[np.ndarray | None, int, int]] = []
    for _ in range(int(rng.integers(0, 600))):
        if rng.random() < 0.3:
            width = int(rng.integers(1, 17))
            written.append((None, width, int(rng.integers(0, 1 << width))))
            coder.encode(
                np.array([written[-1][2]], np.int32), constriction.stream.model.Uniform(), np.array([1 << width], np.int32)
            )
        else:
            counts = rng.integers(0, 4097, int(rng.integers(2, 88))) * (rng.random() < 0.9)
            counts[rng.integers(0, len(counts))] += 1
            written.append((counts, 0, int(rng.integers(0, len(counts)))))
            model = constriction.stream.model.Categorical(counts.astype(float) / float(counts.sum()), perfect=False)
            coder.encode(written[-1][2], model)
    words = coder.get_compressed().astype(np.uint32)
    state = range_decoder.start(words)
    for table, width, value in written:
        if table is None:
            assert range_decoder.decode_bits(state, words, width) == value
        else:
            assert range_decoder.decode_symbol(state, words, range_decoder.edges_of(table)) == value
    assert range_decoder.may_be_exhausted(state, words)
    assert len(words) < 3 or not range_decoder.may_be_exhausted(range_decoder.start(words), words)


def test_symbols_of_one_model_at_once() -> None:
    """As one after another, and nothing is lost between two models; words that no encoder writes are refused."""
    constriction = pytest.importorskip("constriction")
    rng = np.random.default_rng(1)
    coder = constriction.stream.queue.RangeEncoder()
    runs = []
    for size in (2, 40, 88, 3):
        counts = rng.integers(0, 4097, size) + 1
        symbols = rng.choice(size, int(rng.integers(0, 900)), p=counts / counts.sum())
        runs.append((counts, symbols))
        model = constriction.stream.model.Categorical(counts.astype(float) / float(counts.sum()), perfect=False)
        coder.encode(symbols.astype(np.int32), model)
    words = coder.get_compressed().astype(np.uint32)
    state = range_decoder.start(words)
    for counts, symbols in runs:
        found = np.zeros(len(symbols), np.int64)
        assert range_decoder.decode_symbols(state, words, range_decoder.edges_of(counts), found)
        assert (found == symbols).all()
    assert range_decoder.may_be_exhausted(state, words)
    state = np.array([1 << 63, 1 << 33, 2], np.uint64)  # beyond the range
    assert not range_decoder.decode_symbols(state, words, range_decoder.edges_of(runs[0][0]), np.zeros(1, np.int64))
