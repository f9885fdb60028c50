"""Blocks of integers decode one by one, and any prefix of them."""

from __future__ import annotations

import numpy as np
import pytest

from gvpipe.entropy.block_coder import BlockDecoder, BlockEncoder
from gvpipe.foundation.errors import CorruptFile


def test_blocks_decode_one_by_one_and_any_prefix_of_them() -> None:
    rng = np.random.default_rng(0)
    scales = 10.0 ** rng.integers(-1, 7, 4)
    blocks = [
        (np.rint(rng.laplace(0, scale, n)).astype(int), rng.integers(0, 5, n))
        for scale, n in zip(scales, (0, 1, 9, 800), strict=True)
    ]
    coder = BlockEncoder(6)
    for values, contexts in blocks:
        coder.add(values, contexts)
    data = coder.finish()
    for n_blocks in range(len(blocks) + 1):
        decoder = BlockDecoder(data, 6, "x")
        for values, contexts in blocks[:n_blocks]:
            assert np.array_equal(decoder.take(contexts), values)
    decoder.end()
    with pytest.raises(CorruptFile):
        BlockDecoder(data, 7, "x")
    with pytest.raises(CorruptFile):
        BlockDecoder(data[:-1], 6, "x")


def test_a_context_without_a_table_is_corrupt() -> None:
    coder = BlockEncoder(3)
    coder.add(np.arange(40), np.arange(40) % 2)
    decoder = BlockDecoder(coder.finish(), 3, "x")
    with pytest.raises(CorruptFile, match="no table"):
        decoder.take(np.array([2]))
