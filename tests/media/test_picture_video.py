"""Rows of pictures as video tracks."""

from __future__ import annotations

import numpy as np

from gvpipe.media.picture_video import encode_pictures
from gvpipe.media.texel_fill import TexelFill

SIZE = (176, 256)


def pictures() -> list[np.ndarray]:
    steps = np.random.default_rng(0).integers(0, 3, (5, *SIZE[::-1], 3))
    return list(np.cumsum(steps, axis=2).astype(np.uint8))


def test_the_same_pictures_give_the_same_bytes_whatever_memory_held() -> None:
    found = set()
    for _ in range(6):
        for n_bytes in (1 << 14, 1 << 16, 50_000, 90_000, 200_000):
            del_later = [np.random.default_rng(n_bytes).integers(0, 256, n_bytes, np.uint8) for _ in range(12)]
            del del_later
        found.add(encode_pictures(pictures(), SIZE, 25.0))
    assert len(found) == 1


def test_a_fill_depends_on_used_texels_alone() -> None:
    used = np.zeros(SIZE[::-1], bool)
    used[40:120, 30:100] = True
    first, second = pictures()[:2]
    other = np.where(used[:, :, None], first, second)
    assert np.array_equal(TexelFill(used)(first), TexelFill(used)(other))
