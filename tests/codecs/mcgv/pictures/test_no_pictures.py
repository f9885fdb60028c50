"""Files without pictures: frames are their prediction, where that is smaller."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sequences import held, rigid, waving

import gvpipe
from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.motion.blended import CHUNK
from gvpipe.coding.codec import Memo
from gvpipe.coding.quality_scale import error_of
from gvpipe.coding.registry import encode_sequence, open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.errors import CorruptFile
from gvpipe.model.sequence import MeshSequence


@pytest.fixture(scope="module")
def sequence() -> MeshSequence:
    return rigid()


@pytest.fixture(scope="module")
def stream(sequence: MeshSequence) -> Bitstream:
    return Mcgv(segment=40).encode(sequence).bitstream


def kg(sequence: MeshSequence, path: Path) -> float:
    error = gvpipe.compare(sequence, gvpipe.decode(path)).kg
    assert error is not None
    return error


def test_the_file_has_a_poster_and_no_trace_of_pictures(stream: Bitstream, sequence: MeshSequence, tmp_path: Path) -> None:
    assert set(stream.header) == {"prediction", "clusters", "segments", "base", "transform_step", "pictures"}
    assert stream.header["pictures"] is False and not stream.video
    assert set(stream.sections) == {"mesh", "order", "still", "weights", "transforms.0", "transforms.1"}
    gvpipe.encode(sequence, tmp_path / "a.mp4")
    info = gvpipe.info(tmp_path / "a.mp4")
    assert info.settings["pictures"] is False and 0 < info.sections["video"] < 1000
    gvpipe.encode(sequence, tmp_path / "b.mp4", placement="tiles")
    assert "pictures" not in gvpipe.info(tmp_path / "b.mp4").settings  # pictures that are asked for are there
    assert info.bytes < gvpipe.info(tmp_path / "b.mp4").bytes


def test_any_frame_alone_is_that_of_the_whole(stream: Bitstream) -> None:
    whole = open_reader(stream).read(0, 60)
    for start, stop in ((0, 1), (59, 60), (17, 19), (28, 47)):
        assert np.array_equal(open_reader(stream).read(start, stop), whole[start:stop])


def test_groups_are_what_shares_transforms(stream: Bitstream) -> None:
    reader: Any = open_reader(stream)
    assert [reader.group(frame) for frame in (0, 15, 16, 29, 30, 59)] == [
        (0, CHUNK),
        (0, CHUNK),
        (CHUNK, 30),
        (CHUNK, 30),
        (30, 30 + CHUNK),
        (30 + CHUNK, 60),
    ]


def test_rigid_parts_get_a_finer_error_than_asked_for(sequence: MeshSequence, tmp_path: Path) -> None:
    for quality in (50, 75):
        gvpipe.encode(sequence, tmp_path / "a.mp4", quality=quality)
        assert kg(sequence, tmp_path / "a.mp4") <= 0.25 * error_of(quality)
    gvpipe.encode(sequence, tmp_path / "b.mp4", prediction="affine")
    assert (tmp_path / "a.mp4").stat().st_size < 0.5 * (tmp_path / "b.mp4").stat().st_size


def test_a_target_is_met_with_no_finer_error(sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.encode(sequence, tmp_path / "a.mp4", target_kg=0.1)
    assert 0.08 <= kg(sequence, tmp_path / "a.mp4") <= 0.1
    memo = Memo()
    plain = encode_sequence(Mcgv(quality=75), sequence).bitstream
    sought = encode_sequence(Mcgv(quality=75), sequence, memo=memo).bitstream
    assert sum(map(len, sought.sections.values())) < sum(map(len, plain.sections.values()))


@pytest.mark.slow
def test_a_bound_is_kept(sequence: MeshSequence, tmp_path: Path) -> None:
    gvpipe.encode(sequence, tmp_path / "a.mp4", max_error="0.05%")
    assert gvpipe.info(tmp_path / "a.mp4").settings["pictures"] is False
    largest = gvpipe.compare(sequence, gvpipe.decode(tmp_path / "a.mp4")).max_diag
    assert largest is not None and largest <= 0.0005


def test_repeated_frames(sequence: MeshSequence, tmp_path: Path) -> None:
    lengths = [3, *[1] * 58, 5]
    gvpipe.encode(held(sequence, lengths), tmp_path / "a.mp4")
    video = gvpipe.open(tmp_path / "a.mp4")
    assert video.bitstream.header["pictures"] is False
    assert len(video) == sum(lengths) and np.array_equal(video[0], video[2]) and np.array_equal(video[-1], video[-5])


def test_pictures_stay_where_they_pay() -> None:
    assert "pictures" not in Mcgv().encode(waving(12, 60)).bitstream.header


@pytest.mark.parametrize(
    "wrong",
    [
        {"pictures": True},
        {"pictures": 0},
        {"pictures": None},
        {"profile": "h264-8"},
        {"residual_step": 1.0},
        {"outliers": True},
        {"transform": "klt"},
        {"prediction": "affine"},
        {"segments": 0},
        {"clusters": 0},
        {"base": [0, 0, 0, 0]},
        {"transform_step": 0},
    ],
    ids=str,
)
def test_headers_are_hostile(wrong: dict[str, Any], stream: Bitstream) -> None:
    with pytest.raises(CorruptFile, match="header"):
        open_reader(dataclasses.replace(stream, header={**stream.header, **wrong})).read(0, 1)
