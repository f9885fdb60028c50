"""What decoders are set up with is under a checksum too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from folders import GOLDEN

from gvpipe.container import mp4
from gvpipe.container.track import inspect, remux_fragments
from gvpipe.foundation.errors import CorruptFile
from gvpipe.rendering.poster import make_poster


def written_again(name: str, path: Path) -> bytes:
    """A golden file as it is written today."""
    mp4.write_file(mp4.read_file(GOLDEN / f"{name}.mp4"), path)
    return path.read_bytes()


def test_flipped_bits_in_the_configuration_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    data = written_again("mcgv-1-h264", path)
    at = data.index(b"avcC")
    size = int.from_bytes(data[at - 4 : at], "big")
    for place in range(at + 4, at - 4 + size):
        path.write_bytes(data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])
        with pytest.raises(CorruptFile):
            mp4.read_file(path)


def test_boxes_that_are_not_gvpipes_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    data = written_again("mcgv-1-h264", path)
    at = data.index(b"mdat") - 4
    for kind in (b"moof", b"sidx", b"moov"):
        path.write_bytes(data[:at] + (8).to_bytes(4, "big") + kind + data[at:])
        with pytest.raises(CorruptFile, match="comes before its geometry"):
            mp4.read_file(path)


def test_one_picture_may_last_for_hours() -> None:
    positions, faces = np.eye(3, dtype=np.float32), np.array([[0, 1, 2]], np.int32)
    video = make_poster(positions, faces, 30.0, 400_000)
    assert inspect(remux_fragments(video, "2 x")).checksum == inspect(video).checksum
