"""Residuals that pictures cannot hold: coded beside them, read without trust, and worth it."""

from __future__ import annotations

import dataclasses
import json
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sequences import waving

from gvcodecs.mcgv import Mcgv
from gvcodecs.mcgv.pictures.outliers import SECTION, OutlierWriter
from gvpipe.coding.corrections.displacements import DisplacementReader
from gvpipe.coding.registry import open_reader
from gvpipe.container.bitstream import Bitstream
from gvpipe.foundation.errors import CorruptFile
from gvpipe.media.video import PROFILES
from gvpipe.model.sequence import MeshSequence

FAST: dict[str, Any] = {"preset": "ultrafast", "gop": 8, "clusters": 12}


def jumping(n_frames: int = 30) -> tuple[MeshSequence, np.ndarray]:
    """A waving sheet on which a few vertices are far off for a few frames, and which those are, ``(F, V)``."""
    sequence = waving(12, n_frames)
    positions = np.array(sequence.positions[:])
    off = np.zeros(positions.shape[:2], bool)
    off[6:11, 40] = off[15, 17:20] = off[7:9, 100] = True  # over ends of groups too
    positions[off] += np.array([1.5, -0.8, 2.0], np.float32)
    return dataclasses.replace(sequence, positions=positions), off


@pytest.fixture(scope="module")
def stream() -> Bitstream:
    return Mcgv(quality=90, **FAST).encode(jumping()[0]).bitstream


@pytest.mark.parametrize(
    "settings",
    [
        {"quality": 60, "prediction": "affine"},
        {"quality": 60, "prediction": "affine", "placement": "halves"},
        {"quality": 90, "prediction": "blended"},
        {"quality": 70, "prediction": "affine", "profile": "precise"},
        {"quality": 60, "prediction": "affine", "image": "jpeg"},
    ],
    ids=str,
)
def test_outliers_come_back_and_coarsen_nothing(settings: dict[str, Any]) -> None:
    sequence, off = jumping()
    codec = Mcgv(**{**FAST, **settings})
    stream = codec.encode(sequence).bitstream
    assert stream.header["outliers"] is True
    groups = DisplacementReader(stream.section(SECTION), 30, 144, SECTION)
    assert groups.group == 8
    error = np.abs(open_reader(stream).read(0, 30) - sequence.positions[:]).max(axis=2)
    step = groups.step
    assert error.max() < 4 * step
    assert error[off].max() < 3 * step  # of 2 model units
    held = DisplacementReader(stream.section(SECTION), 30, 144, SECTION)
    moved = np.zeros((30, 144, 3), np.float32)
    held.apply(0, moved)
    assert 0 < np.count_nonzero(moved.any(axis=2)) < 0.1 * off.size


def test_files_without_outliers_do_not_tell_of_any() -> None:
    for prediction in ("affine", "blended"):
        stream = Mcgv(quality=40, prediction=prediction, **FAST).encode(waving(12, 10)).bitstream
        assert "outliers" not in stream.header and SECTION not in stream.sections


def test_no_quality_is_out_of_reach() -> None:
    """The error falls on to quality 100, whatever few vertices do."""
    sequence, _ = jumping(16)
    errors = []
    for quality in (75, 85, 95, 100):
        frames = open_reader(Mcgv(quality=quality, **FAST).encode(sequence).bitstream).read(0, 16)
        errors.append(float(np.sqrt(np.mean((frames - sequence.positions[:]) ** 2))))
    assert all(fine < 0.8 * coarse for coarse, fine in pairwise(errors)), errors


def test_frames_decode_in_any_order(stream: Bitstream) -> None:
    whole = open_reader(stream).read(0, 30)
    reader = open_reader(stream)
    for frame in np.random.default_rng(3).permutation(30):
        assert np.array_equal(reader.read(frame, frame + 1)[0], whole[frame])
    for start, stop in ((3, 3), (7, 9), (5, 29)):
        assert np.array_equal(reader.read(start, stop), whole[start:stop])


def test_frames_that_leap_beyond_all_measure() -> None:
    """A residual of more steps than can be coded stays in the pictures, as coarse as they then are."""
    sequence = waving(12, 8)
    positions = np.array(sequence.positions[:])
    positions[5, ::3] *= np.float32(1e14)
    frames = open_reader(Mcgv(quality=100, **FAST).encode(dataclasses.replace(sequence, positions=positions)).bitstream).read(
        0, 8
    )
    assert np.abs(frames - positions).max() < 0.02 * np.abs(positions).max()


@given(st.integers(1, 40), st.integers(1, 9), st.integers(1, 50), st.floats(1, 8), st.integers(0, 2**32 - 1))
def test_what_pictures_and_section_hold_is_the_residual(
    n_frames: int, n_vertices: int, group: int, levels: float, seed: int
) -> None:
    """Whatever the chunks and groups: within half a level and, for outliers, half a step."""
    rng = np.random.default_rng(seed)
    profile, level = PROFILES["h264-8"], 0.01
    residual = rng.standard_t(1, (n_frames, n_vertices, 3)) * rng.choice([0.01, 1.0])
    writer = OutlierWriter(profile, level, levels * level, group, n_vertices)
    for part in np.array_split(residual, rng.integers(1, n_frames + 1)):
        writer.add(part)
    section = writer.finish()
    held = np.clip(np.rint(residual / level) + profile.middle, profile.low, profile.high) - profile.middle
    result = (held * level).astype(np.float32)
    outside = np.abs(np.rint(residual / level) - held) * level > levels * level / 2
    assert bool(section) >= bool(outside.any())
    if section:
        DisplacementReader(section, n_frames, n_vertices, SECTION).apply(0, result)
    allowed = (level + np.where(np.abs(residual) >= 1, levels * level, 0)) / 2 + 1e-6 * np.abs(residual) + 1e-9
    assert (np.abs(result - residual) <= allowed).all()


def test_headers_and_sections_that_do_not_fit(stream: Bitstream) -> None:
    section = stream.section(SECTION)
    for value in (1, False, None, "yes", [True]):
        with pytest.raises(CorruptFile, match="outliers"):
            open_reader(dataclasses.replace(stream, header={**stream.header, "outliers": value}))
    silent = {key: value for key, value in stream.header.items() if key != "outliers"}
    bare = {name: data for name, data in stream.sections.items() if name != SECTION}
    with pytest.raises(CorruptFile, match="outliers"):
        open_reader(dataclasses.replace(stream, header=silent))
    with pytest.raises(CorruptFile, match="outliers"):
        open_reader(dataclasses.replace(stream, sections=bare))
    images = Mcgv(prediction="blended", transform="klt", **FAST).encode(waving(8, 6)).bitstream
    header = json.loads(json.dumps({**images.header, "outliers": True}))
    with pytest.raises(CorruptFile, match="outliers"):
        open_reader(dataclasses.replace(images, header=header, sections={**images.sections, SECTION: section}))


@pytest.mark.slow
def test_hostile_sections(stream: Bitstream) -> None:
    """Cut, lengthened or changed: `CorruptFile`, or frames that are numbers."""
    data = stream.section(SECTION)
    for cut in range(len(data)):
        with pytest.raises(CorruptFile):
            open_reader(dataclasses.replace(stream, sections={**stream.sections, SECTION: data[:cut]})).read(0, 30)
    rng = np.random.default_rng(4)
    for _ in range(200):
        changed = bytearray(data)
        changed[rng.integers(len(data))] ^= int(rng.integers(1, 256))
        broken = dataclasses.replace(stream, sections={**stream.sections, SECTION: bytes(changed)})
        try:
            assert np.isfinite(open_reader(broken).read(0, 30)).all()
        except CorruptFile as exc:
            assert SECTION in str(exc)
