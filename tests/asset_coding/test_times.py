"""Physical times come back bit for bit, whatever the film's rate."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import waving

import gvpipe
from gvpipe.asset_coding.times import SECTION, pack_times, unpack_times
from gvpipe.foundation.errors import CorruptFile, InputError

UNEVEN = (0.0, 1.25e-5, 2.5e-5, 3.7500000000000003e-05, 1.0, 0.5, -7e300)


@pytest.mark.parametrize(
    "times", [UNEVEN, (1 / 3,), tuple(np.arange(5000) * 1e-6), tuple(np.random.default_rng(1).normal(size=99))]
)
def test_times_come_back_bit_for_bit(times: tuple[float, ...]) -> None:
    assert unpack_times(pack_times(times), len(times)) == times
    with pytest.raises(CorruptFile, match="a time for each"):
        unpack_times(pack_times(times), len(times) + 1)


def test_even_steps_take_little() -> None:
    assert len(pack_times(tuple(np.arange(5000) * 1e-6))) < 5000
    with pytest.raises(CorruptFile, match="frame 1 is no number"):
        unpack_times(pack_times((1.0, float("inf"), 2.0)), 3)
    with pytest.raises(CorruptFile, match="does not inflate"):
        unpack_times(b"abc", 3)


def test_a_file_has_its_source_s_times(tmp_path: Path, run: Any) -> None:
    waves = waving(4, len(UNEVEN))
    given = replace(waves, metadata=gvpipe.Metadata(times=UNEVEN), fields={"heat": np.asarray(waves[:])[:, :, 2]})
    gvpipe.encode(given, tmp_path / "a.mp4", "pca")
    with gvpipe.open(tmp_path / "a.mp4") as video:
        assert tuple(video.times) == UNEVEN and SECTION in video.bitstream.sections
        assert video.sequence().part(2, 4).metadata.times == UNEVEN[2:4]
    gvpipe.restream(tmp_path / "a.mp4", tmp_path / "s.mp4", "stream")
    assert gvpipe.info(tmp_path / "s.mp4").metadata["times"] == list(UNEVEN)
    assert "times: 0..-7e+300 s" in run("info", tmp_path / "a.mp4").out
    gvpipe.write(given, tmp_path / "b.npz")
    assert gvpipe.read(tmp_path / "b.npz").metadata.times == UNEVEN
    for frame in (1, 2):  # the legend tells the time
        gvpipe.render(given, tmp_path / f"{frame}.png", frame=frame, field="heat", field_range=(0, 1), size=(320, 240))
    assert (tmp_path / "1.png").read_bytes() != (tmp_path / "2.png").read_bytes()
    plain = replace(given, metadata=gvpipe.Metadata(start_time=2, times=(1, 2)))  # of another number of frames
    assert np.allclose(plain.times, 2 + np.arange(len(UNEVEN)) / waves.fps)
    gvpipe.encode(plain, tmp_path / "c.mp4", "pca")
    assert gvpipe.info(tmp_path / "c.mp4").metadata["times"] == []
    with pytest.raises(InputError, match="the time of frame 1 is nan"):
        gvpipe.Metadata(times=(0, float("nan")))
