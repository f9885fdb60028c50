"""Mixed binary decisions: bits come back, adapt, and cost what they must."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gvpipe.entropy.decision_kernels import (
    code_decision,
    finish,
    new_mixing,
    put,
    start_decoder,
    start_encoder,
    take,
)
from gvpipe.entropy.logistic_tables import LIMIT, squash_table, stretch_table
from gvpipe.foundation.arrays import Int64


def encode(bits: Int64, slots: Int64, n_mixers: int = 2) -> bytes:
    """Code ``bits (n,)`` in contexts ``slots (n, K)``."""
    mixing = new_mixing(slots.shape[1], int(slots.max()) + 1, n_mixers)
    state, out = start_encoder(), np.zeros(4 * len(bits) + 16, np.uint8)
    for bit, own in zip(bits, slots, strict=True):
        code_decision(mixing, own, int(own[0]) % n_mixers, state, out, False, int(bit))
    return out[: finish(state, out)].tobytes()


def decode(data: bytes, slots: Int64, n_mixers: int = 2) -> list[int]:
    """Mirror of `encode`."""
    mixing = new_mixing(slots.shape[1], int(slots.max()) + 1, n_mixers)
    array = np.frombuffer(bytearray(data), np.uint8)
    state = start_decoder(array)
    return [int(code_decision(mixing, own, int(own[0]) % n_mixers, state, array, True, 0)) for own in slots]


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 999), st.integers(0, 400), st.integers(1, 4), st.floats(0, 1))
def test_bits_come_back(seed: int, n: int, n_contexts: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    bits = (rng.random(n + 1) < share).astype(np.int64)
    slots = rng.integers(0, 5, (n + 1, n_contexts))
    assert decode(encode(bits, slots), slots) == bits.tolist()


@settings(deadline=None, max_examples=60)
@given(st.lists(st.tuples(st.integers(1, 65535), st.booleans()), max_size=300))
def test_any_chances_come_back(decisions: list[tuple[int, bool]]) -> None:
    state, out = start_encoder(), np.zeros(4 * len(decisions) + 16, np.uint8)
    for chance, bit in decisions:
        put(state, out, chance, int(bit))
    data = out[: finish(state, out)].copy()
    state = start_decoder(data)
    assert [bool(take(state, data, chance)) for chance, _ in decisions] == [bit for _, bit in decisions]
    assert len(data) <= state[2] <= len(data) + 3


def test_carries_run_through_bytes_of_255() -> None:
    decisions = [(65535, 0)] * 3 + [(1, 0), (65535, 1)] * 400 + [(32768, 0)] * 64
    state, out = start_encoder(), np.zeros(1 << 13, np.uint8)
    for chance, bit in decisions:
        put(state, out, chance, bit)
    data = out[: finish(state, out)].copy()
    state = start_decoder(data)
    assert [take(state, data, chance) for chance, _ in decisions] == [bit for _, bit in decisions]


@pytest.mark.parametrize("share", [0.5, 0.1, 0.01])
def test_cost_is_near_the_entropy(share: float) -> None:
    n = 20_000
    bits = (np.random.default_rng(1).random(n) < share).astype(np.int64)
    slots = np.zeros((n, 2), np.int64)
    entropy = -n * (share * np.log2(share) + (1 - share) * np.log2(1 - share))
    assert 8 * len(encode(bits, slots)) < 1.06 * entropy + 100


def test_the_context_that_knows_is_believed() -> None:
    rng = np.random.default_rng(2)
    bits = rng.integers(0, 2, 4000)
    slots = np.stack([rng.integers(0, 5, 4000), bits, rng.integers(0, 5, 4000)], axis=1)
    assert 8 * len(encode(bits, slots)) < 0.06 * len(bits)


def test_tables_are_inverse_and_exact() -> None:
    squash, stretch = squash_table(), stretch_table()
    assert len(squash) == 2 * LIMIT + 1
    assert (np.diff(squash) >= 0).all()
    assert np.array_equal(squash + squash[::-1], np.full(len(squash), 65536))
    logits = np.arange(-LIMIT, LIMIT + 1) / 256
    assert np.abs(squash - 65536 / (1 + np.exp(-logits))).max() < 4
    centres = 16 * np.arange(4096) + 8
    assert np.abs(squash[stretch + LIMIT] - centres).max() <= 65536 / 4 / 256 + 1
