"""Bytes of a file by a part of the work."""

from __future__ import annotations

from sequences import waving

from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.encoding.bitstream_sizes import count_bytes
from gvpipe.coding.codec import Memo
from gvpipe.coding.registry import encode_sequence, estimate_sequence


def test_an_estimate_is_near_the_size() -> None:
    """Blends alone and pictures of trajectories have estimates; published files have none."""
    sequence, memo = waving(16, 30), Memo()
    for transform in ("none", "klt"):
        codec = Mcgv(quality=60.0, transform=transform, preset="ultrafast")
        size = count_bytes(encode_sequence(codec, sequence).bitstream)
        guess = estimate_sequence(codec, sequence, 1e9, memo=memo)
        assert guess is not None and 0.7 * size < guess < 1.4 * size
    low = estimate_sequence(Mcgv(quality=60.0, transform="klt", preset="ultrafast"), sequence, 1.0, memo=memo)
    assert low is not None and guess is not None and 1.0 < low < guess  # no pictures: the file is too large without
    assert estimate_sequence(Mcgv(prediction="affine"), sequence, 1e9) is None
