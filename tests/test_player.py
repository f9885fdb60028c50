"""A video plays alike forwards, backwards and from threads, with every codec."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.registry import codec_ids


@pytest.mark.parametrize("codec", codec_ids())
def test_a_video_plays_alike_forwards_backwards_and_from_threads(codec: str, tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    gvpipe.encode(waving(8, 40), path, codec=codec)
    whole = gvpipe.decode(path).positions[:]
    with gvpipe.open(path) as video:
        assert len(video) == 40
        np.testing.assert_array_equal(np.stack(list(video)), whole)
        np.testing.assert_array_equal(video[::-1], whole[::-1])
        np.testing.assert_array_equal(video[3:30:4], whole[3:30:4])
        np.testing.assert_array_equal(video[-1], whole[-1])
        with ThreadPoolExecutor(4) as pool:
            order = np.random.default_rng(0).integers(0, 40, 60).tolist()
            for k, frame in zip(order, pool.map(video.__getitem__, order), strict=True):
                np.testing.assert_array_equal(frame, whole[k])
    np.testing.assert_array_equal(video[4], whole[4])  # closing lets go of memory and no more
