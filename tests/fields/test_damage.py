"""Damaged sections raise `CorruptFile` or decode to something, without effort."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from waves import EXACT, MESH, encode, wave

from gvpipe.container.cursor import varint
from gvpipe.fields.reader import FieldReader
from gvpipe.fields.segment import MODES
from gvpipe.fields.trajectories import STEP, decode_trajectories
from gvpipe.fields.values import FieldBound
from gvpipe.foundation.errors import CorruptFile

VALUES = wave(n_frames=10, n_components=2)
HOLED = np.where(np.arange(81)[None, :, None] % 5, VALUES, np.nan)
HELD = np.repeat(VALUES[:5], 2, axis=0)
SECTIONS = [encode(VALUES, FieldBound(0.05), modes=(mode,)) for mode in MODES]
SECTIONS += [encode(HOLED, FieldBound(0.05), holes=True), encode(HELD, FieldBound(0.05)), encode(VALUES, EXACT)]


def read(data: bytes) -> np.ndarray:
    return FieldReader(data, 10, MESH, "field").read(0, 10)


@pytest.mark.parametrize("section", SECTIONS, ids=range(len(SECTIONS)))
def test_every_prefix_is_refused(section: bytes) -> None:
    for length in range(0, len(section), max(1, len(section) // 150)):
        with pytest.raises(CorruptFile):
            read(section[:length])
    with pytest.raises(CorruptFile):
        read(section + b"\0")


@settings(max_examples=150, deadline=None)
@given(st.integers(0, len(SECTIONS) - 1), st.integers(0, 1 << 30), st.integers(1, 255))
def test_a_flipped_byte_is_no_crash(number: int, at: int, change: int) -> None:
    section = bytearray(SECTIONS[number])
    section[at % min(len(section), 400)] ^= change
    try:
        back = read(bytes(section))
    except CorruptFile:
        return
    assert back.shape == VALUES.shape


@settings(max_examples=100, deadline=None)
@given(st.binary(max_size=60))
def test_noise_is_no_crash(noise: bytes) -> None:
    for head in (b"", SECTIONS[0][:6], bytes([1, 0]) + varint(1) + varint(10) + varint(len(noise))):
        try:
            read(head + noise)
        except CorruptFile:
            continue


def test_a_small_file_asks_for_little() -> None:
    start = time.monotonic()
    with pytest.raises(CorruptFile):
        FieldReader(bytes([1, 0]) + varint(256) + varint(100000), 1 << 24, MESH, "field")
    with pytest.raises(CorruptFile):
        FieldReader(bytes([1, 0]) + varint(1) + varint(1) + bytes(100), 1 << 24, MESH, "field")
    assert time.monotonic() - start < 5


@pytest.mark.parametrize("step", [0.0, -1.0, 5e-324, 1e-180, 1e39, float("nan"), float("inf")])
def test_steps_of_coefficients_have_squares(step: float) -> None:
    """Weights divide by the square of one."""
    unused: Any = None
    with pytest.raises(CorruptFile, match="a step of coefficients is"):
        decode_trajectories(STEP.pack(step), (4, 1), unused, "field")
