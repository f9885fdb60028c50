"""Vectors of coefficients come back within a step; a prefix of blocks decodes alone."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.foundation.errors import CorruptFile, InputError
from gvpipe.trajectory import coefficient_coding
from gvpipe.trajectory.coefficient_coding import decode_vectors, encode_vectors, stream_flags
from gvpipe.trajectory.contexts import BASIS, REST
from gvpipe.trajectory.temporal_neighbours import temporal_order
from gvpipe.trajectory.trellis import FINDS_NOISES, GRADES, find_noises


def test_rows_come_back_within_a_step_and_a_prefix_of_blocks_alone() -> None:
    rng = np.random.default_rng(2)
    time = np.arange(50)[:, None]
    target = np.repeat(np.sin(time / rng.uniform(3, 20, 12)) * 40 * 0.7 ** np.arange(12), 3, axis=0)
    target *= np.tile([1, -2, 0.5], 50)[:, None]
    causal = temporal_order(50)
    data, decoded = encode_vectors(target, 0.01, causal)
    assert np.abs(target - decoded).max() < 0.0059  # ROUND_UP lets 0.58 of a step pass
    assert np.allclose(decode_vectors(data, 12, 0.01, causal, "x"), decoded, atol=1e-9)
    part = decode_vectors(data, 12, 0.01, causal, "x", n_blocks=1)
    known = causal.order[: causal.blocks[1]]
    assert np.allclose(part[known], decoded[known], atol=1e-9)
    assert 8 * len(data) < 0.6 * target.size * np.log2(np.abs(target).mean() / 0.01)


@pytest.mark.parametrize("penalty", [None, 1.0])
@pytest.mark.parametrize("size", [1e14, 1e30])
def test_residuals_that_do_not_fit_are_refused(penalty: float | None, size: float) -> None:
    target = np.random.default_rng(0).normal(size=(12, 2)) * size
    with pytest.raises(InputError, match="ask for a lower quality"):
        encode_vectors(target, 1.0, temporal_order(4), penalty=penalty)


def test_a_trellis_takes_fewer_bits_at_the_same_error() -> None:
    rng = np.random.default_rng(4)
    target = rng.normal(0, 3, (600, 9)).cumsum(axis=0) * 0.6 ** np.arange(9)
    causal = temporal_order(200)

    def rate_and_error(step: float, penalty: float | None) -> tuple[int, float]:
        data, decoded = encode_vectors(target, step, causal, penalty=penalty)
        assert np.allclose(decode_vectors(data, 9, step, causal, "x"), decoded, rtol=0, atol=1e-6 * step)
        return len(data), float(((target - decoded) ** 2).mean())

    size, error = rate_and_error(0.1, None)
    finer, less = rate_and_error(0.083, 0.2)
    assert less < error
    assert finer < size


@pytest.mark.parametrize("flags", [GRADES, FINDS_NOISES, GRADES | FINDS_NOISES, FINDS_NOISES + 4 * BASIS, GRADES + 4 * REST])
def test_flags_of_a_stream(flags: int) -> None:
    """They come back, and so do the vectors; a prefix of blocks decodes alone; early blocks err less where steps are graded."""
    rng = np.random.default_rng(5)
    target = rng.normal(0, 3, (1200, 9)).cumsum(axis=0) * 0.6 ** np.arange(9)
    causal = temporal_order(400, finds_noises=bool(flags & FINDS_NOISES))
    data, decoded = encode_vectors(target, 0.1, causal, penalty=0.2, flags=flags)
    assert stream_flags(data, "x") in (flags, flags % 4)  # contexts by spans, where they take fewer bytes
    with pytest.raises(CorruptFile, match="flags are those of the predictor kalman"):
        decode_vectors(data, target.shape[1], 0.1, causal, "x", predictor="navg")
    assert np.allclose(decode_vectors(data, 9, 0.1, causal, "x"), decoded, rtol=0, atol=1e-7)
    part = decode_vectors(data, 9, 0.1, causal, "x", n_blocks=3)
    early, late = causal.order[: causal.blocks[3]], causal.order[causal.blocks[-2] :]
    assert np.allclose(part[early], decoded[early], rtol=0, atol=1e-7)
    errors = [np.square(decoded[ranks] - target[ranks]).mean() for ranks in (early, late)]
    assert (errors[0] < 0.9 * errors[1]) == bool(flags & GRADES)


def test_noises_follow_the_residuals_of_the_block_before() -> None:
    before = np.array([[4, 0], [-12, 0]])
    assert find_noises(before, 0.5, FINDS_NOISES).tolist() == [0.25 * (1 + 4), 0.25]
    assert find_noises(before, 0.5, GRADES).tolist() == find_noises(before[:0], 0.5, FINDS_NOISES).tolist() == [0.25, 0.25]


@pytest.mark.parametrize("flags", [0, GRADES | FINDS_NOISES])
@pytest.mark.parametrize("penalty", [None, 0.2])
def test_parts_that_are_decoded_ahead(penalty: float | None, flags: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """However many vectors are decoded before they are predicted, the values are the same to the bit; damage is found."""
    rng = np.random.default_rng(3)
    causal = temporal_order(200)
    target = rng.normal(0, 3, (600, 9)).cumsum(axis=0)
    data, _ = encode_vectors(target, 0.01, causal, penalty=penalty, flags=flags)
    whole = decode_vectors(data, 9, 0.01, causal, "x")
    assert len(causal.blocks) > 4
    for part in (1, 50, 130, 599):
        monkeypatch.setattr(coefficient_coding, "PART", part)
        assert np.array_equal(decode_vectors(data, 9, 0.01, causal, "x"), whole)
        with pytest.raises(CorruptFile, match="'x'"):
            decode_vectors(data[:-40], 9, 0.01, causal, "x")
