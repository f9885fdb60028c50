"""What headers tell of segments is checked against the number of frames."""

from __future__ import annotations

from typing import Any

import pytest

from gvpipe.container.bitstream import Bitstream
from gvpipe.container.segments import LARGEST_STEP, MAX_SEGMENT, SMALLEST_STEP, read_segments, read_steps
from gvpipe.foundation.errors import CorruptFile


def bitstream(n_frames: int, **header: Any) -> Bitstream:
    return Bitstream("pca", 1, n_frames, 3, 1, 24.0, header)


def test_segments_come_back() -> None:
    assert read_segments(bitstream(7, segments=7), 10) == 7
    assert read_segments(bitstream(2 * MAX_SEGMENT, segments=2), 2) == 2
    assert read_steps(bitstream(2, steps=[SMALLEST_STEP, LARGEST_STEP]), 2) == (SMALLEST_STEP, LARGEST_STEP)
    whole = read_steps(bitstream(1, steps=[3]), 1)
    assert whole == (3.0,) and isinstance(whole[0], float)


@pytest.mark.parametrize("segments", [0, 8, 11, 1.0, True, "1", None])
def test_segments_out_of_range_are_refused(segments: Any) -> None:
    with pytest.raises(CorruptFile, match="'segments'"):
        read_segments(bitstream(7, segments=segments), 10)


def test_segments_above_the_most_or_too_long_are_refused() -> None:
    with pytest.raises(CorruptFile, match="clips"):
        read_segments(bitstream(100, clips=11), 10, "clips")
    with pytest.raises(CorruptFile, match=f"at most {MAX_SEGMENT} each"):
        read_segments(bitstream(2 * MAX_SEGMENT + 1, segments=2), 10)


@pytest.mark.parametrize(
    "steps", [None, 1.0, [1.0], [1.0, 0.0], [1.0, -1.0], [1.0, 2e39], [1.0, float("nan")], [1.0, True], [1.0, "1"]]
)
def test_steps_out_of_range_are_refused(steps: Any) -> None:
    with pytest.raises(CorruptFile, match="'steps'"):
        read_steps(bitstream(2, steps=steps), 2)
