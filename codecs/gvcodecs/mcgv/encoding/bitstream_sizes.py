"""Bytes of bitstreams, as the search for a step compares them."""

from __future__ import annotations

from gvcodecs.mcgv.layout.chart_coding import SECTION as CHARTS
from gvcodecs.mcgv.pictures.outliers import SECTION as OUTLIERS
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.elementary import power
from gvpipe.rate_control.step_search import StepTrial

POSTER = 1000  # bytes that stand in place of pictures, about
FALL = 0.2  # bytes of one blend go with the error to the power of about minus this


def cost(trial: StepTrial, fall: float = FALL) -> float:
    """Bytes, as if at equal error: they go with the error to the power of minus ``fall``."""
    return count_bytes(trial.bitstream) * power(trial.error, fall)


def count_bytes(bitstream: Bitstream) -> int:
    """Bytes of sections and video, or of what stands in its place."""
    return sum(map(len, bitstream.sections.values())) + (len(bitstream.video) or POSTER)


def count_picture_bytes(bitstream: Bitstream) -> int:
    """Bytes that a file without pictures does without."""
    placed = sum(len(bitstream.sections.get(name, b"")) for name in (CHARTS, "pixels", OUTLIERS))
    return placed + len(bitstream.video) - POSTER
