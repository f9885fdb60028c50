"""A video plays alike forwards, backwards and from threads, with every codec."""

from __future__ import annotations

import dataclasses
import re
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from folders import GOLDEN
from sequences import waving

import gvpipe
from gvpipe.coding.registry import codec_ids
from gvpipe.container.mp4 import read_file, write_file
from gvpipe.foundation.errors import CorruptFile


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


@pytest.mark.parametrize("codec", codec_ids())
def test_damaged_triangles_are_those_of_a_file(codec: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.mp4"
    bitstream = read_file(sorted(GOLDEN.glob(f"{codec}-*.mp4"))[-1])
    write_file(dataclasses.replace(bitstream, sections={**bitstream.sections, "mesh": bytes(9)}), path)
    with pytest.raises(CorruptFile, match=re.escape(f"{path}: section 'mesh'")):
        _ = gvpipe.open(path).faces
