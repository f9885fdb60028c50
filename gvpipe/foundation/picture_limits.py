"""The largest picture that FFmpeg may decode, whatever a stream says of itself, and the most of a video kept in memory."""

from __future__ import annotations

from typing import Any

from gvpipe.foundation.budget import Budget

BYTES_PER_PIXEL = 32  # of the pictures that H.264's decoder holds at once: samples of two bytes, references, side data
MAX_PIXELS = 1 << 28
IN_MEMORY = 4 << 20  # bytes of a video that is written; longer ones lie in a temporary file: a buffer that grows is copied


def most_pixels(budget: Budget) -> int:
    """Pixels that a picture may have where nothing else is known of it."""
    return int(min(MAX_PIXELS, budget.memory_left // BYTES_PER_PIXEL))


def picture_limits(budget: Budget) -> list[Any]:  # of dictionaries; PyAV declares another type
    """Options for `av.open`: FFmpeg decodes a first picture to find out what a track holds."""
    return [{"max_pixels": str(most_pixels(budget))}]
