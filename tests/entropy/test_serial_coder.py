"""Values one by one, in contexts that depend on what came before."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.container.cursor import Cursor
from gvpipe.entropy.serial_coder import SerialDecoder, SerialEncoder, encode_serial, estimate_bytes
from gvpipe.entropy.serial_kernels import code_value, refuse
from gvpipe.entropy.serial_tables import read_tables, write_tables
from gvpipe.entropy.tokens import MAX_TOKENS
from gvpipe.foundation.errors import CorruptFile


def some_values(n: int, seed: int = 0) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.rint(random.laplace(0, 1, n) * 10.0 ** random.integers(-1, 10, n)).astype(np.int64)


@pytest.mark.parametrize("n", [0, 1, 500])
def test_values_decode_in_contexts_of_those_before(n: int) -> None:
    encoder, before = SerialEncoder(3, n), 0
    for value in some_values(n).tolist():
        assert code_value(encoder.coder, before % 3, value) == value
        before = value
    data = encoder.finish()
    decoder, before = SerialDecoder(data, 3, "x"), 0
    for value in some_values(n).tolist():
        before = code_value(decoder.coder, before % 3, 0)
        assert before == value
    decoder.end()


def test_the_estimate_is_close_to_the_length() -> None:
    values, contexts = some_values(3000), np.arange(3000) % 4
    length = len(encode_serial(values, contexts, 4))
    assert abs(estimate_bytes(values, contexts, 4) - length) < 12


def test_what_is_left_over_missing_or_refused_is_corrupt() -> None:
    data = encode_serial(some_values(50), np.zeros(50, np.int64), 1)
    with pytest.raises(CorruptFile, match="left over"):
        SerialDecoder(data, 1, "x").end()
    decoder = SerialDecoder(data, 1, "x")
    for _ in range(50):
        code_value(decoder.coder, 0, 0)
    decoder.end()
    refuse(decoder.coder)
    assert code_value(decoder.coder, 0, 0) == 0
    with pytest.raises(CorruptFile, match="out of range"):
        decoder.end()
    with pytest.raises(CorruptFile, match="does not exist"):
        SerialDecoder(bytes([2]) + data[1:], 1, "x")
    decoder = SerialDecoder(encode_serial(some_values(50), np.zeros(50, np.int64), 2), 2, "x")
    assert code_value(decoder.coder, 1, 0) == 0
    with pytest.raises(CorruptFile, match="no table"):
        decoder.end()


@pytest.mark.parametrize("n", [1, 30, 5000])
def test_tables_come_back_and_take_few_bytes(n: int) -> None:
    random = np.random.default_rng(n)
    counts = np.zeros((11, MAX_TOKENS), np.int64)
    for own in counts[::2]:
        own[:] = np.bincount(random.choice([0, 1, 2, 40, 87], n, p=[0.5, 0.2, 0.1, 0.1, 0.1]), minlength=MAX_TOKENS)
    counts[4] = random.multinomial(n, np.append(0.7 ** np.arange(30), np.zeros(MAX_TOKENS - 30)) * 0.3)
    data, tables = write_tables(counts)
    cursor = Cursor(data, "x")
    assert all(np.array_equal(a, b) for a, b in zip(read_tables(cursor, 11), tables, strict=True))
    cursor.end()
    assert len(data) < 6 * 16
    for own, table in zip(counts, tables, strict=True):
        assert (table[np.flatnonzero(own)] > 0).all()
