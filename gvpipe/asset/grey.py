"""Pictures of 16 bits, which Pillow's `convert` clips at 255 where it should scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from PIL import Image as Pillow


def grey_levels(picture: Pillow.Image) -> NDArray[np.uint16] | None:
    """Levels (height, width) of a grey picture of 16 bits, or None of any other. Older Pillow opens such a PNG as mode I."""
    if picture.mode != "I" and not picture.mode.startswith("I;16"):
        return None
    return np.asarray(np.clip(np.asarray(picture), 0, 65535), np.uint16)


def eight_bits(picture: Pillow.Image) -> Pillow.Image:
    """The picture, with levels of 16 bits as their upper eight, so that it can be converted to RGB."""
    from PIL import Image

    levels = grey_levels(picture)
    return picture if levels is None else Image.fromarray((levels >> 8).astype(np.uint8))
