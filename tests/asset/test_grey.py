"""Grey pictures of 16 bits, as Pillow of today and older ones open them."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from gvpipe.asset.grey import eight_bits, grey_levels

LEVELS = np.array([[0, 255, 256], [40_000, 65_280, 65_535]])


@pytest.mark.parametrize("dtype", [np.uint16, np.int32])
def test_levels_are_scaled_and_not_clipped(dtype: type) -> None:
    picture = Image.fromarray(LEVELS.astype(dtype))
    levels = grey_levels(picture)
    assert levels is not None and levels.tolist() == LEVELS.tolist()
    assert np.asarray(eight_bits(picture).convert("RGB"))[:, :, 1].tolist() == (LEVELS >> 8).tolist()


def test_pictures_of_eight_bits_are_left_alone() -> None:
    picture = Image.new("LA", (2, 2))
    assert grey_levels(picture) is None and eight_bits(picture) is picture
