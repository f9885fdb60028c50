"""Integers as bytes: exact, near their entropy, and read without trust."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from gvpipe.entropy.integers import decode_integers, encode_integers
from gvpipe.foundation.errors import CorruptFile

VALUES = st.one_of(st.integers(-20, 20), st.integers(-(2**39) + 1, 2**39 - 1), st.integers(-5000, 5000))


@settings(max_examples=120)
@given(st.lists(st.tuples(VALUES, st.integers(0, 6)), max_size=60), st.booleans())
def test_integers_round_trip(pairs: list[tuple[int, int]], grouped: bool) -> None:
    values = np.array([value for value, _ in pairs], np.int64)
    contexts = np.array([context for _, context in pairs], np.int64) if grouped else None
    data = encode_integers(values, contexts)
    assert np.array_equal(decode_integers(data, len(values), contexts), values)
    for bad in (data + b"\0", data[:-1]):
        try:
            assert len(decode_integers(bad, len(values), contexts)) == len(values)
        except CorruptFile:
            continue
        raise AssertionError("a byte more or less went unnoticed")


@settings(max_examples=120)
@given(st.binary(max_size=80), st.integers(0, 50), st.booleans())
def test_garbage_is_corrupt_or_decodes(data: bytes, count: int, grouped: bool) -> None:
    contexts = np.arange(count) % 3 if grouped else None
    try:
        assert len(decode_integers(data, count, contexts)) == count
    except CorruptFile as exc:
        assert "\n" not in str(exc)


def test_damaged_integers_never_fail_otherwise() -> None:
    """Every byte of a real block changed in several ways."""
    random = np.random.default_rng(10)
    values, contexts = np.rint(random.laplace(0, 30, 500)).astype(np.int64), random.integers(0, 4, 500)
    data = encode_integers(values, contexts)
    for i in range(len(data)):
        for mask in (1, 0x40, 0x80, 0xFF):
            damaged = bytearray(data)
            damaged[i] ^= mask
            with contextlib.suppress(CorruptFile):
                assert decode_integers(bytes(damaged), 500, contexts).shape == (500,)


def test_integers_cost_about_their_entropy() -> None:
    """Within 2 % and the tables' bytes of the empirical entropy; contexts that tell pay off; too large a value is refused."""
    random = np.random.default_rng(11)
    contexts = random.integers(0, 2, 20_000)
    values = np.rint(random.normal(0, np.where(contexts == 1, 4.0, 0.4))).astype(np.int64)

    def entropy(x: NDArray[np.int64]) -> float:
        share = np.unique(x, return_counts=True)[1] / len(x)
        return float(-(share * np.log2(share)).sum() * len(x) / 8)

    apart = sum(entropy(values[contexts == c]) for c in (0, 1))
    assert apart < len(encode_integers(values, contexts)) < 1.02 * apart + 120
    assert len(encode_integers(values, contexts)) < len(encode_integers(values)) < 1.03 * entropy(values) + 120
    for value in (2**39, -(2**39) - 1, 2**61):
        with pytest.raises(ValueError, match="does not fit"):
            encode_integers(np.array([value]))
